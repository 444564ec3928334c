//! The glTF loader on malformed files: the validator's own test data, mutated files, hostile sizes.

mod gltf_support;

use gltf_support::{assert_sound, gltf_files, load, within_limit};
use proptest::prelude::*;
use scene::load::gltf::load_bytes;
use scene::{LoadError, LoadOptions, Loaded};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The folder of the validator's test data, or `None` where it is missing and the test may be skipped.
fn validator_data(test: &str) -> Option<PathBuf> {
    Some(testkit::require_shared(test)?.join("scenes/torture_gltf_validator/base/data"))
}

/// Files with errors in the validator's report that are loaded all the same: the error has no effect on the picture,
/// is in something that the shown scene does not use, or is mended and reported.
const INVALID_BUT_LOADED: &[&str] = &[
    "accessor/alignment.gltf",
    "accessor/byteoffset_no_bufferview.gltf",
    "accessor/empty_array.gltf",
    "accessor/float_normalized.gltf",
    "accessor/invalid_sparse_count_and_stride.gltf",
    "accessor/matrix_alignment.gltf",
    "accessor/small_stride.gltf",
    "accessor/unresolved_bufferviews.gltf",
    "asset/min_version_invalid.gltf",
    "buffer/empty_array.gltf",
    "buffer/empty_object.gltf",
    "buffer/invalid_object.gltf",
    "buffer/invalid_uri_data.glb",
    "buffer/invalid_uri_data.gltf",
    "buffer/invalid_uri_data_bytelength.gltf",
    "buffer/invalid_uri_data_mime.gltf",
    "buffer/invalid_uri_scheme.gltf",
    "buffer/no_bin_chunk.glb",
    "buffer/not_found.gltf",
    "buffer/wrong_bytelength.glb",
    "buffer/zero_bytelength.gltf",
    "buffer_view/empty_array.gltf",
    "buffer_view/invalid_length.gltf",
    "buffer_view/invalid_stride_multiple.gltf",
    "buffer_view/invalid_stride_too_big.gltf",
    "buffer_view/invalid_stride_wrong_target.gltf",
    "buffer_view/unresolved_buffer.gltf",
    "buffer_view/zero_bytelength.gltf",
    "glb/bom.glb",
    "glb/chunk_too_big.glb",
    "glb/json_and_two_buffers.glb",
    "glb/length_mismatch.glb",
    "glb/misplaced_bin_chunk.glb",
    "glb/unaligned_chunk.glb",
    "json/bom.gltf",
    "mesh/accessor_attribute_uint32.gltf",
    "mesh/accessor_unaligned.gltf",
    "mesh/accessor_unequal_count.gltf",
    "mesh/accessor_without_bytestride.gltf",
    "mesh/bufferview_target_override.gltf",
    "mesh/empty_array.gltf",
    "mesh/indices_bytestride.gltf",
    "mesh/indices_invalid_format.gltf",
    "mesh/invalid_attribute.gltf",
    "mesh/invalid_attribute_escaped_name.gltf",
    "mesh/invalid_indexed_attribute.gltf",
    "mesh/morph_attribute_invalid_count.gltf",
    "mesh/morph_attribute_no_base.gltf",
    "mesh/morph_bufferview_target_override.gltf",
    "mesh/morph_position_accessor_no_bounds.gltf",
    "mesh/morph_unequal_targets_count.gltf",
    "mesh/morph_weights_wrong_count.gltf",
    "mesh/position_accessor_invalid_format.gltf",
    "mesh/position_accessor_no_bounds.gltf",
    "mesh/unequal_joints.gltf",
    "mesh/unresolved_indices.gltf",
    "mesh/unresolved_material.gltf",
    "mesh/unresolved_morph_positions.gltf",
    "mesh/unresolved_positions.gltf",
    "mesh/uv.gltf",
    "node/empty_array.gltf",
    "node/empty_children_array.gltf",
    "node/matrix_indecomposable.gltf",
    "node/matrix_trs.gltf",
    "node/node_skin_without_skinned_mesh.gltf",
    "node/node_weights_invalid.gltf",
    "node/rotation_non_unit.gltf",
    "node/skin_with_no_mesh.gltf",
    "node/unresolved_skin.gltf",
    "node/weights_with_no_mesh.gltf",
    "root/duplicate_extension_entry.gltf",
    "root/extensions_non_objects.gltf",
    "root/extensions_undeclared_wrong_pointer.gltf",
    "sampler/empty_array.gltf",
    "texture/empty_array.gltf",
    "texture/unresolved_sampler.gltf",
    "texture/unresolved_source.gltf",
];

