//! OBJ and MTL files from the wild, and files made to break the loader.

mod common;

use common::{Limits, files, load_within, mesh, rgb, triangles};
use glam::{Vec2, Vec3, Vec4, vec2, vec3};
use proptest::prelude::*;
use scene::load::obj;
use scene::{AlphaMode, LoadError, LoadOptions, LoadReport, Loaded, Model, Pixels, Severity, Wrap};
use std::path::{Path, PathBuf};
use std::time::Duration;

fn load_shared(test: &str, path: &str) -> Option<Loaded> {
    let path = testkit::require_shared(test)?.join("scenes").join(path);
    Some(load_within(&path, Limits::default()).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
}

fn parse(text: &str) -> Loaded {
    obj::parse(text.as_bytes(), &LoadOptions::default()).unwrap()
}

fn notes(report: &LoadReport) -> Vec<&str> {
    report.notes.iter().map(|n| n.message.as_str()).collect()
}

/// Writes files into a temporary folder and loads the first.
fn load_files(files: &[(&str, &[u8])]) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }
    scene::load::load(&folder.path().join(files[0].0), &LoadOptions::default()).unwrap()
}

#[test]
fn every_shared_file_loads_or_says_why() {
    let Some(shared) = testkit::require_shared("every_shared_file_loads_or_says_why") else { return };
    let folders = [
        "torture_tinyobj",
        "torture_assimp_obj",
        "spaceship",
        "mesh_spot",
        "mesh_nefertiti",
        "mesh_koala",
        "cornell_box_obj",
    ];
    let mut count = 0;
    for file in folders.iter().flat_map(|f| files(&shared.join("scenes").join(f), "obj")) {
        let loaded =
            load_within(&file, Limits::default()).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        common::check(&loaded.scene);
        count += 1;
    }
    assert!(count >= 45, "only {count} files were found");
}

#[test]
fn spaceship_has_its_objects_and_materials() {
    let Some(loaded) = load_shared("spaceship_has_its_objects_and_materials", "spaceship/spaceship.obj")
    else {
        return;
    };
    let scene = &loaded.scene;
    assert_eq!(scene.unique_triangles(), 318_558);
    assert_eq!(scene.meshes.len(), 84);
    assert_eq!(scene.instances.len(), 84);
    assert_eq!(scene.meshes[0].name, "Mesh042");
    assert_eq!(notes(&loaded.report), [] as [&str; 0]);

    let find = |name: &str| scene.materials.iter().find(|m| m.name == name).unwrap();
    let glass = find("Glass");
    assert_eq!((glass.model, glass.ior, glass.roughness), (Model::Dielectric, 1.5, 0.01));
    assert_eq!(rgb(glass), vec3(0.7, 0.7, 0.7));
    assert_eq!((glass.alpha_mode, glass.base_color.w), (AlphaMode::Opaque, 1.0));
    for (name, color) in [
        ("RoughAluminium", [0.5, 0.54, 0.6]),
        ("RoughSteel", [0.5, 0.54, 0.6]),
        ("DarkPlastic", [0.35, 0.15, 0.15]),
        ("PinkLeather", [0.356, 0.113, 0.18]),
        ("Leather", [0.134, 0.114, 0.108]),
        ("RedLeather", [0.363, 0.23, 0.237]),
        ("BrightPinkLeather", [0.772, 0.175, 0.262]),
        ("DarkRubber", [0.1, 0.1, 0.1]),
        ("Black", [0.05, 0.05, 0.05]),
    ] {
        let material = find(name);
        // Its Ks is 0: nothing but diffuse reflection is left.
        assert_eq!((material.model, rgb(material)), (Model::Lambert, Vec3::from(color)), "{name}");
        assert_eq!((material.roughness, material.metallic), (1.0, 0.0), "{name}");
    }
    for mesh in scene.meshes.iter().flat_map(|m| &m.parts).map(mesh) {
        assert_eq!((mesh.normals.len(), mesh.uv0.len()), (mesh.positions.len(), mesh.positions.len()));
    }
}

/// Prints what `cargo test --release -p scene --test obj -- --ignored --nocapture spaceship_loads_quickly` is for.
#[test]
#[ignore = "measures time, which says little in a debug build or on a busy machine"]
fn spaceship_loads_quickly() {
    for _ in 0..3 {
        let Some(loaded) = load_shared("spaceship_loads_quickly", "spaceship/spaceship.obj") else { return };
        let vertices: usize =
            loaded.scene.meshes.iter().flat_map(|m| &m.parts).map(|p| mesh(p).positions.len()).sum();
        println!(
            "{} triangles, {vertices} vertices: {:?}",
            loaded.scene.unique_triangles(),
            loaded.report.elapsed
        );
        assert!(loaded.report.elapsed < Duration::from_secs(2));
    }
}

