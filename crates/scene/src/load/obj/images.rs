//! Images that a material needs and no file has: channels packed together, and bump maps as normal maps.

use crate::{Image, ImageId, LoadReport, Pixels};

/// How an image of the scene is made from decoded ones. Indices are into the decoded images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Recipe {
    /// The image itself.
    Plain(ImageId),
    /// Colour of one image, opacity of another.
    Opacity { color: Option<ImageId>, opacity: (ImageId, Channel) },
    /// Roughness in G, metalness in B, as glTF has them.
    MetallicRoughness { roughness: Option<(ImageId, Channel)>, metallic: Option<(ImageId, Channel)> },
    /// A tangent-space normal map, from one or from a height map of that strength.
    Normal { bump: ImageId, strength: f32 },
}

/// What a scalar is taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Channel {
    Component(usize),
    Luminance,
    /// Alpha if the image has any, luminance otherwise.
    AlphaOrLuminance,
}

/// Whether opacities are all or nothing, or something between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Coverage {
    Opaque,
    Cutout,
    Gradual,
}

/// Makes an image.
pub(super) fn make(recipe: &Recipe, decoded: &[Image], report: &mut LoadReport) -> Image {
    let image = |id: ImageId| &decoded[id as usize];
    match *recipe {
        Recipe::Plain(id) => image(id).clone(),
        Recipe::Opacity { color, opacity: (id, channel) } => {
            let opacity = Scalar::new(image(id), channel);
            if let Some(color) = color.map(image).filter(|color| color.pixels.is_float()) {
                return float_with_opacity(color, &opacity);
            }
            combine(&image(id).name, color.map(image), Some(&opacity), |color, value| {
                [color[0], color[1], color[2], value]
            })
        }
        Recipe::MetallicRoughness { roughness, metallic } => {
            let scalar = |source: Option<(ImageId, Channel)>| source.map(|(id, c)| Scalar::new(image(id), c));
            let (roughness, metallic) = (scalar(roughness), scalar(metallic));
            let name = roughness.as_ref().or(metallic.as_ref()).map_or("", |s| s.image.name.as_str());
            let base = combine(name, None, metallic.as_ref(), |_, value| [255, 255, value, 255]);
            match &roughness {
                Some(_) => {
                    combine(name, Some(&base), roughness.as_ref(), |base, value| [255, value, base[2], 255])
                }
                None => base,
            }
        }
        Recipe::Normal { bump, strength } => {
            let bump = image(bump);
            if looks_like_normals(bump) {
                return bump.clone();
            }
            report.approximated(format!("bump map {} was turned into a normal map", bump.name));
            normals_from_heights(bump, strength)
        }
    }
}

/// Whether a bump map is a normal map already: mostly blue, on average pointing straight up.
pub(super) fn looks_like_normals(image: &Image) -> bool {
    let count = image.pixels.len();
    let sum = (0..count).fold([0.0; 3], |sum, i| {
        let stored = image.pixels.stored(i);
        std::array::from_fn(|c| sum[c] + f64::from(stored[c]))
    });
    let [x, y, z] = sum.map(|s| s / count as f64);
    (x - 0.5).abs() < 0.1 && (y - 0.5).abs() < 0.1 && z > 0.745
}

/// Mean of the linear values of an sRGB image, per channel.
pub(super) fn mean_color(image: &Image) -> glam::Vec3 {
    let linear = image.pixels.clone().into_linear();
    let sum = linear.iter().fold(glam::DVec3::ZERO, |sum, p| sum + glam::Vec3::from(*p).as_dvec3());
    (sum / linear.len() as f64).as_vec3()
}

/// What the alpha channel of an image needs.
pub(super) fn coverage(image: &Image) -> Coverage {
    let (low, high) = (8.0 / 255.0, 248.0 / 255.0);
    let alphas = || (0..image.pixels.len()).map(|i| image.pixels.stored(i)[3]);
    let between = alphas().filter(|alpha| (low..high).contains(alpha)).count();
    if alphas().all(|alpha| alpha >= high) {
        Coverage::Opaque
    } else if between * 10 <= image.pixels.len() {
        Coverage::Cutout // up to a tenth of the pixels may be smoothed borders
    } else {
        Coverage::Gradual
    }
}

/// One number for each pixel of an image, as eight bits.
struct Scalar<'a> {
    image: &'a Image,
    channel: Channel,
}

impl<'a> Scalar<'a> {
    fn new(image: &'a Image, channel: Channel) -> Self {
        let has_alpha = (0..image.pixels.len()).any(|i| image.pixels.stored(i)[3] != 1.0);
        let channel = match channel {
            Channel::AlphaOrLuminance if has_alpha => Channel::Component(3),
            Channel::AlphaOrLuminance => Channel::Luminance,
            other => other,
        };
        Self { image, channel }
    }

    /// The pixel nearest to (x + ½, y + ½) of a picture of the given size.
    fn at(&self, x: u32, y: u32, size: (u32, u32)) -> u8 {
        let pixel = nearest(self.image, x, y, size);
        match self.channel {
            Channel::Component(c) => pixel[c],
            Channel::Luminance | Channel::AlphaOrLuminance => luminance(pixel),
        }
    }
}

fn luminance(pixel: [u8; 4]) -> u8 {
    let [r, g, b, _] = pixel.map(u32::from);
    ((r * 2126 + g * 7152 + b * 722 + 5000) / 10_000) as u8
}

/// Number of the pixel nearest to (x + ½, y + ½) of a picture of the given size.
fn nearest_index(image: &Image, x: u32, y: u32, size: (u32, u32)) -> usize {
    let scale = |v: u32, from: u32, to: u32| {
        ((u64::from(v) * 2 + 1) * u64::from(to) / (u64::from(from) * 2)) as usize
    };
    scale(y, size.1, image.height) * image.width as usize + scale(x, size.0, image.width)
}

