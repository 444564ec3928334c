use super::*;
use crate::{Random, ReferenceError, require_shared};
use film::{Film, Rect};

/// A render of uniform noise: `samples` samples in `[0, 2)` times `brightness`, plus the pixel (5, 6) times `spot`.
fn noise(size: u32, samples: u32, brightness: f32, spot: f32, seed: u64) -> Estimate {
    let mut random = Random::new(seed);
    let mut film = Film::new(size, size).unwrap();
    for y in 0..size {
        for x in 0..size {
            let scale = 2.0 * brightness * if (x, y) == (5, 6) { spot } else { 1.0 };
            for _ in 0..samples {
                film.add(x, y, [(); 3].map(|()| scale * random.uniform_f32()));
            }
        }
    }
    Estimate::from_film(&film)
}

fn check(a: &Estimate, b: &Estimate, block: usize) {
    Comparison { pictures: false, ..Comparison::new("noise", block) }.assert(a, b);
}

#[test]
fn equal_expectations_pass_at_every_block_size() {
    for seed in 0..5 {
        let (a, b) = (noise(64, 64, 1.0, 1.0, seed), noise(64, 64, 1.0, 1.0, seed + 100));
        for block in [1, 7, 8, 63, WHOLE_IMAGE] {
            check(&a, &b, block);
        }
    }
}

#[test]
fn z_scores_are_standard_normal() {
    let (a, b) = (noise(96, 64, 1.0, 1.0, 1), noise(96, 64, 1.0, 1.0, 2));
    let report = Comparison::new("z", 4).run(&a, &b);
    // The largest of three absolute normal scores has a root mean square of 1.476.
    let rms = (report.z.iter().map(|z| z * z).sum::<f64>() / report.z.len() as f64).sqrt();
    assert!((rms - 1.476).abs() < 0.1, "{rms}");
}

#[test]
#[should_panic(expected = "the expected images differ: 3 of 3 tests by blocks of 64×64")]
fn one_percent_of_brightness_is_caught_by_the_whole_image() {
    check(&noise(64, 64, 1.01, 1.0, 1), &noise(64, 64, 1.0, 1.0, 2), WHOLE_IMAGE);
}

#[test]
fn five_percent_of_brightness_is_missed_by_single_pixels() {
    // Not a wish, but what the documentation says of the power: whoever runs single pixels alone is fooled.
    check(&noise(64, 64, 1.05, 1.0, 3), &noise(64, 64, 1.0, 1.0, 4), 1);
}

#[test]
#[should_panic(expected = "worst: block at (5, 6)")]
fn one_wrong_pixel_is_caught_by_single_pixels() {
    check(&noise(64, 64, 1.0, 2.0, 1), &noise(64, 64, 1.0, 1.0, 2), 1);
}

#[test]
fn one_wrong_pixel_is_missed_by_the_whole_image() {
    check(&noise(64, 64, 1.0, 2.0, 1), &noise(64, 64, 1.0, 1.0, 2), WHOLE_IMAGE);
}

#[test]
fn some_single_pixels_may_be_allowed_to_fail_but_no_larger_blocks() {
    let (a, b) = (noise(64, 64, 1.0, 2.0, 1), noise(64, 64, 1.0, 1.0, 2));
    let lenient =
        |block| Comparison { failing_share: 0.001, ..Comparison::new("lenient", block) }.run(&a, &b);
    let pixels = lenient(1);
    assert!(pixels.failures > 0 && pixels.passed(), "{pixels:?}");
    let bright = noise(64, 64, 1.05, 1.0, 3);
    let blocks = Comparison { failing_share: 0.5, ..Comparison::new("lenient", 8) }.run(&bright, &b);
    assert!(blocks.allowed == 0 && !blocks.passed());
}

#[test]
fn images_without_noise_may_differ_by_rounding_only() {
    let flat =
        |v: f32| Estimate::from_image(&Image::from_fn(16, 16, |_, _| [v, 0.0, v]), ReferenceError::default());
    check(&flat(1.0), &flat(1.000_01), 1);
    let differ = |a, b| !Comparison::new("flat", 1).run(&flat(a), &flat(b)).passed();
    assert!(differ(1.0, 1.001));
    assert!(differ(0.0, 1e-6));
}

#[test]
#[should_panic(expected = "NaN in the second image")]
fn nan_is_never_equal() {
    let (a, mut b) = (noise(8, 4, 1.0, 1.0, 1), noise(8, 4, 1.0, 1.0, 2));
    b.mean[9][1] = f64::NAN;
    check(&a, &b, WHOLE_IMAGE);
}

#[test]
#[should_panic(expected = "differ in size")]
fn sizes_must_agree() {
    check(&noise(8, 4, 1.0, 1.0, 1), &noise(9, 4, 1.0, 1.0, 2), 1);
}

