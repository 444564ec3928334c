//! Axis-aligned boxes.

/// An axis-aligned box. `min > max` in some axis means empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: [f32; 3],
    /// Largest coordinates.
    pub max: [f32; 3],
}

impl Aabb {
    /// The empty box: the neutral element of a union.
    pub const EMPTY: Aabb = Aabb { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    /// Whether the box contains no point.
    pub fn is_empty(&self) -> bool {
        (0..3).any(|a| self.min[a] > self.max[a])
    }

    /// The smallest box that contains both.
    #[must_use]
    pub fn union(self, other: Aabb) -> Aabb {
        let mut r = self;
        for a in 0..3 {
            r.min[a] = r.min[a].min(other.min[a]);
            r.max[a] = r.max[a].max(other.max[a]);
        }
        r
    }

    /// The smallest box that contains this one and a point.
    #[must_use]
    pub fn with_point(self, p: [f32; 3]) -> Aabb {
        self.union(Aabb { min: p, max: p })
    }

    /// Half of the surface area; zero for an empty box.
    pub fn half_area(&self) -> f32 {
        let [x, y, z] = [0, 1, 2].map(|a| (self.max[a] - self.min[a]).max(0.0));
        x * y + y * z + z * x
    }

    /// Whether `other` lies inside. The boundary counts as inside.
    pub fn contains(&self, other: &Aabb) -> bool {
        (0..3).all(|a| self.min[a] <= other.min[a] && other.max[a] <= self.max[a])
    }

    /// The largest magnitude of a coordinate, by axis; zero for an empty box. Rounding errors of
    /// coordinates in the box are relative to it.
    pub(crate) fn extent(&self) -> [f32; 3] {
        if self.is_empty() {
            return [0.0; 3];
        }
        [0, 1, 2].map(|a: usize| self.min[a].abs().max(self.max[a].abs()))
    }
}
