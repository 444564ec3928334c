//! Colours by other primaries than those of Rec. 709.

use exr::meta::attribute::Chromaticities;
use exr::prelude::Vec2;

/// Chromaticities of red, green, blue and white: CIE x and y.
pub type Primaries = [[f32; 2]; 4];

type Matrix = [[f64; 3]; 3];

/// Those of Rec. 709 and sRGB.
pub(super) const REC_709: Primaries = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]];

/// Bradford's matrix from XYZ to the responses of cones that are scaled where white is another.
const BRADFORD: Matrix = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];

/// The primaries that a file names; `None` for those of Rec. 709, rounded ones too, and for what spans no colours.
pub(super) fn named(attribute: Option<Chromaticities>) -> Option<Primaries> {
    let c = attribute?;
    let named = [c.red, c.green, c.blue, c.white].map(|Vec2(x, y)| [x, y]);
    let distance = |(a, b): (&f32, &f32)| (a - b).abs();
    let differs = named.as_flattened().iter().zip(REC_709.as_flattened()).map(distance).any(|d| d > 5e-4);
    (differs && to_rec709(&named).is_some()).then_some(named)
}

/// As the attribute of a file.
pub(super) fn attribute(primaries: Option<&Primaries>) -> Chromaticities {
    let [red, green, blue, white] = primaries.unwrap_or(&REC_709).map(|[x, y]| Vec2(x, y));
    Chromaticities { red, green, blue, white }
}

/// The matrix from linear colours of `primaries` to those of Rec. 709, white to white by Bradford's adaptation, as OpenEXR's
/// library converts. `None` if they span no colours.
pub(super) fn to_rec709(primaries: &Primaries) -> Option<Matrix> {
    let cones = |white: [f32; 2]| times(&BRADFORD, xyz(white));
    let ([from, to], back) = ([cones(primaries[3]), cones(REC_709[3])], inverse(&BRADFORD)?);
    let gains: [f64; 3] = std::array::from_fn(|i| to[i] / from[i]);
    let scaled: Matrix = std::array::from_fn(|i| BRADFORD[i].map(|v| v * gains[i]));
    let adapted = product(&back, &scaled);
    let matrix = product(&inverse(&to_xyz(&REC_709)?)?, &product(&adapted, &to_xyz(primaries)?));
    matrix.as_flattened().iter().all(|v| v.is_finite()).then_some(matrix)
}

/// From linear colours to XYZ, where white has Y = 1.
fn to_xyz(primaries: &Primaries) -> Option<Matrix> {
    // Blue of ACES has a negative y: columns are (x, y, z) themselves, which always exist.
    let column = |[x, y]: [f32; 2]| [f64::from(x), f64::from(y), 1.0 - f64::from(x) - f64::from(y)];
    let [r, g, b] = [0, 1, 2].map(|i| column(primaries[i]));
    let columns: Matrix = std::array::from_fn(|row| [r[row], g[row], b[row]]);
    let amounts = times(&inverse(&columns)?, xyz(primaries[3]));
    Some(columns.map(|row| std::array::from_fn(|i| row[i] * amounts[i])))
}

/// XYZ of a chromaticity at Y = 1.
fn xyz([x, y]: [f32; 2]) -> [f64; 3] {
    let (x, y) = (f64::from(x), f64::from(y));
    [x / y, 1.0, (1.0 - x - y) / y]
}

fn times(m: &Matrix, v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    a.map(|row| std::array::from_fn(|j| (0..3).map(|k| row[k] * b[k][j]).sum()))
}

fn inverse(m: &Matrix) -> Option<Matrix> {
    // Cofactors, whose rows and columns go around.
    let at = |i: usize, j: usize| m[i % 3][j % 3];
    let cofactor =
        |i: usize, j: usize| at(i + 1, j + 1) * at(i + 2, j + 2) - at(i + 1, j + 2) * at(i + 2, j + 1);
    let determinant: f64 = (0..3).map(|j| m[0][j] * cofactor(0, j)).sum();
    let inverse: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / determinant));
    (determinant.abs() > 1e-9 && determinant.is_finite()).then_some(inverse)
}
