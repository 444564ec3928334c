//! `--backend`, `--adapter`, `--profile`: what renders is chosen, named, and the same picture whatever it is.

mod common;

use common::{fail, names, run, succeed};

const SMALL: &str = "--width 24 --height 16 --spp 4";

/// Whether a GPU back end runs here; says so if not.
fn has(backend: &str, test: &str) -> bool {
    let folder = tempfile::tempdir().unwrap();
    let doctor = succeed(folder.path(), "doctor --json").json();
    let status = doctor["backends"].as_array().and_then(|b| b.iter().find(|b| b["name"] == backend).cloned());
    let Some(status) = status else { panic!("doctor does not know {backend}") };
    let there = status["available"] == true;
    if !there {
        testkit::skip_without_gpu(test, &format!("{backend}: {}", status["reason"]));
    }
    there
}

#[test]
fn back_ends_that_are_not_there_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let ran = run(folder.path(), "render cornell --backend gpu-magic");
    assert!(
        ran.code == Some(2) && ran.stderr.contains("gpu-magic") && ran.stderr.contains("gpu-query"),
        "{ran:?}"
    );
    fail(folder.path(), "render cornell --backend cpu --adapter chip", "chip");
    for backend in ["auto", "gpu", "gpu-query"] {
        let arguments = format!("render cornell -q --backend {backend} --adapter no-such-chip");
        fail(folder.path(), &arguments, "no-such-chip");
    }
}

#[test]
fn the_back_end_is_named_once_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let ran = succeed(folder.path(), &format!("render cornell {SMALL} --json"));
    let lines: Vec<_> = ran.stderr.lines().filter(|l| l.starts_with("rendering on")).collect();
    assert_eq!(lines.len(), 1, "{}", ran.stderr);
    let backend = ran.json()["backend"].as_str().map(str::to_owned);
    assert!(lines[0].contains("CPU") == (backend.as_deref() == Some("cpu")), "{backend:?}: {}", lines[0]);
    let quiet = succeed(folder.path(), &format!("render cornell {SMALL} -q"));
    assert_eq!(quiet.stderr, "");
}

#[test]
fn every_back_end_makes_the_same_picture() {
    let folder = tempfile::tempdir().unwrap();
    succeed(folder.path(), &format!("render cornell {SMALL} -q --backend cpu -o cpu.exr"));
    for backend in ["gpu-bvh", "gpu-query", "gpu-pipeline"] {
        if !has(backend, "every_back_end_makes_the_same_picture") {
            continue;
        }
        let ran = succeed(
            folder.path(),
            &format!("render cornell {SMALL} --json --backend {backend} -o {backend}.exr"),
        );
        let json = ran.json();
        assert_eq!((json["backend"].as_str(), json["samples"].as_u64()), (Some(backend), Some(24 * 16 * 4)));
        assert!(json["rays"].as_u64() > Some(24 * 16 * 4), "{json}");
        // The same random numbers make the same noise.
        succeed(folder.path(), &format!("compare cpu.exr {backend}.exr --max-flip 0.02"));
    }
}

/// The wavefront makes the megakernel's picture, and says that it did.
#[test]
fn kernels_can_be_chosen() {
    let folder = tempfile::tempdir().unwrap();
    fail(folder.path(), "render cornell --backend cpu --kernel wavefront", "wavefront");
    let ran = run(folder.path(), "render cornell --kernel microkernel");
    assert!(ran.code == Some(2) && ran.stderr.contains("megakernel"), "{ran:?}");
    if !has("gpu-bvh", "kernels_can_be_chosen") {
        return;
    }
    for (kernel, taken) in [("auto", "megakernel"), ("wavefront", "wavefront")] {
        let arguments =
            format!("render cornell {SMALL} --json --backend gpu-bvh --kernel {kernel} -o {kernel}.exr");
        assert_eq!(succeed(folder.path(), &arguments).json()["kernel"].as_str(), Some(taken));
    }
    succeed(folder.path(), "compare auto.exr wavefront.exr --max-flip 0.001");
}

#[test]
fn profiles_are_traces_of_host_and_device() {
    let folder = tempfile::tempdir().unwrap();
    let name = "profiles_are_traces_of_host_and_device";
    let backend = if has("gpu-query", name) { "gpu-query" } else { "cpu" };
    let arguments = format!("render cornell {SMALL} -q --backend {backend} --profile trace.json -o a.png");
    succeed(folder.path(), &arguments);
    assert_eq!(names(folder.path()), ["a.png", "trace.json"]);
    let text = std::fs::read_to_string(folder.path().join("trace.json")).unwrap();
    let trace: serde_json::Value = serde_json::from_str(&text).unwrap();
    let events = trace["traceEvents"].as_array().expect("events");
    let named = |name: &str| events.iter().filter(|e| e["name"] == name && e["ph"] == "X").count();
    assert_eq!((named("render"), named("write")), (1, 1));
    let device = events.iter().filter(|e| e["ph"] == "X" && e["pid"] == 2).count();
    assert_eq!(device > 0, backend != "cpu", "{text}");
    fail(
        folder.path(),
        &format!("render cornell {SMALL} -q --profile missing/trace.json -o b.png"),
        "missing/trace.json",
    );
}

/// On a machine without a real GPU that is the processor, whose bits are then the same.
#[test]
fn all_devices_are_listed_and_render() {
    let folder = tempfile::tempdir().unwrap();
    let doctor = succeed(folder.path(), "doctor --json").json();
    let devices = doctor["all_devices"].as_array().unwrap().len();
    assert!(devices >= 1 && succeed(folder.path(), "doctor").stdout.contains("\n  all  "));
    let ran = succeed(folder.path(), &format!("render cornell {SMALL} --backend all -o all.exr"));
    assert!(ran.stderr.contains("cpu on"), "{}", ran.stderr);
    succeed(folder.path(), &format!("render cornell {SMALL} --backend cpu -o cpu.exr"));
    let compared = succeed(folder.path(), "compare all.exr cpu.exr --json").json();
    let error = compared["rel_mse"].as_f64().unwrap_or(f64::NAN);
    assert!(if devices == 1 { error == 0.0 } else { error < 0.01 }, "{compared}");
    fail(folder.path(), "render cornell --backend all --adapter no-such-chip,nor-this", "no-such-chip");
}
