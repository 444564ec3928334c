use super::signal::estimate_variance;
use super::*;
use film::metrics::mse;

const WIDTH: u32 = 70;
const HEIGHT: u32 = 60;

/// Normally distributed enough: the sum of twelve uniform numbers, of variance one; pure in its arguments.
fn gaussian(x: u32, y: u32, c: u32) -> f32 {
    let uniform = |i: u32| {
        let mut h = (x * 7919 + y * 104_729 + c * 1_299_709 + i * 15_485_863).wrapping_mul(0x9e37_79b9);
        h = (h ^ (h >> 15)).wrapping_mul(0x85eb_ca6b);
        h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
        (h >> 8) as f32 / (1 << 24) as f32
    };
    (0..12).map(uniform).sum::<f32>() - 6.0
}

/// A wall and a floor with a chequered texture, light that fades to the right, and a shadow with a hard edge.
fn truth() -> NoisyPicture {
    let is_floor = |y: u32| y >= HEIGHT / 2;
    let albedo = |x: u32, y: u32| {
        if is_floor(y) && (x / 5 + y / 5).is_multiple_of(2) { [0.8, 0.7, 0.6] } else { [0.3, 0.3, 0.35] }
    };
    let light = |x: u32, y: u32| {
        let fade = 1.5 - x as f32 / WIDTH as f32;
        if is_floor(y) && x > 45 { 0.2 * fade } else { fade }
    };
    NoisyPicture {
        colour: Image::from_fn(WIDTH, HEIGHT, |x, y| albedo(x, y).map(|a| a * light(x, y))),
        variance: Some(Image::black(WIDTH, HEIGHT, 3)),
        albedo: Image::from_fn(WIDTH, HEIGHT, albedo),
        normal: Image::from_fn(
            WIDTH,
            HEIGHT,
            |_, y| if is_floor(y) { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] },
        ),
    }
}

/// The same with noise of standard deviation `deviation` times the colour.
fn noisy(deviation: f32) -> NoisyPicture {
    let truth = truth();
    let clean = truth.colour.clone();
    let value = |x: u32, y: u32| clean.rgb(x, y);
    let colour = Image::from_fn(WIDTH, HEIGHT, |x, y| {
        let v = value(x, y);
        std::array::from_fn(|c| v[c] * (1.0 + deviation * gaussian(x, y, c as u32)).max(0.0))
    });
    let variance = Image::from_fn(WIDTH, HEIGHT, |x, y| value(x, y).map(|v| (v * deviation).powi(2)));
    NoisyPicture { colour, variance: Some(variance), ..truth }
}