#[test]
#[should_panic(expected = "only 1 samples")]
fn one_sample_is_not_an_estimate() {
    let _ = noise(2, 1, 1.0, 1.0, 1);
}

#[test]
fn renders_with_different_seeds_give_the_same_variance() {
    let films: Vec<Film> = (0..32)
        .map(|seed| {
            let mut random = Random::new(seed);
            let mut film =
                Film::with_window(40, 40, Rect { x: 4, y: 4, width: 24, height: 24 }, &[]).unwrap();
            for pixel in film.pixels_mut() {
                (0..16).for_each(|_| assert!(pixel.add([(); 3].map(|()| random.uniform_f32()))));
            }
            film
        })
        .collect();
    let across = Estimate::from_renders(&films);
    let mut merged = films[0].clone();
    films[1..].iter().for_each(|f| merged.merge(f).unwrap());
    let within = Estimate::from_film(&merged);
    let sum = |e: &Estimate| e.variance.iter().flatten().sum::<f64>();
    assert!((sum(&across) / sum(&within) - 1.0).abs() < 0.03);
    let difference = across.mean.iter().flatten().zip(within.mean.iter().flatten());
    assert!(difference.into_iter().all(|(a, b)| (a - b).abs() < 1e-12));
}

#[test]
fn a_pixel_that_missed_its_bright_samples_is_forgiven_by_its_neighbours() {
    // Each sample is 1000 with a chance of 1 in 500: of 512 samples a third of the pixels see none.
    let fireflies = |seed| {
        let mut random = Random::new(seed);
        let mut film = Film::new(48, 48).unwrap();
        for i in 0..48 * 48 * 512 {
            let value = if random.uniform() < 0.002 { 1000.0 } else { random.uniform_f32() };
            film.add(i % 48, i / 48 % 48, [value; 3]);
        }
        Estimate::from_film(&film)
    };
    let (a, b) = (fireflies(1), fireflies(2));
    let run = |a: &Estimate, b: &Estimate| Comparison::new("fireflies", 1).run(a, b);
    let (alone, pooled) = (
        run(&a, &b),
        run(&a.clone().with_variance_of_neighbours(2), &b.clone().with_variance_of_neighbours(2)),
    );
    assert!(pooled.failures == 0 && pooled.worst.z.abs() < alone.worst.z.abs(), "{alone:?} {pooled:?}");
    // A pixel that is wrong is still caught.
    let mut wrong = a;
    wrong.mean[48 * 20 + 20] = [40.0; 3];
    assert!(!run(&wrong.with_variance_of_neighbours(2), &b.with_variance_of_neighbours(2)).passed());
}

#[test]
fn measured_noise_is_the_noise() {
    let mut e = noise(64, 32, 1.0, 1.0, 9);
    let known: f64 = e.variance.iter().flatten().sum();
    e.variance.iter_mut().for_each(|v| *v = [0.0; 3]);
    // A slope is no noise.
    (0..64 * 64).for_each(|i| e.mean[i] = e.mean[i].map(|m| m + 0.1 * (i % 64) as f64));
    let measured: f64 = e.with_measured_noise(2).variance.iter().flatten().sum();
    assert!((measured / known - 1.0).abs() < 0.05, "{measured} {known}");
}

#[test]
fn a_failure_leaves_pictures() {
    let name = "testkit-a_failure_leaves_pictures";
    let (a, b) = (noise(20, 16, 1.5, 1.0, 1), noise(20, 16, 1.0, 1.0, 2));
    let comparison = Comparison::new(name, 8);
    let report = comparison.run(&a, &b);
    let message = comparison.message(&a, &b, &report);
    let dir = output_dir(name);
    assert!(message.contains(&dir.display().to_string()), "{message}");
    for file in ["actual.exr", "actual.png", "expected.exr", "expected.png", "difference.png", "z.png"] {
        let image = Image::open(dir.join(file)).unwrap();
        assert_eq!((image.width(), image.height()), (20, 20), "{file}");
    }
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn shared_references_open_and_equal_themselves() {
    let Some(shared) = require_shared("shared_references_open_and_equal_themselves") else { return };
    for name in ["cornell", "glass", "spheres"] {
        let reference = Estimate::open_reference(&shared.join("references").join(name)).unwrap();
        assert!(reference.mean_colour().iter().all(|&m| m > 0.01), "{name}");
        for block in [1, 8, WHOLE_IMAGE] {
            assert_eq!(Comparison::new(name, block).run(&reference, &reference).failures, 0);
        }
        let mut darker = reference.clone();
        darker.mean.iter_mut().flatten().for_each(|m| *m *= 0.995);
        assert!(!Comparison::new(name, WHOLE_IMAGE).run(&reference, &darker).passed(), "{name}");
    }
}
