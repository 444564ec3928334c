//! A data set that is begun, cancelled at random moments and begun again leaves nothing behind.
//!
//! `ALHAZEN_SOAK_SECONDS=N`: for so long.

use alhazen::{Control, Image, Job, Limits, LoadOptions, Renderer, Source, memory_bytes, open_files};
use sensors::SensorError;
use sensors::dataset::{Dataset, Poses};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use testkit::Random;

const POSES: &str = r#"{"width": 32, "height": 24, "matrix": [[32, 0, 15.5], [0, 32, 11.5], [0, 0, 1]], "poses": [
    [[1, 0, 0, 0], [0, -1, 0, 1], [0, 0, -1, 6], [0, 0, 0, 1]],
    [[1, 0, 0, 0.5], [0, -1, 0, 1], [0, 0, -1, 6], [0, 0, 0, 1]],
    [[1, 0, 0, 1], [0, -1, 0, 1], [0, 0, -1, 5], [0, 0, 0, 1]]]}"#;

fn data_set(folder: &Path) -> Dataset {
    let path = folder.join("poses.json");
    std::fs::write(&path, POSES).expect("a file");
    let scene = Source::parse("three-spheres").load(&LoadOptions::default()).expect("a built-in scene").scene;
    let job = Job::for_scene(&scene);
    let limits = Limits { spp: 4, ..Limits::default() };
    Dataset { scene, poses: Poses::read(&path).expect("poses"), categories: Default::default(), job, limits }
}

/// Every file of the data set is whole.
fn assert_whole(folder: &Path, poses: usize) {
    for file in Dataset::files(folder, poses).filter(|file| file.exists()) {
        let whole = match file.extension().and_then(|e| e.to_str()) {
            Some("json") => {
                serde_json::from_slice::<serde_json::Value>(&std::fs::read(&file).unwrap()).is_ok()
            }
            Some("exr") => alhazen::ExrFile::read(&file).is_ok(),
            _ => Image::open(&file).is_ok(),
        };
        assert!(whole, "{} is damaged", file.display());
    }
    for part in ["images", "layers"] {
        for entry in std::fs::read_dir(folder.join(part)).into_iter().flatten() {
            let name = entry.expect("an entry").file_name().into_string().expect("a plain name");
            assert!(!name.contains(".tmp"), "{name} is left");
        }
    }
}

#[test]
fn cancelled_data_sets_leave_nothing_behind() {
    let seconds = std::env::var("ALHAZEN_SOAK_SECONDS").ok().and_then(|n| n.parse().ok()).unwrap_or(6.0);
    let (begin, time) = (Instant::now(), Duration::from_secs_f64(seconds));
    let folder = tempfile::tempdir().expect("a folder");
    let data_set = data_set(folder.path());
    let out = folder.path().join("out");
    let mut renderer = Renderer::cpu(Some(1)).expect("a renderer");
    let mut random = Random::new(1);
    let (mut settled, mut cancelled, mut done) = (None, 0, 0);
    // How long a whole data set takes.
    let mut usual = Duration::from_millis(100);
    while begin.elapsed() < time || done == 0 || cancelled == 0 {
        let control = Arc::new(Control::new());
        let stop = (random.uniform() < 0.7).then(|| {
            let (control, after) = (control.clone(), usual.mul_f64(random.uniform()));
            std::thread::spawn(move || {
                std::thread::sleep(after);
                control.cancel();
            })
        });
        let started = Instant::now();
        match data_set.export(&out, &mut renderer, &control, |_| {}) {
            Ok(exported) => {
                assert_eq!(exported.images, 3);
                (done, usual) = (done + 1, started.elapsed());
            }
            Err(error) => {
                assert!(matches!(error, SensorError::Cancelled), "{error}");
                cancelled += 1;
            }
        }
        if let Some(thread) = stop {
            thread.join().expect("it only sleeps");
        }
        assert_whole(&out, 3);
        if settled.is_none() && begin.elapsed() > time / 3 {
            settled = Some((memory_bytes(), open_files()));
        }
    }
    let (Some((Some(bytes), Some(files))), Some(now), Some(open)) = (settled, memory_bytes(), open_files())
    else {
        println!("the system does not tell what the process holds");
        return;
    };
    println!("{done} done, {cancelled} cancelled; {bytes} to {now} bytes, {files} to {open} files");
    assert!(now < bytes + bytes / 12, "{bytes} bytes became {now}");
    assert!(open <= files + 1, "{files} open files became {open}");
}
