//! The environment as a table: constant, gradient, or an image with its sampling table.

use super::AliasEntry;
use super::alias::build_alias_table;
use crate::{Environment, Image, Pixels};
use optics::{Vec3f, vec3f};

/// What a ray sees that leaves the scene, without the sun (which is a light).
#[derive(Clone, Debug, Default)]
pub struct EnvironmentTable {
    /// Radiance at the horizon.
    pub horizon: [f32; 3],
    /// Radiance at the zenith.
    pub zenith: [f32; 3],
    /// Radiance below the horizon.
    pub ground: [f32; 3],
    /// Width of the image in pixels; 0: no image, the gradient counts.
    pub width: u32,
    /// Height of the image in pixels.
    pub height: u32,
    /// Rotation of the image in turns.
    pub rotation: f32,
    /// `width × height` pixels, radiance with the intensity multiplied in, row 0 at the top.
    pub texels: Vec<[f32; 3]>,
    /// Chooses a pixel with a probability near its share of the radiant power; as long as `texels`.
    pub alias: Vec<AliasEntry>,
    /// Index into the lights of the environment image, or [`super::NONE`].
    pub light: u32,
}

impl EnvironmentTable {
    /// Builds the table; `image` is the environment's image if it has one.
    pub(super) fn new(environment: &Environment, image: Option<&Image>) -> Self {
        let mut table = Self { light: super::NONE, ..Self::default() };
        match environment {
            Environment::Black => {}
            Environment::Constant(c) => {
                (table.horizon, table.zenith, table.ground) = (c.to_array(), c.to_array(), c.to_array());
            }
            Environment::Sky(sky) => {
                table.horizon = sky.horizon.to_array();
                table.zenith = sky.zenith.to_array();
                table.ground = sky.ground.to_array();
            }
            Environment::Image { rotation, intensity, .. } => {
                if let Some(image) = image {
                    table.set_image(image, *rotation / std::f32::consts::TAU, *intensity);
                }
            }
        }
        table
    }

    fn set_image(&mut self, image: &Image, rotation: f32, intensity: f32) {
        let decode = |b: u8| optics::tonemap::srgb_decode_channel(f32::from(b) / 255.0);
        self.texels = match &image.pixels {
            Pixels::Rgb32F(pixels) => pixels.iter().map(|p| p.map(|c| c * intensity)).collect(),
            Pixels::Rgba8(pixels) => {
                pixels.iter().map(|p| [p[0], p[1], p[2]].map(|b| decode(b) * intensity)).collect()
            }
        };
        (self.width, self.height, self.rotation) = (image.width, image.height, rotation);
        self.alias = build_alias_table(&self.pixel_weights());
    }

    /// Luminance of each pixel's bilinear footprint times the solid angle of its row.
    fn pixel_weights(&self) -> Vec<f64> {
        let (w, h) = (self.width as usize, self.height as usize);
        let luminance = |x: usize, y: usize| {
            let c = self.texels[y * w + x];
            f64::from(optics::math::luminance(vec3f(c[0], c[1], c[2])))
        };
        let row = |y: usize| {
            let sin_theta = ((y as f64 + 0.5) / h as f64 * std::f64::consts::PI).sin();
            let (up, down) = (y.saturating_sub(1), (y + 1).min(h - 1));
            (0..w).map(move |x| {
                let (left, right) = ((x + w - 1) % w, (x + 1) % w);
                // A pixel shines into its neighbours when it is interpolated, so their share must not be zero.
                let around = luminance(left, y) + luminance(right, y) + luminance(x, up) + luminance(x, down);
                (0.5 * luminance(x, y) + 0.125 * around) * sin_theta
            })
        };
        (0..h).flat_map(row).collect()
    }

    /// Mean luminance over all directions.
    pub(super) fn mean_luminance(&self) -> f32 {
        let (mut sum, mut weights) = (0.0, 0.0);
        for (i, c) in self.texels.iter().enumerate() {
            let y = i as u32 / self.width;
            let weight = ((f64::from(y) + 0.5) / f64::from(self.height) * std::f64::consts::PI).sin();
            sum += f64::from(optics::math::luminance(vec3f(c[0], c[1], c[2]))) * weight;
            weights += weight;
        }
        if weights > 0.0 { (sum / weights) as f32 } else { 0.0 }
    }

    /// Radiance from unit direction `direction`.
    pub fn radiance(&self, direction: Vec3f) -> Vec3f {
        if self.width == 0 {
            let color = |c: [f32; 3]| vec3f(c[0], c[1], c[2]);
            return optics::sky::gradient_sky(
                direction,
                color(self.horizon),
                color(self.zenith),
                color(self.ground),
            );
        }
        let uv = optics::sky::direction_to_equirect(direction, self.rotation);
        self.bilinear(uv.x, uv.y)
    }

    /// Bilinear interpolation; wraps around horizontally, stops at the poles.
    fn bilinear(&self, u: f32, v: f32) -> Vec3f {
        let x = u * self.width as f32 - 0.5;
        let y = (v * self.height as f32 - 0.5).clamp(0.0, (self.height - 1) as f32);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let x0 = (x.floor() as i64).rem_euclid(i64::from(self.width)) as u32;
        let x1 = if x0 + 1 == self.width { 0 } else { x0 + 1 };
        let y0 = y as u32;
        let y1 = (y0 + 1).min(self.height - 1);
        let texel = |x: u32, y: u32| {
            let c = self.texels[(y * self.width + x) as usize];
            vec3f(c[0], c[1], c[2])
        };
        let top = texel(x0, y0) * (1.0 - fx) + texel(x1, y0) * fx;
        let bottom = texel(x0, y1) * (1.0 - fx) + texel(x1, y1) * fx;
        top * (1.0 - fy) + bottom * fy
    }

    /// Density over solid angle with which the sampling table chooses `direction`; 0 without an image.
    pub fn pdf(&self, direction: Vec3f) -> f32 {
        if self.width == 0 {
            return 0.0;
        }
        let uv = optics::sky::direction_to_equirect(direction, self.rotation);
        let x = ((uv.x * self.width as f32) as u32).min(self.width - 1);
        let y = ((uv.y * self.height as f32) as u32).min(self.height - 1);
        let entry = self.alias[(y * self.width + x) as usize];
        optics::sky::equirect_pdf(entry.probability * self.texels.len() as f32, uv.y)
    }

    /// Samples a unit direction and its density over solid angle; `u`: two uniform numbers in `[0, 1)`.
    pub fn sample(&self, u: [f32; 2]) -> (Vec3f, f32) {
        use optics::warp::{alias_choose, alias_slot};
        let count = self.alias.len() as u32;
        let slot = alias_slot(u[0], count);
        let entry = self.alias[slot as usize];
        let choice = alias_choose(u[0], count, slot, entry.threshold, entry.alias);
        let (x, y) = (choice.index % self.width, choice.index / self.width);
        let uv = optics::vec2f(
            (x as f32 + choice.remainder) / self.width as f32,
            (y as f32 + u[1]) / self.height as f32,
        );
        let probability = self.alias[choice.index as usize].probability;
        let pdf = optics::sky::equirect_pdf(probability * count as f32, uv.y);
        (optics::sky::equirect_to_direction(uv, self.rotation), pdf)
    }

    /// Bytes in all arrays.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.texels[..]) + size_of_val(&self.alias[..])
    }
}
