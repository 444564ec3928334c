//! The lower level: primitives of one object.

use crate::aabb::Aabb;
use crate::behind::Behind;
use crate::build::{self, Cuts, Cutting, Leaves, PrimitiveRef, Quality, Settings, Waste, WideTree};
use crate::cover::Cover;
use crate::handful::Handful;
use crate::kernel::{self, Kernel, MAX_DEPTH};
use crate::layout::{
    Block, ChildRef, EMPTY, LEAF, NO_PRIMITIVE, Node, SphereBlock, TriangleBlock, WIDTH, leaf_index,
    sphere_bounds,
};
use crate::ray::{Hit, HitFilter, Ray};
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

/// One of the triangle lists that a [`Blas`] is built from.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<'a> {
    /// Vertex positions, in object space.
    pub positions: &'a [[f32; 3]],
    /// Three positions for each triangle.
    pub indices: &'a [[u32; 3]],
    /// Id of the first triangle; the others count on from there. Ids must be unique within the `Blas` for hits to
    /// be told apart, and below `u32::MAX`.
    pub first_id: u32,
}

/// A procedural sphere.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Sphere {
    /// Where it is, in object space.
    pub center: [f32; 3],
    /// Its radius, above zero.
    pub radius: f32,
}

/// The leaves of a [`Blas`].
pub(crate) enum Shape {
    Triangles(Vec<TriangleBlock>),
    Spheres(Vec<SphereBlock>),
}

/// A bounding volume hierarchy over the triangles or spheres of one object.
pub struct Blas {
    pub(crate) nodes: Vec<Node>,
    pub(crate) root: ChildRef,
    pub(crate) shape: Shape,
    /// The largest magnitude of a coordinate, by axis.
    pub(crate) extent: [f32; 3],
    bounds: Aabb,
    /// What is known of the bounds when the object is turned.
    cover: Cover,
    /// First id and number of triangles of each geometry.
    geometries: Vec<(u32, u32)>,
    skipped: usize,
    /// Whether leaves hold parts of triangles, whose boxes are smaller than the triangles.
    split: bool,
    /// The triangles that all rays of a stream are tested with, once more, if this is made of triangles.
    handful: Option<Handful>,
    /// See [`Blas::find_behind`].
    behind: Option<Behind>,
    kernel: Kernel,
}

/// Boxes that [`Quality::High`] adds at most, as a share of the triangles.
const CUTS: f64 = 0.3;

/// The corners of a triangle, if they are finite and span an area.
fn corners(g: &Geometry, index: usize) -> Option<[[f32; 3]; 3]> {
    let triangle = g.indices[index];
    let n = g.positions.len();
    if triangle.iter().any(|&i| i as usize >= n) {
        return None;
    }
    let p = triangle.map(|i| g.positions[i as usize]);
    let sum = p[0][0] + p[0][1] + p[0][2] + p[1][0] + p[1][1] + p[1][2] + p[2][0] + p[2][1] + p[2][2];
    // The sum finds NaN and infinities; if it overflows itself, look closer.
    if !sum.is_finite() && !p.as_flattened().iter().all(|c| c.is_finite()) {
        return None;
    }
    let edge = |q: [f32; 3]| [0, 1, 2].map(|a: usize| f64::from(q[a]) - f64::from(p[0][a]));
    let (a, b) = (edge(p[1]), edge(p[2]));
    let flat = a[1] * b[2] == a[2] * b[1] && a[2] * b[0] == a[0] * b[2] && a[0] * b[1] == a[1] * b[0];
    if flat { None } else { Some(p) }
}

fn handful_of(nodes: &[Node], root: ChildRef, shape: &Shape, bounds: &Aabb) -> Option<Handful> {
    match shape {
        Shape::Triangles(blocks) => Some(Handful::new(nodes, root, blocks, bounds)),
        Shape::Spheres(_) => None,
    }
}

fn points_bounds(p: &[[f32; 3]; 3]) -> Aabb {
    let fold = |f: fn(f32, f32) -> f32| [0, 1, 2].map(|a: usize| f(f(p[0][a], p[1][a]), p[2][a]));
    Aabb { min: fold(f32::min), max: fold(f32::max) }
}

fn extent(b: &Aabb) -> [f32; 3] {
    [0, 1, 2].map(|a: usize| if b.is_empty() { 0.0 } else { b.min[a].abs().max(b.max[a].abs()) })
}

/// Makes references from `count` boxes, without those that are `None`. Returns how many those are, too.
fn references(
    count: usize,
    geometry: u32,
    bounds: impl Fn(usize) -> Option<Aabb> + Sync,
) -> (Vec<PrimitiveRef>, usize) {
    let none = PrimitiveRef::new(&Aabb::EMPTY, u32::MAX, 0);
    let mut refs = Vec::new();
    (0..count)
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| bounds(i).map_or(none, |b| PrimitiveRef::new(&b, i as u32, geometry)))
        .collect_into_vec(&mut refs);
    refs.retain(|r| r.index() != u32::MAX);
    let skipped = count - refs.len();
    (refs, skipped)
}

