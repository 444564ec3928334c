//! The glTF loader on real assets: counts of the table in the data's README, and features one by one.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod gltf_support;

use gltf_support::{assert_sound, gltf_files, load};
use scene::load::gltf::load_bytes;
use scene::{
    AlphaMode, Environment, Filter, LightKind, LoadError, LoadOptions, Loaded, Model, Projection, Severity,
    Shape, TriangleMesh, Wrap,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The folder of the scenes, or `None` where the data is missing and the test may be skipped.
fn scenes(test: &str) -> Option<PathBuf> {
    Some(testkit::require_shared(test)?.join("scenes"))
}

fn load_ok(path: &Path) -> Loaded {
    let loaded = load(path, false).unwrap_or_else(|error| panic!("{error}"));
    assert_sound(&path.display().to_string(), &loaded);
    loaded
}

fn triangles(loaded: &Loaded, mesh: usize, part: usize) -> &TriangleMesh {
    match &loaded.scene.meshes[mesh].parts[part].shape {
        Shape::Triangles(mesh) => mesh,
        Shape::Spheres(_) => panic!("glTF has no spheres"),
    }
}

fn has_note(loaded: &Loaded, severity: Severity, text: &str) -> bool {
    loaded.report.notes.iter().any(|n| n.severity == severity && n.message.contains(text))
}

/// Unique and instanced triangles of each asset, from the tables of the data's README.
fn expected_counts(readme: &str) -> BTreeMap<String, (u64, u64)> {
    let number = |text: &str| text.replace(',', "").parse::<u64>().ok();
    let row = |line: &str| {
        let mut cells = line.split('|').map(str::trim).skip(1);
        let (name, format, count) = (cells.next()?, cells.next()?, cells.next()?);
        let (unique, instanced) = match count.split_once(" (") {
            Some((unique, rest)) => (number(unique)?, number(rest.strip_suffix(" instanced)")?)?),
            None => (number(count)?, number(count)?),
        };
        (format == "glTF" || format == "GLB").then(|| (name.to_owned(), (unique, instanced)))
    };
    readme.lines().filter_map(row).collect()
}

/// Files that are meant to be refused.
const REFUSED: [&str; 1] = ["ACMEBox.gltf"];

#[test]
fn all_assets_load_with_the_expected_numbers_of_triangles() {
    let Some(scenes) = scenes("all_assets_load_with_the_expected_numbers_of_triangles") else { return };
    let counts = expected_counts(&std::fs::read_to_string(scenes.join("README.md")).unwrap());
    assert!(counts.len() > 55, "only {} rows of the table were understood", counts.len());
    let mut loaded_assets = 0;
    for (name, (unique, instanced)) in &counts {
        for path in gltf_files(&scenes.join(name)) {
            if REFUSED.iter().any(|end| path.ends_with(end)) {
                let error = load(&path, false).unwrap_err();
                assert!(
                    matches!(
                        error,
                        LoadError::UnsupportedExtension { .. } | LoadError::UnknownExtension { .. }
                    ),
                    "{error}"
                );
                continue;
            }
            let scene = load_ok(&path).scene;
            assert_eq!(scene.unique_triangles() as u64, *unique, "{}", path.display());
            assert_eq!(scene.instanced_triangles(), *instanced, "{}", path.display());
            loaded_assets += 1;
        }
    }
    assert!(loaded_assets > 55, "only {loaded_assets} assets were loaded");
}

#[test]
fn no_file_of_the_data_is_forgotten() {
    let Some(scenes) = scenes("no_file_of_the_data_is_forgotten") else { return };
    let counts = expected_counts(&std::fs::read_to_string(scenes.join("README.md")).unwrap());
    for path in gltf_files(&scenes) {
        let folder = path.strip_prefix(&scenes).unwrap().components().next().unwrap();
        let folder = folder.as_os_str().to_str().unwrap();
        if counts.contains_key(folder) || folder == "torture_gltf_validator" {
            continue; // covered by the test above and by tests/gltf_torture.rs
        }
        if let Ok(loaded) = load(&path, false) {
            assert_sound(&path.display().to_string(), &loaded);
        }
    }
}

#[test]
fn unknown_required_extensions_are_refused_or_noted() {
    let Some(scenes) = scenes("unknown_required_extensions_are_refused_or_noted") else { return };
    let path = scenes.join("gt_ACMEBox/ACMEBox.gltf");
    match load(&path, false) {
        Err(LoadError::UnknownExtension { extension, .. }) => assert_eq!(extension, "ACME_gizmo"),
        other => panic!("{other:?}"),
    }
    let loaded = load(&path, true).unwrap();
    assert_eq!(loaded.scene.unique_triangles(), 12);
    assert!(has_note(&loaded, Severity::Ignored, "ACME_gizmo"), "{:?}", loaded.report);
}

/// The surface of an axis-parallel box: every vertex is a corner, every normal points out, and the areas of the triangles
/// add up.
fn assert_is_box(loaded: &Loaded, what: &str) {
    let (low, high) = loaded.scene.meshes[0].bounds().unwrap();
    let mesh = triangles(loaded, 0, 0);
    let size = high - low;
    let mut area = 0.0;
    for triangle in &mesh.indices {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
        let normal = (b - a).cross(c - a);
        area += 0.5 * normal.length();
        for i in triangle.map(|i| i as usize) {
            let corner = (mesh.positions[i] - low) / size;
            assert!((corner - corner.round()).length() < 1e-2, "{what}: {corner} is no corner");
            assert!(mesh.normals[i].dot(normal.normalize()) > 0.99, "{what}: {:?}", mesh.normals[i]);
        }
    }
    let expected = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
    assert!((area / expected - 1.0).abs() < 1e-2, "{what}: {area} m² for {expected} m²");
}

#[test]
fn compressed_boxes_are_boxes() {
    let Some(scenes) = scenes("compressed_boxes_are_boxes") else { return };
    for file in ["gt_BoxMeshopt/BoxMeshopt.glb", "gt_BoxDraco/BoxDraco.gltf"] {
        assert_is_box(&load_ok(&scenes.join(file)), file);
    }
}

/// Area of all triangles in the world, and their mean centre weighted by it.
fn area_and_centre(loaded: &Loaded) -> (f64, glam::DVec3) {
    let (mut area, mut centre) = (0.0, glam::DVec3::ZERO);
    for instance in &loaded.scene.instances {
        for part in &loaded.scene.meshes[instance.mesh as usize].parts {
            let Shape::Triangles(mesh) = &part.shape else { continue };
            for triangle in &mesh.indices {
                let corner =
                    |i: u32| instance.transform.transform_point3(mesh.positions[i as usize]).as_dvec3();
                let [a, b, c] = triangle.map(corner);
                let own = 0.5 * (b - a).cross(c - a).length();
                area += own;
                centre += own * (a + b + c) / 3.0;
            }
        }
    }
    (area, centre / area)
}

#[test]
fn compressed_scenes_are_their_plain_copies() {
    let Some(scenes) = scenes("compressed_scenes_are_their_plain_copies") else { return };
    for (compressed, plain) in [
        ("chess_board/chess-board.glb", "chess_board/chess_board.glb"),
        ("dream_apartment/dream-apartment.glb", "dream_apartment/dream_apartment.glb"),
        ("hotel_room/scene.glb", "hotel_room/hotel_room.glb"),
    ] {
        let [a, b] = [compressed, plain].map(|file| load_ok(&scenes.join(file)));
        let ((area, centre), (expected, at)) = (area_and_centre(&a), area_and_centre(&b));
        let size = expected.sqrt();
        assert!((area / expected - 1.0).abs() < 2e-3, "{compressed}: {area} m² for {expected} m²");
        assert!((centre - at).length() < 2e-3 * size, "{compressed}: around {centre} instead of {at}");
        assert_eq!(a.scene.unique_triangles(), b.scene.unique_triangles(), "{compressed}");
        assert_eq!(a.scene.materials.len(), b.scene.materials.len(), "{compressed}");
    }
}

/// One wrong byte in compressed data is an error or another mesh, never a panic or a long wait.
#[test]
fn broken_compressed_data_ends() {
    let Some(scenes) = scenes("broken_compressed_data_ends") else { return };
    let gltf = std::fs::read_to_string(scenes.join("gt_BoxDraco/BoxDraco.gltf")).unwrap();
    let data = std::fs::read(scenes.join("gt_BoxDraco/0.bin")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("broken.gltf");
    std::fs::write(&path, gltf).unwrap();
    let mut refused = 0;
    for at in 0..data.len() {
        for flip in [0x01, 0x80, 0xff] {
            let mut broken = data.clone();
            broken[at] ^= flip;
            std::fs::write(folder.path().join("0.bin"), broken).unwrap();
            refused += usize::from(load(&path, false).is_err());
        }
    }
    assert!(refused > data.len(), "only {refused} of {} broken files were refused", data.len() * 3);
}

#[test]
fn texture_transforms_are_read() {
    let Some(scenes) = scenes("texture_transforms_are_read") else { return };
    let loaded = load_ok(&scenes.join("khr_TextureTransformTest/TextureTransformTest.gltf"));
    let transform = |name: &str| {
        let material = loaded.scene.materials.iter().find(|m| m.name == name).unwrap();
        material.base_color_texture.unwrap().transform
    };
    assert_eq!(transform("Offset UV").offset, glam::vec2(0.5, 0.5));
    assert_eq!(transform("Scale").rows, [glam::vec2(1.5, 0.0), glam::vec2(0.0, 1.5)]);
    let (sin, cos) = std::f32::consts::FRAC_PI_8.sin_cos();
    assert_eq!(transform("Rotation").rows, [glam::vec2(cos, sin), glam::vec2(-sin, cos)]);
    let floor = load_ok(&scenes.join("kajiya_floor/scene.gltf")).scene;
    let tiled = floor.materials[0].metallic_roughness_texture.unwrap().transform;
    assert_eq!((tiled.rows[0].x, tiled.offset), (24.0, glam::vec2(0.0, -23.0)));
}

#[test]
fn gpu_instances_share_one_mesh() {
    let Some(scenes) = scenes("gpu_instances_share_one_mesh") else { return };
    let simple = load_ok(&scenes.join("khr_SimpleInstancing/simple-instancing.glb")).scene;
    assert_eq!((simple.meshes.len(), simple.instances.len()), (1, 125));
    // Every attribute is a rising lattice: the last instance is at its far corner, twice as large.
    let last = simple.instances.last().unwrap().transform;
    assert!((last.translation - glam::Vec3A::splat(10.0)).length() < 1e-4, "{last:?}");
    assert!((last.matrix3.determinant() - 8.0).abs() < 1e-3, "{last:?}");
    let many = load_ok(&scenes.join("sg_InstanceTest/InstanceTest.glb")).scene;
    assert_eq!((many.meshes.len(), many.instances.len()), (1, 2500));
}

#[test]
fn alpha_modes_normal_maps_and_supplied_tangents_are_read() {
    let Some(scenes) = scenes("alpha_modes_normal_maps_and_supplied_tangents_are_read") else { return };
    let loaded = load_ok(&scenes.join("khr_AlphaBlendModeTest/AlphaBlendModeTest.gltf"));
    let material = |name: &str| loaded.scene.materials.iter().find(|m| m.name == name).unwrap();
    assert_eq!(material("MatBlend").alpha_mode, AlphaMode::Blend);
    assert_eq!(material("MatCutoff25").alpha_mode, AlphaMode::Mask(0.25));
    assert_eq!(material("MatCutoffDefault").alpha_mode, AlphaMode::Mask(0.5));
    assert_eq!(material("MatOpaque").alpha_mode, AlphaMode::Opaque);
    assert!(material("MatBlend").double_sided && !material("MatBed").double_sided);
    let bed = material("MatBed");
    assert_eq!((bed.metallic, bed.roughness), (1.0, 1.0));
    let texture = |reference: Option<scene::TextureRef>| {
        let texture = &loaded.scene.textures[reference.unwrap().texture as usize];
        texture.as_image().expect("an image").color_space
    };
    assert_eq!(texture(bed.base_color_texture), scene::ColorSpace::Srgb);
    assert_eq!(texture(bed.normal_texture), scene::ColorSpace::Linear);
    assert_eq!(texture(bed.metallic_roughness_texture), scene::ColorSpace::Linear);
    let parts = loaded.scene.meshes.iter().flat_map(|m| &m.parts);
    for part in parts {
        let Shape::Triangles(mesh) = &part.shape else { continue };
        let mapped = loaded.scene.materials[part.material as usize].normal_texture.is_some();
        assert_eq!(mapped, !mesh.tangents.is_empty());
    }
}

#[test]
fn samplers_are_read() {
    let Some(scenes) = scenes("samplers_are_read") else { return };
    let scene = load_ok(&scenes.join("khr_TextureSettingsTest/TextureSettingsTest.gltf")).scene;
    let samplers: Vec<_> = scene.textures.iter().filter_map(|t| t.as_image()).map(|t| t.sampler).collect();
    for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
        assert!(samplers.iter().any(|s| s.wrap_u == wrap), "no sampler has {wrap:?} along u");
        assert!(samplers.iter().any(|s| s.wrap_v == wrap), "no sampler has {wrap:?} along v");
    }
    assert!(samplers.iter().all(|s| s.filter == Filter::Linear));
    let nearest = load_ok(&scenes.join("viva_balloon/scene.gltf")).scene;
    assert!(
        nearest.textures.iter().filter_map(|t| t.as_image()).any(|t| t.sampler.filter == Filter::Nearest)
    );
}

#[test]
fn cameras_and_lights_are_placed() {
    let Some(scenes) = scenes("cameras_and_lights_are_placed") else { return };
    let scene = load_ok(&scenes.join("pc_geometry_camera_light/geometry-camera-light.glb")).scene;
    let names: Vec<_> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["CameraPersp", "CameraOrtho"]);
    let camera = &scene.cameras[0];
    assert!((camera.eye - glam::vec3(4.559_937, -7.584_074, 4.958_309)).length() < 1e-5);
    assert!(
        matches!(camera.projection, Projection::Perspective { fov_y } if (fov_y - 0.399_596_5).abs() < 1e-6)
    );
    assert_eq!(camera.aspect, Some(16.0 / 9.0));
    // The scene's middle is in the picture, and up is up (the file's +Z).
    let forward = (camera.target - camera.eye).normalize();
    assert!(forward.dot(-camera.eye.normalize()) > 0.98 && camera.up.z > 0.5, "{camera:?}");
    assert_eq!(scene.cameras[1].projection, Projection::Orthographic { height: 27.0 });

    let [point, spot] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
    let LightKind::Point { position, intensity } = point.kind else { panic!("{point:?}") };
    assert!((position - glam::vec3(4.076_245, 1.005_454, 5.903_862)).length() < 1e-5);
    assert!((intensity - glam::vec3(339.911_84, 627.417_4, 1000.0)).length() < 1e-2);
    let LightKind::Spot { direction, inner_angle, outer_angle, .. } = spot.kind else { panic!("{spot:?}") };
    assert!((direction.length() - 1.0).abs() < 1e-5 && direction.z < -0.8, "{direction}");
    assert!((inner_angle - 0.556_323_7).abs() < 1e-6 && (outer_angle - 0.654_498_5).abs() < 1e-6);

    let cubes = load_ok(&scenes.join("bevy_cubes_lights/Cubes.glb")).scene;
    let [light] = &cubes.lights[..] else { panic!("{:?}", cubes.lights) };
    assert!(
        matches!(light.kind, LightKind::Point { intensity, .. } if (intensity.x - 79.577_47).abs() < 1e-3),
        "{light:?}"
    );
}