#[test]
fn counts_of_known_files() {
    for (path, triangle_count, mesh_count) in [
        ("mesh_nefertiti/nefertiti-lowres.obj", 70_000, 1),
        ("mesh_koala/koala.obj", 99_994, 1),
        ("mesh_spot/spot_control_mesh.obj", 372, 1),
        ("torture_tinyobj/cube.obj", 12, 6),
        ("torture_tinyobj/issue-235-usemtl-then-o.obj", 2, 2),
        ("torture_tinyobj/issue-140-zero-face-idx.obj", 1, 1),
        ("torture_tinyobj/invalid-face-definition.obj", 0, 0),
        ("torture_tinyobj/points-prim.obj", 0, 0),
        ("torture_assimp_obj/box.obj", 12, 1),
        ("torture_tinyobj/cornell_box.obj", 36, 8),
        ("cornell_box_obj/cornell_box.obj", 3_968, 5),
        ("torture_assimp_obj/testline.obj", 0, 0),
        ("torture_assimp_obj/number_formats.obj", 1, 1),
        ("torture_assimp_obj/spider.obj", 1_368, 19),
    ] {
        let Some(loaded) = load_shared("counts_of_known_files", path) else { return };
        let scene = &loaded.scene;
        assert_eq!((scene.unique_triangles(), scene.meshes.len()), (triangle_count, mesh_count), "{path}");
    }
}

#[test]
fn shared_files_with_known_values() {
    let test = "shared_files_with_known_values";
    let Some(numbers) = load_shared(test, "torture_assimp_obj/number_formats.obj") else { return };
    let positions = &mesh(&numbers.scene.meshes[0].parts[0]).positions;
    assert_eq!(positions[..], [vec3(0.0, 0.0, 0.0), vec3(1.0, 2.0, 3.0), vec3(-1.0, -2.0, -3.0)]);

    let colored = load_shared(test, "torture_assimp_obj/cube_with_vertexcolors.obj").unwrap();
    let colors = &mesh(&colored.scene.meshes[0].parts[0]).colors;
    // The first corner is position 1, (0.48627, 0.43137, 0.47059) in sRGB.
    assert!(colors[0].distance(Vec4::new(0.2016, 0.1559, 0.1878, 1.0)) < 1e-3, "{}", colors[0]);

    let spider = load_shared(test, "torture_assimp_obj/spider.obj").unwrap().scene;
    assert_eq!((spider.materials.len(), spider.images.len()), (4, 4));
    let skin = spider.materials.iter().find(|m| m.name == "Skin").unwrap();
    let texture = skin.base_color_texture.unwrap();
    let shown = spider.textures[texture.texture as usize].as_image().expect("an image");
    let image = &spider.images[shown.image as usize];
    assert_eq!((image.name.as_str(), image.width > 1), ("wal67ar_small.jpg", true));

    let smooth = load_shared(test, "torture_tinyobj/smoothing-normal.obj").unwrap();
    assert!(!mesh(&smooth.scene.meshes[0].parts[0]).normals.is_empty());

    let other_folder = load_shared(test, "torture_assimp_obj/mtl_different_folder.obj").unwrap();
    assert_eq!(rgb(&other_folder.scene.materials[0]), Vec3::ONE.min(vec3(0.141176, 0.184314, 0.411765)));
    assert!(notes(&other_folder.report)[0].contains("image.jpg"));

    let concave = load_shared(test, "torture_assimp_obj/concave_polygon.obj").unwrap();
    assert_eq!(notes(&concave.report), [] as [&str; 0]);

    let cornell = load_shared(test, "torture_tinyobj/cornell_box.obj").unwrap();
    let light = cornell.scene.materials.iter().find(|m| m.name == "light").unwrap();
    assert_eq!(light.emission, Vec3::splat(20.0));
}

