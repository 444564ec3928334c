//! Every platform yields the same bits: a hash of 4096 results of each function.

use elementary::*;

/// How many results of a function are hashed.
const COUNT: u64 = 4096;

/// Random bits (SplitMix64).
fn random(i: u64) -> u64 {
    let mut z = i.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

/// Arguments: every fourth is any number at all, subnormal, infinite and none included; the others
/// are within ±1, ±8 and ±100, where most calls are.
fn argument(i: u64) -> f64 {
    let bits = random(i);
    let within = (bits >> 11) as f64 / 4_503_599_627_370_496.0 - 1.0;
    match i % 4 {
        0 => f64::from_bits(bits),
        1 => within,
        2 => 8.0 * within,
        _ => 100.0 * within,
    }
}

/// The same for `f32`.
fn argument_f32(i: u64) -> f32 {
    if i.is_multiple_of(4) { f32::from_bits((random(i) >> 32) as u32) } else { argument(i) as f32 }
}

/// FNV-1a of the results' bits. All that is not a number counts as one: IEEE 754 does not say which.
fn hash(results: impl Iterator<Item = f64>) -> u64 {
    let bits = results.map(|x| if x.is_nan() { u64::MAX } else { x.to_bits() });
    bits.flat_map(u64::to_le_bytes)
        .fold(0xcbf2_9ce4_8422_2325, |h, byte| (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Names and hashes of functions, for `f32` and `f64`. An `f32` is hashed as the `f64` that it is.
macro_rules! hashes {
    (one: $($one:ident)*; two: $($two:ident)*) => {
        vec![
            $((stringify!($one), [
                hash((0..COUNT).map(|i| f64::from($one(argument_f32(i))))),
                hash((0..COUNT).map(|i| $one(argument(i)))),
            ]),)*
            $((stringify!($two), [
                hash((0..COUNT).map(|i| f64::from($two(argument_f32(i), argument_f32(i + COUNT))))),
                hash((0..COUNT).map(|i| $two(argument(i), argument(i + COUNT)))),
            ]),)*
            ("sin_cos", [
                hash((0..COUNT).map(|i| sin_cos(argument_f32(i))).flat_map(|(s, c)| [s.into(), c.into()])),
                hash((0..COUNT).map(|i| sin_cos(argument(i))).flat_map(|(s, c)| [s, c])),
            ]),
            ("powi", [
                hash((0..COUNT).map(|i| f64::from(powi(argument_f32(i), random(i) as i32 % 40)))),
                hash((0..COUNT).map(|i| powi(argument(i), random(i) as i32 % 40))),
            ]),
        ]
    };
}

/// What x86-64 yields. Where functions were changed on purpose, the test prints the new table.
const EXPECTED: &[(&str, [u64; 2])] = &[
    ("sin", [0x8b4f9b8bba24ddce, 0xfc2c0baeb0f08453]),
    ("cos", [0x1782ca74978c1b39, 0x281da0b4b0bc1d4e]),
    ("tan", [0xd9bd88aa1d1d74a0, 0x3aab0f78577673bc]),
    ("asin", [0x9880be2205cb3a83, 0xea7f657da25b52e2]),
    ("acos", [0xe770997eb122552c, 0x9cc584648bf1b9f8]),
    ("atan", [0xef7ac4f86ce30991, 0x7c07aa7e46796a11]),
    ("exp", [0x46f9d02294f00d00, 0x69c78cdd8782b89a]),
    ("exp2", [0xab7d5858d0d02ccb, 0xfd87b82e4a5cc5a5]),
    ("log", [0x84ea6bacf1a6ed5f, 0xcf8b05163fdefd27]),
    ("log2", [0x3fa93b682017aeba, 0x7801221174fd9ae3]),
    ("log10", [0x081806281ba4f85c, 0x57ed4894ba2f1dcf]),
    ("cbrt", [0x144e9fab8906e513, 0xc538cbd297f85566]),
    ("atan2", [0x5d2a87343715a88f, 0x19581bdac5ed2b9b]),
    ("pow", [0xd5ee4b249b23b998, 0x358f11b6390744d4]),
    ("hypot", [0xdaabc838579b6bae, 0x3c15ddce59fb01de]),
    ("sin_cos", [0x66375addcb57a7de, 0x8222cd8970feff8c]),
    ("powi", [0x08655a3735b510a8, 0xba005f3fed684732]),
];

#[test]
fn results_have_the_same_bits_on_every_platform() {
    let hashes = hashes!(
        one: sin cos tan asin acos atan exp exp2 log log2 log10 cbrt;
        two: atan2 pow hypot
    );
    let mut table = String::new();
    for (name, [single, double]) in &hashes {
        table += &format!("    (\"{name}\", [{single:#018x}, {double:#018x}]),\n");
    }
    assert!(hashes == EXPECTED, "these are not the bits of x86-64:\n{table}");
}
