//! Nodes and leaves as the kernels read them.

use crate::aabb::Aabb;

/// How many children a node has, and how many primitives a block.
pub(crate) const WIDTH: usize = 8;

/// Reference to a child: a node's index, or [`LEAF`] and a block's index, or [`INSTANCE`] and an instance's index, or
/// [`EMPTY`].
pub(crate) type ChildRef = u32;

/// Marks a reference to a block of primitives.
pub(crate) const LEAF: u32 = 0x8000_0000;

/// Marks a reference to an instance, at the leaves of the upper level. As a number it is above all other references but those to
/// nothing.
pub(crate) const INSTANCE: u32 = 0xC000_0000;

/// What a reference to a leaf leads to.
#[inline(always)]
pub(crate) fn leaf_index(child: ChildRef) -> usize {
    (child & !INSTANCE) as usize
}

/// Reference to nothing.
pub(crate) const EMPTY: u32 = u32::MAX;

/// Primitive id of an unused lane of a block.
pub(crate) const NO_PRIMITIVE: u32 = u32::MAX;

/// Eight boxes and what is inside of them: four cache lines. Unused boxes come last, are inverted, and hold [`EMPTY`].
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// Box faces by axis, then low/high, then child.
    pub planes: [[[f32; WIDTH]; 2]; 3],
    pub children: [ChildRef; WIDTH],
}

/// Which of a node's planes: an axis and a side.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(crate) struct Plane {
    /// Of the plane's first number in [`Node::planes`]: a multiple of [`WIDTH`] below six times that.
    first: u32,
}

impl Plane {
    /// The low face (`side` 0) or the high one (`side` 1) along an axis.
    #[inline(always)]
    pub fn new(axis: usize, side: usize) -> Self {
        debug_assert!(axis < 3 && side < 2);
        Plane { first: (2 * (axis as u32 % 3) + (side as u32 & 1)) * WIDTH as u32 }
    }

    /// The face on the other side.
    #[inline(always)]
    pub fn opposite(self) -> Self {
        Plane { first: self.first ^ WIDTH as u32 }
    }

    /// All that it is made of, in memory as well.
    #[inline(always)]
    pub fn number(self) -> u32 {
        self.first
    }

    /// 0: the low face; 1: the high one.
    #[inline(always)]
    pub fn side(self) -> usize {
        (self.first as usize / WIDTH) & 1
    }
}

impl Node {
    /// One face of each box.
    #[inline(always)]
    pub fn plane(&self, plane: Plane) -> &[f32; WIDTH] {
        let numbers = self.planes.as_flattened().as_flattened().as_ptr();
        // SAFETY: a whole plane begins there, see `Plane`: both ways to make one see to that.
        unsafe { &*numbers.add(plane.first as usize).cast() }
    }

    pub const EMPTY: Node =
        Node { planes: [[[f32::MAX; WIDTH], [f32::MIN; WIDTH]]; 3], children: [EMPTY; WIDTH] };

    #[inline(always)]
    pub fn bounds(&self, child: usize) -> Aabb {
        // Not by iterators or `map`: kernels' instructions are not those of their closures.
        let [x, y, z] = &self.planes;
        Aabb { min: [x[0][child], y[0][child], z[0][child]], max: [x[1][child], y[1][child], z[1][child]] }
    }

    pub fn set_bounds(&mut self, child: usize, b: &Aabb) {
        for a in 0..3 {
            self.planes[a][0][child] = if b.min[a] <= b.max[a] { b.min[a] } else { f32::MAX };
            self.planes[a][1][child] = if b.min[a] <= b.max[a] { b.max[a] } else { f32::MIN };
        }
    }

    /// The box around all children.
    pub fn union(&self) -> Aabb {
        (0..WIDTH).filter(|&i| self.children[i] != EMPTY).fold(Aabb::EMPTY, |b, i| b.union(self.bounds(i)))
    }
}

/// A leaf's contents.
pub(crate) trait Block: Copy + Send + Sync {
    /// Primitive ids by lane, [`NO_PRIMITIVE`] where unused.
    fn ids(&self) -> &[u32; WIDTH];
    /// The box around one lane; empty if the lane can never be hit.
    fn lane_bounds(&self, lane: usize) -> Aabb;

    fn bounds(&self) -> Aabb {
        (0..WIDTH).fold(Aabb::EMPTY, |b, lane| b.union(self.lane_bounds(lane)))
    }
}

/// Up to eight triangles: five cache lines. Unused lanes are NaN, which never hits.
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

impl Block for TriangleBlock {
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

impl Block for SphereBlock {
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

/// The box around a sphere, rounded outwards.
pub(crate) fn sphere_bounds(center: [f32; 3], radius: f32) -> Aabb {
    Aabb { min: center.map(|c| (c - radius).next_down()), max: center.map(|c| (c + radius).next_up()) }
}
