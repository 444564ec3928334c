use super::*;
use crate::Aov;
use crate::{AovSample, NO_ID};

fn film() -> Film {
    let window = Rect { x: 3, y: 2, width: 21, height: 37 };
    let mut film = Film::with_window(40, 50, window, &Aov::ALL).unwrap();
    for y in 2..39 {
        for x in 3..24 {
            let v = (x * y) as f32;
            for sample in 0..2 {
                film.add(x, y, [v / 8.0, v + sample as f32, 0.25]);
            }
            let seen = AovSample { depth: 1.0 / v, material_id: x << 20 | 1, ..Default::default() };
            film.add_aovs(x, y, 0, &seen);
        }
    }
    film
}

#[test]
fn films_survive_with_every_layer_and_setting() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("film.exr");
    let film = film();
    let compressions = [ExrCompression::None, ExrCompression::Rle, ExrCompression::Zip, ExrCompression::Piz];
    for compression in compressions {
        let file = ExrFile::from_film(&film, Precision::Float)
            .with_metadata("spp", "2")
            .with_metadata("scene", "Çınar ☀ with a rather long name for a key");
        let mut file = file;
        file.attributes.insert("cryptomatte/f834d0a/name".into(), "crypto_object".into());
        file.write(&path, compression).unwrap();
        let mut back = ExrFile::read(&path).unwrap();
        back.channels.sort_by(|a, b| a.name.cmp(&b.name));
        file.channels.sort_by(|a, b| a.name.cmp(&b.name));
        assert!(back == file, "{compression:?}");
        assert_eq!(back.colour().unwrap(), film.to_image());
        // Opened as a picture, it is the whole, black where nothing is stored.
        let whole = Image::open(&path).unwrap();
        assert_eq!((whole.width(), whole.height()), (40, 50));
        assert_eq!(
            (whole.rgb(3, 2), whole.rgb(23, 38)),
            (film.to_image().rgb(0, 0), film.to_image().rgb(20, 36))
        );
        assert_eq!((whole.rgb(2, 2), whole.rgb(24, 38)), ([0.0; 3], [0.0; 3]));
    }
    let back = ExrFile::read(&path).unwrap();
    let Some(AovData::Float(depth)) = film.aov(Aov::Depth) else { panic!("no depth") };
    assert_eq!(back.layer("depth"), Some(depth));
    assert_eq!(back.layer("normal").unwrap().channels(), 3);
    assert_eq!(back.layer("nothing"), None);
    let ids = back.channels.iter().find(|c| c.name == "instance.I").unwrap();
    assert_eq!(ids.samples, ExrSamples::Uint(vec![NO_ID; 21 * 37]));
}

#[test]
fn cameras_survive() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("camera.exr");
    let matrix = |scale: f32| std::array::from_fn(|r| std::array::from_fn(|c| scale * (4 * r + c) as f32));
    let perspective = ExrCamera {
        world_to_camera: matrix(0.5),
        world_to_ndc: Some(matrix(-3.0)),
        screen_window: Some(([0.1, -0.2], 0.7)),
        focus: Some(2.5),
        panorama: false,
    };
    let panorama =
        ExrCamera { world_to_ndc: None, screen_window: None, focus: None, panorama: true, ..perspective };
    for camera in [Some(perspective), Some(panorama), None] {
        let mut file = ExrFile::from_image(&Image::black(2, 2, 3), Precision::Half);
        file.camera = camera;
        file.write(&path, ExrCompression::Zip).unwrap();
        assert_eq!(ExrFile::read(&path).unwrap().camera, camera);
    }
}

#[test]
fn half_is_clamped_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("half.exr");
    let image = Image::from_data(2, 1, 3, vec![1e9, 0.1, -1e9, 65504.0, 0.0, 1.0]).unwrap();
    ExrFile::from_image(&image, Precision::Half).write(&path, ExrCompression::Zip).unwrap();
    let back = ExrFile::read(&path).unwrap();
    assert_eq!(back.metadata["half-clamped"], "2");
    let colour = back.colour().unwrap();
    assert_eq!((colour.data()[0], colour.data()[2], colour.data()[3]), (65504.0, -65504.0, 65504.0));
    assert!((colour.data()[1] - 0.1).abs() < 1e-4);
}

#[test]
fn files_that_cannot_be_are_errors() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bad.exr");
    let good = ExrFile::from_image(&Image::black(4, 4, 3), Precision::Half);
    let refused = |change: &dyn Fn(&mut ExrFile)| {
        let mut file = good.clone();
        change(&mut file);
        matches!(file.write(&path, ExrCompression::Zip), Err(ImageError::Encode { .. }))
    };
    assert!(!refused(&|_| {}));
    assert!(refused(&|f| f.channels.clear()));
    assert!(refused(&|f| f.channels[1].name = "R".into()));
    assert!(refused(&|f| f.channels[1].name = String::new()));
    assert!(refused(&|f| f.channels[1].name = "x".repeat(300)));
    assert!(refused(&|f| f.channels[1].samples = ExrSamples::Uint(vec![0; 3])));
    assert!(refused(&|f| drop(f.metadata.insert("a\0b".into(), "c".into()))));
    assert!(refused(&|f| drop(f.attributes.insert("x".repeat(300), "c".into()))));
    assert!(refused(&|f| f.data_width = 0));
}

#[test]
fn colour_is_found_by_name() {
    let plane = |v: f32| ExrSamples::Float(vec![v; 4]);
    let with = |channels: &[(&str, f32)]| {
        let mut file = ExrFile::new(2, 2, Rect::full(2, 2));
        file.channels =
            channels.iter().map(|&(n, v)| ExrChannel { name: n.into(), samples: plane(v) }).collect();
        file.colour().map(|image| image.pixel(0, 0).to_vec())
    };
    assert_eq!(with(&[("B", 3.0), ("G", 2.0), ("R", 1.0)]), Some(vec![1.0, 2.0, 3.0]));
    let layered =
        [("albedo.R", 7.0), ("albedo.G", 7.0), ("albedo.B", 7.0), ("B", 3.0), ("G", 2.0), ("R", 1.0)];
    assert_eq!(with(&layered), Some(vec![1.0, 2.0, 3.0]));
    let blender = [
        ("View.Combined.A", 0.5),
        ("View.Combined.B", 3.0),
        ("View.Combined.G", 2.0),
        ("View.Combined.R", 1.0),
    ];
    assert_eq!(with(&blender), Some(vec![1.0, 2.0, 3.0, 0.5]));
    assert_eq!(with(&[("Y", 4.0)]), Some(vec![4.0; 3]));
    assert_eq!(with(&[("depth.Z", 4.0)]), None);
}

#[test]
fn huge_headers_are_refused_before_memory_is() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("huge.exr");
    ExrFile::from_image(&Image::black(5, 3, 3), Precision::Half).write(&path, ExrCompression::Zip).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let mut patch = |attribute: &str, offset: usize, values: &[i32]| {
        let found = bytes.windows(attribute.len()).position(|w| w == attribute.as_bytes());
        let start = found.unwrap() + attribute.len() + 4 + offset; // the value follows its length
        let values: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        bytes[start..start + values.len()].copy_from_slice(&values);
    };
    patch("dataWindow\0box2i\0", 8, &[59_999, 59_999]);
    patch("displayWindow\0box2i\0", 8, &[59_999, 59_999]);
    patch("chunkCount\0int\0", 0, &[60_000 / 16]);
    std::fs::write(&path, bytes).unwrap();
    let error = ExrFile::read(&path).unwrap_err();
    assert!(matches!(error, ImageError::TooLarge { width: 60_000, .. }), "{error}");
}
