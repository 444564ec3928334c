//! Four `f32` lanes for the builder, with instructions that every processor of an architecture has.

/// Four lanes; boxes use three of them.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(crate) struct Float4(Inner);

#[cfg(all(target_arch = "x86_64", not(miri)))]
use std::arch::x86_64 as sse;
#[cfg(all(target_arch = "x86_64", not(miri)))]
type Inner = sse::__m128;

#[cfg(all(target_arch = "x86_64", not(miri)))]
impl Float4 {
    #[inline(always)]
    pub fn new(x: [f32; 4]) -> Float4 {
        // SAFETY: SSE is part of x86-64.
        Float4(unsafe { sse::_mm_setr_ps(x[0], x[1], x[2], x[3]) })
    }

    #[inline(always)]
    pub fn splat(x: f32) -> Float4 {
        // SAFETY: SSE is part of x86-64.
        Float4(unsafe { sse::_mm_set1_ps(x) })
    }

    #[inline(always)]
    pub fn to_array(self) -> [f32; 4] {
        // SAFETY: both are sixteen bytes of plain data.
        unsafe { std::mem::transmute(self.0) }
    }

    #[inline(always)]
    pub fn min(self, other: Float4) -> Float4 {
        // SAFETY: SSE is part of x86-64.
        Float4(unsafe { sse::_mm_min_ps(self.0, other.0) })
    }

    #[inline(always)]
    pub fn max(self, other: Float4) -> Float4 {
        // SAFETY: SSE is part of x86-64.
        Float4(unsafe { sse::_mm_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    pub fn add(self, other: Float4) -> Float4 {
        // SAFETY: SSE is part of x86-64.
        Float4(unsafe { sse::_mm_add_ps(self.0, other.0) })
    }

    #[inline(always)]
    pub fn sub(self, other: Float4) -> Float4 {
        // SAFETY: SSE is part of x86-64.
        Float4(unsafe { sse::_mm_sub_ps(self.0, other.0) })
    }

    #[inline(always)]
    pub fn mul(self, other: Float4) -> Float4 {
        // SAFETY: SSE is part of x86-64.
        Float4(unsafe { sse::_mm_mul_ps(self.0, other.0) })
    }

    /// Truncates to integers; what does not fit becomes some integer.
    #[inline(always)]
    pub fn to_i32(self) -> [i32; 4] {
        // SAFETY: SSE2 is part of x86-64, and both are sixteen bytes of plain data.
        unsafe { std::mem::transmute(sse::_mm_cvttps_epi32(self.0)) }
    }
}

#[cfg(not(all(target_arch = "x86_64", not(miri))))]
type Inner = [f32; 4];

#[cfg(not(all(target_arch = "x86_64", not(miri))))]
impl Float4 {
    #[inline(always)]
    pub fn new(x: [f32; 4]) -> Float4 {
        Float4(x)
    }

    #[inline(always)]
    pub fn splat(x: f32) -> Float4 {
        Float4([x; 4])
    }

    #[inline(always)]
    pub fn to_array(self) -> [f32; 4] {
        self.0
    }

    #[inline(always)]
    fn zip(self, other: Float4, f: impl Fn(f32, f32) -> f32) -> Float4 {
        let (a, b) = (self.0, other.0);
        Float4([f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])])
    }

    #[inline(always)]
    pub fn min(self, other: Float4) -> Float4 {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    pub fn max(self, other: Float4) -> Float4 {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    pub fn add(self, other: Float4) -> Float4 {
        self.zip(other, |a, b| a + b)
    }

    #[inline(always)]
    pub fn sub(self, other: Float4) -> Float4 {
        self.zip(other, |a, b| a - b)
    }

    #[inline(always)]
    pub fn mul(self, other: Float4) -> Float4 {
        self.zip(other, |a, b| a * b)
    }

    /// Truncates to integers; what does not fit becomes some integer.
    #[inline(always)]
    pub fn to_i32(self) -> [i32; 4] {
        self.0.map(|x| x as i32)
    }
}