/// Makes the blocks of a tree: `fill` puts a primitive into a lane.
fn fill_blocks<B: Block>(
    tree: &WideTree,
    refs: &[PrimitiveRef],
    empty: B,
    fill: impl Fn(&mut B, usize, &PrimitiveRef) + Sync,
) -> Vec<B> {
    let mut blocks = Vec::new();
    tree.leaves
        .par_iter()
        .with_min_len(256)
        .map(|&(first, count)| {
            let mut block = empty;
            for lane in 0..count as usize {
                fill(&mut block, lane, &refs[first as usize + lane]);
            }
            block
        })
        .collect_into_vec(&mut blocks);
    blocks
}

/// References to the triangles that can be hit, and how many others there are.
pub(crate) fn triangle_references(g: &Geometry, number: u32) -> (Vec<PrimitiveRef>, usize) {
    references(g.indices.len(), number, |i| corners(g, i).map(|p| points_bounds(&p)))
}

/// References to the spheres that can be hit, and how many others there are.
pub(crate) fn sphere_references(spheres: &[Sphere], number: u32) -> (Vec<PrimitiveRef>, usize) {
    references(spheres.len(), number, |i| {
        let s = &spheres[i];
        let finite = s.center.iter().chain([&s.radius]).all(|c| c.is_finite());
        (finite && s.radius > 0.0).then(|| sphere_bounds(s.center, s.radius))
    })
}

impl Blas {
    /// Builds over triangles.
    ///
    /// Triangles with a vertex that is not finite or does not exist, and triangles without area, are left out: see
    /// [`Blas::skipped_primitives`].
    pub fn triangles(geometries: &[Geometry], quality: Quality) -> Blas {
        let mut refs = Vec::new();
        let mut skipped = 0;
        for (number, g) in geometries.iter().enumerate() {
            let (mut new, new_skipped) = triangle_references(g, number as u32);
            skipped += new_skipped;
            if refs.is_empty() {
                refs = new;
            } else {
                refs.append(&mut new);
            }
        }
        let points = |r: &PrimitiveRef| {
            let g = &geometries[r.geometry() as usize];
            g.indices[r.index() as usize].map(|i| g.positions[i as usize])
        };
        let settings = Settings::new(quality, WIDTH, Leaves::Lanes);
        let split = quality == Quality::High && refs.len() > WIDTH * build::TINY_BLOCKS;
        if split {
            let cutting = Cutting { budget: CUTS, waste: Waste::Whole };
            refs = Cuts::new(&refs, |r: &PrimitiveRef| Some(points(r)), cutting).make(&refs);
        }
        let tree = build::build(&mut refs, settings);
        let blocks = fill_blocks(&tree, &refs, TriangleBlock::EMPTY, |block, lane, r| {
            let id = geometries[r.geometry() as usize].first_id + r.index();
            // Two parts of a triangle may be in one block.
            if !block.ids.contains(&id) {
                block.set_triangle(lane, &points(r));
                block.ids[lane] = id;
            }
        });
        let geometries = geometries.iter().map(|g| (g.first_id, g.indices.len() as u32)).collect();
        Blas::finish(tree, Shape::Triangles(blocks), geometries, skipped, split)
    }

    /// Builds over spheres, whose ids count on from `first_id`.
    ///
    /// Spheres that are not finite, or have no positive radius, are left out: see [`Blas::skipped_primitives`].
    pub fn spheres(spheres: &[Sphere], first_id: u32, quality: Quality) -> Blas {
        let (mut refs, skipped) = sphere_references(spheres, 0);
        let tree = build::build(&mut refs, Settings::new(quality, WIDTH, Leaves::Lanes));
        let blocks = fill_blocks(&tree, &refs, SphereBlock::EMPTY, |block, lane, r| {
            let s = &spheres[r.index() as usize];
            for a in 0..3 {
                block.spheres[a][lane] = s.center[a];
            }
            block.spheres[3][lane] = s.radius;
            block.ids[lane] = first_id + r.index();
        });
        Blas::finish(tree, Shape::Spheres(blocks), vec![(first_id, spheres.len() as u32)], skipped, false)
    }

