//! Hit points of many triangles at once.
//!
//! Position and normals of sixteen hits are computed by one loop over lanes, which the compiler turns into vector
//! instructions; only fetching vertices goes hit by hit. Spheres, and triangles with normal maps or in mirrored instances,
//! take the general way of [`Surface::new`].

use crate::lanes::{LANES, Lanes, PlainPoint, Vectors};
use crate::scene::{CpuScene, transform_normal, transform_point, vec3};
use crate::sites::Site;
use crate::surface::{Surface, TexCoords, largest_coordinate, tex_coords, vertex_color};
use accel::{Hit, Ray};
use optics::frame::{Frame, bend_normal};
use optics::vector::{cross, dot};
use optics::{Vec3f, vec3f};
use scene::tables::NONE;

/// Sixteen hits in a row.
#[derive(Default)]
pub(crate) struct TriangleLanes {
    /// Vertices of each triangle, as the tables number them within its geometry.
    indices: [[u32; 3]; LANES],
    corners: [Vectors; 3],
    normals: [Vectors; 3],
    /// Whether the triangle has vertex normals.
    smooth: Lanes<u32>,
    u: Lanes<f32>,
    v: Lanes<f32>,
    wo: Vectors,
    position: Vectors,
    extent: Lanes<f32>,
    normal: Vectors,
    shading_normal: Vectors,
    front: Lanes<u32>,
    /// Whether the lane holds a triangle that these loops can do.
    plain: Lanes<u32>,
    instance: Lanes<u32>,
    binding: Lanes<u32>,
    /// Number of the triangle in its geometry.
    primitive: Lanes<u32>,
}

impl TriangleLanes {
    /// Computes the surfaces of at most sixteen hits.
    #[inline(always)]
    pub fn compute(&mut self, scene: &CpuScene, rays: &[Ray], hits: &[Hit]) {
        for (lane, (ray, hit)) in rays.iter().zip(hits).enumerate() {
            self.locate(scene, lane, ray, hit);
        }
        for lane in 0..hits.len() {
            self.fetch_vertices(scene, lane);
        }
        for lane in 0..LANES {
            self.compute_lane(lane);
        }
    }

    /// Finds the triangle of a hit. Apart from [`TriangleLanes::fetch_vertices`], so that the look-ups of sixteen
    /// hits, which often miss the caches, wait for memory together.
    #[inline(always)]
    fn locate(&mut self, scene: &CpuScene, lane: usize, ray: &Ray, hit: &Hit) {
        self.plain.0[lane] = 0;
        if hit.is_miss() {
            return;
        }
        let binding = scene.sites.binding(hit.instance, hit.primitive);
        let site = scene.sites.site(binding);
        if !site.in_lanes {
            return;
        }
        let primitive = hit.primitive - site.first_in_blas;
        self.indices[lane] = scene.tables.indices[(site.first_primitive + primitive) as usize];
        self.smooth.0[lane] = u32::from(site.first_normal != NONE);
        self.u.0[lane] = hit.u;
        self.v.0[lane] = hit.v;
        self.wo.set(lane, -vec3(ray.direction));
        self.plain.0[lane] = 1;
        self.instance.0[lane] = hit.instance;
        self.binding.0[lane] = binding;
        self.primitive.0[lane] = primitive;
    }

    #[inline(always)]
    fn fetch_vertices(&mut self, scene: &CpuScene, lane: usize) {
        if self.plain.0[lane] == 0 {
            return;
        }
        let tables = &*scene.tables;
        let site = scene.sites.site(self.binding.0[lane]);
        let indices = self.indices[lane];
        for (corner, index) in self.corners.iter_mut().zip(indices) {
            corner.set(lane, vec3(tables.positions[(site.first_vertex + index) as usize]));
        }
        if site.first_normal != NONE {
            for (normal, index) in self.normals.iter_mut().zip(indices) {
                normal.set(lane, vec3(tables.normals[(site.first_normal + index) as usize]));
            }
        }
        if !site.identity {
            let instance = &tables.instances[self.instance.0[lane] as usize];
            for k in 0..3 {
                let corner = transform_point(&instance.object_to_world, self.corners[k].get(lane));
                let normal = transform_normal(&instance.world_to_object, self.normals[k].get(lane));
                self.corners[k].set(lane, corner);
                self.normals[k].set(lane, normal);
            }
        }
    }

