use super::*;
use crate::{DenoiseError, denoise};
use film::metrics::mse;

const WIDTH: usize = 72;
const HEIGHT: usize = 48;

/// A number in `[0, 1)`, pure in its arguments.
fn uniform(x: usize, y: usize, key: usize) -> f32 {
    let mut h = (x * 7919 + y * 104_729 + key * 15_485_863) as u32;
    for _ in 0..2 {
        h = (h ^ (h >> 15)).wrapping_mul(0x85eb_ca6b);
        h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    }
    (h >> 8) as f32 / (1 << 24) as f32
}

/// A sequence's frame with its truth.
struct Made {
    noisy: NoisyPicture,
    truth: Image,
    surfaces: Vec<Surface>,
}

impl Made {
    /// `light` of a place of the world, its albedo and its surface; the camera has moved by `shift`
    /// pixels in all, by `step` in this frame. The noise has a relative standard deviation of
    /// `deviation`.
    fn new(key: usize, deviation: f32, [shift, step]: [f32; 2], light: impl Fn(f32, f32) -> f32) -> Self {
        let albedo =
            |x: f32, y: f32| if ((x / 4.0).floor() + (y / 4.0).floor()) % 2.0 == 0.0 { 0.8 } else { 0.3 };
        let value = |x: u32, y: u32| albedo(x as f32 + shift, y as f32) * light(x as f32 + shift, y as f32);
        let image =
            |of: &dyn Fn(u32, u32) -> f32| Image::from_fn(WIDTH as u32, HEIGHT as u32, |x, y| [of(x, y); 3]);
        let noise = |x: u32, y: u32| {
            let sum: f32 = (0..12).map(|i| uniform(x as usize, y as usize, 12 * key + i)).sum();
            (sum - 6.0) * deviation
        };
        let noisy = NoisyPicture {
            colour: image(&|x, y| (value(x, y) * (1.0 + noise(x, y))).max(0.0)),
            variance: Some(image(&|x, y| (value(x, y) * deviation).powi(2))),
            albedo: image(&|x, y| albedo(x as f32 + shift, y as f32)),
            normal: Image::from_fn(WIDTH as u32, HEIGHT as u32, |_, _| [0.0, 0.0, 1.0]),
        };
        let surface = Surface { back: [step, 0.0], distance_before: 5.0, distance: 5.0, ids: [1, 2] };
        Self { noisy, truth: image(&value), surfaces: vec![surface; WIDTH * HEIGHT] }
    }

    fn frame(&self) -> Frame<'_> {
        Frame { noisy: &self.noisy, surfaces: &self.surfaces }
    }
}

/// The network on what frames have found together.
fn denoised(history: &mut History, made: &Made) -> Image {
    let filter = |combined: &NoisyPicture| {
        denoise(combined).map_err(|e| match e {
            DenoiseError::Sizes(sizes) => FrameError::from(sizes),
            DenoiseError::MissingLayer(layer) => panic!("{layer} is there"),
        })
    };
    history.denoise(made.frame(), filter).unwrap()
}

/// A wall that gets darker to the right, with a shadow.
fn wall(x: f32, y: f32) -> f32 {
    let fade = 1.5 - x / 120.0;
    if x > 40.0 && y > 20.0 { 0.4 * fade } else { fade }
}

#[test]
fn still_pictures_converge_from_frame_to_frame() {
    let mut history = History::default();
    let mut errors = Vec::new();
    for key in 0..64 {
        let made = Made::new(key, 0.4, [0.0; 2], wall);
        let combined = history.combine(made.frame()).unwrap();
        errors.push(mse(&made.truth, &combined.colour).unwrap());
    }
    let ratio = |frames: usize| errors[0] / errors[frames - 1];
    assert!(ratio(16) > 10.0 && ratio(64) > 30.0, "{} {}", ratio(16), ratio(64));
}

