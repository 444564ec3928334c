//! The upper level: instances of objects.

use crate::aabb::Aabb;
use crate::blas::{Blas, validate_tree};
use crate::build::{self, Leaves, PrimitiveRef, Quality, Settings};
use crate::kernel::{self, Kernel};
use crate::layout::{ChildRef, EMPTY, INSTANCE, LEAF, Node};
use crate::ray::{Hit, HitFilter, Ray};
use crate::streams::{HitStream, RayStream};
use std::sync::Arc;

/// One appearance of an object in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Which object, as an index.
    pub blas: u32,
    /// Rows of the 3×4 matrix that maps object space to world space (column vectors).
    pub object_to_world: [[f32; 4]; 3],
    /// Queries see this instance if their mask shares a bit with it.
    pub mask: u32,
}

impl Instance {
    /// The transform that changes nothing.
    pub const IDENTITY: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

    /// Object `blas` as it is, visible to all queries.
    pub fn identity(blas: u32) -> Instance {
        Instance { blas, object_to_world: Instance::IDENTITY, mask: u32::MAX }
    }
}

/// Whether rays that follow each other in a stream are alike.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coherence {
    /// They go anywhere.
    #[default]
    Incoherent,
    /// Neighbours start close to each other and go almost the same way, as camera rays do.
    Coherent,
}

/// An instance as queries need it.
struct Placed {
    world_to_object: [[f32; 4]; 3],
    blas: u32,
    mask: u32,
    index: u32,
    is_identity: bool,
}

/// A bounding volume hierarchy over instances.
pub struct Tlas {
    pub(crate) nodes: Vec<Node>,
    pub(crate) root: ChildRef,
    /// The largest magnitude of a coordinate, by axis.
    pub(crate) extent: [f32; 3],
    /// In the order of the leaves.
    placed: Vec<Placed>,
    blas: Vec<Arc<Blas>>,
    bounds: Aabb,
    /// The mask of the only instance, if there is one and it is not transformed.
    only: Option<u32>,
    skipped: usize,
    kernel: Kernel,
}

impl Tlas {
    /// Builds over `instances` of the objects `blas`. [`Hit::instance`] is an index into `instances`.
    ///
    /// Instances whose transform is not finite or has no inverse, and those of empty objects, are left out: see
    /// [`Tlas::skipped_instances`].
    ///
    /// # Panics
    ///
    /// If an instance names an object that is not there.
    pub fn build(instances: &[Instance], blas: Vec<Arc<Blas>>) -> Tlas {
        let mut tlas = Tlas {
            nodes: Vec::new(),
            root: EMPTY,
            extent: [0.0; 3],
            placed: Vec::new(),
            blas,
            bounds: Aabb::EMPTY,
            only: None,
            skipped: 0,
            kernel: Kernel::best(),
        };
        tlas.update(instances);
        tlas
    }

