//! What the whole denoiser keeps to. Weights are pseudo-random: the same as
//! `training/denoiser/golden.py` makes.

mod pictures;
mod speed;
pub mod weights;

use super::*;
use half::f16;
use pictures::Picture;
use rayon::ThreadPoolBuilder;
use safetensors::{Dtype, SafeTensors};

/// A network whose weights are pseudo-random.
fn network() -> Network {
    Network::from_bytes(&weights::file()).unwrap()
}

/// The largest difference between two pictures, relative to the mean of the first.
fn difference(expected: &[f32], found: &[f32]) -> f64 {
    assert_eq!(expected.len(), found.len());
    let mean = expected.iter().map(|v| f64::from(v.abs())).sum::<f64>() / expected.len() as f64;
    let largest = expected.iter().zip(found).map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max);
    assert!(found.iter().all(|v| v.is_finite()));
    largest / mean.max(1e-30)
}

/// PyTorch's results for the same weights, from `training/denoiser/golden.py`.
#[test]
fn results_are_those_of_the_training() {
    let golden = SafeTensors::deserialize(include_bytes!("tests/golden.safetensors")).unwrap();
    let image = |name: &str| {
        let tensor = golden.tensor(name).unwrap();
        let &[3, height, width] = tensor.shape() else { panic!("{name} is no picture") };
        let value = |i: usize| match tensor.dtype() {
            Dtype::F16 => f16::from_le_bytes(tensor.data().as_chunks().0[i]).to_f32(),
            _ => f32::from_le_bytes(tensor.data().as_chunks().0[i]),
        };
        Image::from_fn(width as u32, height as u32, |x, y| {
            [0, 1, 2].map(|c| value((c * height + y as usize) * width + x as usize))
        })
    };
    let [colour, albedo, normal, variance] = ["color", "albedo", "normal", "variance"].map(image);
    for (variance, name) in [(Some(&variance), "output"), (None, "output_unknown")] {
        let input = NetworkInput::new(&colour, &albedo, &normal, variance).unwrap();
        let (expected, found) = (image(name), network().denoise(&input));
        let relative = |(a, b): (&f32, &f32)| (a - b).abs() / (a.abs() + 0.01);
        let worst = expected.data().iter().zip(found.data()).map(relative).fold(0.0, f32::max);
        println!("{name}: {worst:e}");
        // Sums are rounded in another order, and random weights magnify that more than trained
        // ones.
        assert!(worst < 1e-4, "{name}: {worst}");
    }
    let ignores_variance = difference(image("output").data(), image("output_unknown").data()) < 1e-3;
    assert!(!ignores_variance);
}

#[test]
fn instruction_sets_agree() {
    let picture = Picture::noisy(50, 37);
    let network = network();
    let of = |set| network.denoise_with(set, tiles::MOST_PIXELS, &picture.input());
    let results: Vec<Image> = InstructionSet::available().into_iter().map(of).collect();
    let Some((portable, fused)) = results.split_last() else { panic!("there is always one") };
    for result in fused {
        assert!(result == &fused[0]);
        assert!(difference(result.data(), portable.data()) < 1e-4);
    }
}

#[test]
fn neither_threads_nor_tiles_change_a_bit() {
    let network = network();
    // Long enough for tiles that see less than all of the picture.
    for (width, height) in [(768, 40), (40, 768)] {
        let picture = Picture::noisy(width, height);
        let of = |threads: usize, most_pixels: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let set = InstructionSet::best();
            pool.install(|| network.denoise_with(set, most_pixels, &picture.input()))
        };
        let whole = of(1, tiles::MOST_PIXELS);
        let most_pixels = (2 * tiles::OVERLAP + 3 * tiles::ALIGNMENT) * 2 * tiles::ALIGNMENT;
        assert!(tiles::plan(width as usize, height as usize, most_pixels).len() > 2);
        assert!(whole == of(2, tiles::MOST_PIXELS));
        assert!(whole == of(3, most_pixels));
    }
}

#[test]
fn exposure_scales_the_result() {
    let picture = Picture::noisy(48, 33);
    let network = network();
    let expected = network.denoise(&picture.input());
    for factor in [1024.0, 1.0 / 1024.0, 1024.0f32.powi(4)] {
        let found = network.denoise(&picture.exposed(factor).input()).map(|v| v / factor);
        let difference = difference(expected.data(), found.data());
        assert!(difference < 1e-5, "{factor}: {difference}");
    }
}

#[test]
fn any_size_and_any_values_give_finite_pictures() {
    let network = network();
    for (width, height) in [(1, 1), (1, 40), (33, 1), (31, 33), (64, 32)] {
        let picture = Picture::noisy(width, height);
        let found = network.denoise(&picture.input());
        assert_eq!((found.width(), found.height(), found.channels()), (width, height, 3));
        assert!(found.data().iter().all(|v| v.is_finite() && *v >= 0.0));
    }
    for (width, height) in [(0, 0), (0, 5), (5, 0)] {
        let found = network.denoise(&Picture::noisy(width, height).input());
        assert_eq!((found.width(), found.height()), (width, height));
    }
    let black = Picture::of(20, 20, |_| 0.0);
    assert!(network.denoise(&black.input()).data().iter().all(|v| *v == 0.0));
    let ugly = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1.0, 1e30, 1e-40, 0.0, 1.0];
    for period in [1, 2, 7, 9] {
        let picture = Picture::of(40, 20, |i| ugly[i / 5 % period]);
        let found = network.denoise(&picture.input());
        assert!(found.data().iter().all(|v| v.is_finite() && *v >= 0.0), "{period}");
    }
    let bright = Picture::of(40, 20, |_| 1e30);
    let found = network.denoise(&bright.input());
    assert!(found.data().iter().all(|v| (v / 1e30 - 1.0).abs() < 1e-4));
}

#[test]
fn images_of_other_sizes_are_refused() {
    let (a, b) = (Image::black(3, 4, 3), Image::black(4, 3, 3));
    let error = NetworkInput::new(&a, &a, &b, None).unwrap_err();
    assert_eq!(error.to_string(), "the normal has 4×3 pixels, but the picture has 3×4");
    assert!(NetworkInput::new(&a, &a, &a, Some(&b)).is_err());
}