#[test]
fn emission_is_factor_times_strength() {
    let Some(scenes) = scenes("emission_is_factor_times_strength") else { return };
    let scene = load_ok(&scenes.join("cornell_box_gltf/CornellBox.glb")).scene;
    let light = scene.materials.iter().find(|m| m.is_emissive()).unwrap();
    assert!((light.emission - glam::Vec3::splat(100.0)).length() < 1e-3, "{light:?}");
    let strengths = load_ok(&scenes.join("bio_14_emission_strength/14_emission_strength.gltf")).scene;
    let strong = strengths.materials.iter().find(|m| m.name == "pbrEmissiveStrength").unwrap();
    assert!((strong.emission - glam::vec3(4.5, 4.0, 3.5)).length() < 1e-5, "{strong:?}");
}

#[test]
fn material_extensions_choose_the_model() {
    let Some(scenes) = scenes("material_extensions_choose_the_model") else { return };
    let unlit = load_ok(&scenes.join("khr_UnlitTest/UnlitTest.gltf")).scene;
    assert!(unlit.materials.iter().all(|m| m.model == Model::Unlit));
    let iors = load_ok(&scenes.join("bio_17_ior/17_ior.gltf")).scene;
    assert!(iors.materials.iter().any(|m| m.ior == 2.0 && m.transmission == 0.5 && m.thin_walled));
    let glass = load_ok(&scenes.join("khr_TransmissionRoughnessTest/TransmissionRoughnessTest.glb"));
    let dielectrics = glass.scene.materials.iter().filter(|m| m.model == Model::Dielectric);
    assert!(dielectrics.clone().count() >= 5 && dielectrics.clone().all(|m| !m.thin_walled));
    let variants = load_ok(&scenes.join("bio_18_variants/18_variants.gltf")).scene;
    let names: Vec<_> = variants.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["Blue", "Green", "White"]);
}