    /// Builds the upper level again, for instances that have moved, appeared or gone, or objects that were refitted.
    ///
    /// # Panics
    ///
    /// If an instance names an object that is not there.
    pub fn update(&mut self, instances: &[Instance]) {
        let mut refs = Vec::with_capacity(instances.len());
        let mut placed = Vec::with_capacity(instances.len());
        for (index, instance) in instances.iter().enumerate() {
            let object = &self.blas[instance.blas as usize];
            let bounds = object.bounds();
            let is_identity = instance.object_to_world == Instance::IDENTITY;
            let Some(world_to_object) = inverse(&instance.object_to_world) else { continue };
            let world = if is_identity { bounds } else { object.bounds_under(&instance.object_to_world) };
            if bounds.is_empty() || !world.min.iter().chain(&world.max).all(|c| c.is_finite()) {
                continue;
            }
            refs.push(PrimitiveRef::new(&world, placed.len() as u32, 0));
            let (blas, mask) = (instance.blas, instance.mask);
            placed.push(Some(Placed { world_to_object, blas, mask, index: index as u32, is_identity }));
        }
        self.skipped = instances.len() - placed.len();
        let tree = build::build(&mut refs, Settings::new(Quality::Balanced, 1, Leaves::Lanes));
        let order = tree.leaves.iter().map(|&(first, _)| refs[first as usize].index() as usize);
        self.placed = order.filter_map(|i| placed[i].take()).collect();
        self.nodes = tree.nodes;
        self.root = instance_ref(tree.root);
        for node in &mut self.nodes {
            node.children = node.children.map(instance_ref);
        }
        self.bounds = tree.bounds;
        self.extent = [0, 1, 2].map(|a: usize| {
            if tree.bounds.is_empty() { 0.0 } else { tree.bounds.min[a].abs().max(tree.bounds.max[a].abs()) }
        });
        self.only = match &self.placed[..] {
            [one] if one.is_identity && one.index == 0 => Some(one.mask),
            _ => None,
        };
        #[cfg(debug_assertions)]
        self.validate().expect("a tree that was just built");
    }

    /// Changes the object `index`, say to refit it. Call [`Tlas::update`] before the next query.
    ///
    /// # Panics
    ///
    /// If there is no such object, or if someone else holds on to it.
    pub fn blas_mut(&mut self, index: usize) -> &mut Blas {
        Arc::get_mut(&mut self.blas[index]).expect("an object that changes must not be shared")
    }

    /// The only object, if there is one instance of it that stands as the object does.
    pub fn only_mut(&mut self) -> Option<&mut Blas> {
        self.only?;
        Arc::get_mut(&mut self.blas[self.placed[0].blas as usize])
    }

    /// Whether rays that say what they leave are faster here, see [`Blas::find_behind`].
    pub fn knows_behind(&self) -> bool {
        self.only.is_some() && !self.blas[self.placed[0].blas as usize].behind().is_empty()
    }

    /// The objects.
    pub fn blas(&self) -> &[Arc<Blas>] {
        &self.blas
    }

    /// The nearest hit of a ray in world space.
    #[inline]
    pub fn closest<F: HitFilter>(&self, ray: &Ray, filter: &F) -> Hit {
        kernel::tlas_closest(self.kernel, self, ray, filter)
    }

    /// Whether a ray in world space hits anything.
    #[inline]
    pub fn any<F: HitFilter>(&self, ray: &Ray, filter: &F) -> bool {
        kernel::tlas_any(self.kernel, self, ray, filter)
    }

    /// The nearest hit of each ray. Where rays are tested with large or few triangles together, those that pass an edge by no more than
    /// rounding may err hit, too, which [`Tlas::closest`] may not find.
    ///
    /// # Panics
    ///
    /// If the lengths differ.
    pub fn closest_stream<F: HitFilter>(
        &self,
        rays: &(impl RayStream + ?Sized),
        hits: &mut (impl HitStream + ?Sized),
        filter: &F,
        coherence: Coherence,
    ) {
        assert_eq!(rays.len(), hits.len(), "one hit a ray");
        if coherence == Coherence::Coherent {
            return kernel::coherent_closest(self.kernel, self, rays, hits, filter);
        }
        kernel::incoherent_closest(self.kernel, self, rays, hits, filter);
    }

    /// Whether each ray hits anything.
    ///
    /// # Panics
    ///
    /// If the lengths differ.
    pub fn any_stream<F: HitFilter>(
        &self,
        rays: &(impl RayStream + ?Sized),
        hit: &mut [bool],
        filter: &F,
        coherence: Coherence,
    ) {
        assert_eq!(rays.len(), hit.len(), "one answer a ray");
        if coherence == Coherence::Coherent {
            return kernel::coherent_any(self.kernel, self, rays, hit, filter);
        }
        kernel::incoherent_any(self.kernel, self, rays, hit, filter);
    }

