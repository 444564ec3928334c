//! glTF files whose structure is right and whose numbers are random become pictures or errors.
//!
//! `ALHAZEN_TRUST_RUNS=N` makes N times as many; `ALHAZEN_TRUST_FIRST=S` starts at another seed.

use alhazen::{
    Control, Job, Limits, LoadError, LoadOptions, Renderer, add_daylight_if_dark, check_default_camera,
    peak_memory_bytes,
};
use std::path::Path;
use std::time::{Duration, Instant};
use testkit::{Choices, random_glb};

/// What came of a file.
enum End {
    Refused(LoadError),
    /// It has nothing to look at, or more than a renderer takes.
    Unseen,
    /// Its values, and how many samples were NaN or infinite.
    Picture(Vec<f32>, u64),
}

/// Loads and renders a file, at its second moment if it moves.
fn attempt(file: &[u8], lenient: bool, renderer: &mut Renderer) -> End {
    let options = LoadOptions { lenient, max_memory: 256 << 20, ..LoadOptions::default() };
    let mut loaded = match scene::load::gltf::load_bytes(Path::new("random.glb"), file, &options) {
        Ok(loaded) => loaded,
        Err(error) => return End::Refused(error),
    };
    loaded.scene.set_time(0.7);
    add_daylight_if_dark(&mut loaded.scene, &mut loaded.report, None);
    if check_default_camera(&loaded.scene).is_err() || renderer.load(&loaded.scene).is_err() {
        return End::Unseen;
    }
    let job = Job { width: 8, height: 8, ..Job::for_scene(&loaded.scene) };
    let limits = Limits { spp: 2, ..Limits::default() };
    let Ok(summary) = renderer.render(&job, &limits, &Control::new()) else { return End::Unseen };
    match renderer.film() {
        Ok(Some(film)) => End::Picture(film.to_image().into_data(), summary.invalid_samples),
        _ => End::Unseen,
    }
}

/// Keeps a file that shows a fault, and says where.
fn kept(file: &[u8], seed: u64) -> String {
    let path = std::env::temp_dir().join(format!("alhazen-random-{seed}.glb"));
    match std::fs::write(&path, file) {
        Ok(()) => format!("seed {seed} ({})", path.display()),
        Err(error) => format!("seed {seed}, which cannot be kept: {error}"),
    }
}

fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).ok().and_then(|n| n.parse().ok()).unwrap_or(otherwise)
}

#[test]
fn random_files_are_pictures_or_errors() {
    let (first, cases) = (number("ALHAZEN_TRUST_FIRST", 0), 200 * number("ALHAZEN_TRUST_RUNS", 1));
    let mut renderer = Renderer::cpu(Some(1)).expect("a renderer");
    let (mut pictures, mut refused, mut faults) = (0, 0, Vec::new());
    for seed in first..first + cases {
        let file = random_glb(&mut Choices::from_seed(seed));
        let begin = Instant::now();
        let end = attempt(&file, seed % 2 == 0, &mut renderer);
        let (time, memory) = (begin.elapsed(), peak_memory_bytes());
        let mut fault = |is_one: bool, what: String| {
            if is_one {
                faults.push(format!("{}: {what}", kept(&file, seed)));
            }
        };
        fault(time > Duration::from_secs(30), format!("{time:?}"));
        fault(memory.is_some_and(|bytes| bytes > 1 << 30), format!("{memory:?} bytes"));
        match end {
            End::Picture(values, invalid) => {
                pictures += 1;
                fault(invalid > 0, "samples are NaN, infinite or too large".into());
                fault(values.iter().any(|v| !(v.is_finite() && *v >= 0.0)), format!("{values:?}"));
            }
            End::Refused(error) => {
                refused += 1;
                let text = error.to_string();
                fault(!text.contains("random.glb") || text.contains("expected struct"), text);
            }
            End::Unseen => {}
        }
    }
    let counts = format!("{pictures} pictures and {refused} refused of {cases} files");
    println!("{counts}");
    assert!(faults.is_empty(), "{counts}, {} faults:\n{}", faults.len(), faults.join("\n"));
    // Most files are possible, and some are not.
    assert!(pictures * 2 > cases && refused > 0, "{counts}");
}
