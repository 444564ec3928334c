use super::*;
use crate::layout::{assert_layout, constant, layout_of};
use crate::open_for_test;
use crate::portions::{number_in_tiles, portions};
use crate::readback::read_all;
use crate::shader::check;
use backend::{Integrator, PathSettings, PixelSamples, SamplerKind, View};
use film::{Allocation, Rect};
use optics::camera::{CAMERA_PERSPECTIVE, CameraFrame};
use optics::rounds::ROUND_QUANTUM;
use optics::{vec2f, vec3f};

#[test]
fn layouts_and_constants_match_the_shader() {
    let module = check::module("rounds");
    assert_layout!(module, Round { size, first_sample, size_number, total, offset, padding });
    assert_layout!(
        module,
        Picture { offset, squared_error, least_valid, least_taken, low, high, most_extra, portions }
    );
    for (name, size) in [("Estimate", ESTIMATE), ("Plan", PLAN)] {
        assert_eq!(layout_of(&module, name).1 as u64, size, "{name}");
    }
    assert_eq!(layout_of(&module, "FilmPixel"), layout_of(&check::module("film"), "FilmPixel"));
    let numbers = [
        ("SIZES", SIZES as u64),
        ("LARGE_PORTION", PORTIONS[0].into()),
        ("SMALL_PORTION", PORTIONS[1].into()),
        ("CANDIDATES", CANDIDATES),
        ("TRIED_PIXELS", TRIED_PIXELS),
    ];
    for (name, value) in numbers {
        assert_eq!(u64::from(constant(&module, name)), value, "{name}");
    }
    assert_eq!(ROUND_QUANTUM as u32 % PORTIONS[SIZES - 1], 0, "what a pixel gets is made up of portions");
}

/// No multiple of a tile, and more than one workgroup tries factors on.
const SIZE: [u32; 2] = [75, 29];

/// Uniform numbers in `[0, 1)`.
fn uniform(pixel: u32, sample: u32) -> f32 {
    let mut z = pixel.wrapping_mul(0x9e37_79b9) ^ sample.wrapping_mul(0x85eb_ca6b);
    for _ in 0..3 {
        z = (z ^ (z >> 15)).wrapping_mul(0x2c1b_3c6d);
    }
    (z >> 8) as f32 / (1 << 24) as f32
}

/// A film with quiet, noisy and dark columns, of 16 samples or 80, some of which are no numbers.
fn film_of_a_picture() -> Film {
    let mut film = Film::new(SIZE[0], SIZE[1]).expect("small");
    for (i, pixel) in (0..).zip(film.pixels_mut()) {
        let (x, y) = (i % SIZE[0], i / SIZE[0]);
        for sample in 0..if y < 15 { 16 } else { 80 } {
            let u = uniform(i, sample);
            let value = match x {
                0..20 => f32::from(u < 0.06) * 20.0,
                20..45 => 2.0 * u,
                45..60 => 0.95 + 0.1 * u,
                _ => 0.003 * u * u,
            };
            pixel.add([value, 0.5 * value, if sample == 7 && x % 9 == 0 { f32::NAN } else { 0.1 }]);
        }
    }
    film
}

fn film_buffers(gpu: &Gpu) -> FilmBuffers {
    let view = View {
        // Nobody looks through it.
        camera: CameraFrame {
            kind: CAMERA_PERSPECTIVE,
            origin: vec3f(0.0, 0.0, 0.0),
            right: vec3f(1.0, 0.0, 0.0),
            up: vec3f(0.0, 1.0, 0.0),
            forward: vec3f(0.0, 0.0, -1.0),
            half_size: vec2f(0.5, 0.5),
            lens_radius: 0.0,
            focus_distance: 1.0,
            distortion: optics::distortion::no_distortion(),
        },
        width: SIZE[0],
        height: SIZE[1],
        window: Rect { x: 0, y: 0, width: SIZE[0], height: SIZE[1] },
        first_sample: 5,
        sampler: SamplerKind::Sobol,
        seed: 0,
        integrator: Integrator::Path(PathSettings::default()),
        single_scatter: false,
        aovs: Vec::new(),
        shutter: None,
    };
    FilmBuffers::new(gpu, &view, false).expect("memory")
}

fn decide(
    gpu: &Gpu,
    rounds: &mut Rounds,
    first: u32,
    total: u64,
    offset: Option<f64>,
    timer: &mut Timer,
) -> Decision {
    rounds.decide(gpu, first, total, offset, timer).expect("a device");
    rounds.read(gpu).expect("a device")
}

