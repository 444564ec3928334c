//! The scalar twin of the shaders' traversal: the same steps in the same order, for tests and
//! counts.
//!
//! Method: Ylitie, Karras and Laine, HPG 2017. A group is the children of one node that the ray
//! hits, as bits of a word. Groups of primitives are tested at once. Of a group of nodes, the one
//! with the highest bit is visited next, and the rest is pushed on a stack, which is at most as
//! deep as the tree.

use super::instance::{EncodedInstance, INSTANCE_IDENTITY, INSTANCE_SPHERES};
use super::node::{EncodedNode, whole_number};
use super::primitive::{EncodedPrimitive, OWNER_SPHERE};
use super::scene::EncodedScene;
use crate::layout::WIDTH;
use crate::ray::Ray;
use optics::intersect::{RayShear, intersect_sphere, intersect_triangle, ray_shear};
use wgsl_rs::std::{Vec3f, vec3f};

/// A hit, as shaders have it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncodedHit {
    /// Ray parameter.
    pub t: f32,
    /// Barycentric weight of the second corner; zero for spheres.
    pub u: f32,
    /// Barycentric weight of the third corner; zero for spheres.
    pub v: f32,
    /// Index of the instance.
    pub instance: u32,
    /// Number of the geometry in the object.
    pub geometry: u32,
    /// Number of the primitive in the object.
    pub primitive: u32,
}

/// The work of traversals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraversalCounts {
    /// Nodes visited, of both levels.
    pub nodes: u64,
    /// Primitives tested.
    pub primitives: u64,
    /// Instances entered.
    pub instances: u64,
    /// The largest number of groups on the stack.
    pub stack: u32,
}

/// Children of a node to visit. Nodes: in the upper eight bits of `hits`, with all slots that hold
/// nodes in the lower eight. Primitives or instances: in the lower 24.
#[derive(Clone, Copy, Default)]
struct Group {
    base: u32,
    hits: u32,
}

impl Group {
    const NODES: u32 = 0xFF00_0000;

    fn has_nodes(self) -> bool {
        self.hits & Group::NODES != 0
    }
}

/// A ray in the space of a structure, with its constants for nodes and primitives.
struct TraversalRay {
    origin: Vec3f,
    direction: Vec3f,
    shear: RayShear,
    inverse: [f32; 3],
    /// By how much each plane is moved outwards, so that rounding cannot miss a box.
    room: [f32; 3],
    /// Bit `a` is set if the direction along axis `a` is not negative.
    upwards: u32,
}

/// Boxes are extended by this share of the coordinates: for the rounding of the reciprocal (shaders
/// guarantee 2.5 units in the last place), of the grid's corner, and of the sums.
const ROOM: f32 = 8.0 * f32::EPSILON;

impl TraversalRay {
    fn new(origin: Vec3f, direction: Vec3f, extent: &[f32; 3]) -> TraversalRay {
        let (o, d) = (origin.to_array(), direction.to_array());
        // A zero direction would give infinity, and then NaN. This value is small enough to count
        // as parallel at any distance.
        let tiny = (d[0].abs().max(d[1].abs()).max(d[2].abs()) * 1e-20).max(1e-37);
        let inverse = d.map(|d| 1.0 / if d.abs() < tiny { tiny.copysign(d) } else { d });
        let room = [0, 1, 2].map(|a: usize| (o[a].abs() + extent[a]) * inverse[a].abs() * ROOM);
        let up = |a: usize| u32::from(inverse[a] >= 0.0) << a;
        TraversalRay {
            origin,
            direction,
            shear: ray_shear(direction),
            inverse,
            room,
            upwards: up(0) | up(1) | up(2),
        }
    }

    /// The ray in the object space of an instance.
    fn enter(ray: &Ray, instance: &EncodedInstance) -> TraversalRay {
        let (mut o, mut d) = (ray.origin, ray.direction);
        if instance.flags & INSTANCE_IDENTITY == 0 {
            let rows = &instance.world_to_object;
            o = rows.map(|m| m[0] * ray.origin[0] + m[1] * ray.origin[1] + m[2] * ray.origin[2] + m[3]);
            d = rows.map(|m| m[0] * ray.direction[0] + m[1] * ray.direction[1] + m[2] * ray.direction[2]);
        }
        TraversalRay::new(vec3f(o[0], o[1], o[2]), vec3f(d[0], d[1], d[2]), &instance.extent)
    }
}

/// The children that the ray hits, as bits of [`EncodedNode::meta`], nodes in the order of visits.
fn hit_children(node: &EncodedNode, ray: &TraversalRay, t_min: f32, t_max: f32) -> u32 {
    let (mut scale, mut near_offset, mut far_offset) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    for a in 0..3 {
        scale[a] = f32::from_bits(u32::from(node.exponents[a]) << 23) * ray.inverse[a];
        let from = node.origin[a] - ray.origin.to_array()[a];
        near_offset[a] = from * ray.inverse[a] - ray.room[a];
        far_offset[a] = from * ray.inverse[a] + ray.room[a];
    }
    let mut hits = 0;
    for slot in 0..WIDTH {
        let (mut near, mut far) = (t_min, t_max);
        for a in 0..3 {
            let up = ray.upwards >> a & 1 == 1;
            let at = |side: bool| f32::from(whole_number(node.planes[a][usize::from(side)][slot]));
            near = near.max(at(!up) * scale[a] + near_offset[a]);
            far = far.min(at(up) * scale[a] + far_offset[a]);
        }
        let meta = u32::from(node.meta[slot]);
        let is_node = meta & 0b11000 == 0b11000;
        let shift = if is_node { meta & 31 ^ ray.upwards } else { meta & 31 };
        if near <= far {
            hits |= meta >> 5 << shift;
        }
    }
    hits
}