#[test]
fn negative_indices_line_continuations_and_odd_spacing() {
    let plain = parse("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3");
    let odd = parse(
        "\u{feff}v 0 0 0\r\n  v\t1  0 \\\r\n 0\r\nv 0 1 0 # up\r\nvt 0 0\r\nvt 1\r\nvt 0 1\r\nf -3/-3 \\\n -2/-2\t-1/-1/  ",
    );
    let old_mac = parse("v 0 0 0\rv 1 0 0\rv 0 1 0\rvt 0 0\rvt 1 0\rvt 0 1\rf 1/1 2/2 3/3");
    for loaded in [&plain, &odd, &old_mac] {
        let part = mesh(&loaded.scene.meshes[0].parts[0]);
        assert_eq!(part.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
        assert_eq!(part.uv0, [vec2(0.0, 1.0), Vec2::ONE, Vec2::ZERO], "v points up in the file");
        assert_eq!(part.indices, [[0, 1, 2]]);
    }
}

#[test]
fn concave_polygons_keep_their_area_and_winding() {
    let loaded = parse("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\nf 5 4 3 2 1\n");
    let areas: Vec<f32> =
        triangles(&loaded.scene).iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).z * 0.5).collect();
    assert_eq!(areas.len(), 6);
    assert_eq!(areas.iter().sum::<f32>(), 0.0);
    assert_eq!(areas.iter().map(|a| a.abs()).sum::<f32>(), 20.0);
}

#[test]
fn objects_groups_and_materials_make_meshes_and_parts() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let groups = parse(&format!(
        "{text}f 1 2 3\ng left wing\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\ng tail\nf 1 2 3\ng left wing\nusemtl a\nf 1 2 3"
    ));
    let names: Vec<_> = groups.scene.meshes.iter().map(|m| (m.name.as_str(), m.parts.len())).collect();
    assert_eq!(names, [("memory", 1), ("left wing", 2), ("tail", 1)]);
    assert_eq!(mesh(&groups.scene.meshes[1].parts[0]).indices.len(), 2);
    assert_eq!(groups.scene.instances[2].name, "tail");
    let materials: Vec<_> = groups.scene.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(materials, ["default", "a", "b"]);

    let objects = parse(&format!("{text}usemtl a\no x\ng p\nf 1 2 3\ng q\nf 1 2 3\no y\nf 1 2 3"));
    let names: Vec<_> = objects.scene.meshes.iter().map(|m| (m.name.as_str(), m.parts.len())).collect();
    assert_eq!(names, [("x", 1), ("y", 1)]);
}

#[test]
fn bad_indices_are_left_out_and_reported() {
    let loaded = parse("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\nf 0 1 2\nf -4 1 2\nf 1//1 2/7 3\nf 1 2");
    assert_eq!(loaded.scene.unique_triangles(), 1);
    let expected = [
        "a face has fewer than three corners",
        "3 faces refer to positions that do not exist",
        "2 corners refer to normals or texture coordinates that do not exist",
    ];
    assert!(expected.iter().all(|e| notes(&loaded.report).contains(e)), "{:?}", loaded.report);
}

#[test]
fn smoothing_groups_decide_where_there_are_some() {
    // A roof of 90°.
    let text = "v 0 1 0\nv 0 1 1\nv 1 0 0\nv -1 0 0\n";
    for (statements, smooth) in [("", false), ("s 1\n", true), ("s off\n", false)] {
        let loaded = parse(&format!("{text}{statements}f 1 2 3\nf 2 1 4"));
        let part = mesh(&loaded.scene.meshes[0].parts[0]);
        let is_smooth = part.normals.first().is_some_and(|n| n.distance(Vec3::Y) < 1e-6);
        assert_eq!(is_smooth, smooth, "{statements}");
    }
}

fn png(width: u32, pixels: &[[u8; 4]]) -> Vec<u8> {
    let image = image::RgbaImage::from_raw(width, pixels.len() as u32 / width, pixels.concat()).unwrap();
    let mut bytes = Vec::new();
    image.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
    bytes
}

