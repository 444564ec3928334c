//! `alhazen sensor` and `alhazen dataset`.

mod common;

use common::{fail, folder_with_triangle, names, succeed};

const POSES: &str = r#"{"width": 16, "height": 12, "matrix": [[16, 0, 7.5], [0, 16, 5.5], [0, 0, 1]],
    "poses": [[[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 3], [0, 0, 0, 1]]]}"#;

#[test]
fn a_scan_is_written_in_both_formats() {
    let folder = folder_with_triangle();
    // Three metres in front of the triangle, looking at it: the beam at 0° meets it, the one at 60° does not.
    let scan = "sensor lidar triangle.obj --position 0,0,3 --elevations 0,60 --azimuths 1";
    for file in ["scan.ply", "scan.npz"] {
        let ran = succeed(folder.path(), &format!("{scan} -o {file}"));
        assert!(ran.stderr.contains("1 of 2 beams came back"), "{ran:?}");
    }
    let ply = std::fs::read(folder.path().join("scan.ply")).unwrap();
    let header = b"end_header\n";
    let at = ply.windows(header.len()).position(|w| w == header).unwrap() + header.len();
    let x = f32::from_le_bytes(ply[at..at + 4].try_into().unwrap());
    assert!((x - 3.0).abs() < 1e-3, "the point is {x} m ahead");
}

#[test]
fn mistakes_are_errors_that_name_the_value() {
    let folder = folder_with_triangle();
    let lidar = "sensor lidar triangle.obj -o";
    fail(folder.path(), &format!("{lidar} scan.las"), "scan.las: unknown point cloud format");
    fail(folder.path(), &format!("{lidar} scan.ply --elevation -120..0"), "elevation");
    fail(folder.path(), &format!("{lidar} scan.ply --range 5..1"), "5..1");
    fail(folder.path(), &format!("{lidar} scan.ply --azimuth 0..720"), "more than a turn");
    fail(folder.path(), &format!("{lidar} scan.ply --pose 2,0,0,0,0,2,0,0,0,0,2,0"), "not a rotation");
    fail(folder.path(), "dataset triangle.obj --poses no.json -o out", "no.json");
    std::fs::write(folder.path().join("bad.json"), POSES.replace("\"poses\"", "\"pose\"")).unwrap();
    fail(folder.path(), "dataset triangle.obj --poses bad.json -o out", "unknown field `pose`");
}

#[test]
fn a_data_set_is_a_folder_of_pictures_layers_and_annotations() {
    let folder = folder_with_triangle();
    std::fs::write(folder.path().join("poses.json"), POSES).unwrap();
    let ran = succeed(
        folder.path(),
        "dataset triangle.obj --poses poses.json -o out --spp 2 --backend cpu --threads 1",
    );
    assert!(ran.stdout.contains("1 pictures with 1 annotations in out"), "{ran:?}");
    let out = folder.path().join("out");
    assert_eq!(names(&out), ["annotations.json"]);
    assert_eq!(names(&out.join("images")), ["000000.png"]);
    assert_eq!(names(&out.join("layers")), ["000000.exr"]);
    let exr = film::ExrFile::read(&out.join("layers/000000.exr")).unwrap();
    let depth = exr.layer("depth").unwrap();
    assert!((depth.pixel(8, 6)[0] - 3.0).abs() < 1e-4);
}