/// The camera moves by 1.3 pixels a frame: errors, and how they change from frame to frame, are
/// smaller than without a history.
#[test]
fn moving_pictures_are_cleaner_and_steadier() {
    let mut history = History::default();
    let (mut alone, mut together) = (Vec::new(), Vec::new());
    for key in 0..8 {
        let made = Made::new(key, 0.5, [1.3 * key as f32, 1.3], wall);
        let error = |image: &Image| -> Vec<f32> {
            image.data().iter().zip(made.truth.data()).map(|(a, b)| a - b).collect()
        };
        alone.push(error(&denoise(&made.noisy).unwrap()));
        let picture = denoised(&mut history, &made);
        together.push(error(&picture));
        for (before, after) in made.noisy.colour.mean().iter().zip(picture.mean()) {
            assert!((after / before - 1.0).abs() < 1e-3, "frame {key}: {before} became {after}");
        }
    }
    let square = |e: &[f32]| e.iter().map(|v| f64::from(v * v)).sum::<f64>();
    // By one pixel and a third: near enough for errors of several pixels.
    let change = |e: &[Vec<f32>]| {
        let pairs = e[7].chunks_exact(3 * WIDTH).zip(e[6].chunks_exact(3 * WIDTH));
        pairs
            .map(|(now, before)| {
                now.iter().zip(&before[3..]).map(|(a, b)| f64::from((a - b).powi(2))).sum::<f64>()
            })
            .sum::<f64>()
    };
    assert!(square(&together[7]) < square(&alone[7]) / 2.0, "{} {}", square(&together[7]), square(&alone[7]));
    assert!(change(&together) < change(&alone) / 2.0, "{} {}", change(&together), change(&alone));
}

/// Half of the light goes out. What is left of it is less than the noise of the frame, and soon
/// nothing.
#[test]
fn light_that_goes_out_leaves_no_ghost() {
    let mut history = History::default();
    (0..8).for_each(|key| drop(history.combine(Made::new(key, 0.3, [0.0; 2], wall).frame()).unwrap()));
    let dark = |x: f32, y: f32| if x < 36.0 { 0.2 * wall(x, y) } else { wall(x, y) };
    for key in 8..12 {
        let made = Made::new(key, 0.3, [0.0; 2], dark);
        let combined = history.combine(made.frame()).unwrap().colour;
        let ghosts = combined.data().iter().zip(made.truth.data()).enumerate();
        let ghosts = ghosts.filter(|(i, _)| i / 3 % WIDTH < 34).map(|(_, (a, b))| f64::from((a - b) / b));
        let (sum, count) = ghosts.fold((0.0, 0.0), |(sum, n), ghost| (sum + ghost, n + 1.0));
        // The noise of a pixel is 0.3 of its value, and light was five times as much.
        assert!((sum / count).abs() < 0.06, "frame {key}: {}", sum / count);
        let picture = denoised(&mut history.clone(), &made);
        let reach = picture.data().iter().zip(made.noisy.colour.data()).zip(made.truth.data());
        let farthest =
            reach.map(|((after, before), truth)| (after - before).abs() / truth).fold(0.0, f32::max);
        assert!(farthest < 2.6, "beyond the noise: {farthest}");
    }
}

/// A bright thing has moved on by six pixels. What was behind it has no history, and nothing
/// trails.
#[test]
fn what_comes_to_light_has_no_history() {
    let thing = |x: usize, y: usize, left: usize| (left..left + 20).contains(&x) && (10..30).contains(&y);
    let made = |key: usize, left: usize| {
        let mut made =
            Made::new(key, 0.2, [0.0; 2], |x, y| if thing(x as usize, y as usize, left) { 9.0 } else { 1.0 });
        for (i, surface) in made.surfaces.iter_mut().enumerate() {
            if thing(i % WIDTH, i / WIDTH, left) {
                *surface = Surface { back: [-6.0, 0.0], distance_before: 2.0, distance: 2.0, ids: [7, 7] };
            }
        }
        made
    };
    let mut history = History::default();
    (0..4).for_each(|k| drop(history.combine(made(k, 6 * k).frame()).unwrap()));
    let last = made(4, 24);
    let combined = history.combine(last.frame()).unwrap().colour;
    let (mut uncovered, mut steady) = (0, 0);
    for (x, y) in (0..WIDTH).flat_map(|x| (0..HEIGHT).map(move |y| (x, y))) {
        let (own, found) =
            (last.noisy.colour.rgb(x as u32, y as u32)[0], combined.rgb(x as u32, y as u32)[0]);
        if thing(x, y, 18) && !thing(x, y, 24) {
            assert!((found - own).abs() < 1e-5, "({x}, {y}): {own} became {found}");
            uncovered += 1;
        } else if thing(x, y, 24) && thing(x + 6, y, 24) {
            steady += usize::from((found - own).abs() > 1e-3);
        }
    }
    assert_eq!(uncovered, 6 * 20);
    assert!(steady > 200, "the thing itself has a history: {steady}");
}

