//! Random scenes of materials, lights, media and cameras, many of them extreme: pictures are finite and not negative, or there
//! is an error.
//!
//! `ALHAZEN_TRUST_RUNS=N` makes N times as many.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

use alhazen::{
    Control, Job, Limits, LoadOptions, Renderer, Source, add_daylight_if_dark, check_default_camera,
};
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

/// SplitMix64: Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.next() as usize % all.len()]
    }

    /// A number of `[0, 1]`, often one of its ends or next to them.
    fn share(&mut self) -> f64 {
        match self.next() % 4 {
            0 => self.one_of(&[0.0, 1.0, 1e-7, 1.0 - 1e-6, 1e-3]),
            _ => self.unit(),
        }
    }

    /// A positive number of any size that scenes have, and some that they should not.
    fn size(&mut self) -> f64 {
        match self.next() % 3 {
            0 => 10f64.powf(self.unit() * 24.0 - 12.0),
            _ => 10f64.powf(self.unit() * 2.0 - 1.0),
        }
    }

    fn color(&mut self) -> String {
        format!("[{}, {}, {}]", self.share(), self.share(), self.share())
    }

    fn place(&mut self, size: f64) -> String {
        let mut at = || (self.unit() * 4.0 - 2.0) * size;
        format!("[{}, {}, {}]", at(), at(), at())
    }
}

fn material(random: &mut Random, text: &mut String, name: &str) -> std::fmt::Result {
    writeln!(text, "[materials.{name}]\nbase-color = {}", random.color())?;
    if random.next().is_multiple_of(4) {
        let model = random.one_of(&["lambert", "dielectric", "mirror", "unlit"]);
        return writeln!(text, "model = \"{model}\"");
    }
    writeln!(text, "metallic = {}\nroughness = {}", random.share(), random.share())?;
    for key in [
        "transmission",
        "clearcoat",
        "clearcoat-roughness",
        "diffuse-roughness",
        "sheen-roughness",
        "iridescence",
        "specular",
    ] {
        if random.next().is_multiple_of(4) {
            writeln!(text, "{key} = {}", random.share())?;
        }
    }
    if random.next().is_multiple_of(3) {
        writeln!(text, "ior = {}", 1.0 + 2.0 * random.share())?;
    }
    if random.next().is_multiple_of(4) {
        writeln!(text, "emission = {}\nemission-strength = {}", random.color(), random.size().min(1e9))?;
    }
    Ok(())
}

fn light(random: &mut Random, text: &mut String, size: f64) -> std::fmt::Result {
    // More radiance than a film can hold is counted as invalid.
    let (color, power) = (random.color(), random.size().min(1e6) * size * size);
    match random.next() % 3 {
        0 => writeln!(
            text,
            "[[light]]\nkind = \"point\"\nposition = {}\ncolor = {color}\nintensity = {power}",
            random.place(size)
        ),
        1 => writeln!(
            text,
            "[[light]]\nkind = \"spot\"\nposition = {}\ntarget = {}\nangle = {}\ncolor = {color}\nintensity = {power}",
            random.place(size),
            random.place(size),
            1.0 + 80.0 * random.unit()
        ),
        _ => writeln!(
            text,
            "[[light]]\nkind = \"directional\"\ntowards = {}\ncolor = {color}\nirradiance = {}",
            random.place(1.0),
            random.size().min(1e6)
        ),
    }
}

/// A scene as a scene file.
fn scene(random: &mut Random) -> Result<String, std::fmt::Error> {
    let size = random.size();
    let mut text = String::from("name = \"random\"\n");
    for i in 0..3 {
        material(random, &mut text, &format!("m{i}"))?;
    }
    for i in 0..3 {
        let (place, radius) = (random.place(size), size * random.size().min(10.0));
        writeln!(
            text,
            "[[shape]]\nkind = \"sphere\"\nradius = {radius}\ntranslate = {place}\nmaterial = \"m{i}\""
        )?;
    }
    for _ in 0..random.next() % 3 {
        light(random, &mut text, size)?;
    }
    if random.next().is_multiple_of(4) {
        let (scattering, absorption) = (random.size() / size, random.size() / size);
        writeln!(
            text,
            "[fog]\nscattering = {scattering}\nabsorption = {absorption}\nemission = {}",
            random.share()
        )?;
    }
    if !random.next().is_multiple_of(3) {
        let (eye, target) = (random.place(2.0 * size), random.place(size));
        writeln!(text, "[[camera]]\neye = {eye}\ntarget = {target}\nfov = {}", 1.0 + 170.0 * random.share())?;
    }
    Ok(text)
}

/// Renders a scene file; `None` if it is refused.
fn picture(path: &Path, renderer: &mut Renderer) -> Option<(Vec<f32>, u64)> {
    let mut loaded = Source::parse_file(path).load(&LoadOptions::default()).ok()?;
    add_daylight_if_dark(&mut loaded.scene, &mut loaded.report, None);
    check_default_camera(&loaded.scene).ok()?;
    renderer.load(&loaded.scene).ok()?;
    let job = Job { width: 8, height: 8, ..Job::for_scene(&loaded.scene) };
    let limits = Limits { spp: 2, ..Limits::default() };
    let summary = renderer.render(&job, &limits, &Control::new()).ok()?;
    let film = renderer.film().ok()??;
    Some((film.to_image().into_data(), summary.invalid_samples))
}

#[test]
fn random_scenes_are_pictures_or_errors() {
    let factor = std::env::var("ALHAZEN_TRUST_RUNS").ok().and_then(|n| n.parse().ok()).unwrap_or(1u64);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("random.toml");
    let mut renderer = Renderer::cpu(Some(1)).expect("a renderer");
    let (mut made, cases) = (0, 150 * factor);
    for seed in 0..cases {
        let text = scene(&mut Random(seed)).expect("text");
        std::fs::write(&path, &text).expect("written");
        let begin = Instant::now();
        let Some((values, invalid)) = picture(&path, &mut renderer) else { continue };
        made += 1;
        assert_eq!(invalid, 0, "seed {seed}: samples are NaN, infinite or too large in\n{text}");
        assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0), "seed {seed}: {values:?} in\n{text}");
        assert!(begin.elapsed() < Duration::from_secs(30), "seed {seed}: {:?} for\n{text}", begin.elapsed());
    }
    // Most scenes are possible.
    assert!(made * 2 > cases, "{made} of {cases} scenes became pictures");
}
