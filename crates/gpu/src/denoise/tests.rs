//! The network on the device against that on the CPU.

mod emulated;

use super::*;
use crate::GpuOptions;
use post::Network;
use wgpu::Features;

/// A picture with all that belongs to it.
struct Picture {
    colour: Image,
    albedo: Image,
    normal: Image,
    variance: Option<Image>,
}

/// A number in `[0, 1)`, pure in its arguments.
fn uniform(layer: u32, x: u32, y: u32, c: usize) -> f32 {
    let mut h =
        (layer * 7919 + x * 104_729 + y * 1_299_709 + c as u32 * 15_485_863).wrapping_mul(0x9e37_79b9);
    h = (h ^ (h >> 15)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    ((h ^ (h >> 16)) >> 8) as f32 / (1 << 24) as f32
}

impl Picture {
    /// A wall and a chequered floor, with noise; light is `exposure` times as much as usual.
    fn noisy(width: u32, height: u32, exposure: f32) -> Self {
        let is_floor = |y: u32| 2 * y >= height;
        let albedo = move |x: u32, y: u32| {
            if is_floor(y) && (x / 5 + y / 5).is_multiple_of(2) { [0.8, 0.7, 0.6] } else { [0.3, 0.3, 0.35] }
        };
        let light = move |x: u32, y: u32, c| exposure * (0.2 + 3.0 * uniform(0, x, y, c).powi(3));
        let normal = move |x: u32, y: u32| {
            let tilt = 0.2 * uniform(1, x, y, 0) - 0.1;
            if is_floor(y) { [tilt, 0.98, 0.0] } else { [0.0, tilt, 0.98] }
        };
        let value = move |x, y, c: usize| albedo(x, y)[c] * light(x, y, c);
        Self {
            colour: Image::from_fn(width, height, |x, y| [0, 1, 2].map(|c| value(x, y, c))),
            albedo: Image::from_fn(width, height, albedo),
            normal: Image::from_fn(width, height, normal),
            variance: Some(Image::from_fn(width, height, |x, y| {
                [0, 1, 2].map(|c| 0.1 * value(x, y, c) * value(x, y, c))
            })),
        }
    }

    fn input(&self) -> NetworkInput<'_> {
        NetworkInput::new(&self.colour, &self.albedo, &self.normal, self.variance.as_ref()).expect("one size")
    }
}

/// The largest difference of two pictures' values, relative to the value and a hundredth of the
/// picture's mean.
fn difference(found: &Image, expected: &Image) -> f64 {
    let values = expected.data();
    let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len().max(1) as f64;
    let pairs = found.data().iter().zip(values).map(|(a, b)| (f64::from(*a), f64::from(*b)));
    pairs.map(|(a, b)| (a - b).abs() / (b.abs() + 0.01 * mean).max(1e-37)).fold(0.0, |most, d| {
        assert!(!d.is_nan());
        f64::max(most, d)
    })
}

/// How far the network on a device may be from that on the CPU, relative to the value: with numbers
/// of 32 bits rounding of sums in another order, with 16 bits that of each layer's results.
fn tolerance(products: Products) -> f64 {
    match products.numbers() {
        Numbers::Full => 2e-4,
        Numbers::Half => 1e-2,
    }
}

/// All ways that a device has.
fn ways(gpu: &Gpu) -> Vec<Products> {
    let mut ways = vec![Products::Lanes(Numbers::Full)];
    if gpu.features.contains(Features::SHADER_F16) {
        ways.push(Products::Lanes(Numbers::Half));
    }
    ways.extend(matrices::usable(gpu).map(Products::Matrices));
    ways
}

fn denoised(gpu: &Gpu, network: &GpuNetwork, picture: &Picture) -> Image {
    let mut timer = Timer::new(gpu).expect("memory");
    let filtered = network.denoise(gpu, &picture.input(), &mut timer).expect("denoised");
    timer.collect(gpu).expect("times");
    filtered
}

/// The network in all ways that a device has, and what each does with pictures.
fn compare(test: &str, pictures: &[(&str, Picture)]) {
    let Some(gpu) = crate::open_for_test(test, &GpuOptions::default()) else { return };
    let weights = NetworkWeights::trained().expect("weights");
    for products in ways(&gpu) {
        let network = GpuNetwork::with(&gpu, &weights, products).expect("compiled");
        for (name, picture) in pictures {
            let expected = Network::trained().denoise(&picture.input());
            let found = difference(&denoised(&gpu, &network, picture), &expected);
            println!("{name}, {products:?}: {found:.2e}");
            assert!(found <= tolerance(products), "{name}, {products:?}: {found:e}");
        }
    }
}