/// The number of errors in the validator's report beside a file; `None` without a report.
fn validator_errors(file: &Path) -> Option<u64> {
    let mut report = file.as_os_str().to_owned();
    report.push(".report.json");
    let report: Value = serde_json::from_slice(&std::fs::read(report).ok()?).unwrap();
    Some(report["issues"]["numErrors"].as_u64().unwrap())
}

#[test]
fn verdicts_agree_with_the_validator() {
    let Some(folder) = validator_data("verdicts_agree_with_the_validator") else { return };
    let (mut compared, mut valid) = (0, 0);
    let (mut tolerated, mut silent) = (Vec::new(), Vec::new());
    for file in gltf_files(&folder) {
        let name = file.strip_prefix(&folder).unwrap().to_str().unwrap().replace('\\', "/");
        let result = load(&file, false);
        if let Ok(loaded) = &result {
            assert_sound(&name, loaded);
        }
        let errors = validator_errors(&file).unwrap_or_else(|| panic!("{name} has no report"));
        compared += 1;
        match (errors, result) {
            (0, Err(error)) => panic!("{name} is valid: {error}"),
            (0, Ok(_)) => valid += 1,
            (_, Err(_)) => {}
            (_, Ok(loaded)) => {
                let shows = !loaded.scene.instances.is_empty();
                if shows && loaded.report.notes.is_empty() {
                    silent.push(name.clone());
                }
                tolerated.push(name);
            }
        }
        if let Ok(loaded) = load(&file, true) {
            assert_sound("lenient", &loaded);
        }
    }
    assert!(compared == 161 && valid == 46, "{compared} files were found, {valid} valid ones loaded");
    assert_eq!(silent, [""; 0], "what is wrong with files that show something must be said");
    assert_eq!(tolerated, INVALID_BUT_LOADED, "the list of tolerated files must be kept up to date");
}

/// Most of the data has no scene, so that its broken meshes are never looked at: here they are all shown.
#[test]
fn broken_meshes_are_refused_when_they_are_shown() {
    let Some(folder) = validator_data("broken_meshes_are_refused_when_they_are_shown") else { return };
    let mut verdicts = Vec::new();
    for file in gltf_files(&folder) {
        let Ok(mut json) = serde_json::from_slice::<Value>(&std::fs::read(&file).unwrap()) else { continue };
        let meshes = json["meshes"].as_array().map_or(0, Vec::len);
        if meshes == 0 || json["asset"].is_null() {
            continue;
        }
        json["nodes"] = (0..meshes).map(|mesh| json!({ "mesh": mesh })).collect();
        json["scenes"] = Value::Null;
        json.as_object_mut().unwrap().remove("scenes");
        json.as_object_mut().unwrap().remove("scene");
        let name = file.strip_prefix(&folder).unwrap().to_str().unwrap().to_owned();
        let bytes = serde_json::to_vec(&json).unwrap();
        for lenient in [false, true] {
            let options = LoadOptions { lenient, ..LoadOptions::default() };
            let (path, bytes) = (file.clone(), bytes.clone());
            let result = within_limit(&name, move || load_bytes(&path, &bytes, &options));
            if let Ok(loaded) = &result {
                assert_sound(&name, loaded);
            }
            verdicts.push((name.replace('\\', "/"), lenient, result.map(|l| l.report.notes.len())));
        }
    }
    for broken in
        ["mesh/unresolved_indices.gltf", "mesh/unresolved_material.gltf", "mesh/unresolved_positions.gltf"]
    {
        let verdict = verdicts.iter().find(|(name, lenient, _)| name == broken && !lenient).unwrap();
        assert!(matches!(verdict.2, Err(LoadError::Malformed { .. })), "{verdict:?}");
        let verdict = verdicts.iter().find(|(name, lenient, _)| name == broken && *lenient).unwrap();
        assert!(verdict.2.is_ok(), "{verdict:?}");
    }
}

