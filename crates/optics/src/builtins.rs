//! Built-in functions of WGSL as rustc inlines them into kernels of other crates, with the same bits on every platform.
//!
//! `wgsl-rs` has the same functions without `#[inline]`: without link-time optimisation each use of those below would be a
//! call in the innermost loops. [`inlining::inline_all`] imports these into every module that it is put on, where they take
//! the place of those of `wgsl_rs::std`. Their results are the same bit for bit, but for sines, arcs, exponentials,
//! logarithms and powers: those of `wgsl_rs::std` are the platform's C library, these are `elementary`'s. The text for
//! the GPU has WGSL's own either way.

pub use elementary::{acos, asin, atan, atan2, cos, exp, exp2, log, log2, pow, sin, tan};
use wgsl_rs::std::{self as library, Vec2f, Vec3f, Vec4f};

/// Numbers and vectors of them. Vectors have each function for each component.
pub trait Number: Copy {
    /// See [`abs`].
    fn absolute(self) -> Self;
    /// See [`clamp`].
    fn within(self, low: Self, high: Self) -> Self;
    /// See [`max`].
    fn larger(self, other: Self) -> Self;
    /// See [`min`].
    fn smaller(self, other: Self) -> Self;
}

/// Floating point numbers and vectors of them.
pub trait Float: Number {
    /// See [`saturate`].
    fn saturated(self) -> Self;
}

/// Vectors of floating point numbers.
pub trait Vector: Copy {
    /// The sum of the squares of the components.
    fn squared(self) -> f32;
    /// The vector times a number.
    fn scaled(self, factor: f32) -> Self;
}

/// The length of a vector.
#[inline(always)]
pub fn length<T: Vector>(e: T) -> f32 {
    e.squared().sqrt()
}

/// The vector of length 1 in the same direction; not numbers for the zero vector.
#[inline(always)]
pub fn normalize<T: Vector>(e: T) -> T {
    e.scaled(1.0 / length(e))
}

/// The absolute value.
#[inline(always)]
pub fn abs<T: Number>(e: T) -> T {
    e.absolute()
}

/// The value within `low` and `high`.
///
/// # Panics
/// If `low` is greater than `high` or either is not a number.
#[inline(always)]
pub fn clamp<T: Number>(e: T, low: T, high: T) -> T {
    e.within(low, high)
}

/// The larger value; of a number and one that is not, the number.
#[inline(always)]
pub fn max<T: Number>(a: T, b: T) -> T {
    a.larger(b)
}

/// The smaller value; of a number and one that is not, the number.
#[inline(always)]
pub fn min<T: Number>(a: T, b: T) -> T {
    a.smaller(b)
}

/// The value within 0 and 1.
#[inline(always)]
pub fn saturate<T: Float>(e: T) -> T {
    e.saturated()
}

/// Hermite interpolation between 0 at `low` and 1 at `high`.
#[inline(always)]
pub fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = f32::clamp((x - low) / (high - low), 0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Functions of a type from those of a scalar.
macro_rules! number {
    ($type:ty, $absolute:expr, $within:expr, $larger:expr, $smaller:expr) => {
        impl Number for $type {
            #[inline(always)]
            fn absolute(self) -> Self {
                $absolute(self)
            }
            #[inline(always)]
            fn within(self, low: Self, high: Self) -> Self {
                $within(self, low, high)
            }
            #[inline(always)]
            fn larger(self, other: Self) -> Self {
                $larger(self, other)
            }
            #[inline(always)]
            fn smaller(self, other: Self) -> Self {
                $smaller(self, other)
            }
        }
    };
}

number!(f32, f32::abs, f32::clamp, f32::max, f32::min);
number!(i32, i32::wrapping_abs, Ord::clamp, Ord::max, Ord::min);
number!(u32, std::convert::identity, Ord::clamp, Ord::max, Ord::min);

impl Float for f32 {
    #[inline(always)]
    fn saturated(self) -> Self {
        f32::clamp(self, 0.0, 1.0)
    }
}

/// Functions of a vector. Those that the library lets rustc inline are the library's.
macro_rules! vector {
    ($type:ty) => {
        impl Number for $type {
            #[inline(always)]
            fn absolute(self) -> Self {
                Self::from_array(self.to_array().map(f32::abs))
            }
            #[inline(always)]
            fn within(self, low: Self, high: Self) -> Self {
                library::clamp(self, low, high)
            }
            #[inline(always)]
            fn larger(self, other: Self) -> Self {
                library::max(self, other)
            }
            #[inline(always)]
            fn smaller(self, other: Self) -> Self {
                library::min(self, other)
            }
        }

        impl Float for $type {
            #[inline(always)]
            fn saturated(self) -> Self {
                Self::from_array(self.to_array().map(f32::saturated))
            }
        }

        impl Vector for $type {
            #[inline(always)]
            fn squared(self) -> f32 {
                let [first, rest @ ..] = self.to_array();
                rest.into_iter().fold(first * first, |sum, x| sum + x * x)
            }
            #[inline(always)]
            fn scaled(self, factor: f32) -> Self {
                Self::from_array(self.to_array().map(|x| x * factor))
            }
        }
    };
}

vector!(Vec2f);
vector!(Vec3f);
vector!(Vec4f);

#[cfg(test)]
mod tests {
    use super::*;

    /// One zero only: which of two is larger depends on the compiler.
    const VALUES: [f32; 8] = [-f32::INFINITY, -2.5, -0.0, 1e-30, 0.75, 1.0, 3.0e9, f32::INFINITY];

    #[test]
    fn results_are_those_of_the_library() {
        let same = |a: f32, b: f32, what: &str| assert_eq!(a.to_bits(), b.to_bits(), "{what}");
        let same3 = |a: Vec3f, b: Vec3f, what: &str| {
            a.to_array().into_iter().zip(b.to_array()).for_each(|(a, b)| same(a, b, what));
        };
        for a in VALUES {
            same(abs(a), library::abs(a), "abs");
            same(saturate(a), library::saturate(a), "saturate");
            same(smoothstep(-1.0, 2.0, a), library::smoothstep(-1.0, 2.0, a), "smoothstep");
            for b in VALUES {
                same(max(a, b), library::max(a, b), "max");
                same(min(a, b), library::min(a, b), "min");
                same(clamp(a, b, b + 1.0), library::clamp(a, b, b + 1.0), "clamp");
                let u = Vec3f { x: a, y: b, z: 0.5 };
                same3(abs(u), library::abs(u), "abs of a vector");
                same3(saturate(u), library::saturate(u), "saturate of a vector");
                same(length(u), library::length(u), "length");
                if u.to_array().into_iter().all(|x| x.abs() < 1e18) {
                    same3(normalize(u), library::normalize(u), "normalize");
                }
            }
        }
        for (a, b) in [(3i32, -4), (i32::MIN, 7)] {
            assert_eq!(
                (abs(a), min(a, b), max(a, b)),
                (library::abs(a), library::min(a, b), library::max(a, b))
            );
            assert_eq!(clamp(a, -5, 5), library::clamp(a, -5, 5));
        }
        assert_eq!((abs(7u32), min(7u32, 3), max(7u32, 3), clamp(7u32, 1, 5)), (7, 3, 7, 5));
    }

    #[test]
    fn what_is_no_number_gives_way() {
        for (a, b) in [(f32::NAN, 1.0), (1.0, f32::NAN)] {
            assert_eq!((max(a, b), min(a, b)), (1.0, 1.0));
        }
        assert!(saturate(f32::NAN).is_nan());
    }
}