/// Depth alone tells, and so does the normal.
#[test]
fn other_surfaces_are_not_mixed() {
    let made = |key| Made::new(key, 0.2, [0.0; 2], |_, _| 1.0);
    let near = |a: &Image, b: &Image| a.data().iter().zip(b.data()).all(|(a, b)| (a - b).abs() < 1e-5);
    let is_alone = |change: &dyn Fn(&mut Made)| {
        let mut history = History::default();
        history.combine(made(0).frame()).unwrap();
        let mut next = made(1);
        change(&mut next);
        near(&history.combine(next.frame()).unwrap().colour, &next.noisy.colour)
    };
    assert!(!is_alone(&|_| {}));
    assert!(is_alone(&|made| made.surfaces.iter_mut().for_each(|s| s.distance_before = 5.5)));
    assert!(is_alone(&|made| made.surfaces.iter_mut().for_each(|s| s.distance_before = f32::INFINITY)));
    assert!(is_alone(&|made| made.surfaces.iter_mut().for_each(|s| s.back = [f32::NAN; 2])));
    assert!(is_alone(&|made| made.surfaces.iter_mut().for_each(|s| s.back = [1e9, 0.0])));
    assert!(is_alone(&|made| made.noisy.normal = made.noisy.normal.map(|v| -v)));
    assert!(!is_alone(&|made| made.surfaces.iter_mut().for_each(|s| s.distance_before = f32::NAN)));
}

/// A frame of a hundred times the samples hardly needs what those before have found.
#[test]
fn history_counts_less_the_more_samples_a_frame_has() {
    let weight = |deviation: f32| {
        let mut history = History::default();
        history.combine(Made::new(0, 0.4, [0.0; 2], |_, _| 1.0).frame()).unwrap();
        let next = Made::new(1, deviation, [0.0; 2], |_, _| 1.0);
        let combined = history.combine(next.frame()).unwrap().colour;
        mse(&combined, &next.noisy.colour).unwrap().sqrt()
    };
    assert!(weight(0.04) < weight(0.4) / 20.0, "{} {}", weight(0.04), weight(0.4));
    assert!(weight(0.0) < 1e-6);
}

#[test]
fn frames_of_other_sizes_begin_anew_and_what_does_not_fit_is_refused() {
    let mut history = History::default();
    let made = Made::new(0, 0.2, [0.0; 2], wall);
    history.combine(made.frame()).unwrap();
    let single = NoisyPicture {
        colour: Image::from_fn(1, 1, |_, _| [0.5, f32::NAN, f32::INFINITY]),
        variance: None,
        albedo: Image::black(1, 1, 3),
        normal: Image::black(1, 1, 3),
    };
    let surface = Surface { back: [0.0; 2], distance_before: f32::NAN, distance: f32::NAN, ids: [0; 2] };
    for _ in 0..2 {
        let combined = history.combine(Frame { noisy: &single, surfaces: &[surface] }).unwrap();
        assert_eq!((combined.colour.rgb(0, 0), combined.variance), ([0.5, 0.0, 0.0], None));
    }
    let error = history.combine(Frame { noisy: &single, surfaces: &[] }).unwrap_err().to_string();
    assert!(error.contains("0 surfaces for 1 pixels"), "{error}");
    let wrong = NoisyPicture { normal: Image::black(2, 1, 3), ..single };
    let error = history.combine(Frame { noisy: &wrong, surfaces: &[surface] }).unwrap_err().to_string();
    assert!(error.contains("normal has 2×1"), "{error}");
}
