//! The builder's view of a primitive: its bounds and where it comes from.

use crate::aabb::Aabb;
use crate::simd::float4::Float4;

/// Makes a small integer look like a normal float. Denormal floats would slow down the arithmetic
/// on all lanes.
const NORMAL_FLOAT: u32 = 0x4000_0000;

/// The bounds of a primitive, its index and the number of its geometry. The fourth lanes hold the
/// two integers.
#[derive(Clone, Copy)]
#[repr(C)]
pub(crate) struct PrimitiveRef {
    pub(super) low: Float4,
    pub(super) high: Float4,
}

impl PrimitiveRef {
    #[inline]
    pub fn new(b: &Aabb, index: u32, geometry: u32) -> Self {
        let ([x0, y0, z0], [x1, y1, z1]) = (b.min, b.max);
        PrimitiveRef {
            low: Float4::new([x0, y0, z0, f32::from_bits(index ^ NORMAL_FLOAT)]),
            high: Float4::new([x1, y1, z1, f32::from_bits(geometry ^ NORMAL_FLOAT)]),
        }
    }

    pub fn index(&self) -> u32 {
        self.low.to_array()[3].to_bits() ^ NORMAL_FLOAT
    }

    pub fn geometry(&self) -> u32 {
        self.high.to_array()[3].to_bits() ^ NORMAL_FLOAT
    }

    pub fn bounds(&self) -> Aabb {
        let ([x0, y0, z0, _], [x1, y1, z1, _]) = (self.low.to_array(), self.high.to_array());
        Aabb { min: [x0, y0, z0], max: [x1, y1, z1] }
    }

    /// Twice the centre; the fourth lane is undefined.
    #[inline(always)]
    pub(super) fn center2(&self) -> Float4 {
        self.low.add(self.high)
    }
}

/// A box in vector registers; the fourth lanes are undefined.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    pub low: Float4,
    pub high: Float4,
}

impl Bounds {
    #[inline(always)]
    pub fn empty() -> Bounds {
        Bounds { low: Float4::splat(f32::INFINITY), high: Float4::splat(f32::NEG_INFINITY) }
    }

    #[inline(always)]
    pub fn grow(&mut self, low: Float4, high: Float4) {
        self.low = self.low.min(low);
        self.high = self.high.max(high);
    }

    #[inline(always)]
    pub fn union(self, b: Bounds) -> Bounds {
        Bounds { low: self.low.min(b.low), high: self.high.max(b.high) }
    }

    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        let [x, y, z, _] = self.high.sub(self.low).to_array();
        x * y + y * z + z * x
    }

    pub fn to_aabb(self) -> Aabb {
        let ([x0, y0, z0, _], [x1, y1, z1, _]) = (self.low.to_array(), self.high.to_array());
        Aabb { min: [x0, y0, z0], max: [x1, y1, z1] }
    }
}
