//! Environments on the six faces of a cube, as equirectangular pictures.

use crate::{Image, Pixels};
use glam::{Quat, Vec3};
use rayon::prelude::*;

/// The faces, in the order of files and of graphics APIs: where the middle of each is, and where its picture's right and lower edge are.
/// Pictures are what is seen from the middle of the cube, not mirrored.
const FACES: [[Vec3; 3]; 6] = [
    [Vec3::X, Vec3::Z, Vec3::NEG_Y],
    [Vec3::NEG_X, Vec3::NEG_Z, Vec3::NEG_Y],
    [Vec3::Y, Vec3::NEG_X, Vec3::Z],
    [Vec3::NEG_Y, Vec3::NEG_X, Vec3::NEG_Z],
    [Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y],
    [Vec3::NEG_Z, Vec3::X, Vec3::NEG_Y],
];

/// No picture becomes higher than this.
const MAX_HEIGHT: u32 = 2048;

/// A face's picture: linear radiance, row by row.
pub(super) struct Face {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<[f32; 3]>,
}

/// The cube `faces` (towards +X, −X, +Y, −Y, +Z, −Z), turned by the unit `rotation`, as an equirectangular picture with about the
/// same number of pixels around the horizon.
///
/// Each pixel is the mean of four places in it, which are not interpolated: closer than pixels of the faces are anywhere, so that
/// none of them is lost.
pub(super) fn equirectangular(name: &str, faces: &[Face; 6], rotation: Quat) -> Image {
    let height = faces.iter().map(|face| 2 * face.height).max().unwrap_or(1).clamp(4, MAX_HEIGHT);
    let width = 2 * height;
    let to_cube = rotation.conjugate();
    let radiance = |x: f32, y: f32| {
        let uv = optics::vec2f(x / width as f32, y / height as f32);
        let direction = Vec3::from_array(optics::sky::equirect_to_direction(uv, 0.0).to_array());
        at(faces, to_cube * direction)
    };
    let pixel = |x: u32, y: u32| {
        let places = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];
        let sum: Vec3 = places.iter().map(|(dx, dy)| radiance(x as f32 + dx, y as f32 + dy)).sum();
        (sum / places.len() as f32).to_array()
    };
    let row = |y: u32| (0..width).map(|x| pixel(x, y)).collect::<Vec<_>>();
    let pixels = (0..height).into_par_iter().flat_map_iter(row).collect();
    Image { name: name.into(), width, height, pixels: Pixels::Rgb32F(pixels) }
}

/// What is seen from the middle of the cube in a direction other than zero.
fn at(faces: &[Face; 6], direction: Vec3) -> Vec3 {
    let axis = direction.abs().max_position();
    let number = 2 * axis + usize::from(direction[axis] < 0.0);
    let [middle, right, lower] = FACES[number];
    let face = &faces[number];
    let texel = |side: Vec3, count: u32| {
        let share = 0.5 + 0.5 * direction.dot(side) / direction.dot(middle);
        ((share * count as f32) as u32).min(count - 1) as usize
    };
    let (x, y) = (texel(right, face.width), texel(lower, face.height));
    Vec3::from_array(face.pixels[y * face.width as usize + x])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Faces of 2×2 pixels; each pixel says its face, column and row.
    fn cube() -> [Face; 6] {
        std::array::from_fn(|face| {
            let pixel = |i: usize| [face as f32, (i % 2) as f32, (i / 2) as f32];
            Face { width: 2, height: 2, pixels: (0..4).map(pixel).collect() }
        })
    }

    #[test]
    fn pictures_are_those_of_a_camera_in_the_middle() {
        let cube = cube();
        for (number, [middle, right, lower]) in FACES.into_iter().enumerate() {
            // Not mirrored: right is right of who looks at the middle with the picture's upper edge above.
            assert_eq!(middle.cross(-lower), right, "face {number}");
            for (column, row) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                let direction = middle + right * (column - 0.5) + lower * (row - 0.5);
                assert_eq!(at(&cube, direction), Vec3::new(number as f32, column, row), "{direction}");
            }
        }
    }

    #[test]
    fn a_turned_cube_is_found_in_turned_directions() {
        let cube = cube();
        let rotation = Quat::from_xyzw(0.3, 0.5, -0.2, 0.8).normalize();
        let image = equirectangular("cube", &cube, rotation);
        assert_eq!((image.width, image.height), (8, 4));
        let Pixels::Rgb32F(pixels) = &image.pixels else { panic!("floats") };
        // Where all four places of a pixel are in one pixel of the cube, its middle is, too.
        let mut same = 0;
        for (i, pixel) in pixels.iter().enumerate() {
            let uv = optics::vec2f(((i % 8) as f32 + 0.5) / 8.0, ((i / 8) as f32 + 0.5) / 4.0);
            let direction = Vec3::from_array(optics::sky::equirect_to_direction(uv, 0.0).to_array());
            same += u32::from(at(&cube, rotation.inverse() * direction).to_array() == *pixel);
        }
        assert!(same >= 4, "{same} of 32");
        let mirrored = equirectangular("cube", &cube, rotation.inverse());
        let Pixels::Rgb32F(other) = &mirrored.pixels else { panic!("floats") };
        assert_ne!(pixels, other);
    }

    /// The mean over all directions of a cube is that of the picture.
    #[test]
    fn radiance_is_neither_lost_nor_made() {
        let bright = |face: usize, i: usize| if face == 3 && i == 37 { 1000.0 } else { 1.0 };
        let cube: [Face; 6] = std::array::from_fn(|face| Face {
            width: 16,
            height: 16,
            pixels: (0..256).map(|i| [bright(face, i); 3]).collect(),
        });
        let image = equirectangular("cube", &cube, Quat::IDENTITY);
        let Pixels::Rgb32F(pixels) = &image.pixels else { panic!("floats") };
        let (mut sum, mut all) = (0.0, 0.0);
        for (i, pixel) in pixels.iter().enumerate() {
            let weight =
                (((i as u32 / image.width) as f32 + 0.5) / image.height as f32 * std::f32::consts::PI).sin();
            (sum, all) = (sum + weight * pixel[0], all + weight);
        }
        // The solid angle of a pixel is its area over the cube of its distance.
        let (x, y) = ((37 % 16) as f32 / 8.0 - 0.9375, (37 / 16) as f32 / 8.0 - 0.9375);
        let solid_angle = (0.125 * 0.125) / (1.0 + x * x + y * y).powf(1.5);
        let expected = 1.0 + 999.0 * solid_angle / (4.0 * std::f32::consts::PI);
        assert!((sum / all / expected - 1.0).abs() < 0.05, "{} instead of {expected}", sum / all);
    }
}
