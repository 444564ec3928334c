//! Elementary functions: sines, arcs, exponentials, logarithms and powers, with the same bits on
//! every platform.
//!
//! `f32::sin` and its like are calls of the platform's C library. IEEE 754 says how sums, products,
//! quotients and square roots are rounded, but not these: glibc, musl, Apple's and Microsoft's
//! libraries differ in the last bit, and glibc from one processor to the next. A picture made on two
//! machines would not be one picture, and parts of it could not be merged. What is here is made of
//! operations that IEEE 754 rounds exactly, in an order that no compiler may change, and so yields
//! the same on every machine. `tests/bits.rs` holds every platform to it.
//!
//! Exponentials, logarithms, powers and lengths of `f32` are in [`single`]: as fast as those of C
//! libraries, and inlined. Everything else is the crate `libm`, in Rust after FreeBSD's and musl's libraries,
//! and pinned: another version may round differently.
//!
//! Clippy's list of disallowed methods (`clippy.toml`) keeps the methods of `f32` and `f64` out of
//! code that pictures depend on.

pub mod single;

/// Numbers that have elementary functions: `f32` and `f64`.
///
/// The functions of this crate are these, written as mathematics (and WGSL) writes them.
pub trait Elementary: Copy {
    /// See [`sin`].
    fn sine(self) -> Self;
    /// See [`cos`].
    fn cosine(self) -> Self;
    /// See [`sin_cos`].
    fn sine_cosine(self) -> (Self, Self);
    /// See [`tan`].
    fn tangent(self) -> Self;
    /// See [`asin`].
    fn arc_sine(self) -> Self;
    /// See [`acos`].
    fn arc_cosine(self) -> Self;
    /// See [`atan`].
    fn arc_tangent(self) -> Self;
    /// See [`atan2`].
    fn angle(self, x: Self) -> Self;
    /// See [`exp`].
    fn exponential(self) -> Self;
    /// See [`exp2`].
    fn power_of_two(self) -> Self;
    /// See [`log`].
    fn logarithm(self) -> Self;
    /// See [`log2`].
    fn logarithm_2(self) -> Self;
    /// See [`log10`].
    fn logarithm_10(self) -> Self;
    /// See [`pow`].
    fn power(self, exponent: Self) -> Self;
    /// See [`powi`].
    fn integer_power(self, exponent: i32) -> Self;
    /// See [`cbrt`].
    fn cube_root(self) -> Self;
    /// See [`hypot`].
    fn hypotenuse(self, other: Self) -> Self;
}

/// Free functions that call those of the trait.
macro_rules! functions {
    ($($(#[$doc:meta])* $name:ident($x:ident $(, $y:ident)?) = $method:ident;)*) => {
        $($(#[$doc])*
        #[inline(always)]
        pub fn $name<T: Elementary>($x: T $(, $y: T)?) -> T {
            $x.$method($($y)?)
        })*
    };
}

functions! {
    /// The sine of `x` radians.
    sin(x) = sine;
    /// The cosine of `x` radians.
    cos(x) = cosine;
    /// The tangent of `x` radians.
    tan(x) = tangent;
    /// The angle in `[-π/2, π/2]`, in radians, whose sine is `x`; not a number beyond ±1.
    asin(x) = arc_sine;
    /// The angle in `[0, π]`, in radians, whose cosine is `x`; not a number beyond ±1.
    acos(x) = arc_cosine;
    /// The angle in `[-π/2, π/2]`, in radians, whose tangent is `x`.
    atan(x) = arc_tangent;
    /// The angle of the vector (`x`, `y`) from the x axis, in radians, in `[-π, π]`; 0 or ±π, by the
    /// signs of the zeros, for the zero vector.
    atan2(y, x) = angle;
    /// e to the power of `x`.
    exp(x) = exponential;
    /// 2 to the power of `x`; exact for integers.
    exp2(x) = power_of_two;
    /// The natural logarithm of `x`: −∞ of zero, not a number below.
    log(x) = logarithm;
    /// The logarithm of `x` to the base 2: −∞ of zero, not a number below; exact for powers of 2.
    log2(x) = logarithm_2;
    /// The logarithm of `x` to the base 10: −∞ of zero, not a number below.
    log10(x) = logarithm_10;
    /// `x` to the power of `y`, with the special cases of IEEE 754: 1 if `y` is zero, not a number if
    /// `x` is negative and `y` is finite and no integer.
    pow(x, y) = power;
    /// The cube root of `x`, with its sign.
    cbrt(x) = cube_root;
    /// √(`x`² + `y`²), without overflow on the way.
    hypot(x, y) = hypotenuse;
}

/// The sine and the cosine of `x` radians.
#[inline(always)]
pub fn sin_cos<T: Elementary>(x: T) -> (T, T) {
    x.sine_cosine()
}

/// `x` to the power of an integer, by repeated squaring.
///
/// `f32::powi` is not one thing either: some platforms make it `pow`.
#[inline(always)]
pub fn powi<T: Elementary>(x: T, exponent: i32) -> T {
    x.integer_power(exponent)
}

/// Functions that are those of `libm` for a type, and its power of an integer.
macro_rules! library {
    ($($method:ident = $name:ident($($other:ident)?);)*) => {
        $(#[inline(always)]
        fn $method(self $(, $other: Self)?) -> Self {
            libm::$name(self $(, $other)?)
        })*

        #[inline(always)]
        fn integer_power(self, exponent: i32) -> Self {
            let (mut product, mut square, mut rest) = (1.0, self, exponent.unsigned_abs());
            while rest != 0 {
                if rest & 1 != 0 {
                    product *= square;
                }
                rest >>= 1;
                if rest != 0 {
                    square *= square;
                }
            }
            if exponent < 0 { 1.0 / product } else { product }
        }
    };
}

impl Elementary for f32 {
    library! {
        sine = sinf();
        cosine = cosf();
        tangent = tanf();
        arc_sine = asinf();
        arc_cosine = acosf();
        arc_tangent = atanf();
        angle = atan2f(x);
        cube_root = cbrtf();
    }

    #[inline(always)]
    fn sine_cosine(self) -> (Self, Self) {
        libm::sincosf(self)
    }

    #[inline(always)]
    fn exponential(self) -> Self {
        single::exp(self)
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        single::exp2(self)
    }

    #[inline(always)]
    fn logarithm(self) -> Self {
        single::log(self)
    }

    #[inline(always)]
    fn logarithm_2(self) -> Self {
        single::log2(self)
    }

    #[inline(always)]
    fn logarithm_10(self) -> Self {
        single::log10(self)
    }

    #[inline(always)]
    fn power(self, exponent: Self) -> Self {
        single::pow(self, exponent)
    }

    #[inline(always)]
    fn hypotenuse(self, other: Self) -> Self {
        single::hypot(self, other)
    }
}

impl Elementary for f64 {
    library! {
        sine = sin();
        cosine = cos();
        tangent = tan();
        arc_sine = asin();
        arc_cosine = acos();
        arc_tangent = atan();
        angle = atan2(x);
        exponential = exp();
        power_of_two = exp2();
        logarithm = log();
        logarithm_2 = log2();
        logarithm_10 = log10();
        power = pow(exponent);
        cube_root = cbrt();
        hypotenuse = hypot(other);
    }

    #[inline(always)]
    fn sine_cosine(self) -> (Self, Self) {
        libm::sincos(self)
    }
}