#[test]
fn skins_stand_in_the_pose_of_their_nodes() {
    let Some(scenes) = scenes("skins_stand_in_the_pose_of_their_nodes") else { return };
    let simple = load_ok(&scenes.join("khr_SimpleSkin/SimpleSkin.gltf"));
    let (low, high) = simple.scene.bounds().unwrap();
    // The nodes are in the bind pose: a strip one wide and two high.
    assert!((low - glam::vec3(-0.5, 0.0, 0.0)).length() < 1e-5, "{low}");
    assert!((high - glam::vec3(0.5, 2.0, 0.0)).length() < 1e-5, "{high}");
    assert!(has_note(&simple, Severity::Info, "can be played"), "{:?}", simple.report);
    // The figure lies along z in its own space; the skeleton's root stands it up, about 1.5 m tall.
    let (low, high) = load_ok(&scenes.join("khr_RiggedFigure/RiggedFigure.gltf")).scene.bounds().unwrap();
    let size = high - low;
    assert!((1.3..1.7).contains(&size.y) && size.y > size.x && size.x > size.z, "{size}");
}

#[test]
fn non_ascii_names_and_percent_encoded_uris_are_found() {
    let Some(scenes) = scenes("non_ascii_names_and_percent_encoded_uris_are_found") else { return };
    let [path] = &gltf_files(&scenes.join("gt_UnicodeTest"))[..] else { panic!("one file") };
    let loaded = load_ok(path);
    assert_eq!(loaded.scene.meshes[0].name, "Unicode❤♻Mesh");
    assert!(loaded.scene.images[0].width > 1 && loaded.report.notes.is_empty(), "{:?}", loaded.report);
}