fn nearest(image: &Image, x: u32, y: u32, size: (u32, u32)) -> [u8; 4] {
    let index = nearest_index(image, x, y, size);
    match &image.pixels {
        Pixels::Rgba8(pixels) => pixels[index],
        floats => floats.stored(index).map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8),
    }
}

/// A colour of floats with the opacity of another image, as large as the larger of both.
fn float_with_opacity(color: &Image, opacity: &Scalar) -> Image {
    let sizes = [color, opacity.image].map(|i| (i.width, i.height));
    let size = if sizes[0].0 * sizes[0].1 >= sizes[1].0 * sizes[1].1 { sizes[0] } else { sizes[1] };
    let places = (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y)));
    let pixel = |(x, y)| {
        let [r, g, b, _] = color.pixels.stored(nearest_index(color, x, y, size));
        [r, g, b, f32::from(opacity.at(x, y, size)) / 255.0]
    };
    let pixels = Pixels::Rgba32F(places.map(pixel).collect());
    Image { name: opacity.image.name.clone(), width: size.0, height: size.1, pixels }
}

/// A picture as large as the larger of its two sources, one of which must be there.
fn combine(
    name: &str,
    color: Option<&Image>,
    scalar: Option<&Scalar>,
    pixel: impl Fn([u8; 4], u8) -> [u8; 4],
) -> Image {
    let sizes = [color, scalar.map(|s| s.image)].into_iter().flatten().map(|i| (i.width, i.height));
    let size = sizes.max_by_key(|(w, h)| u64::from(*w) * u64::from(*h)).unwrap_or((1, 1));
    let mut pixels = Vec::with_capacity(size.0 as usize * size.1 as usize);
    for y in 0..size.1 {
        for x in 0..size.0 {
            let color = color.map_or([255; 4], |image| nearest(image, x, y, size));
            pixels.push(pixel(color, scalar.map_or(255, |s| s.at(x, y, size))));
        }
    }
    Image { name: name.into(), width: size.0, height: size.1, pixels: Pixels::Rgba8(pixels) }
}

/// Central differences of the heights, which repeat. Strength 1 makes a step of the full range between neighbouring
/// pixels a slope of 1.
fn normals_from_heights(heights: &Image, strength: f32) -> Image {
    let (width, height) = (heights.width, heights.height);
    let at = |x: u32, y: u32| {
        let [r, g, b, _] = heights.pixels.stored((y % height * width + x % width) as usize);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let dx = (at(x + 1, y) - at(x + width - 1, y)) * 0.5 * strength;
            let dy = (at(x, y + 1) - at(x, y + height - 1)) * 0.5 * strength;
            // The map's y axis points up, the rows go down.
            let normal = glam::Vec3::new(-dx, dy, 1.0).normalize();
            let [r, g, b] = (normal * 127.5 + 127.5).to_array().map(|v| v.round().clamp(0.0, 255.0) as u8);
            pixels.push([r, g, b, 255]);
        }
    }
    Image { name: heights.name.clone(), width, height, pixels: Pixels::Rgba8(pixels) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, pixels: &[[u8; 4]]) -> Image {
        let height = pixels.len() as u32 / width;
        Image { name: "i".into(), width, height, pixels: Pixels::Rgba8(pixels.to_vec()) }
    }

    fn pixels(image: &Image) -> &[[u8; 4]] {
        match &image.pixels {
            Pixels::Rgba8(pixels) => pixels,
            _ => panic!("not eight bits"),
        }
    }

    #[test]
    fn channels_are_packed_at_the_larger_size() {
        let sources = [image(2, &[[10; 4], [20; 4]]), image(1, &[[90, 91, 92, 93]])];
        let recipe = Recipe::MetallicRoughness {
            roughness: Some((0, Channel::Luminance)),
            metallic: Some((1, Channel::Component(2))),
        };
        let packed = make(&recipe, &sources, &mut LoadReport::default());
        assert_eq!(pixels(&packed), [[255, 10, 92, 255], [255, 20, 92, 255]]);

        let recipe = Recipe::Opacity { color: Some(0), opacity: (1, Channel::AlphaOrLuminance) };
        let packed = make(&recipe, &sources, &mut LoadReport::default());
        assert_eq!(pixels(&packed), [[10, 10, 10, 93], [20, 20, 20, 93]]);
        assert_eq!(coverage(&packed), Coverage::Gradual);
    }

    #[test]
    fn heights_become_normals_and_normals_stay() {
        let flat = [image(2, &[[77; 4]; 4])];
        let mut report = LoadReport::default();
        let normals = make(&Recipe::Normal { bump: 0, strength: 1.0 }, &flat, &mut report);
        assert_eq!(pixels(&normals), [[128, 128, 255, 255]; 4]);
        assert_eq!(report.notes.len(), 1);

        // Rising to the right, in the middle columns: the normal leans to the left.
        let ramp = [image(4, &[0, 60, 120, 180].map(|v| [v, v, v, 255]))];
        let normals = make(&Recipe::Normal { bump: 0, strength: 1.0 }, &ramp, &mut report);
        assert!(pixels(&normals)[1][0] < 110 && pixels(&normals)[1][1] == 128);

        let map = [image(1, &[[128, 128, 255, 255]])];
        let kept = make(&Recipe::Normal { bump: 0, strength: 1.0 }, &map, &mut LoadReport::default());
        assert_eq!(pixels(&kept), [[128, 128, 255, 255]]);
    }
}