#[test]
fn textures_are_found_packed_and_placed() {
    let leaf = png(2, &[[10, 200, 10, 255], [10, 100, 10, 255]]);
    let mask = png(2, &[[255, 255, 255, 255], [0, 0, 0, 255]]);
    let rough = png(1, &[[64, 64, 64, 255]]);
    let loaded = load_files(&[
        ("m.obj", b"mtllib sub dir\\my lib.mtl other.mtl\nusemtl leaf\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1"),
        ("sub dir/my lib.mtl", b"newmtl leaf\nmap_Kd -s 2 2 1 -o 0.25 0 -clamp on Leaf 1.PNG\nmap_d mask.png\nPr 0.5\nmap_Pr rough.png\nPm 0\nmap_Ke nowhere.png"),
        ("sub dir/leaf 1.png", &leaf),
        ("mask.png", &mask),
        ("sub dir/rough.png", &rough),
    ]);
    let scene = &loaded.scene;
    let material = &scene.materials[0];
    assert_eq!((material.alpha_mode, material.roughness), (AlphaMode::Mask(0.5), 0.5));
    let color = material.base_color_texture.unwrap();
    assert_eq!(color.transform.rows, [vec2(2.0, 0.0), vec2(0.0, 2.0)]);
    assert_eq!(color.transform.offset, vec2(0.25, -1.0));
    let texture = scene.textures[color.texture as usize].as_image().expect("an image");
    assert_eq!(texture.sampler.wrap_u, Wrap::ClampToEdge);
    let Pixels::Rgba8(pixels) = &scene.images[texture.image as usize].pixels else {
        panic!("not eight bits")
    };
    assert_eq!(pixels[..], [[10, 200, 10, 255], [10, 100, 10, 0]]);
    let packed = &scene.textures[material.metallic_roughness_texture.unwrap().texture as usize];
    let packed = packed.as_image().expect("an image");
    let Pixels::Rgba8(pixels) = &scene.images[packed.image as usize].pixels else { panic!("not eight bits") };
    assert_eq!(pixels[..], [[255, 64, 255, 255]]);
    let missing = loaded.report.notes.iter().find(|n| n.message.contains("nowhere.png")).unwrap();
    assert_eq!(missing.severity, Severity::Repaired);
    assert!(notes(&loaded.report).contains(&"material library other.mtl does not exist"));
}

#[test]
fn what_is_no_obj_file_is_an_error() {
    for bytes in [&b""[..], b"\0\0\0\0", b"<html>", b"# nothing"] {
        let error = obj::parse(bytes, &LoadOptions::default()).unwrap_err();
        assert!(matches!(error, LoadError::Malformed { .. }), "{error}");
    }
    let error = obj::load(Path::new("/nonexistent/a.obj"), &LoadOptions::default()).unwrap_err();
    assert!(matches!(error, LoadError::Read { .. }));
}

#[test]
fn hostile_files_take_bounded_time() {
    let many = |line: fn(usize) -> String, count: usize| (0..count).map(line).collect::<String>();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let spread =
        format!("{}{}", "v 0 0 0\n".repeat(50_000), many(|i| format!("g {i}\nf 1 25000 50000\n"), 20_000));
    let variants = format!(
        "{triangle}{}{}",
        "vt 0 0\n".repeat(50_000),
        many(|i| format!("f 1/{i} 2/{i} 3/{i}\n"), 50_000)
    );
    let materials =
        format!("{triangle}{}", many(|i| format!("mtllib {i}.mtl {i}\nusemtl {i}\nf 1 2 3\n"), 20_000));
    let polygon = format!("{triangle}f{}\n", " 1 2 3".repeat(200_000));
    let words = format!("{triangle}mtllib{}\nf 1 2 3\n", " a".repeat(500_000));
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("spread", spread),
        ("variants", variants),
        ("materials", materials),
        ("polygon", polygon),
        ("words", words),
    ] {
        let path: PathBuf = folder.path().join(format!("{name}.obj"));
        std::fs::write(&path, text).unwrap();
        let loaded = load_within(&path, Limits { seconds: 20 }).unwrap();
        assert!(loaded.scene.unique_triangles() > 0, "{name}");
    }
}

/// Lines that a generator for OBJ files picks from.
fn line() -> impl Strategy<Value = String> {
    let index =
        prop_oneof!["[1-9]", "-[1-9]", "0", "[1-9]/[1-9]", "-1//[1-9]", "[1-9]/[1-9]/-[1-9]", "[0-9/-]{0,6}"];
    prop_oneof![
        4 => prop::collection::vec(prop::num::f32::ANY, 0..8).prop_map(|n| {
            format!("v {}", n.iter().map(f32::to_string).collect::<Vec<_>>().join(" "))
        }),
        2 => "vt [0-9.e-]{0,4} [0-9.]{1,3}",
        2 => "vn [0-9.-]{1,4} [0-9.]{1,3} [01]",
        6 => prop::collection::vec(index, 0..9).prop_map(|i| format!("f {}", i.join(" "))),
        1 => "(o|g|usemtl|s|mtllib|p|l|vp|#|\\\\) [a-c0-2 ]{0,3}",
        1 => "[ -~\\t\\r\\\\]{0,20}",
    ]
}