#[test]
fn vertex_colours_and_flat_shading() {
    let Some(scenes) = scenes("vertex_colours_and_flat_shading") else { return };
    let colours = load_ok(&scenes.join("bio_22_vertex_color/22_vertex_color.gltf"));
    assert!(triangles(&colours, 0, 0).colors.iter().all(|c| c.max_element() <= 1.0));
    assert!(has_note(&colours, Severity::Ignored, "primitives are not drawn"));
    assert!(colours.report.undrawn_primitives > 0);
    // No normals in the file: the triangles are flat.
    assert!(triangles(&load_ok(&scenes.join("khr_Fox/Fox.glb")), 0, 0).normals.is_empty());
}

/// Tangents that an asset brings along were made by the same algorithm: ours must agree.
#[test]
fn computed_tangents_match_supplied_ones() {
    let Some(scenes) = scenes("computed_tangents_match_supplied_ones") else { return };
    let loaded = load_ok(&scenes.join("khr_FlightHelmet/FlightHelmet.gltf"));
    let (mut same, mut total) = (0usize, 0usize);
    for index in 0..loaded.scene.meshes.len() {
        let supplied = triangles(&loaded, index, 0);
        let mut computed = supplied.clone();
        computed.tangents.clear();
        scene::tangents::generate(&mut computed, 0);
        for (a, b) in supplied.indices.as_flattened().iter().zip(computed.indices.as_flattened()) {
            let (a, b) = (supplied.tangents[*a as usize], computed.tangents[*b as usize]);
            same += usize::from(a.w == b.w && a.truncate().dot(b.truncate()) > 0.98);
            total += 1;
        }
    }
    assert!(total > 200_000 && same as f64 > 0.97 * total as f64, "{same} of {total} corners agree");
}

