//! Small versions of the scene's images: the window has no others.

use alhazen::{Pixels, Scene, SceneImage, Texture};
use glam::Vec2;

/// Their longest side, pixels.
pub const SIDE: u32 = 48;

/// An image whose sides are at most [`SIDE`]: pixels of the original, evenly chosen.
pub fn thumbnail(image: &SceneImage) -> SceneImage {
    let (width, height) = (image.width.clamp(1, SIDE), image.height.clamp(1, SIDE));
    let middle = |i: u32, of: u32, size: u32| (2 * u64::from(i) + 1) * u64::from(size) / (2 * u64::from(of));
    let index = |i: u32| {
        let (x, y) = (middle(i % width, width, image.width), middle(i / width, height, image.height));
        (y * u64::from(image.width) + x) as usize
    };
    let chosen = (0..width * height).map(index);
    let pixels = match &image.pixels {
        Pixels::Rgba8(all) => Pixels::Rgba8(chosen.map(|i| at(all, i)).collect()),
        Pixels::Rgb32F(all) => Pixels::Rgb32F(chosen.map(|i| at(all, i)).collect()),
        Pixels::Rgba32F(all) => Pixels::Rgba32F(chosen.map(|i| at(all, i)).collect()),
    };
    SceneImage { name: image.name.clone(), width, height, pixels }
}

fn at<T: Copy + Default>(all: &[T], index: usize) -> T {
    all.get(index).copied().unwrap_or_default()
}

/// Linear RGBA of a texture at texture coordinates; white where it is no image.
pub fn pixel_of(scene: &Scene, texture: u32, uv: Vec2) -> [f32; 4] {
    let shown = scene.textures.get(texture as usize).and_then(Texture::as_image);
    let image = shown.and_then(|shown| Some((shown, scene.images.get(shown.image as usize)?)));
    image.map_or([1.0; 4], |(shown, image)| shown.pixel_at(image, uv))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thumbnails_show_the_whole_image() {
        let pixels =
            Pixels::Rgba8((0..100 * 20).map(|i| [(i % 100) as u8, (i / 100) as u8, 0, 255]).collect());
        let image = SceneImage { name: "ramp".into(), width: 100, height: 20, pixels };
        let small = thumbnail(&image);
        assert_eq!((small.width, small.height, small.pixels.len()), (48, 20, 960));
        let red = |i: usize| (small.pixels.stored(i)[0] * 255.0).round();
        assert!(red(0) < 3.0 && red(47) > 96.0, "{} {}", red(0), red(47));
        assert_eq!(small.pixels.stored(48)[1] * 255.0, 1.0);
    }
}