/// A file with a bit of everything: a textured, indexed, skinned, morphed, sparse and instanced quad, camera, light.
fn small_scene() -> (Value, Vec<u8>) {
    let mut binary: Vec<u8> = Vec::new();
    let mut views = Vec::new();
    let mut view = |bytes: Vec<u8>| {
        views.push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() }));
        binary.extend(bytes);
        binary.resize(binary.len().next_multiple_of(4), 0);
    };
    let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    view(floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]));
    view(floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]));
    view(floats(&[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]));
    view(vec![0, 1, 2, 0, 2, 3]);
    view([[0u8, 1, 0, 0]; 4].concat());
    view([[128u8, 127, 0, 0]; 4].concat());
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    view(floats(&[identity, identity].concat()));
    view(vec![1, 0, 3, 0]);
    view(floats(&[0.0, 0.0, 0.5, 0.0, 0.0, -0.5]));
    view([[255u8, 128, 0, 255]; 4].concat());
    let mut png = Vec::new();
    let image = image::RgbaImage::from_pixel(2, 2, image::Rgba([128, 128, 255, 255]));
    image.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    view(png);
    let attributes =
        json!({ "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "JOINTS_0": 4, "WEIGHTS_0": 5, "COLOR_0": 8 });
    let accessor = |view: usize, component: u32, count: usize, kind: &str| json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
    let json = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0, 1, 4, 5], "extras": { "environment": [0.5, 1, 2] } }],
        "nodes": [
            { "name": "skinned", "mesh": 0, "skin": 0, "weights": [0.5] },
            { "children": [2, 3], "translation": [0, 1, 0], "rotation": [0, 0, 0, 1], "scale": [1, 2, 1] },
            { "name": "a", "mesh": 1, "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1, 2, 3, 1] },
            { "name": "b", "mesh": 1 },
            { "camera": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "mesh": 1, "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 0 } } } }
        ],
        "meshes": [
            { "primitives": [{ "attributes": attributes, "indices": 3, "material": 0, "targets": [{ "POSITION": 7 }] }] },
            { "name": "strip", "primitives": [
                { "attributes": { "POSITION": 0, "TEXCOORD_0": 2 }, "mode": 5, "material": 0 },
                { "attributes": { "POSITION": 0 }, "mode": 6 },
                { "attributes": { "POSITION": 0 }, "mode": 1 }
            ] }
        ],
        "skins": [{ "joints": [2, 3], "inverseBindMatrices": 6 }],
        "materials": [{
            "name": "mapped", "normalTexture": { "index": 0, "scale": 0.5 }, "alphaMode": "MASK",
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": { "rotation": 1 } } } },
            "extensions": { "KHR_materials_transmission": { "transmissionFactor": 0.5 }, "KHR_materials_ior": { "ior": 1.3 },
                "KHR_materials_volume": { "thicknessFactor": 1 }, "KHR_materials_sheen": {} }
        }],
        "textures": [{ "source": 0, "sampler": 0 }],
        "samplers": [{ "wrapS": 33071 }],
        "images": [{ "bufferView": 10, "mimeType": "image/png" }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "spot", "intensity": 5, "spot": {} }] } },
        "accessors": [
            accessor(0, 5126, 4, "VEC3"), accessor(1, 5126, 4, "VEC3"), accessor(2, 5126, 4, "VEC2"),
            accessor(3, 5121, 6, "SCALAR"), accessor(4, 5121, 4, "VEC4"), accessor(5, 5121, 4, "VEC4"),
            accessor(6, 5126, 2, "MAT4"),
            { "componentType": 5126, "count": 4, "type": "VEC3", "sparse": { "count": 2,
                "indices": { "bufferView": 7, "componentType": 5123 }, "values": { "bufferView": 8 } } },
            { "bufferView": 9, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC4" }
        ],
        "bufferViews": views,
        "buffers": [{ "byteLength": binary.len() }],
        "extensionsUsed": ["KHR_lights_punctual"]
    });
    (json, binary)
}

fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = (28 + json.len() + binary.len()) as u32;
    let mut file = [b"glTF", &2u32.to_le_bytes()[..], &length.to_le_bytes()].concat();
    for (kind, content) in [(b"JSON", &json[..]), (b"BIN\0", binary)] {
        file.extend((content.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(content);
    }
    file
}

fn load_glb(file: &[u8], lenient: bool) -> Result<Loaded, LoadError> {
    load_bytes(Path::new("small.glb"), file, &LoadOptions { lenient, ..LoadOptions::default() })
}

#[test]
fn the_small_scene_is_read_in_full() {
    let (json, binary) = small_scene();
    let loaded = load_glb(&glb(&json.to_string(), &binary), false).unwrap();
    assert_sound("small scene", &loaded);
    let scene = &loaded.scene;
    assert_eq!(scene.environment, scene::Environment::Constant(glam::vec3(0.5, 1.0, 2.0)));
    // The image is used as a colour and as a normal map, which are replaced differently if it cannot be decoded.
    assert_eq!((scene.cameras.len(), scene.lights.len(), scene.images.len()), (1, 1, 2));
    // The skinned quad, the strip and fan of nodes a and b, and four instances of them.
    assert_eq!((scene.meshes.len(), scene.instances.len(), scene.instanced_triangles()), (2, 7, 2 + 6 * 4));
    let material = &scene.materials[0];
    assert!(
        material.alpha_mode == scene::AlphaMode::Mask(0.5) && !material.thin_walled && material.ior == 1.3
    );
    let part = |mesh: usize, part: usize| match &scene.meshes[mesh].parts[part].shape {
        scene::Shape::Triangles(mesh) => mesh,
        scene::Shape::Spheres(_) => panic!("glTF has no spheres"),
    };
    // Node a doubles and moves by (1, 2, 3) below a node that moves by (0, 1, 0) and doubles y; node b only has the
    // latter. Weights of 128 and 127 blend both; half the sparse target moves vertex 1 by 0.25 along z.
    let expected = |p: glam::Vec3| {
        let a = glam::vec3(2.0 * p.x + 1.0, 4.0 * p.y + 5.0, 2.0 * p.z + 3.0);
        let b = glam::vec3(p.x, 2.0 * p.y + 1.0, p.z);
        (a * 128.0 + b * 127.0) / 255.0
    };
    let quad = part(0, 0);
    for (actual, rest) in
        quad.positions.iter().zip([[0.0, 0.0, 0.0], [1.0, 0.0, 0.25], [1.0, 1.0, 0.0], [0.0, 1.0, -0.25]])
    {
        assert!((*actual - expected(rest.into())).length() < 1e-5, "{actual} for {rest:?}");
    }
    assert_eq!(quad.colors[0], glam::vec4(1.0, 128.0 / 255.0, 0.0, 1.0));
    assert_eq!((part(1, 0).indices.len(), part(1, 1).indices.len()), (2, 2));
    assert!(!part(1, 0).tangents.is_empty() && part(1, 0).normals.is_empty());
}

/// A block of green pixels, as BC1.
fn green_dds() -> Vec<u8> {
    let (width, height, depth) = (4, 4, None);
    let (format, mipmap_levels, caps2) = (ddsfile::D3DFormat::DXT1, None, None);
    let parameters = ddsfile::NewD3dParams { width, height, depth, format, mipmap_levels, caps2 };
    let mut dds = ddsfile::Dds::new_d3d(parameters).unwrap();
    dds.data = vec![0xe0, 0x07, 0, 0, 0, 0, 0, 0];
    let mut bytes = Vec::new();
    dds.write(&mut bytes).unwrap();
    bytes
}

#[test]
fn blocks_are_decoded_where_there_is_no_plain_image() {
    use base64::Engine;
    let (mut json, binary) = small_scene();
    let dds = base64::engine::general_purpose::STANDARD.encode(green_dds());
    let image = json!({ "uri": format!("data:image/vnd-ms.dds;base64,{dds}") });
    json["images"].as_array_mut().unwrap().push(image);
    json["textures"][0] = json!({ "extensions": { "MSFT_texture_dds": { "source": 1 } } });
    json["extensionsUsed"] = json!(["KHR_lights_punctual", "MSFT_texture_dds"]);
    json["extensionsRequired"] = json!(["MSFT_texture_dds"]);
    let first_image = |json: &Value| {
        let loaded = load_glb(&glb(&json.to_string(), &binary), false).unwrap();
        assert_sound("blocks", &loaded);
        match &loaded.scene.images[0].pixels {
            scene::Pixels::Rgba8(pixels) => pixels.clone(),
            _ => panic!("a float image"),
        }
    };
    let decoded = first_image(&json);
    assert_eq!(decoded, [[0, 255, 0, 255]; 16]);
    json["textures"][0]["source"] = json!(0);
    assert_ne!(first_image(&json), decoded, "the plain image has lost nothing");
}

/// Small files that ask for a lot.
#[test]
fn hostile_sizes_are_refused_before_memory_is_taken() {
    let cases = [
        json!({ "count": 4_000_000_000u64 }),
        json!({ "count": 1u64 << 62 }),
        json!({ "count": u64::MAX, "byteOffset": u64::MAX }),
        json!({ "bufferView": 0, "count": u64::MAX }),
        json!({ "bufferView": 0, "count": 2, "byteOffset": u64::MAX }),
    ];
    for case in cases {
        let (mut json, binary) = small_scene();
        json["accessors"][0] = case;
        json["accessors"][0]["componentType"] = json!(5126);
        json["accessors"][0]["type"] = json!("VEC3");
        let file = glb(&json.to_string(), &binary);
        let what = json["accessors"][0].to_string();
        assert!(within_limit(&what, move || load_glb(&file, false)).is_err(), "{what}");
    }
    // Sixteen million zeros are allowed for one accessor, but not for each of a hundred thousand meshes.
    let mesh = json!({ "primitives": [{ "attributes": { "POSITION": 0 } }] });
    let node: Vec<Value> = (0..100_000).map(|mesh| json!({ "mesh": mesh })).collect();
    let json = json!({ "asset": { "version": "2.0" }, "nodes": node, "meshes": vec![mesh; 100_000],
        "accessors": [{ "componentType": 5126, "type": "VEC3", "count": 1 << 24 }] });
    let file = json.to_string();
    let result = within_limit("zeros", move || load_glb_text(&file));
    assert!(matches!(result, Err(LoadError::TooLarge { .. })), "{:?}", result.err());
}

fn load_glb_text(json: &str) -> Result<Loaded, LoadError> {
    load_bytes(Path::new("small.gltf"), json.as_bytes(), &LoadOptions::default())
}

#[test]
fn deep_and_cyclic_hierarchies_end() {
    let depth = 200_000;
    let mut nodes: Vec<Value> = (1..depth).map(|child| json!({ "children": [child] })).collect();
    nodes.push(json!({}));
    let deep = json!({ "asset": { "version": "2.0" }, "nodes": nodes }).to_string();
    assert!(within_limit("deep hierarchy", move || load_glb_text(&deep)).is_ok());
    for nodes in [
        json!([{ "children": [0] }]),
        json!([{ "children": [1] }, { "children": [0] }]),
        json!([{ "children": [2] }, { "children": [2] }, {}]),
        json!([{ "children": [1, 1] }, {}]),
    ] {
        let json = json!({ "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": nodes })
            .to_string();
        let what = json.clone();
        assert!(within_limit(&what, move || load_glb_text(&json)).is_err(), "{what}");
    }
    let text = "[".repeat(1_000_000);
    assert!(within_limit("deep text", move || load_glb_text(&text)).is_err());
}

/// All places in a JSON value where a number or a string stands.
fn leaves(value: &mut Value) -> Vec<&mut Value> {
    match value {
        Value::Array(values) => values.iter_mut().flat_map(leaves).collect(),
        Value::Object(fields) => fields.values_mut().flat_map(leaves).collect(),
        leaf => vec![leaf],
    }
}

/// Values that loaders are afraid of.
fn nasty() -> impl Strategy<Value = Value> {
    prop_oneof![
        (-3i64..20).prop_map(Value::from),
        prop_oneof![Just(u64::MAX), Just(1 << 32), Just((1 << 31) - 1), Just(65535)].prop_map(Value::from),
        prop_oneof![Just(1e38), Just(1e300), Just(-1e-40), Just(0.5)].prop_map(Value::from),
        prop_oneof![
            Just("VEC3"),
            Just("SCALAR"),
            Just("MAT4"),
            Just("BLEND"),
            Just("http://a/b"),
            Just("data:,")
        ]
        .prop_map(Value::from),
        prop_oneof![Just(5120), Just(5121), Just(5122), Just(5123), Just(5125), Just(5126)]
            .prop_map(Value::from),
        Just(Value::Null),
        Just(json!([])),
        Just(json!({})),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn changed_values_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), nasty()), 1..6),
        lenient: bool,
    ) {
        let (mut json, binary) = small_scene();
        for (place, value) in changes {
            let mut places = leaves(&mut json);
            let index = place.index(places.len());
            *places[index] = value;
        }
        if let Ok(loaded) = load_glb(&glb(&json.to_string(), &binary), lenient) {
            assert_sound("changed values", &loaded);
        }
    }

    #[test]
    fn changed_bytes_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..16),
        cut in prop::option::of(any::<prop::sample::Index>()),
        lenient: bool,
    ) {
        let (json, binary) = small_scene();
        let mut file = glb(&json.to_string(), &binary);
        for (place, value) in changes {
            let index = place.index(file.len());
            file[index] = value;
        }
        if let Some(cut) = cut {
            file.truncate(cut.index(file.len()));
        }
        if let Ok(loaded) = load_glb(&file, lenient) {
            assert_sound("changed bytes", &loaded);
        }
    }

    /// Only the binary part: any bits may be a position, a normal, a weight or a matrix.
    #[test]
    fn changed_numbers_never_panic(seed in prop::collection::vec(any::<u32>(), 1..64), every in 1usize..8) {
        let (json, mut binary) = small_scene();
        for (i, word) in binary.chunks_exact_mut(4).enumerate().filter(|(i, _)| i % every == 0) {
            word.copy_from_slice(&seed[i % seed.len()].to_le_bytes());
        }
        if let Ok(loaded) = load_glb(&glb(&json.to_string(), &binary), true) {
            assert_sound("changed numbers", &loaded);
        }
    }
}