#[test]
fn files_without_scenes_or_nodes_are_empty_or_show_all_roots() {
    let Some(scenes) = scenes("files_without_scenes_or_nodes_are_empty_or_show_all_roots") else { return };
    for (name, instances) in [("no_nodes", 0), ("empty_scene", 0), ("no_scene", 1), ("no_scenes", 1)] {
        let loaded = load_ok(&scenes.join(format!("bio_00_{name}/00_{name}.gltf")));
        assert_eq!(loaded.scene.instances.len(), instances, "{name}");
        assert_eq!(loaded.scene.environment, Environment::Black);
    }
}

/// Normals on the far side of most faces are turned with their bitangents kept, unless they are to be kept themselves.
#[test]
fn normals_against_the_winding_are_turned_and_reported() {
    use base64::Engine;
    let triangle = [[0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let floats: Vec<f32> =
        triangle.as_flattened().iter().copied().chain([0.0, 0.0, -1.0].repeat(3)).collect();
    let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let text = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ "mesh": 0 }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0, "NORMAL": 1 }} }}] }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }},
            {{ "bufferView": 0, "byteOffset": 36, "componentType": 5126, "count": 3, "type": "VEC3" }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 72 }}],
        "buffers": [{{ "byteLength": 72, "uri": "data:application/octet-stream;base64,{data}" }}] }}"#
    );
    for (keep_normals, expected, done) in [(false, 1.0, "turned round"), (true, -1.0, "kept")] {
        let options = LoadOptions { keep_normals, ..LoadOptions::default() };
        let loaded = load_bytes(Path::new("n.gltf"), text.as_bytes(), &options);
        let loaded = loaded.unwrap_or_else(|e| panic!("{e}"));
        let Shape::Triangles(mesh) = &loaded.scene.meshes[0].parts[0].shape else { panic!("triangles") };
        assert!(mesh.normals.iter().all(|n| n.z == expected), "{:?}", mesh.normals);
        assert!(loaded.report.notes.iter().any(|n| n.message.contains(done)), "{:?}", loaded.report);
    }
}