    #[inline(always)]
    fn compute_lane(&mut self, lane: usize) {
        let [p0, p1, p2] = [0, 1, 2].map(|k| self.corners[k].get(lane));
        let [n0, n1, n2] = [0, 1, 2].map(|k| self.normals[k].get(lane));
        let (u, v) = (self.u.0[lane], self.v.0[lane]);
        let w = 1.0 - u - v;
        let wo = self.wo.get(lane);
        let outward = unit(cross(p1 - p0, p2 - p0));
        let interpolated = n0 * w + n1 * u + n2 * v;
        let smooth = self.smooth.0[lane] != 0 && dot(interpolated, interpolated) > 1e-20;
        let front = dot(outward, wo) >= 0.0;
        let side = if front { 1.0 } else { -1.0 };
        let normal = outward * side;
        let bent = bend_normal(wo, normal, unit(interpolated) * side);
        let choose = |smooth_component: f32, flat: f32| if smooth { smooth_component } else { flat };
        let shading = vec3f(choose(bent.x, normal.x), choose(bent.y, normal.y), choose(bent.z, normal.z));
        self.position.set(lane, p0 * w + p1 * u + p2 * v);
        self.extent.0[lane] = largest_coordinate([p0, p1, p2]);
        self.normal.set(lane, normal);
        self.shading_normal.set(lane, shading);
        self.front.0[lane] = u32::from(front);
    }

    /// The site of one lane, if the lane is done here.
    #[inline(always)]
    pub fn site<'s>(&self, scene: &'s CpuScene, lane: usize) -> Option<&'s Site> {
        (self.plain.0[lane] != 0).then(|| scene.sites.site(self.binding.0[lane]))
    }

    /// One lane as a point on a plain surface.
    #[inline(always)]
    pub fn plain_point(&self, lane: usize, site: &Site) -> PlainPoint {
        PlainPoint {
            position: self.position.get(lane),
            extent: self.extent.0[lane],
            normal: self.normal.get(lane),
            shading_normal: self.shading_normal.get(lane),
            color: vec3(site.color),
            wo: self.wo.get(lane),
            eta: if self.front.0[lane] != 0 { site.ior } else { 1.0 / site.ior },
        }
    }

    /// The surface of one lane; `None` where it takes the general way.
    ///
    /// `wants_coordinates`: whether texture coordinates are asked for even if the material does not need them.
    #[inline(always)]
    pub fn surface(&self, scene: &CpuScene, lane: usize, wants_coordinates: bool) -> Option<Surface> {
        let site = self.site(scene, lane)?;
        let tables = &*scene.tables;
        let geometry = &tables.geometries[site.geometry as usize];
        let binding = &tables.bindings[self.binding.0[lane] as usize];
        let primitive = self.primitive.0[lane];
        let position = self.position.get(lane);
        let (mut coords, mut color) = (TexCoords::default(), [1.0; 4]);
        let material = &tables.materials[site.material as usize];
        if wants_coordinates || material.is_textured() || geometry.first_color != NONE {
            let corners = self.indices[lane];
            let (u, v) = (self.u.0[lane], self.v.0[lane]);
            let weights = [1.0 - u - v, u, v];
            coords = tex_coords(tables, geometry, corners, weights);
            color = vertex_color(tables, geometry, corners, weights);
        }
        let shading_normal = self.shading_normal.get(lane);
        Some(Surface {
            position,
            extent: self.extent.0[lane],
            normal: self.normal.get(lane),
            shading_normal,
            front: self.front.0[lane] != 0,
            wo: self.wo.get(lane),
            coords,
            color,
            material: site.material,
            light: tables.light_of(binding, primitive),
            object: binding.object,
            primitive,
            pattern_position: [position.x, position.z],
            layer_frame: Frame { tangent: shading_normal, bitangent: shading_normal, normal: shading_normal },
        })
    }
}

/// A vector of length 1 in the direction of `v`; not a number for zero, which the caller has excluded or ignores.
#[inline(always)]
fn unit(v: Vec3f) -> Vec3f {
    v * (1.0 / dot(v, v).sqrt())
}