/// What denoises, and its name.
type Filter = (&'static str, fn(&NoisyPicture) -> Result<Image, DenoiseError>);

const FILTERS: [Filter; 2] = [("network", denoise), ("regression", denoise_by_regression)];

#[test]
fn noise_goes_and_light_stays() {
    for ((name, filter), deviation) in FILTERS.into_iter().flat_map(|f| [0.1, 0.3].map(|d| (f, d))) {
        let picture = noisy(deviation);
        let truth = truth().colour;
        let filtered = filter(&picture).unwrap();
        let (before, after) = (mse(&truth, &picture.colour).unwrap(), mse(&truth, &filtered).unwrap());
        assert!(after < before / 8.0, "{name}, {deviation}: {before} became {after}");
        for c in 0..3 {
            let (before, after) = (picture.colour.mean()[c], filtered.mean()[c]);
            assert!((after / before - 1.0).abs() < 1e-3, "{name}, {deviation}: {before} became {after}");
        }
    }
}

#[test]
fn constant_pictures_and_pictures_without_noise_stay_as_they_are() {
    let constant = NoisyPicture { colour: Image::from_fn(WIDTH, HEIGHT, |_, _| [0.4, 0.2, 7.0]), ..truth() };
    let flat = NoisyPicture { albedo: Image::from_fn(WIDTH, HEIGHT, |_, _| [0.5; 3]), ..constant };
    for (picture, (name, filter)) in [flat, truth()].iter().flat_map(|p| FILTERS.map(|f| (p, f))) {
        let filtered = filter(picture).unwrap();
        for (before, after) in picture.colour.data().iter().zip(filtered.data()) {
            assert!((before - after).abs() <= 1e-3 * before, "{name}: {before} became {after}");
        }
    }
}

/// Where texture, normal or a shadow have an edge, the step is as high as it was.
#[test]
fn edges_stay_sharp() {
    let truth = truth().colour;
    let step = |image: &Image, a: (u32, u32), b: (u32, u32)| {
        // Along the edge, so that what noise is left does not count.
        let mean = |(x, y): (u32, u32), (dx, dy): (u32, u32)| {
            (0..4).map(|i| image.rgb(x + i * dx, y + i * dy)[1]).sum::<f32>() / 4.0
        };
        let along = if a.0 == b.0 { (1, 0) } else { (0, 1) };
        mean(a, along) - mean(b, along)
    };
    let edges =
        [("texture", (19, 40), (20, 40)), ("normal", (30, 29), (30, 30)), ("shadow", (45, 41), (46, 41))];
    for (by, filter) in FILTERS {
        let filtered = filter(&noisy(0.1)).unwrap();
        for (name, a, b) in edges {
            let (expected, actual) = (step(&truth, a, b), step(&filtered, a, b));
            assert!(expected.abs() > 0.05, "{name}: there is an edge");
            assert!((actual / expected - 1.0).abs() < 0.15, "{by}, {name}: {expected} became {actual}");
        }
    }
}

/// One sample that found the lamp does not stay a spot, nor does its light get lost.
#[test]
fn bright_specks_are_spread_and_not_lost() {
    let mut picture = NoisyPicture { colour: Image::from_fn(WIDTH, HEIGHT, |_, _| [0.5; 3]), ..noisy(0.2) };
    picture.albedo = Image::from_fn(WIDTH, HEIGHT, |_, _| [0.5; 3]);
    picture.normal = Image::from_fn(WIDTH, HEIGHT, |_, _| [0.0, 1.0, 0.0]);
    let at = 3 * (30 * WIDTH as usize + 30);
    let mut variance = Image::from_fn(WIDTH, HEIGHT, |_, _| [0.01; 3]);
    picture.colour.data_mut()[at..at + 3].fill(20.0);
    variance.data_mut()[at..at + 3].fill(400.0);
    picture.variance = Some(variance);
    for (name, filter) in FILTERS {
        let filtered = filter(&picture).unwrap();
        assert!(filtered.rgb(30, 30)[0] < 3.0, "{name}: {:?}", filtered.rgb(30, 30));
        let (before, after) = (picture.colour.mean()[0], filtered.mean()[0]);
        assert!((after / before - 1.0).abs() < 1e-3, "{name}: {before} became {after}");
    }
}

/// Where the noise is even, the estimate is its variance; a chequered texture does not disturb it, nor does a picture without
/// noise get any.
#[test]
fn variance_is_estimated_from_the_picture() {
    let truth = truth();
    let deviation = 0.05;
    // Noise of the light, on the upper half, which has one albedo.
    let picture = noisy(deviation);
    let known = picture.variance.as_ref().unwrap();
    let estimate = estimate_variance(&picture.colour, &picture.albedo);
    let (mut sum, mut expected) = (0.0, 0.0);
    for (x, y) in (4..60).flat_map(|x| (4..26).map(move |y| (x, y))) {
        sum += f64::from(estimate.rgb(x, y)[0]);
        expected += f64::from(known.rgb(x, y)[0]);
    }
    assert!((sum / expected - 1.0).abs() < 0.15, "{sum} instead of {expected}");
    let clean = estimate_variance(&truth.colour, &truth.albedo);
    let floor = |x: u32| clean.rgb(x, 45)[0] / truth.colour.rgb(x, 45)[0].powi(2);
    assert!(floor(20) < 1e-4, "the texture is no noise: {}", floor(20));
    assert_eq!(estimate_variance(&Image::black(1, 1, 3), &Image::black(1, 1, 3)), Image::black(1, 1, 3));
}

#[test]
fn images_of_other_sizes_are_refused() {
    let picture = NoisyPicture { albedo: Image::black(3, 4, 3), ..truth() };
    for (name, filter) in FILTERS {
        let error = filter(&picture).unwrap_err().to_string();
        assert!(error.contains("albedo has 3×4"), "{name}: {error}");
    }
}