    fn finish(
        tree: WideTree,
        shape: Shape,
        geometries: Vec<(u32, u32)>,
        skipped: usize,
        split: bool,
    ) -> Blas {
        let WideTree { mut nodes, root, bounds, .. } = tree;
        nodes.shrink_to_fit();
        let handful = handful_of(&nodes, root, &shape, &bounds);
        let (extent, kernel) = (extent(&bounds), Kernel::best());
        let cover = Cover::new(&nodes, root, bounds);
        let blas = Blas {
            nodes,
            root,
            shape,
            extent,
            bounds,
            cover,
            geometries,
            skipped,
            split,
            handful,
            behind: None,
            kernel,
        };
        #[cfg(debug_assertions)]
        blas.validate().expect("a tree that was just built");
        blas
    }

    /// Moves the triangles to new positions. The tree keeps its shape, so that queries get slower the more it moves.
    ///
    /// Triangles that are not finite or have no area now cannot be hit until a later refit. Triangles that were left
    /// out when building stay out.
    ///
    /// # Panics
    ///
    /// If this holds spheres, or if number, ids or lengths of the geometries differ from those it was built with.
    pub fn refit(&mut self, geometries: &[Geometry]) {
        let shape: Vec<_> = geometries.iter().map(|g| (g.first_id, g.indices.len() as u32)).collect();
        assert_eq!(shape, self.geometries, "refit needs the geometries that the tree was built with");
        let Shape::Triangles(blocks) = &mut self.shape else { panic!("only triangles can be refitted") };
        self.behind = None;
        let find = |id: u32| {
            let g = geometries.iter().find(|g| id.wrapping_sub(g.first_id) < g.indices.len() as u32)?;
            corners(g, (id - g.first_id) as usize)
        };
        blocks.par_iter_mut().with_min_len(256).for_each(|block| {
            for lane in 0..WIDTH {
                if block.ids[lane] != NO_PRIMITIVE {
                    block.set_triangle(lane, &find(block.ids[lane]).unwrap_or([[f32::NAN; 3]; 3]));
                }
            }
        });
        // Children come after their parents.
        for at in (0..self.nodes.len()).rev() {
            for slot in 0..WIDTH {
                let child = self.nodes[at].children[slot];
                let bounds = if child == EMPTY { break } else { self.child_bounds(child) };
                self.nodes[at].set_bounds(slot, &bounds);
            }
        }
        self.bounds = if self.root == EMPTY { Aabb::EMPTY } else { self.child_bounds(self.root) };
        self.extent = extent(&self.bounds);
        self.cover = Cover::new(&self.nodes, self.root, self.bounds);
        self.handful = handful_of(&self.nodes, self.root, &self.shape, &self.bounds);
        #[cfg(debug_assertions)]
        self.validate().expect("a tree that was just refitted");
    }

    /// Triangles that streams test all rays with.
    #[inline(always)]
    pub(crate) fn handful(&self) -> Option<&Handful> {
        self.handful.as_ref()
    }

    /// Finds out what lies behind each triangle, if their ids count from zero on: streams of rays that say what they leave
    /// ([`crate::RayColumns::leaving`]) are faster then. That takes longer than building, and is forgotten by [`Blas::refit`].
    pub fn find_behind(&mut self) {
        if let Shape::Triangles(blocks) = &self.shape
            && self.can_look_behind()
        {
            let triangles = self.geometries.iter().map(|g| g.1 as usize).sum();
            self.behind = Some(Behind::find(self.kernel, &self.nodes, blocks, triangles));
        }
    }

    /// Whether that has been found out, or there is nothing to be found.
    pub fn knows_behind(&self) -> bool {
        self.behind.is_some() || !self.can_look_behind()
    }

    /// Whether there are triangles, and so many that there is a tree, and none of them so far away that the square of that is infinite.
    fn can_look_behind(&self) -> bool {
        self.handful().is_some_and(|handful| !handful.is_all()) && self.extent.iter().all(|x| *x < 1e18)
    }

    /// What lies behind each triangle; nothing if nobody has asked to find that out.
    #[inline(always)]
    pub(crate) fn behind(&self) -> &Behind {
        self.behind.as_ref().unwrap_or(const { &Behind::NOTHING })
    }

    /// The blocks, if they are so few that a search of all of them is faster than a tree.
    #[inline(always)]
    pub(crate) fn tiny(&self) -> Option<&[TriangleBlock]> {
        match &self.shape {
            Shape::Triangles(blocks) if blocks.len() <= build::TINY_BLOCKS => Some(blocks),
            _ => None,
        }
    }

    fn child_bounds(&self, child: ChildRef) -> Aabb {
        if child & LEAF == 0 {
            return self.nodes[child as usize].union();
        }
        let index = leaf_index(child);
        match &self.shape {
            Shape::Triangles(blocks) => blocks[index].bounds(),
            Shape::Spheres(blocks) => blocks[index].bounds(),
        }
    }

