use super::*;

const SIDE: u32 = 12;

/// Uniform numbers in `[0, 1)`: pure in their arguments (SplitMix64).
fn uniform(seed: u64, pixel: usize, sample: u64) -> f64 {
    let mut z = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ ((pixel as u64) << 32) ^ sample;
    for _ in 0..2 {
        z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
    }
    (z >> 11) as f64 / (1u64 << 53) as f64
}

/// A sample of radiance whose mean is one in every pixel: rare and bright at the left, nearly quiet at the right.
fn radiance(seed: u64, pixel: usize, sample: u64) -> [f32; 3] {
    let u = uniform(seed, pixel, sample);
    let value = match pixel as u32 % SIDE {
        0..4 => f64::from(u < 0.05) * 20.0,
        4..8 => 2.0 * u,
        _ => 0.95 + 0.1 * u,
    };
    [value as f32; 3]
}

/// How many samples to add to each pixel so that there are about as many as given.
type Rule = fn(&Film, u64) -> Vec<u32>;

/// A picture of 8 samples a pixel, and three rounds by a rule.
fn adaptive(seed: u64, rule: Rule) -> Film {
    let mut film = Film::new(SIDE, SIDE).unwrap();
    let area = u64::from(SIDE * SIDE);
    let mut extra = vec![8; area as usize];
    for total in [12, 18, 27] {
        add(&mut film, seed, &extra);
        extra = rule(&film, total * area);
    }
    add(&mut film, seed, &extra);
    film
}

fn add(film: &mut Film, seed: u64, extra: &[u32]) {
    for (i, (pixel, &n)) in film.pixels_mut().iter_mut().zip(extra).enumerate() {
        let first = pixel.taken();
        (first..first + u64::from(n)).for_each(|s| assert!(pixel.add(radiance(seed, i, s))));
    }
}

/// How many standard errors the mean over many seeds is from the truth, for the columns `columns`.
fn z_score(rule: Rule, columns: std::ops::Range<u32>) -> f64 {
    let means: Vec<f64> = (1..=500)
        .map(|seed| {
            let film = adaptive(seed, rule);
            let pixels = (0..SIDE).flat_map(|y| columns.clone().map(move |x| (x, y)));
            let values: Vec<f64> = pixels.map(|(x, y)| film.pixel(x, y).unwrap().mean()[0]).collect();
            values.iter().sum::<f64>() / values.len() as f64
        })
        .collect();
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|m| (m - mean) * (m - mean)).sum::<f64>() / (n - 1.0);
    (mean - 1.0) / (variance / n).sqrt()
}

fn neighbours_decide(film: &Film, total: u64) -> Vec<u32> {
    Allocation::new(film, Some(0.01)).unwrap().extra(total)
}

/// What everybody does first: a pixel goes on while its own error is large.
fn pixels_decide_themselves(film: &Film, _: u64) -> Vec<u32> {
    let noisy = |p: &PixelStats| {
        let (mean, variance) = (p.mean()[0], p.variance_of_mean().unwrap()[0]);
        variance > 1e-3 * (mean * mean + 0.01)
    };
    film.pixels().iter().map(|p| if noisy(p) { 8 } else { 0 }).collect()
}

#[test]
fn what_neighbours_decide_has_no_bias() {
    for columns in [0..SIDE, 0..2, 2..4, 4..6, 8..SIDE] {
        let z = z_score(neighbours_decide, columns.clone());
        assert!(z.abs() < 4.0, "columns {columns:?}: {z} standard errors");
    }
}

/// What the test above is worth: it notices the usual stopping rule.
#[test]
fn pixels_that_stop_by_themselves_are_biased() {
    let z = z_score(pixels_decide_themselves, 0..4);
    assert!(z < -8.0, "{z} standard errors");
}

#[test]
fn samples_go_where_the_noise_is() {
    let mut film = Film::new(SIDE, SIDE).unwrap();
    add(&mut film, 3, &[64; (SIDE * SIDE) as usize]);
    let allocation = Allocation::new(&film, Some(0.01)).unwrap();
    let (taken, total) = (allocation.taken(), 2 * allocation.taken());
    let extra = allocation.extra(total);
    let of_column = |x: u32| (0..SIDE).map(|y| extra[(y * SIDE + x) as usize]).sum::<u32>() / SIDE;
    // Far from the others' windows the ratio is that of the standard deviations: √19 to 1/√3. The noisy already have a
    // part of what they should have, so they get nearly all.
    assert!(of_column(0) > 10 * of_column(6).max(1), "{} {}", of_column(0), of_column(6));
    assert_eq!(of_column(11), 0);
    let made = taken + extra.iter().map(|&n| u64::from(n)).sum::<u64>();
    assert!(made.abs_diff(total) < total / 20, "{made} instead of {total}");
}

#[test]
fn no_pixel_grows_too_fast_and_quiet_pictures_grow_evenly() {
    let mut film = Film::new(SIDE, SIDE).unwrap();
    add(&mut film, 1, &[8; (SIDE * SIDE) as usize]);
    let extra = Allocation::new(&film, None).unwrap().extra(1_000_000);
    assert!(extra.iter().all(|&n| n <= 24));
    let mut quiet = Film::new(3, 3).unwrap();
    assert!(Allocation::new(&quiet, None).is_none(), "no sample, no estimate");
    quiet.pixels_mut().iter_mut().for_each(|p| p.add_all([[1.0; 3]; 4]));
    assert_eq!(Allocation::new(&quiet, None).unwrap().extra(9 * 6), [2; 9]);
}
