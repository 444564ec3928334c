//! What is filtered: radiance without albedo, its variance, and the features that guide the filter, channel by channel.

use super::NoisyPicture;
use elementary::powi;
use film::Image;

/// Added to the albedo before dividing by it: black surfaces reflect something, too, and what shines has no albedo.
const ALBEDO_FLOOR: f32 = 0.02;

/// A channel: a value for each pixel, row by row.
pub type Plane = Vec<f32>;

/// The picture as the filter sees it.
pub struct Signal {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Radiance divided by `demodulator`.
    pub irradiance: [Plane; 3],
    /// Variance of `irradiance`, never below what its surroundings say: a pixel that has found nothing bright yet is not
    /// therefore certain.
    pub variance: [Plane; 3],
    /// Albedo of what is seen first.
    pub albedo: [Plane; 3],
    /// Normal of what is seen first.
    pub normal: [Plane; 3],
    demodulator: [Plane; 3],
}

impl Signal {
    /// Takes a picture apart.
    pub fn new(picture: &NoisyPicture) -> Self {
        let (width, height) = (picture.colour.width() as usize, picture.colour.height() as usize);
        let albedo = planes(&picture.albedo).map(|p| p.iter().map(|a| a.clamp(0.0, 1.0)).collect::<Plane>());
        let has_albedo = |i: usize| albedo.iter().any(|a| a[i] > 0.0);
        let demodulator = |c: usize| -> Plane {
            // What shines but reflects nothing, and the sky, are left as they are.
            let value = |i: usize| if has_albedo(i) { albedo[c][i] + ALBEDO_FLOOR } else { 1.0 };
            (0..width * height).map(value).collect()
        };
        let demodulator = [0, 1, 2].map(demodulator);
        let divided = |image: &Image, power: i32| -> [Plane; 3] {
            let planes = planes(image);
            let divide =
                |c: usize| planes[c].iter().zip(&demodulator[c]).map(|(v, d)| v / powi(*d, power)).collect();
            [0, 1, 2].map(divide)
        };
        let irradiance = divided(&picture.colour, 1);
        let variance = match &picture.variance {
            Some(variance) => divided(variance, 2),
            None => divided(&estimate_variance(&picture.colour, &picture.albedo), 2),
        };
        let variance = variance.map(|v| with_surroundings(&v, width, height));
        Self { width, height, irradiance, variance, normal: planes(&picture.normal), albedo, demodulator }
    }

    /// Puts a picture together again from filtered irradiance.
    pub fn picture(&self, irradiance: &[Plane; 3]) -> Image {
        let width = self.width;
        Image::from_fn(width as u32, self.height as u32, |x, y| {
            let i = y as usize * width + x as usize;
            std::array::from_fn(|c| irradiance[c][i] * self.demodulator[c][i])
        })
    }
}

/// What the radiance of each pixel is divided by to get its irradiance, row by row. What shines but reflects nothing, and
/// the sky, are left as they are.
pub fn demodulators(albedo: &Image) -> Vec<[f32; 3]> {
    let demodulator = |albedo: &[f32]| {
        let albedo: [f32; 3] = std::array::from_fn(|c| albedo[c].clamp(0.0, 1.0));
        if albedo.iter().any(|a| *a > 0.0) { albedo.map(|a| a + ALBEDO_FLOOR) } else { [1.0; 3] }
    };
    albedo.to_rgb().data().chunks_exact(3).map(demodulator).collect()
}

/// The variance of each value of a picture, estimated from the picture alone, for files that do not know it.
///
/// What is left of the picture (its albedo divided out, if there is one) after taking the second differences along both axes is
/// noise, and what edges are in the light. Its mean square around a pixel, over the sum of the squared weights, is the variance.
/// Source: Immerkær, "Fast Noise Variance Estimation", 1996.
pub fn estimate_variance(colour: &Image, albedo: &Image) -> Image {
    const WEIGHTS: [[f32; 3]; 3] = [[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]];
    const SUM_OF_SQUARES: f32 = 36.0;
    let (width, height) = (colour.width() as usize, colour.height() as usize);
    let black = Image::black(colour.width(), colour.height(), 3);
    let picture = NoisyPicture {
        colour: colour.clone(),
        variance: Some(black.clone()),
        albedo: albedo.clone(),
        normal: black,
    };
    let signal = Signal::new(&picture);
    let variance = |c: usize| -> Plane {
        let values = &signal.irradiance[c];
        let at = |x: usize, y: usize| values[y * width + x];
        let square = |i: usize| {
            let (x, y) = (i % width, i / width);
            let column = |k: usize| (x + k).saturating_sub(1).min(width - 1);
            let row = |k: usize| (y + k).saturating_sub(1).min(height - 1);
            let terms = (0..9).map(|k| WEIGHTS[k / 3][k % 3] * at(column(k % 3), row(k / 3)));
            powi(terms.sum::<f32>(), 2) / SUM_OF_SQUARES
        };
        let squares: Plane = (0..width * height).map(square).collect();
        mean_around(&squares, width, height)
    };
    let planes = [0, 1, 2].map(variance);
    Image::from_fn(colour.width(), colour.height(), |x, y| {
        let i = y as usize * width + x as usize;
        std::array::from_fn(|c| planes[c][i] * powi(signal.demodulator[c][i], 2))
    })
}

/// The mean of the 5×5 values around each.
fn mean_around(values: &[f32], width: usize, height: usize) -> Plane {
    const RADIUS: usize = 2;
    let at = |i: usize| {
        let (x, y) = (i % width, i / width);
        let columns = x.saturating_sub(RADIUS)..(x + RADIUS + 1).min(width);
        let rows = y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(height);
        let count = (columns.len() * rows.len()) as f32;
        rows.flat_map(|y| columns.clone().map(move |x| y * width + x)).map(|i| values[i]).sum::<f32>() / count
    };
    (0..width * height).map(at).collect()
}

/// The three colours of a picture, each by itself.
fn planes(image: &Image) -> [Plane; 3] {
    let image = image.to_rgb();
    [0, 1, 2].map(|c| image.data().iter().skip(c).step_by(3).copied().collect())
}

/// The larger of each value and the mean of the 3×3 around it.
fn with_surroundings(values: &[f32], width: usize, height: usize) -> Plane {
    let at = |i: usize| {
        let (x, y) = (i % width, i / width);
        let (columns, rows) =
            (x.saturating_sub(1)..(x + 2).min(width), y.saturating_sub(1)..(y + 2).min(height));
        let count = (columns.len() * rows.len()) as f32;
        let around = rows.flat_map(|y| columns.clone().map(move |x| y * width + x));
        values[i].max(around.map(|i| values[i]).sum::<f32>() / count)
    };
    (0..width * height).map(at).collect()
}
