//! Benchmarks as a user runs them.

mod common;

use common::{fail, succeed};

#[test]
fn convergence_falls_and_its_report_is_complete() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "bench convergence cornell --width 24 --height 16 --spp 2,32 --seeds 2 --reference-spp 256 \
                     --references kept --report out";
    let ran = succeed(folder.path(), arguments);
    assert!(ran.stdout.contains("cornell") && ran.stdout.contains("relMSE"), "{}", ran.stdout);
    let text = std::fs::read_to_string(folder.path().join("out/convergence.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let error = |row: usize| json["tables"][0]["rows"][row]["relMSE"].as_f64().unwrap();
    assert!(error(1) < 0.3 * error(0), "{} {}", error(0), error(1));
    let html = std::fs::read_to_string(folder.path().join("out/convergence.html")).unwrap();
    assert!(html.contains("<svg") && html.contains("data:image/png"), "a page without pictures");
    assert_eq!(std::fs::read_dir(folder.path().join("kept")).unwrap().count(), 1);
    // The second run finds the reference.
    let again = succeed(folder.path(), arguments);
    assert!(!again.stderr.contains("rendering the reference"), "{}", again.stderr);
}

#[test]
fn scenes_that_are_not_there_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    fail(folder.path(), "bench convergence no-such-scene", "cannot load the scene no-such-scene");
}

#[test]
fn adaptive_sampling_is_compared_at_equal_error() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        "bench adaptive cornell --width 32 --height 18 --spp 32 --seeds 1 --reference-spp 512 --report out";
    let ran = succeed(folder.path(), arguments);
    assert!(ran.stdout.contains("Gains at equal relMSE"), "{}", ran.stdout);
    let text = std::fs::read_to_string(folder.path().join("out/adaptive.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let gain = json["tables"][0]["rows"][0]["rays"].as_f64().unwrap();
    assert!((0.3..10.0).contains(&gain), "{gain}");
    let points = json["tables"][1]["rows"].as_array().unwrap();
    let rays = |sampling: &str| {
        points.iter().find(|p| p["sampling"] == sampling && p["spp"] == 32.0).unwrap()["rays"]
            .as_f64()
            .unwrap()
    };
    // The same budget, but for rounding; pixels that see nothing cost less.
    assert!((0.5..2.0).contains(&(rays("adaptive") / rays("uniform"))));
}
