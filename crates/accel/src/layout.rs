//! Nodes and leaf blocks in memory, as traversal reads them.

use crate::aabb::Aabb;

/// Children of a node, and primitives of a leaf block: one SIMD lane each.
pub(crate) const WIDTH: usize = 8;

/// The deepest tree that may be built. Traversal stacks have a fixed size that relies on it.
pub(crate) const MAX_DEPTH: usize = 64;

/// Reference to a child. One of: the index of a node; [`LEAF`] and the index of a leaf block;
/// [`INSTANCE`] and the index of an instance; [`EMPTY`].
pub(crate) type ChildRef = u32;

/// Marks a reference to a leaf block.
pub(crate) const LEAF: u32 = 0x8000_0000;

/// Marks a reference to an instance, a leaf of the top level. As numbers, these references are
/// larger than all others except [`EMPTY`].
pub(crate) const INSTANCE: u32 = 0xC000_0000;

/// The index of the block or instance that a leaf reference points to.
#[inline(always)]
pub(crate) fn leaf_index(child: ChildRef) -> usize {
    (child & !INSTANCE) as usize
}

/// Reference of an unused child.
pub(crate) const EMPTY: u32 = u32::MAX;

/// Primitive id of an unused lane.
pub(crate) const NO_PRIMITIVE: u32 = u32::MAX;

/// An inner node: eight child boxes and references, in four cache lines. Unused children come
/// last; their boxes are inverted and their references are [`EMPTY`].
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// Box planes by axis, then low/high, then child.
    pub planes: [[[f32; WIDTH]; 2]; 3],
    pub children: [ChildRef; WIDTH],
}

/// Selects one plane of all child boxes: an axis and a side.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(crate) struct NodePlane {
    /// Offset of its first number in [`Node::planes`]: a multiple of [`WIDTH`], below `6 * WIDTH`.
    first: u32,
}

impl NodePlane {
    /// The low plane (`side` 0) or the high plane (`side` 1) of an axis.
    #[inline(always)]
    pub fn new(axis: usize, side: usize) -> Self {
        debug_assert!(axis < 3 && side < 2);
        NodePlane { first: (2 * (axis as u32 % 3) + (side as u32 & 1)) * WIDTH as u32 }
    }

    /// The plane on the other side of the boxes.
    #[inline(always)]
    pub fn opposite(self) -> Self {
        NodePlane { first: self.first ^ WIDTH as u32 }
    }

    /// Its representation in memory.
    #[inline(always)]
    pub fn to_bits(self) -> u32 {
        self.first
    }

    /// 0 for the low plane, 1 for the high plane.
    #[inline(always)]
    pub fn side(self) -> usize {
        (self.first as usize / WIDTH) & 1
    }
}

impl Node {
    /// One plane of each child box.
    #[inline(always)]
    pub fn plane(&self, plane: NodePlane) -> &[f32; WIDTH] {
        let numbers = self.planes.as_flattened().as_flattened().as_ptr();
        // SAFETY: a `NodePlane` is only made by `new` and `opposite`, which keep its offset at the
        // start of a plane.
        unsafe { &*numbers.add(plane.first as usize).cast() }
    }

    pub const EMPTY: Node =
        Node { planes: [[[f32::MAX; WIDTH], [f32::MIN; WIDTH]]; 3], children: [EMPTY; WIDTH] };

    #[inline(always)]
    pub fn bounds(&self, child: usize) -> Aabb {
        // No iterators or `map`: closures are compiled without the caller's instruction set.
        let [x, y, z] = &self.planes;
        Aabb { min: [x[0][child], y[0][child], z[0][child]], max: [x[1][child], y[1][child], z[1][child]] }
    }

    pub fn set_bounds(&mut self, child: usize, b: &Aabb) {
        for a in 0..3 {
            self.planes[a][0][child] = if b.min[a] <= b.max[a] { b.min[a] } else { f32::MAX };
            self.planes[a][1][child] = if b.min[a] <= b.max[a] { b.max[a] } else { f32::MIN };
        }
    }

    /// The union of all child boxes.
    pub fn union(&self) -> Aabb {
        (0..WIDTH).filter(|&i| self.children[i] != EMPTY).fold(Aabb::EMPTY, |b, i| b.union(self.bounds(i)))
    }
}

/// The primitives of a leaf.
pub(crate) trait LeafBlock: Copy + Send + Sync {
    /// Primitive ids by lane, [`NO_PRIMITIVE`] where unused.
    fn ids(&self) -> &[u32; WIDTH];
    /// The bounds of one lane; empty if the lane can never be hit.
    fn lane_bounds(&self, lane: usize) -> Aabb;

    fn bounds(&self) -> Aabb {
        (0..WIDTH).fold(Aabb::EMPTY, |b, lane| b.union(self.lane_bounds(lane)))
    }
}

/// Up to eight triangles, in five cache lines. Unused lanes are NaN, which never hits.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct TriangleBlock {
    /// Coordinates by vertex, then axis, then lane.
    pub vertices: [[[f32; WIDTH]; 3]; 3],
    pub ids: [u32; WIDTH],
}

impl TriangleBlock {
    pub const EMPTY: TriangleBlock =
        TriangleBlock { vertices: [[[f32::NAN; WIDTH]; 3]; 3], ids: [NO_PRIMITIVE; WIDTH] };

    pub fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        [0, 1, 2].map(|v: usize| [0, 1, 2].map(|a: usize| self.vertices[v][a][lane]))
    }

    pub fn set_triangle(&mut self, lane: usize, points: &[[f32; 3]; 3]) {
        for v in 0..3 {
            for a in 0..3 {
                self.vertices[v][a][lane] = points[v][a];
            }
        }
    }
}

impl LeafBlock for TriangleBlock {
    fn ids(&self) -> &[u32; WIDTH] {
        &self.ids
    }

    fn lane_bounds(&self, lane: usize) -> Aabb {
        if self.vertices[0][0][lane].is_nan() {
            return Aabb::EMPTY;
        }
        self.triangle(lane).into_iter().fold(Aabb::EMPTY, Aabb::with_point)
    }
}

/// Up to eight spheres. Unused lanes have a NaN radius, which never hits.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct SphereBlock {
    /// x, y, z and radius, each by lane.
    pub spheres: [[f32; WIDTH]; 4],
    pub ids: [u32; WIDTH],
}

impl SphereBlock {
    pub const EMPTY: SphereBlock =
        SphereBlock { spheres: [[f32::NAN; WIDTH]; 4], ids: [NO_PRIMITIVE; WIDTH] };
}

impl LeafBlock for SphereBlock {
    fn ids(&self) -> &[u32; WIDTH] {
        &self.ids
    }

    fn lane_bounds(&self, lane: usize) -> Aabb {
        let [x, y, z, r] = self.spheres.map(|c| c[lane]);
        if r.is_nan() {
            return Aabb::EMPTY;
        }
        sphere_bounds([x, y, z], r)
    }
}

/// The bounds of a sphere, rounded outwards.
pub(crate) fn sphere_bounds(center: [f32; 3], radius: f32) -> Aabb {
    Aabb { min: center.map(|c| (c - radius).next_down()), max: center.map(|c| (c + radius).next_up()) }
}