/// The next hit of a primitive between `t_min` and `t_max`: distance and barycentric coordinates. A
/// sphere may have two.
fn hit_primitive(
    p: &EncodedPrimitive,
    is_sphere: bool,
    ray: &TraversalRay,
    t_min: f32,
    t_max: f32,
) -> Option<(f32, f32, f32)> {
    let v = |p: [f32; 3]| vec3f(p[0], p[1], p[2]);
    if is_sphere {
        let h = intersect_sphere(ray.origin, ray.direction, v(p.a), p.b[0]);
        let within = |t: &f32| h.hit && *t > t_min && *t < t_max;
        return Some(h.near).filter(within).or(Some(h.far).filter(within)).map(|t| (t, 0.0, 0.0));
    }
    let h = intersect_triangle(ray.origin, ray.shear, v(p.a), v(p.b), v(p.c), t_min, t_max);
    h.hit.then_some((h.t, h.u, h.v))
}

impl EncodedScene {
    /// The closest hit. `accept` decides about candidates, as [`crate::HitFilter::accept`] does.
    pub fn closest(
        &self,
        ray: &Ray,
        accept: impl Fn(&EncodedHit) -> bool,
        counts: &mut TraversalCounts,
    ) -> Option<EncodedHit> {
        self.traverse(ray, false, accept, counts)
    }

    /// Whether there is any hit.
    pub fn any(&self, ray: &Ray, accept: impl Fn(&EncodedHit) -> bool, counts: &mut TraversalCounts) -> bool {
        self.traverse(ray, true, accept, counts).is_some()
    }

    fn traverse(
        &self,
        world_ray: &Ray,
        any: bool,
        accept: impl Fn(&EncodedHit) -> bool,
        counts: &mut TraversalCounts,
    ) -> Option<EncodedHit> {
        let world = &self.instances[0];
        if !world_ray.is_valid() || world.root == u32::MAX {
            return None;
        }
        let (t_min, mut t_max) = (world_ray.t_min.max(0.0), world_ray.t_max);
        let mut best = None;
        let mut stack = vec![Group::default(); self.stack_size() as usize];
        let mut size = 0;
        let mut ray = TraversalRay::enter(world_ray, world);
        // The current instance, and the part of the stack that belongs to the top level.
        let mut inside = self.is_single().then_some(world);
        let mut top_level_size = 0;
        let mut nodes = Group { base: world.root, hits: 1 << 31 };
        let push = |group: Group, size: &mut usize, stack: &mut Vec<Group>, counts: &mut TraversalCounts| {
            stack[*size] = group;
            *size += 1;
            counts.stack = counts.stack.max(*size as u32);
        };
        loop {
            let mut primitives;
            if nodes.has_nodes() {
                let bit = 31 - nodes.hits.leading_zeros();
                nodes.hits &= !(1 << bit);
                if nodes.has_nodes() {
                    push(nodes, &mut size, &mut stack, counts);
                }
                // The root's group has no slots: all of this is zero there.
                let slot = (bit - 24) ^ ray.upwards;
                let before = (nodes.hits & 0xFF & !(u32::MAX << slot)).count_ones();
                let node = &self.nodes[(nodes.base + before) as usize];
                counts.nodes += 1;
                let hits = hit_children(node, &ray, t_min, t_max);
                nodes = Group { base: node.first_child, hits: hits & Group::NODES | u32::from(node.inner) };
                primitives = Group { base: node.first_primitive, hits: hits & !Group::NODES };
            } else {
                primitives = nodes;
                nodes = Group::default();
            }
            while primitives.hits != 0 {
                let bit = 31 - primitives.hits.leading_zeros();
                primitives.hits &= !(1 << bit);
                let at = (primitives.base + bit) as usize;
                if let Some(instance) = inside {
                    let p = &self.primitives[at];
                    counts.primitives += 1;
                    let mut from = t_min;
                    let (index, is_sphere) = match self.is_flattened() {
                        true => (p.owner & !OWNER_SPHERE, p.owner & OWNER_SPHERE != 0),
                        false => (instance.index, instance.flags & INSTANCE_SPHERES != 0),
                    };
                    while let Some((t, u, v)) = hit_primitive(p, is_sphere, &ray, from, t_max) {
                        let (geometry, primitive) = (p.geometry, p.primitive);
                        let hit = EncodedHit { t, u, v, instance: index, geometry, primitive };
                        if accept(&hit) {
                            best = Some(hit);
                            t_max = t;
                            if any {
                                return best;
                            }
                            break;
                        }
                        if !is_sphere {
                            break;
                        }
                        from = t;
                    }
                } else {
                    if primitives.hits != 0 {
                        push(primitives, &mut size, &mut stack, counts);
                    }
                    if nodes.has_nodes() {
                        push(nodes, &mut size, &mut stack, counts);
                    }
                    top_level_size = size;
                    let instance = &self.instances[at];
                    counts.instances += 1;
                    ray = TraversalRay::enter(world_ray, instance);
                    inside = Some(instance);
                    nodes = Group { base: instance.root, hits: 1 << 31 };
                    primitives.hits = 0;
                }
            }
            if !nodes.has_nodes() {
                if !self.is_single() && inside.is_some() && size == top_level_size {
                    inside = None;
                    ray = TraversalRay::enter(world_ray, world);
                }
                if size == 0 {
                    return best;
                }
                size -= 1;
                nodes = stack[size];
            }
        }
    }
}