#[test]
fn pictures_of_all_sizes_are_the_cpus() {
    let sizes = [("64×48", 64, 48), ("37×29", 37, 29), ("1×1", 1, 1), ("100×3", 100, 3)];
    let pictures = sizes.map(|(name, width, height)| (name, Picture::noisy(width, height, 1.0)));
    compare("pictures_of_all_sizes_are_the_cpus", &pictures);
}

#[test]
fn extreme_pictures_are_the_cpus() {
    let of = |exposure| Picture::noisy(40, 33, exposure);
    let mut broken = of(1.0);
    for (i, value) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -3.0, f32::MAX].into_iter().enumerate() {
        broken.colour.data_mut()[100 * i] = value;
        broken.albedo.data_mut()[100 * i + 31] = value;
        broken.normal.data_mut()[100 * i + 50] = value;
        broken.variance.as_mut().expect("known").data_mut()[100 * i + 70] = value;
    }
    let black = |x: Picture| Picture { colour: Image::black(40, 33, 3), ..x };
    let unknown =
        |x: Picture| Picture { albedo: Image::black(40, 33, 3), normal: Image::black(40, 33, 3), ..x };
    let pictures = [
        ("dark", of(1e-30)),
        ("bright", of(1e30)),
        ("black", black(of(1.0))),
        ("values that are no numbers", broken),
        ("no variance", Picture { variance: None, ..of(1.0) }),
        ("nothing but radiance", unknown(Picture { variance: None, ..of(1.0) })),
    ];
    compare("extreme_pictures_are_the_cpus", &pictures);
}

#[test]
fn tiles_leave_no_seams() {
    let Some(gpu) = crate::open_for_test("tiles_leave_no_seams", &GpuOptions::default()) else { return };
    let picture = Picture::noisy(570, 30, 1.0);
    let network = GpuNetwork::new(&gpu).expect("compiled");
    let mut timer = Timer::new(&gpu).expect("memory");
    let mut in_tiles = |most_pixels| {
        let input = picture.input();
        let count = input.prepared().tiles(most_pixels).len();
        (count, network.denoise_in_tiles(&gpu, &input, most_pixels, &mut timer).expect("denoised"))
    };
    let (whole, tiled) = (in_tiles(1 << 20), in_tiles(18_000));
    assert_eq!((whole.0, tiled.0), (1, 2));
    let found = difference(&tiled.1, &whole.1);
    assert!(found <= 1e-5, "{found:e}");
}

/// A picture without pixels needs no device.
#[test]
fn no_pixels_are_no_work() {
    let Some(gpu) = crate::open_for_test("no_pixels_are_no_work", &GpuOptions::default()) else { return };
    let network = GpuNetwork::new(&gpu).expect("compiled");
    let filtered = denoised(&gpu, &network, &Picture::noisy(0, 7, 1.0));
    assert_eq!((filtered.width(), filtered.height()), (0, 7));
}

/// Prints the device's time of a picture of 1920×1080, by pass.
#[test]
#[ignore = "measures"]
fn whole() {
    let Some(gpu) = crate::open_for_test("whole", &GpuOptions::default()) else { return };
    println!("{}, {:?}", gpu.describe(), Products::best(&gpu));
    let picture = Picture::noisy(1920, 1080, 1.0);
    let weights = NetworkWeights::trained().expect("weights");
    let expected = Network::trained().denoise(&picture.input());
    let mut timer = Timer::new(&gpu).expect("memory");
    for products in ways(&gpu) {
        let start = std::time::Instant::now();
        let network = GpuNetwork::with(&gpu, &weights, products).expect("compiled");
        println!("{products:?}: compiled in {:.2} s", start.elapsed().as_secs_f64());
        for turn in 0..4 {
            let start = std::time::Instant::now();
            let filtered = network.denoise(&gpu, &picture.input(), &mut timer).expect("denoised");
            let elapsed = start.elapsed().as_secs_f64();
            timer.collect(&gpu).expect("times");
            let passes = timer.take();
            let Some(first) = passes.first() else { return println!("no clock; {elapsed:.3} s") };
            let sum: f64 = passes.iter().map(|pass| pass.duration.as_secs_f64()).sum();
            let end = passes.iter().map(|pass| pass.start + pass.duration).max().unwrap_or_default();
            let span = end.saturating_sub(first.start).as_secs_f64();
            println!(
                "  {turn}: {:.3} ms of passes, {:.3} ms from first to last, {elapsed:.3} s with the host",
                1e3 * sum,
                1e3 * span
            );
            if turn == 3 {
                println!("  off by {:.2e}", difference(&filtered, &expected));
                for pass in &passes {
                    println!("    {:>9.3} ms {}", 1e3 * pass.duration.as_secs_f64(), pass.name);
                }
            }
        }
    }
}