    /// The box around everything, in world space; empty if there is nothing.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// How many instances were left out, because they cannot be hit.
    pub fn skipped_instances(&self) -> usize {
        self.skipped
    }

    /// Bytes of memory that this occupies, objects included once.
    pub fn memory_bytes(&self) -> usize {
        size_of::<Tlas>()
            + self.nodes.capacity() * size_of::<Node>()
            + self.placed.capacity() * size_of::<Placed>()
            + self.blas.iter().map(|b| b.memory_bytes()).sum::<usize>()
    }

    /// The kernel that answers queries.
    pub fn kernel(&self) -> Kernel {
        self.kernel
    }

    /// Chooses the kernel, for tests and comparisons.
    ///
    /// # Panics
    ///
    /// If this processor cannot run it.
    pub fn set_kernel(&mut self, kernel: Kernel) {
        assert!(kernel.is_available(), "{kernel:?} is not available here");
        self.kernel = kernel;
    }

    /// Checks the structure, see [`Blas::validate`]. Does not look into the objects.
    ///
    /// # Errors
    ///
    /// What is wrong first, in words.
    pub fn validate(&self) -> Result<(), String> {
        if self.placed.iter().any(|p| p.blas as usize >= self.blas.len()) {
            return Err("an instance without an object".into());
        }
        validate_tree(&self.nodes, self.root, &vec![Aabb::EMPTY; self.placed.len()])
    }

    /// The only object, if there is one in one instance without a transform, visible to `mask`.
    #[inline(always)]
    pub(crate) fn only(&self, mask: u32) -> Option<&Blas> {
        match self.only {
            Some(m) if m & mask != 0 => Some(&self.blas[self.placed[0].blas as usize]),
            _ => None,
        }
    }

    /// The object in leaf `leaf`, the index of its instance, and the ray in its space, if `mask` can see it.
    #[inline(always)]
    pub(crate) fn enter(&self, leaf: usize, ray: &Ray, mask: u32) -> Option<(&Blas, u32, Ray)> {
        let placed = &self.placed[leaf];
        if placed.mask & mask == 0 {
            return None;
        }
        let mut r = *ray;
        if !placed.is_identity {
            let ([x, y, z], [o, d]) = (&placed.world_to_object, [&ray.origin, &ray.direction]);
            r.origin = [dot(x, o) + x[3], dot(y, o) + y[3], dot(z, o) + z[3]];
            r.direction = [dot(x, d), dot(y, d), dot(z, d)];
            if !r.is_valid() {
                return None;
            }
        }
        Some((&self.blas[placed.blas as usize], placed.index, r))
    }
}

/// A vector through one row of a transform, without the translation.
#[inline(always)]
fn dot(row: &[f32; 4], v: &[f32; 3]) -> f32 {
    row[0] * v[0] + row[1] * v[1] + row[2] * v[2]
}

/// A reference of a tree whose leaves are instances.
fn instance_ref(child: ChildRef) -> ChildRef {
    if child & LEAF == 0 { child } else { child | INSTANCE }
}

/// The inverse of a 3×4 transform, if there is one.
pub(crate) fn inverse(m: &[[f32; 4]; 3]) -> Option<[[f32; 4]; 3]> {
    let m = m.map(|row| row.map(f64::from));
    let cofactor = |r: usize, c: usize| {
        let (r1, r2, c1, c2) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
        m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
    };
    let det = m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
    let mut inverse = [[0.0f64; 4]; 3];
    for r in 0..3 {
        for c in 0..3 {
            inverse[r][c] = cofactor(c, r) / det;
        }
        inverse[r][3] = -(inverse[r][0] * m[0][3] + inverse[r][1] * m[1][3] + inverse[r][2] * m[2][3]);
    }
    let inverse = inverse.map(|row| row.map(|x| x as f32));
    inverse.as_flattened().iter().all(|x| x.is_finite()).then_some(inverse)
}
