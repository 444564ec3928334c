//! The environment as a table: constant, gradient, or an image with its sampling table.

use super::portals::halves;
use crate::{Environment, Image, Pixels, Portal};
use elementary::sin;
use optics::alias_table::{AliasEntry, build_alias_table};
use optics::constants::NONE;
use optics::equirect::{equirect_mix, equirect_pixel, equirect_pixel_pdf, equirect_place, equirect_point};
use optics::portal_triangle::PortalTriangle;
use optics::sky::{direction_to_equirect, equirect_to_direction};
use optics::{Vec3f, vec2f, vec2u, vec3f};

/// What a ray sees that leaves the scene, without the sun (which is a light).
#[derive(Clone, Debug, Default, PartialEq)]
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
    /// Chooses a row of pixels; as long as `height`.
    pub row_alias: Vec<AliasEntry>,
    /// For each row, chooses a pixel of it; as long as `texels`. Row and pixel together are chosen with a probability
    /// near the pixel's share of the radiant power, which is what `probability` says here.
    pub alias: Vec<AliasEntry>,
    /// Halves of the portals.
    pub portals: Vec<PortalTriangle>,
    /// Index into the lights of the environment that can be sampled, by an image or portals, or [`NONE`].
    pub light: u32,
}

impl EnvironmentTable {
    /// Builds the table; `image` is the environment's image if it has one.
    pub(super) fn new(environment: &Environment, image: Option<&Image>, portals: &[Portal]) -> Self {
        let mut table = Self { light: NONE, ..Self::default() };
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
            Environment::Daylight(daylight) => table.set_image(&daylight.image(), 0.0, 1.0),
            Environment::Image { rotation, intensity, .. } => {
                if let Some(image) = image {
                    table.set_image(image, *rotation / std::f32::consts::TAU, *intensity);
                }
            }
        }
        if table.shines() {
            table.portals = portals.iter().flat_map(halves).collect();
        }
        table
    }

    fn set_image(&mut self, image: &Image, rotation: f32, intensity: f32) {
        let scaled = |p: [f32; 3]| p.map(|c| c * intensity);
        self.texels = match &image.pixels {
            Pixels::Rgb32F(pixels) => pixels.iter().map(|p| scaled(*p)).collect(),
            others => others.clone().into_linear().into_iter().map(scaled).collect(),
        };
        (self.width, self.height, self.rotation) = (image.width, image.height, rotation);
        let weights = self.pixel_weights();
        let rows = || weights.chunks_exact(self.width as usize);
        self.row_alias = build_alias_table(&rows().map(|row| row.iter().sum()).collect::<Vec<f64>>());
        // The table of all pixels at once would use up the random number that chooses among them.
        let joint = |(row, entry): (&[f64], &AliasEntry)| {
            let scale = |e: AliasEntry| AliasEntry { probability: e.probability * entry.probability, ..e };
            build_alias_table(row).into_iter().map(scale).collect::<Vec<_>>()
        };
        self.alias = rows().zip(&self.row_alias).flat_map(joint).collect();
    }

    /// Mean luminance of each pixel, interpolated, times the solid angle of its row.
    fn pixel_weights(&self) -> Vec<f64> {
        let (w, h) = (self.width as usize, self.height as usize);
        let luminance = |x: usize, y: usize| {
            let c = self.texels[y * w + x];
            f64::from(optics::math::luminance(vec3f(c[0], c[1], c[2])))
        };
        // The mean over the pixel of what bilinear interpolation makes of it and its neighbours.
        let across = |x: usize, y: usize| {
            let (left, right) = ((x + w - 1) % w, (x + 1) % w);
            0.75 * luminance(x, y) + 0.125 * (luminance(left, y) + luminance(right, y))
        };
        let row = |y: usize| {
            let sin_theta = sin((y as f64 + 0.5) / h as f64 * std::f64::consts::PI);
            let (up, down) = (y.saturating_sub(1), (y + 1).min(h - 1));
            (0..w).map(move |x| (0.75 * across(x, y) + 0.125 * (across(x, up) + across(x, down))) * sin_theta)
        };
        (0..h).flat_map(row).collect()
    }

    /// Mean radiance over all directions, in the strongest channel.
    pub(super) fn mean_radiance(&self) -> f32 {
        if self.width == 0 {
            let of = |c: [f32; 3]| optics::math::max_component(vec3f(c[0], c[1], c[2]));
            return 0.5 * of(self.ground) + 0.25 * (of(self.horizon) + of(self.zenith));
        }
        let (mut sum, mut weights) = (0.0, 0.0);
        for (i, c) in self.texels.iter().enumerate() {
            let y = i as u32 / self.width;
            let weight = sin((f64::from(y) + 0.5) / f64::from(self.height) * std::f64::consts::PI);
            sum += f64::from(optics::math::max_component(vec3f(c[0], c[1], c[2]))) * weight;
            weights += weight;
        }
        if weights > 0.0 { (sum / weights) as f32 } else { 0.0 }
    }

    /// Whether radiance comes from any direction.
    pub fn shines(&self) -> bool {
        self.width > 0 || [self.horizon, self.zenith, self.ground].concat().iter().any(|&c| c > 0.0)
    }

    /// Whether nothing comes from anywhere.
    pub fn is_black(&self) -> bool {
        self.width == 0 && [self.horizon, self.zenith, self.ground].as_flattened().iter().all(|c| *c == 0.0)
    }

    /// Radiance of the gradient, which counts where there is no image, from unit direction `direction`.
    #[inline(always)]
    pub fn gradient(&self, direction: Vec3f) -> Vec3f {
        let color = |c: [f32; 3]| vec3f(c[0], c[1], c[2]);
        optics::sky::gradient_sky(direction, color(self.horizon), color(self.zenith), color(self.ground))
    }

    /// Radiance from unit direction `direction`.
    pub fn radiance(&self, direction: Vec3f) -> Vec3f {
        if self.width == 0 {
            return self.gradient(direction);
        }
        let place = equirect_place(direction_to_equirect(direction, self.rotation), self.width, self.height);
        let texel = |x: u32, y: u32| {
            let c = self.texels[(y * self.width + x) as usize];
            vec3f(c[0], c[1], c[2])
        };
        let [top, bottom] = [place.top, place.bottom].map(|y| [texel(place.left, y), texel(place.right, y)]);
        equirect_mix(place, top[0], top[1], bottom[0], bottom[1])
    }

    /// Density over solid angle with which the image's sampling table chooses `direction`. Only where there is an image.
    pub fn image_pdf(&self, direction: Vec3f) -> f32 {
        let uv = direction_to_equirect(direction, self.rotation);
        let pixel = equirect_pixel(uv, self.width, self.height);
        let entry = self.alias[(pixel.y * self.width + pixel.x) as usize];
        equirect_pixel_pdf(entry.probability, self.width * self.height, uv.y)
    }

    /// Samples a unit direction by the image's table, and its density over solid angle; `u`: two uniform numbers in `[0, 1)`.
    pub fn sample_image(&self, u: [f32; 2]) -> (Vec3f, f32) {
        use optics::random::dither;
        use optics::warp::{alias_choose_dithered, alias_slot};
        let choose = |table: &[AliasEntry], u: f32, dither: f32| {
            let count = table.len() as u32;
            let slot = alias_slot(u, count);
            let entry = table[slot as usize];
            alias_choose_dithered(u, count, slot, entry.threshold, entry.alias, dither)
        };
        let row = choose(&self.row_alias, u[1], dither(u[0], u[1]));
        let pixels = &self.alias[(row.index * self.width) as usize..][..self.width as usize];
        let column = choose(pixels, u[0], dither(u[1], u[0]));
        let within = vec2f(column.remainder, row.remainder);
        let uv = equirect_point(vec2u(column.index, row.index), within, self.width, self.height);
        let probability = pixels[column.index as usize].probability;
        let pdf = equirect_pixel_pdf(probability, self.width * self.height, uv.y);
        (equirect_to_direction(uv, self.rotation), pdf)
    }

    /// Bytes in all arrays.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.texels[..])
            + size_of_val(&self.alias[..])
            + size_of_val(&self.row_alias[..])
            + size_of_val(&self.portals[..])
    }
}
