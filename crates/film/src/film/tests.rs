use super::*;
use proptest::prelude::*;

const AOVS: [Aov; 5] = [Aov::Depth, Aov::Normal, Aov::MaterialId, Aov::SampleCount, Aov::StandardError];

/// A deterministic stand-in for a renderer: sample `s` of pixel (`x`, `y`), over a wide range of magnitudes.
fn sample(x: u32, y: u32, s: u64) -> ([f32; 3], AovSample) {
    let mut state = u64::from(x) << 40 ^ u64::from(y) << 20 ^ s;
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((z ^ (z >> 29)) >> 40) as f32 / (1 << 24) as f32
    };
    let rgb = [next(), 1e-6 * next(), 1e6 * next()];
    let aovs = AovSample {
        depth: 1.0 + next(),
        normal: [next(), 0.0, -next()],
        material_id: x,
        ..Default::default()
    };
    (rgb, aovs)
}

fn render(film: &mut Film, samples: std::ops::Range<u64>) {
    let w = film.window();
    for s in samples {
        for y in w.y..w.y + w.height {
            for x in w.x..w.x + w.width {
                let (rgb, aovs) = sample(x, y, s);
                film.add(x, y, rgb);
                film.add_aovs(x, y, s, &aovs);
            }
        }
    }
}

fn film(window: Rect) -> Film {
    Film::with_window(13, 9, window, &AOVS).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..Default::default() })]
    #[test]
    fn any_split_merges_to_the_same_bits(side in 1_u32..8, cuts in prop::collection::vec(0_u64..12, 3), seed: u64) {
        let full = Rect::full(13, 9);
        let mut whole = film(full);
        render(&mut whole, 0..12);

        let mut ends = cuts;
        ends.extend([0, 12]);
        ends.sort_unstable();
        let mut parts: Vec<Film> = Vec::new();
        for tile in full.tiles(side) {
            for range in ends.windows(2) {
                let mut part = whole.tile(tile).unwrap();
                render(&mut part, range[0]..range[1]);
                parts.push(part);
            }
        }
        let n = parts.len();
        let mut merged = film(full);
        (0..n).for_each(|i| parts.swap(i, (seed.wrapping_mul(i as u64 + 1) >> 7) as usize % n));
        parts.iter().for_each(|part| merged.merge(part).unwrap());
        assert!(whole == merged);
    }
}

#[test]
#[should_panic(expected = "assertion")]
fn comparison_notices_a_missing_sample() {
    let (mut a, mut b) = (film(Rect::full(13, 9)), film(Rect::full(13, 9)));
    render(&mut a, 0..4);
    render(&mut b, 0..4);
    a.add(3, 3, [1e-6, 0.0, 0.0]);
    assert!(a == b);
}

#[test]
fn tiles_cover_every_pixel_once() {
    let full = Rect { x: 3, y: 2, width: 10, height: 7 };
    for side in [0, 1, 3, 4, 10, 100] {
        let mut hits = vec![0; 13 * 9];
        for tile in full.tiles(side) {
            assert!(full.contains_rect(&tile) && tile.area() > 0);
            for y in tile.y..tile.y + tile.height {
                (tile.x..tile.x + tile.width).for_each(|x| hits[(y * 13 + x) as usize] += 1);
            }
        }
        for (i, &n) in hits.iter().enumerate() {
            assert_eq!(
                n == 1,
                full.contains(i as u32 % 13, i as u32 / 13),
                "pixel {i} with side {side}: {n}"
            );
        }
    }
}

#[test]
fn impossible_films_are_errors() {
    for (w, h) in [(0, 4), (4, 0), (MAX_SIDE + 1, 1), (u32::MAX, u32::MAX), (MAX_SIDE, MAX_SIDE)] {
        assert_eq!(Film::new(w, h), Err(FilmError::Size { width: w, height: h }));
    }
    let outside = [
        Rect { x: 2, y: 0, width: 3, height: 1 },
        Rect { x: u32::MAX, y: 0, width: u32::MAX, height: 1 },
        Rect { x: 0, y: 0, width: 0, height: 1 },
    ];
    for window in outside {
        assert!(matches!(Film::with_window(4, 4, window, &[]), Err(FilmError::Window { .. })), "{window:?}");
    }
}

#[test]
fn films_that_do_not_belong_together_are_refused() {
    let mut a = film(Rect { x: 2, y: 2, width: 4, height: 4 });
    let mut other_size = Film::with_window(14, 9, a.window(), &AOVS).unwrap();
    assert!(matches!(a.merge(&other_size), Err(FilmError::SizeMismatch { .. })));
    other_size.clear();
    assert!(matches!(a.merge(&film(Rect::full(13, 9))), Err(FilmError::WindowMismatch { .. })));
    let other_layers = Film::with_window(13, 9, a.window(), &[Aov::Depth]).unwrap();
    assert!(matches!(a.merge(&other_layers), Err(FilmError::AovMismatch { .. })));
    assert_eq!(a.total_samples(), 0);
}

