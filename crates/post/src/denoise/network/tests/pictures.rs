//! Pictures to denoise.

use super::super::NetworkInput;
use super::weights::uniform;
use film::Image;

/// A picture with all that belongs to it.
pub struct Picture {
    pub colour: Image,
    pub albedo: Image,
    pub normal: Image,
    pub variance: Image,
}

impl Picture {
    /// Values by number: those of the colour, the albedo, the normal and the variance.
    pub fn of(width: u32, height: u32, value: impl Fn(usize) -> f32) -> Self {
        let pixels = width as usize * height as usize;
        let image = |layer: usize| {
            Image::from_fn(width, height, |x, y| {
                let pixel = y as usize * width as usize + x as usize;
                [0, 1, 2].map(|c| value(3 * (layer * pixels + pixel) + c))
            })
        };
        Self { colour: image(0), albedo: image(1), normal: image(2), variance: image(3) }
    }

    /// Noise in all layers, each in its range.
    pub fn noisy(width: u32, height: u32) -> Self {
        let noise = Self::of(width, height, |i| uniform(1000, i as u32) as f32);
        Self {
            colour: noise.colour.map(|v| (3.0 * v).exp()),
            albedo: noise.albedo.map(|v| 0.5 + 0.5 * v),
            variance: noise.variance.map(|v| (4.0 * v).exp()),
            ..noise
        }
    }

    /// The same with more or less light.
    pub fn exposed(&self, factor: f32) -> Self {
        Self {
            colour: self.colour.map(|v| v * factor),
            variance: self.variance.map(|v| v * factor * factor),
            albedo: self.albedo.clone(),
            normal: self.normal.clone(),
        }
    }

    /// What the denoiser takes.
    pub fn input(&self) -> NetworkInput<'_> {
        NetworkInput::new(&self.colour, &self.albedo, &self.normal, Some(&self.variance)).unwrap()
    }
}