proptest! {
    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = obj::parse(&bytes, &LoadOptions::default());
        let _ = obj::mtl::parse(&bytes, &mut LoadReport::default());
    }

    #[test]
    fn almost_valid_files_give_valid_scenes(lines in prop::collection::vec(line(), 0..60), crease in -1.0f32..4.0) {
        let options = LoadOptions { crease_angle: crease, ..Default::default() };
        if let Ok(loaded) = obj::parse(lines.join("\n").as_bytes(), &options) {
            common::check(&loaded.scene);
        }
    }

    #[test]
    fn damaged_files_never_panic(at in 0usize..100_000, bytes in prop::collection::vec(any::<u8>(), 1..4), which in 0usize..2) {
        let Some(shared) = testkit::shared_dir() else { return Ok(()) };
        let file = ["scenes/torture_tinyobj/cornell_box.obj", "scenes/torture_assimp_obj/cube_usemtl.obj"][which];
        let mut content = std::fs::read(shared.join(file)).unwrap();
        let at = at % content.len();
        let end = (at + bytes.len()).min(content.len());
        content.splice(at..end, bytes);
        if let Ok(loaded) = obj::parse(&content, &LoadOptions::default()) {
            common::check(&loaded.scene);
        }
    }

    #[test]
    fn damaged_materials_never_panic(at in 0usize..100_000, bytes in prop::collection::vec(any::<u8>(), 1..4)) {
        let text = b"newmtl a\nKd 0.1 0.2 0.3\nmap_Kd -s 1 2 3 -bm 2 a b.png\nillum 7\nTf 1 1 1\nd -halo 0.5\nKs spectral x\nKe xyz 1 1 1\n";
        let mut content = text.to_vec();
        let at = at % content.len();
        let end = (at + bytes.len()).min(content.len());
        content.splice(at..end, bytes);
        let mut report = LoadReport::default();
        for mtl in obj::mtl::parse(&content, &mut report) {
            let material = obj::interpret(&mtl, &mut report);
            prop_assert!(material.base_color.is_finite() && material.emission.is_finite());
            prop_assert!(material.base_color.min_element() >= 0.0 && material.base_color.max_element() <= 1.0);
        }
    }
}

#[test]
fn comments_behind_names_lose_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    let picture = image::RgbImage::from_pixel(2, 2, image::Rgb([200, 0, 0]));
    for name in ["t.png", "t #1.png", "t#2.png"] {
        picture.save(folder.path().join(name)).expect("a picture");
    }
    write(
        "a.mtl",
        "newmtl red # the first\nKd 1 0 0 # x\nmap_Kd t.png # x\nnewmtl blue #1\nKd 0 0 1\nmap_Kd t #1.png\n\
                    newmtl blue #2\nKd 0 1 0\nmap_Kd t#2.png -s 2 2 2 # x\n",
    );
    write(
        "a.obj",
        "mtllib a.mtl # materials\nv -1 -1 0 # vertex 12 of 99\nv 1 -1 0 # right\nv 1 1 0#\nvt 0 0 # 1\nvt 1 0\nvt 1 1\n\
         usemtl red # x\nf 1/1 2/2 3/3\nusemtl blue #1\nf 1/1 2/2 3/3\nusemtl blue #2\nf 1/1 2/2 3/3\n",
    );
    let loaded = obj::load(&folder.path().join("a.obj"), &LoadOptions::default()).expect("sound");
    assert!(loaded.report.notes.is_empty(), "{:?}", loaded.report);
    let colors: Vec<_> = loaded.scene.materials.iter().map(|m| m.base_color.truncate().to_array()).collect();
    assert_eq!(colors, [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]);
    assert!(loaded.scene.materials.iter().all(|m| m.base_color_texture.is_some()));
    let scaled = loaded.scene.materials[2].base_color_texture.expect("a texture").transform;
    assert_eq!(scaled.rows[0].x, 2.0);
}

#[test]
fn normals_against_the_winding_are_turned_and_reported() {
    for (normal, turned) in [("0 0 1", false), ("0 0 -1", true)] {
        let text = format!("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn {normal}\nf 1//1 2//1 3//1 4//1\n");
        let loaded = parse(&text);
        let mesh = mesh(&loaded.scene.meshes[0].parts[0]);
        assert!(mesh.normals.iter().all(|n| *n == Vec3::Z));
        assert_eq!(loaded.report.notes.iter().any(|n| n.message.contains("oppose the winding")), turned);
    }
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 -1\nf 1//1 2//1 3//1\n";
    let options = LoadOptions { keep_normals: true, ..LoadOptions::default() };
    let kept = obj::parse(text.as_bytes(), &options).expect("sound");
    assert_eq!(mesh(&kept.scene.meshes[0].parts[0]).normals[0], -Vec3::Z);
    assert!(kept.report.notes.iter().any(|n| n.message.contains("kept as they are")), "{:?}", kept.report);
}