    /// The nearest hit of a ray in object space. Its instance is 0.
    #[inline]
    pub fn closest<F: HitFilter>(&self, ray: &Ray, filter: &F) -> Hit {
        kernel::blas_closest(self.kernel, self, ray, filter)
    }

    /// Whether a ray in object space hits anything. The filter sees instance 0.
    #[inline]
    pub fn any<F: HitFilter>(&self, ray: &Ray, filter: &F) -> bool {
        kernel::blas_any(self.kernel, self, ray, filter)
    }

    /// The box around everything, in object space; empty if there is nothing.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// A box around everything under a transform, with room for the rounding of transformed rays.
    pub(crate) fn bounds_under(&self, object_to_world: &[[f32; 4]; 3]) -> Aabb {
        self.cover.under(object_to_world)
    }

    /// How many primitives were left out when building, because they cannot be hit.
    pub fn skipped_primitives(&self) -> usize {
        self.skipped
    }

    /// How many primitives there are, without those left out.
    pub fn primitive_count(&self) -> usize {
        self.geometries.iter().map(|g| g.1 as usize).sum::<usize>() - self.skipped
    }

    /// Bytes of memory that this occupies.
    pub fn memory_bytes(&self) -> usize {
        let blocks = match &self.shape {
            Shape::Triangles(b) => b.capacity() * size_of::<TriangleBlock>(),
            Shape::Spheres(b) => b.capacity() * size_of::<SphereBlock>(),
        };
        let handful = self.handful.as_ref().map_or(0, Handful::memory_bytes);
        let cover = self.cover.memory_bytes();
        let behind = self.behind().memory_bytes();
        size_of::<Blas>() + self.nodes.capacity() * size_of::<Node>() + blocks + handful + cover + behind
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

    /// Checks the structure: every reference leads somewhere, each node and block is reached once, every box contains
    /// what is below it, every primitive is in some block.
    ///
    /// # Errors
    ///
    /// What is wrong first, in words.
    pub fn validate(&self) -> Result<(), String> {
        match &self.shape {
            Shape::Triangles(blocks) => self.validate_blocks(blocks),
            Shape::Spheres(blocks) => self.validate_blocks(blocks),
        }
    }

    fn validate_blocks<B: Block>(&self, blocks: &[B]) -> Result<(), String> {
        let bounds = |block: &B| if self.split { Aabb::EMPTY } else { block.bounds() };
        let boxes: Vec<Aabb> = blocks.iter().map(bounds).collect();
        validate_tree(&self.nodes, self.root, &boxes)?;
        let lanes = blocks.iter().flat_map(|b| b.ids()).filter(|&&id| id != NO_PRIMITIVE).count();
        if lanes < self.primitive_count() {
            return Err(format!("{lanes} lanes for {} primitives", self.primitive_count()));
        }
        Ok(())
    }
}

/// Checks a tree over leaves with these boxes.
pub(crate) fn validate_tree(nodes: &[Node], root: ChildRef, leaves: &[Aabb]) -> Result<(), String> {
    let mut seen_nodes = vec![false; nodes.len()];
    let mut seen_leaves = vec![false; leaves.len()];
    let everything = Aabb { min: [f32::NEG_INFINITY; 3], max: [f32::INFINITY; 3] };
    let mut open = vec![(root, everything, 1)];
    while let Some((child, bounds, depth)) = open.pop() {
        if child == EMPTY {
            continue;
        }
        let is_leaf = child & LEAF != 0;
        let index = if is_leaf { leaf_index(child) } else { child as usize };
        let seen = if is_leaf { &mut seen_leaves } else { &mut seen_nodes };
        match seen.get_mut(index) {
            None => return Err(format!("reference {child:#x} leads nowhere")),
            Some(true) => return Err(format!("reference {child:#x} occurs twice")),
            Some(first) => *first = true,
        }
        if is_leaf {
            if !leaves[index].is_empty() && !bounds.contains(&leaves[index]) {
                return Err(format!(
                    "leaf {index} sticks out of its box: {:?} not in {bounds:?}",
                    leaves[index]
                ));
            }
            continue;
        }
        if depth > MAX_DEPTH {
            return Err(format!("node {index} is at depth {depth}"));
        }
        for slot in 0..WIDTH {
            let b = nodes[index].bounds(slot);
            let child = nodes[index].children[slot];
            if child != EMPTY && !b.is_empty() && !bounds.contains(&b) {
                return Err(format!("child {slot} of node {index} sticks out of its box"));
            }
            if child == EMPTY && !b.is_empty() {
                return Err(format!("unused child {slot} of node {index} has a box"));
            }
            open.push((child, b, depth + 1));
        }
    }
    if !seen_nodes.iter().chain(&seen_leaves).all(|&seen| seen) {
        return Err("some nodes or leaves are out of reach".into());
    }
    Ok(())
}