#[test]
fn json_in_utf16_is_read_and_reported() {
    let text = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"name": "Bär"}]}"#;
    let path = Path::new("x.gltf");
    for bytes in [u16::to_le_bytes, u16::to_be_bytes] {
        for mark in ["", "\u{feff}"] {
            let file: Vec<u8> = mark.encode_utf16().chain(text.encode_utf16()).flat_map(bytes).collect();
            let loaded = load_bytes(path, &file, &LoadOptions::default()).expect("UTF-16");
            assert!(loaded.report.notes.iter().any(|n| n.message.contains("UTF-16")));
        }
    }
    assert!(load_bytes(path, text.as_bytes(), &LoadOptions::default()).unwrap().report.notes.is_empty());
}

/// A file may leave its data to other programs, and ask for a later version 2; both are valid.
#[test]
fn meshes_without_data_and_later_versions_are_reported() {
    let load =
        |json: &Value| load_bytes(Path::new("x.gltf"), json.to_string().as_bytes(), &LoadOptions::default());
    let mut file = json!({
        "asset": { "version": "2.0" },
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "name": "hull", "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{
            "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0],
        }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36 }],
    });
    let loaded = load(&file).expect("a valid file");
    let said = |part: &str| loaded.report.notes.iter().any(|n| n.message.contains(part));
    assert!(said("mesh 0 `hull`, primitive 0 is not drawn") && said("buffer 0"), "{:?}", loaded.report.notes);
    file["buffers"][0]["uri"] = json!("missing.bin");
    assert!(matches!(load(&file), Err(LoadError::Read { .. })), "the file says where its data should be");

    for (version, loads) in [("2.0", true), ("2.1", true), ("3.0", false)] {
        let loaded = load(&json!({ "asset": { "version": "2.1", "minVersion": version } }));
        assert_eq!(loaded.is_ok(), loads, "{version}");
        let notes = loaded.map_or(0, |l| l.report.notes.len());
        assert_eq!(notes, usize::from(version == "2.1"), "{version}");
    }
}
