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

/// Less than a second is no measurement of time, but shows what each sample is worth.
#[test]
fn lights_are_worth_choosing_by_place() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        "bench lights lanterns --width 32 --height 18 --reference-spp 512 --time 0.3s --seeds 1 --report out";
    let ran = succeed(folder.path(), arguments);
    assert!(ran.stdout.contains("10000"), "the hall has ten thousand lights: {}", ran.stdout);
    let text = std::fs::read_to_string(folder.path().join("out/lights.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let number = |column: &str| json["tables"][0]["rows"][0][column].as_f64().unwrap();
    let variance = |way: &str| number(&format!("relMSE by {way}")) * number(&format!("spp by {way}"));
    let gain = variance("power") / variance("place");
    assert!(gain > 1.4, "a sample by place is worth {gain} by power");
    assert!(number("gain") > 0.0);
    fail(
        folder.path(),
        "bench lights cornell --reference-spp 1 --report out",
        "cornell has too few lights for a tree: 1",
    );
}

/// Photons find what paths hardly do, also in a third of a second.
#[test]
fn caustics_are_compared_at_equal_time() {
    let folder = tempfile::tempdir().unwrap();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/scenes/ring.toml");
    let arguments = format!(
        "bench hard {scene} --width 32 --height 18 --reference-spp 256 --times 0.3s --seeds 1 --report out"
    );
    let ran = succeed(folder.path(), &arguments);
    assert!(ran.stdout.contains("caustics"), "{}", ran.stdout);
    let text = std::fs::read_to_string(folder.path().join("out/hard.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let gain = json["tables"][0]["rows"][1]["gain"].as_f64().unwrap();
    assert!(gain > 2.0, "photons are worth {gain}");
}

/// A sequence flickers less with a history, and is no worse.
#[test]
fn sequences_are_denoised_with_and_without_their_history() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "bench denoise cornell --width 64 --height 48 --spp 4 --seeds 1 --reference-spp 512 --frames 5 \
                     --crops crops --report out";
    succeed(folder.path(), arguments);
    let text = std::fs::read_to_string(folder.path().join("out/denoise.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let crops = alhazen::Image::open(folder.path().join("crops/denoising-cornell-4.png")).unwrap();
    assert_eq!((crops.width(), crops.height()), (3 * 32, 24), "noisy, network, reference");
    let rows = &json["tables"][1]["rows"];
    let row = |i: usize| (rows[i]["denoiser"].as_str().unwrap(), rows[i]["history"].as_str().unwrap());
    assert_eq!([row(0), row(1), row(2)], [("none", "no"), ("network", "no"), ("network", "yes")]);
    let number = |i: usize, column: &str| rows[i][column].as_f64().unwrap();
    let (alone, together) = (number(1, "flicker"), number(2, "flicker"));
    assert!(
        together < 0.75 * alone && together > 0.9,
        "{alone} became {together}; of the references it is 1"
    );
    let (alone, together) = (number(1, "relMSE"), number(2, "relMSE"));
    assert!(together < alone, "{alone} became {together}");
}

#[test]
fn scenes_that_are_not_there_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    fail(folder.path(), "bench convergence no-such-scene", "cannot load the scene no-such-scene");
    // Before anything is rendered: this would take hours.
    let late = "bench adaptive atrium no-such-scene --width 4096 --height 4096 --reference-spp 100000";
    fail(folder.path(), late, "cannot load the scene no-such-scene");
}

#[test]
fn adaptive_sampling_is_compared_at_equal_error() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "bench adaptive cornell --width 32 --height 18 --spp 16,32 --seeds 1 --reference-spp 512 --report out";
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

/// A back end that is not there is a row of the table, not the end.
#[test]
fn back_ends_are_compared_side_by_side() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "bench backends cornell --backends cpu,gpu-bvh --adapter no-such-device --width 24 --height 16 \
                     --spp 4 --report out";
    let ran = succeed(folder.path(), arguments);
    assert!(ran.stdout.contains("Back ends") || ran.stdout.contains("back end"), "{}", ran.stdout);
    let text = std::fs::read_to_string(folder.path().join("out/backends.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let rows = json["tables"][0]["rows"].as_array().unwrap();
    assert_eq!((rows[0]["back end"].as_str(), rows[1]["back end"].as_str()), (Some("cpu"), Some("gpu-bvh")));
    assert_eq!((rows[0]["relMSE"].as_f64(), rows[0]["speed over first"].as_f64()), (Some(0.0), Some(1.0)));
    assert!(rows[0]["Mrays/s"].as_f64() > Some(0.0));
    assert!(rows[1]["device"].as_str().unwrap().contains("not there") && rows[1]["relMSE"].is_null());
    fail(folder.path(), "bench backends cornell --backends magic", "unknown back end `magic`");
}

/// Views a second, with what the host adds.
#[test]
fn batches_of_views_are_timed() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "bench batches cornell --width 8 --height 8 --views 9 --calls 2 --backend cpu \
                     --layers rgb,depth,instance --spp 1 --report out";
    let ran = succeed(folder.path(), arguments);
    assert!(ran.stdout.contains("Views a second"), "{}", ran.stdout);
    let text = std::fs::read_to_string(folder.path().join("out/batches.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let row = &json["tables"][0]["rows"][0];
    assert_eq!(row["scene"].as_str(), Some("cornell"));
    assert!(row["views/s"].as_f64() > Some(0.0) && row["Mrays/s"].as_f64() > Some(0.0), "{row}");
    // A processor has no clock of its own.
    assert!(row["device s"].is_null());
    fail(folder.path(), "bench batches cornell --layers colour", "unknown `colour`; there are: rgb");
}
