//! What the network takes: the images that belong to a picture.

use film::Image;

/// What to filter: images of one size.
#[derive(Clone, Copy, Debug)]
pub struct NetworkInput<'a> {
    colour: &'a Image,
    albedo: &'a Image,
    normal: &'a Image,
    variance: Option<&'a Image>,
}

/// The images that belong to a picture differ in size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the {layer} has {}×{} pixels, but the picture has {}×{}",
    found[0], found[1], expected[0], expected[1]
)]
pub struct SizesDiffer {
    /// Which image.
    layer: &'static str,
    /// Its width and height, in pixels.
    found: [u32; 2],
    /// Width and height of the picture, in pixels.
    expected: [u32; 2],
}

impl<'a> NetworkInput<'a> {
    /// - `colour`: linear radiance;
    /// - `albedo` and `normal`: at the first hit, the mean over the samples; the normal in world
    ///   space;
    /// - `variance`: that of each value of `colour` as a mean of samples, if it is known.
    ///
    /// Values that are not finite or out of range are replaced or clamped.
    ///
    /// # Errors
    /// If the images differ in size.
    pub fn new(
        colour: &'a Image,
        albedo: &'a Image,
        normal: &'a Image,
        variance: Option<&'a Image>,
    ) -> Result<Self, SizesDiffer> {
        let size = |image: &Image| [image.width(), image.height()];
        let expected = size(colour);
        let layers = [("albedo", Some(albedo)), ("normal", Some(normal)), ("variance", variance)];
        match layers.into_iter().find(|(_, image)| image.is_some_and(|image| size(image) != expected)) {
            Some((layer, Some(image))) => Err(SizesDiffer { layer, found: size(image), expected }),
            _ => Ok(Self { colour, albedo, normal, variance }),
        }
    }

    /// Width in pixels.
    pub(super) fn width(&self) -> usize {
        self.colour.width() as usize
    }

    /// Height in pixels.
    pub(super) fn height(&self) -> usize {
        self.colour.height() as usize
    }

    /// The radiance of pixel `i`, row by row, as it is.
    pub(super) fn colour(&self, i: usize) -> [f32; 3] {
        rgb(self.colour, i)
    }

    /// Its albedo.
    pub(super) fn albedo(&self, i: usize) -> [f32; 3] {
        rgb(self.albedo, i)
    }

    /// Its normal.
    pub(super) fn normal(&self, i: usize) -> [f32; 3] {
        rgb(self.normal, i)
    }

    /// Its variance, if that is known.
    pub(super) fn variance(&self, i: usize) -> Option<[f32; 3]> {
        self.variance.map(|variance| rgb(variance, i))
    }
}

/// Pixel `i`, row by row, of an image: its first three channels, or three times the first.
#[inline]
fn rgb(image: &Image, i: usize) -> [f32; 3] {
    match &image.data()[i * image.channels()..][..image.channels()] {
        [r, g, b, ..] => [*r, *g, *b],
        [value, ..] => [*value; 3],
        [] => [0.0; 3],
    }
}
