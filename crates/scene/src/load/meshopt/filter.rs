//! Filters: attributes that were prepared for compression, back as they are used.

use super::MeshoptError;
use elementary::powi;

/// What was done to elements before they were compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// Unit vectors as points of an octahedron: four bytes, or four 16-bit numbers, of which the last is kept.
    Octahedral,
    /// Unit quaternions without their largest component: four 16-bit numbers.
    Quaternion,
    /// Floating-point numbers as a power of two (8 bits) and an integer (24 bits).
    Exponential,
    /// Colours as luma, two differences and alpha, of fewer bits: four bytes, or four 16-bit numbers.
    Color,
}

impl Filter {
    /// Undoes the filter on elements of `size` bytes.
    ///
    /// # Errors
    /// [`MeshoptError::ElementSize`] if the filter has no elements of this size.
    pub fn undo(self, data: &mut [u8], size: usize) -> Result<(), MeshoptError> {
        match (self, size) {
            (Self::Octahedral, 4) => data.chunks_exact_mut(4).for_each(octahedral_bytes),
            (Self::Octahedral, 8) => data.chunks_exact_mut(8).for_each(octahedral_shorts),
            (Self::Color, 4) => data.chunks_exact_mut(4).for_each(color_bytes),
            (Self::Color, 8) => data.chunks_exact_mut(8).for_each(color_shorts),
            (Self::Quaternion, 8) => data.chunks_exact_mut(8).for_each(quaternion),
            (Self::Exponential, size) if size > 0 && size.is_multiple_of(4) => {
                data.chunks_exact_mut(4).for_each(exponential);
            }
            _ => return Err(MeshoptError::ElementSize(size)),
        }
        Ok(())
    }
}

fn octahedral_bytes(element: &mut [u8]) {
    let [x, y, one] = [0, 1, 2].map(|i| f32::from(element[i] as i8));
    let unit = octahedral(x, y, one, 127.0);
    (0..3).for_each(|i| element[i] = unit[i] as i8 as u8);
}

fn octahedral_shorts(element: &mut [u8]) {
    let [x, y, one] = [0, 1, 2].map(|i| f32::from(short(element, i)));
    let unit = octahedral(x, y, one, 32767.0);
    (0..3).for_each(|i| set_short(element, i, unit[i] as i16));
}

/// The unit vector times `largest`, rounded. `one` is the octahedron's size in the units of `x` and `y`.
fn octahedral(x: f32, y: f32, one: f32, largest: f32) -> [i32; 3] {
    let z = one - x.abs() - y.abs();
    let fold = z.min(0.0);
    let unfold = |v: f32| v + if v >= 0.0 { fold } else { -fold };
    let (x, y) = (unfold(x), unfold(y));
    let scale = largest / (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|v| round(v * scale))
}

fn color_bytes(element: &mut [u8]) {
    let [co, cg] = [1, 2].map(|i| i32::from(element[i] as i8));
    let rgba = color(element[0].into(), co, cg, element[3].into(), 255.0);
    (0..4).for_each(|i| element[i] = rgba[i] as u8);
}

fn color_shorts(element: &mut [u8]) {
    let unsigned = |i: usize| i32::from(short(element, i) as u16);
    let [co, cg] = [1, 2].map(|i| i32::from(short(element, i)));
    let rgba = color(unsigned(0), co, cg, unsigned(3), 65535.0);
    (0..4).for_each(|i| set_short(element, i, rgba[i] as u16 as i16));
}

/// Red, green, blue and alpha in `0..=largest`. The highest bit of alpha says how many bits the numbers have.
fn color(y: i32, co: i32, cg: i32, alpha: i32, largest: f32) -> [i32; 4] {
    let bits = 32 - (alpha as u32).leading_zeros();
    let one = (1i32 << bits) - 1;
    let alpha = alpha & one >> 1;
    let scale = largest / one.max(1) as f32;
    let scaled = |v: i32| round((v as f32 * scale).clamp(0.0, largest));
    [y + co - cg, y + cg, y - co - cg, alpha << 1 | alpha & 1].map(scaled)
}

fn quaternion(element: &mut [u8]) {
    let last = short(element, 3);
    let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(last | 3);
    let [x, y, z] = [0, 1, 2].map(|i| f32::from(short(element, i)) * scale);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let largest = (last & 3) as usize;
    for (i, value) in [w, x, y, z].into_iter().enumerate() {
        set_short(element, (largest + i) & 3, round(value * 32767.0) as i16);
    }
}

fn exponential(element: &mut [u8]) {
    let bits = i32::from_le_bytes([element[0], element[1], element[2], element[3]]);
    let (exponent, mantissa) = (bits >> 24, bits << 8 >> 8);
    let value = f64::from(mantissa) * powi(2f64, exponent);
    element.copy_from_slice(&(value as f32).to_le_bytes());
}