#[test]
fn first_and_mean_layers() {
    let mut film = Film::with_window(2, 1, Rect::full(2, 1), &AOVS).unwrap();
    let seen = |depth, material_id| AovSample {
        depth,
        normal: [0.0, depth, 0.0],
        material_id,
        ..Default::default()
    };
    film.add_aovs(0, 0, 1, &seen(3.0, 8));
    film.add_aovs(0, 0, 0, &seen(1.0, 7));
    film.add_aovs(0, 0, 2, &AovSample { normal: [f32::NAN; 3], ..Default::default() });
    film.add(0, 0, [1.0; 3]);
    film.add(0, 0, [3.0; 3]);
    let float = |aov| match film.aov(aov).unwrap() {
        AovData::Float(image) => image.data().to_vec(),
        AovData::Integer(_) | AovData::Shares(_) => panic!("{aov} is not float"),
    };
    assert_eq!(float(Aov::Depth), [1.0, 0.0]);
    assert_eq!(float(Aov::Normal), [0.0, 4.0 / 3.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(float(Aov::StandardError), [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    assert_eq!(film.aov(Aov::MaterialId), Some(AovData::Integer(vec![7, NO_ID])));
    assert_eq!(film.aov(Aov::SampleCount), Some(AovData::Integer(vec![2, 0])));
    assert_eq!(film.aov(Aov::Uv), None);
    assert_eq!(film.invalid_aovs(), 1);
}

#[test]
fn mattes_count_what_samples_see() {
    let mut film = Film::with_window(2, 1, Rect::full(2, 1), &[Aov::ObjectMatte]).unwrap();
    assert!(film.wants_aovs());
    for (sample, instance_id) in [(5, 3), (6, 1), (7, 3), (8, NO_ID)] {
        film.add_aovs(1, 0, sample, &AovSample { instance_id, material_id: 9, ..Default::default() });
    }
    let shares = AovData::Shares(vec![vec![], vec![(1, 0.25), (3, 0.5)]]);
    assert_eq!(film.aov(Aov::ObjectMatte), Some(shares));
    film.clear();
    assert_eq!(film.aov(Aov::ObjectMatte), Some(AovData::Shares(vec![vec![]; 2])));
}

#[test]
fn relative_error_follows_its_formula() {
    let mut film = Film::new(2, 1).unwrap();
    assert_eq!(film.relative_error(), None);
    for (x, values) in [(0, [1.0, 3.0]), (1, [0.0, 0.0])] {
        values.iter().for_each(|&v| assert!(film.add(x, 0, [v; 3])));
    }
    // Pixel 0: mean 2, variance of the mean 1; pixel 1: black. Level 1.
    let expected = (0.5_f64 / (4.0 + 0.01)).sqrt();
    assert!((film.relative_error().unwrap() - expected).abs() < 1e-12);

    let mut brighter = Film::new(2, 1).unwrap();
    for (x, values) in [(0, [1024.0, 3072.0]), (1, [0.0, 0.0])] {
        values.iter().for_each(|&v| assert!(brighter.add(x, 0, [v; 3])));
    }
    assert!((brighter.relative_error().unwrap() - expected).abs() < 1e-12);

    let mut black = Film::new(1, 1).unwrap();
    (0..2).for_each(|_| assert!(black.add(0, 0, [0.0; 3])));
    assert_eq!(black.relative_error(), Some(0.0));
}

#[test]
fn relative_error_falls_with_the_root_of_the_samples() {
    let mut film = Film::new(16, 16).unwrap();
    render(&mut film, 0..64);
    let at_64 = film.relative_error().unwrap();
    render(&mut film, 64..1024);
    let ratio = at_64 / film.relative_error().unwrap();
    assert!((ratio - 4.0).abs() < 0.15, "{ratio}");
}

/// Samples with values that single precision sums exactly, added one by one and as sums.
#[test]
fn sums_of_layers_and_samples_agree() {
    // Of mattes no sums are known.
    let all: Vec<Aov> = Aov::ALL.into_iter().filter(|a| a.kind() != AovKind::Shares).collect();
    let mut one_by_one = Film::with_window(1, 1, Rect::full(1, 1), &all).unwrap();
    let mut at_once = one_by_one.clone();
    let seen = |depth: f32| AovSample {
        depth,
        normal: [depth, 0.5, 0.0],
        geometric_normal: [0.0, depth, 1.0],
        albedo: [0.25, depth, 0.75],
        denoising_albedo: [depth, 0.5, 0.25],
        denoising_normal: [0.0, 1.0, depth],
        position: [depth; 3],
        uv: [depth, 0.5],
        material_id: depth as u32,
        instance_id: 7,
        primitive_id: 9,
    };
    (0..4).for_each(|s| one_by_one.add_aovs(0, 0, s, &seen(1.0 + s as f32)));
    let (zero, sum) = (0.0, 1.0 + 2.0 + 3.0 + 4.0);
    let sums = AovSums {
        count: 4,
        normal: [sum, 2.0, zero],
        geometric_normal: [zero, sum, 4.0],
        albedo: [1.0, sum, 3.0],
        denoising_albedo: [sum, 2.0, 1.0],
        denoising_normal: [zero, 4.0, sum],
        first: Some(seen(1.0)),
    };
    at_once.add_aov_sums(0, 0, &sums);
    assert!(one_by_one == at_once);
    at_once.add_aov_sums(0, 0, &AovSums { count: 2, normal: [f64::NAN, zero, zero], ..AovSums::default() });
    assert_eq!(at_once.invalid_aovs(), 2);
    assert!(one_by_one != at_once);
}