/// The device decides as the host does, and lists every sample that it has decided about once.
#[test]
fn devices_decide_as_the_host_does() {
    let Some(gpu) = open_for_test("devices_decide_as_the_host_does", &crate::GpuOptions::default()) else {
        return;
    };
    let (film, buffers) = (film_of_a_picture(), film_buffers(&gpu));
    let mut timer = Timer::new(&gpu).expect("memory");
    let mut rounds = Rounds::new(&gpu, &buffers).expect("a device");
    rounds.follow(&gpu, &film, 1).expect("memory");
    let taken: Vec<u64> = film.pixels().iter().map(|p| p.taken()).collect();
    for (offset, growth) in [(None, 1.5), (Some(0.01), 1.2), (Some(0.01), 100.0)] {
        let total = (taken.iter().sum::<u64>() as f64 * growth) as u64;
        let expected = Allocation::new(&film, offset).expect("estimates").extra(total);
        let decision = decide(&gpu, &mut rounds, 5, total, offset, &mut timer);
        let plans: Vec<[u32; 4]> = read_all(&gpu, &rounds.plans);
        assert!(plans.iter().zip(&taken).all(|(p, n)| u64::from(p[1]) == *n), "other numbers of samples");
        let differing = plans.iter().zip(&expected).filter(|(p, n)| p[2] != **n).count();
        assert!(differing * 100 < expected.len(), "{growth}: {differing} pixels are decided otherwise");
        let samples: u64 = plans.iter().map(|p| u64::from(p[2])).sum();
        assert_eq!(decision.samples(), samples, "{growth}");
        assert!(samples > 0 && (decision.least_valid, decision.least_taken) == (15, 16), "{decision:?}");
        if offset.is_none() {
            let expected = film.relative_error().expect("estimates");
            assert!((decision.error / expected - 1.0).abs() < 1e-4, "{} is {expected}", decision.error);
        }
        assert_eq!(decision.most_extra, plans.iter().map(|p| p[2]).max().expect("pixels"));
        // Each size goes on where the one before has ended, and the device shares out as the host would.
        let wanted: Vec<_> = (0..)
            .zip(&plans)
            .map(|(pixel, p)| PixelSamples { pixel, first: 5 + p[1], count: p[2] })
            .collect();
        let mut cuts = portions(SIZE, &wanted);
        for (size, count) in decision.portions().filter(|p| p.1 > 0) {
            let cut = cuts.next().expect("as many sizes");
            assert_eq!((PORTIONS[size], count), (cut.samples, cut.count), "{growth}");
            rounds.share_out(&gpu, size).expect("a device");
            let tally: Vec<[u32; 2]> = read_all(&gpu, &buffers.counters);
            for (y, x) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (y, x))) {
                let number = number_in_tiles(SIZE[0], y * SIZE[0] + x);
                let share = cut.shares[number];
                assert_eq!(tally[2 + number], [share.before, share.first_sample], "{x}, {y} of size {size}");
            }
        }
        assert!(cuts.next().is_none(), "no portions are left over");
    }
}

/// What the device has and what the host has read before count together.
#[test]
fn samples_count_wherever_they_are() {
    let Some(gpu) = open_for_test("samples_count_wherever_they_are", &crate::GpuOptions::default()) else {
        return;
    };
    let (film, buffers) = (film_of_a_picture(), film_buffers(&gpu));
    let mut timer = Timer::new(&gpu).expect("memory");
    let mut rounds = Rounds::new(&gpu, &buffers).expect("a device");
    let nothing = decide(&gpu, &mut rounds, 0, 1000, None, &mut timer);
    assert_eq!((nothing.least_valid, nothing.samples()), (0, 0), "{nothing:?}");
    let pixels: Vec<_> = film.pixels().iter().map(FilmPixel::of).collect();
    write_buffer(&gpu, "a test", &buffers.pixels, bytemuck::cast_slice(&pixels)).expect("memory");
    let here = decide(&gpu, &mut rounds, 0, 1 << 20, None, &mut timer);
    assert_eq!((here.least_valid, here.least_taken), (15, 16));
    rounds.follow(&gpu, &film, 1).expect("memory");
    let twice = decide(&gpu, &mut rounds, 0, 1 << 20, None, &mut timer);
    assert_eq!((twice.least_valid, twice.least_taken), (30, 32));
    // The same samples twice: half the variance of the mean.
    assert!((here.error / twice.error - 2f64.sqrt()).abs() < 0.05, "{} {}", here.error, twice.error);
}