fn round(v: f32) -> i32 {
    (v + if v >= 0.0 { 0.5 } else { -0.5 }) as i32
}

fn short(element: &[u8], i: usize) -> i16 {
    i16::from_le_bytes([element[2 * i], element[2 * i + 1]])
}

fn set_short(element: &mut [u8], i: usize, value: i16) {
    element[2 * i..2 * i + 2].copy_from_slice(&value.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_come_back_from_the_octahedron() {
        for direction in [[0.0f32, 0.0, 1.0], [0.6, 0.0, -0.8], [-0.48, 0.6, 0.64], [-0.48, -0.6, -0.64]] {
            let [x, y, z] = direction;
            let sum = x.abs() + y.abs() + z.abs();
            let (u, v) = (x / sum, y / sum);
            let fold = |a: f32, b: f32| if z >= 0.0 { a } else { (1.0 - b.abs()).copysign(a) };
            let encoded = [fold(u, v), fold(v, u)].map(|c| round(c * 32767.0) as i16);
            let mut element = [0; 8];
            [encoded[0], encoded[1], 32767, 5]
                .into_iter()
                .enumerate()
                .for_each(|(i, v)| set_short(&mut element, i, v));
            Filter::Octahedral.undo(&mut element, 8).expect("eight bytes");
            for (i, expected) in direction.into_iter().enumerate() {
                let decoded = f32::from(short(&element, i)) / 32767.0;
                assert!((decoded - expected).abs() < 2e-4, "{direction:?}: {decoded} for {expected}");
            }
            assert_eq!(short(&element, 3), 5, "the last number is kept");
        }
    }

    #[test]
    fn the_largest_component_of_a_quaternion_is_found_again() {
        let rotation = [0.1f32, -0.7, 0.3, 0.640_312_4];
        let largest = 1usize;
        let scale = 2047.0 * std::f32::consts::SQRT_2;
        let sign = rotation[largest].signum();
        let mut element = [0; 8];
        for i in 0..3 {
            set_short(&mut element, i, round(rotation[(largest + 1 + i) & 3] * sign * scale) as i16);
        }
        set_short(&mut element, 3, 2044 | largest as i16);
        Filter::Quaternion.undo(&mut element, 8).expect("eight bytes");
        for (i, expected) in rotation.into_iter().enumerate() {
            let decoded = f32::from(short(&element, i)) / 32767.0 * sign;
            assert!((decoded - expected).abs() < 1e-3, "{i}: {decoded} for {expected}");
        }
    }

    /// Of seven bits in bytes and of twelve in shorts: Y = (r + 2g + b) / 4, Co = (r − b) / 2, Cg = (2g − r − b) / 4.
    #[test]
    fn colors_come_back_from_luma_and_differences() {
        let parts = |[r, g, b]: [i32; 3]| ((r + 2 * g + b) / 4, (r - b) / 2, (2 * g - r - b) / 4);
        // All sums are multiples of four, so that nothing is rounded.
        let (y, co, cg) = parts([120, 60, 16]);
        let mut element = [y as u8, co as i8 as u8, cg as i8 as u8, 64 | 63];
        Filter::Color.undo(&mut element, 4).expect("four bytes");
        let of_seven = |v: i32| (v as f32 * 255.0 / 127.0).round() as u8;
        assert_eq!(element, [of_seven(120), of_seven(60), of_seven(16), 255]);
        let (y, co, cg) = parts([4000, 100, 1000]);
        let mut element = [0; 8];
        for (i, v) in [y, co, cg, 2048 | 1].into_iter().enumerate() {
            set_short(&mut element, i, v as i16);
        }
        Filter::Color.undo(&mut element, 8).expect("eight bytes");
        let of_twelve = |v: i32| (v as f32 * 65535.0 / 4095.0).round() as u16;
        let decoded = [0, 1, 2, 3].map(|i| short(&element, i) as u16);
        assert_eq!(decoded, [of_twelve(4000), of_twelve(100), of_twelve(1000), of_twelve(3)]);
        assert!(Filter::Color.undo(&mut [0; 12], 12).is_err());
        let mut transparent = [0; 4];
        Filter::Color.undo(&mut transparent, 4).expect("damaged, but of four bytes");
    }

    #[test]
    fn powers_of_two_are_exact_and_wrong_sizes_are_refused() {
        let mut element = (((-3i32) << 24) | (0x00ff_ffff & -10)).to_le_bytes();
        Filter::Exponential.undo(&mut element, 4).expect("four bytes");
        assert_eq!(f32::from_le_bytes(element), -1.25);
        assert!(Filter::Octahedral.undo(&mut [0; 12], 12).is_err());
        assert!(Filter::Quaternion.undo(&mut [0; 4], 4).is_err());
    }
}
