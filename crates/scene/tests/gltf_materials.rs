//! Material extensions of glTF: what the loader makes of real files and of small ones.

use glam::{Vec3, vec3};
use scene::tables::{ModelTag, SceneTables};
use scene::{LoadError, LoadOptions, Loaded, Material, Scene, Severity, Shape};
use std::path::{Path, PathBuf};

fn scenes(test: &str) -> Option<PathBuf> {
    testkit::require_shared(test).map(|shared| shared.join("scenes"))
}

fn load_ok(path: &Path) -> Loaded {
    scene::load::load(path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn named<'s>(scene: &'s Scene, name: &str) -> &'s Material {
    scene.materials.iter().find(|m| m.name == name).unwrap_or_else(|| panic!("no material {name}"))
}

/// Loads a file whose only material is `material`, JSON without its braces, on one triangle.
fn small(material: &str) -> Loaded {
    let text = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ "mesh": 0 }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "material": 0 }}] }}],
        "materials": [{{ {material} }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 36 }}],
        "buffers": [{{ "byteLength": 36, "uri":
            "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }}] }}"#
    );
    scene::load::gltf::load_bytes(Path::new("small.gltf"), text.as_bytes(), &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn coats_have_their_textures_and_normal_maps() {
    let Some(scenes) = scenes("coats_have_their_textures_and_normal_maps") else { return };
    let loaded = load_ok(&scenes.join("khr_ClearCoatTest/ClearCoatTest.glb"));
    assert!(loaded.report.notes.iter().all(|n| n.severity == Severity::Info), "{:?}", loaded.report);
    let simple = &named(&loaded.scene, "Simple_Coated").layers;
    assert_eq!((simple.clearcoat.strength, simple.clearcoat.roughness), (1.0, 0.03));
    assert!(named(&loaded.scene, "Partial_Coated").layers.clearcoat.texture.is_some());
    assert!(named(&loaded.scene, "RoughVariations_Coated").layers.clearcoat.roughness_texture.is_some());
    let mapped = loaded.scene.materials.iter().filter(|m| m.layers.clearcoat.normal_texture.is_some());
    assert!(mapped.count() >= 2);
    // Where a coat or a base has a normal map, meshes have tangents.
    let tables = SceneTables::build(&loaded.scene);
    let layered = tables.materials.iter().filter(|m| m.model == ModelTag::Layered);
    assert!(layered.count() >= 5 && !tables.tangents.is_empty());
    assert!(!named(&loaded.scene, "Simple_Base").layers.are_present());
}

#[test]
fn sheen_and_grain_are_read() {
    let Some(scenes) = scenes("sheen_and_grain_are_read") else { return };
    let sheen = load_ok(&scenes.join("bio_19_sheen/19_sheen.gltf"));
    assert!(sheen.report.notes.is_empty(), "{:?}", sheen.report);
    let layers = &named(&sheen.scene, "SheenDefault").layers;
    assert!((layers.sheen.color - vec3(0.1, 0.2, 0.3)).length() < 1e-6 && layers.sheen.roughness == 0.0);
    assert!(named(&sheen.scene, "SheenSigmaTexture").layers.sheen.roughness_texture.is_some());
    // A texture alone is multiplied into black, the default.
    assert!(!named(&sheen.scene, "SheenTexture").layers.are_present());

    let grain = load_ok(&scenes.join("khr_AnisotropyStrengthTest/AnisotropyStrengthTest.glb")).scene;
    let strengths: Vec<f32> = grain.materials.iter().map(|m| m.layers.anisotropy.strength).collect();
    assert!(strengths.contains(&0.0) && strengths.contains(&1.0) && strengths.contains(&0.5));
    let meshes = grain.meshes.iter().flat_map(|m| &m.parts);
    let bare = meshes.filter(|part| {
        let Shape::Triangles(mesh) = &part.shape else { return false };
        let grained = grain.materials[part.material as usize].layers.need_tangents();
        grained && mesh.tangents.is_empty() && !mesh.uv0.is_empty()
    });
    assert_eq!(bare.count(), 0, "parts whose grain has no direction");
}

#[test]
fn bodies_absorb() {
    let Some(scenes) = scenes("bodies_absorb") else { return };
    let loaded = load_ok(&scenes.join("khr_AttenuationTest/AttenuationTest.glb"));
    assert!(loaded.report.notes.iter().all(|n| n.severity == Severity::Info), "{:?}", loaded.report);
    let interior = named(&loaded.scene, "R5_Attenuation_2.0").interior;
    assert_eq!(interior.attenuation_distance, 0.5);
    assert!((interior.absorption() - vec3(4.605_17, 1.386_294, 0.210_721)).length() < 1e-4);
    assert!(SceneTables::build(&loaded.scene).has_absorption());
}

#[test]
fn specular_glossiness_is_a_reflectance() {
    let Some(scenes) = scenes("specular_glossiness_is_a_reflectance") else { return };
    let loaded =
        load_ok(&scenes.join("bio_04_sphere_specular_glossiness/04_sphere_specular_glossiness.gltf"));
    assert!(loaded.report.notes.is_empty(), "{:?}", loaded.report);
    let sphere = named(&loaded.scene, "Sphere");
    assert_eq!((sphere.metallic, sphere.roughness), (0.0, 1.0));
    assert!(sphere.layers.specular_is_reflectance && sphere.layers.specular_color == Vec3::ONE);
    let tables = SceneTables::build(&loaded.scene);
    let record = tables.materials.iter().find(|m| m.model == ModelTag::Layered).expect("layered");
    assert_eq!(tables.layers[record.layers as usize].reflectance_ior, 0.0);
}

#[test]
fn an_empty_object_is_no_copy_of_specular_glossiness() {
    let extension = r#""extensions": { "KHR_materials_pbrSpecularGlossiness": {
        "diffuseFactor": [0.8, 0.1, 0.1, 1], "specularFactor": [0.04, 0.04, 0.04], "glossinessFactor": 0.2 } }"#;
    for own in ["", r#""pbrMetallicRoughness": {}, "#] {
        let loaded = small(&format!("{own}{extension}"));
        let material = &loaded.scene.materials[0];
        assert_eq!((material.metallic, material.roughness), (0.0, 0.8), "{own}");
        assert_eq!(material.base_color.truncate(), vec3(0.8, 0.1, 0.1), "{own}");
        assert!(material.layers.specular_is_reflectance, "{own}");
        let untrue = loaded.report.notes.iter().any(|note| note.message.contains("copy is used"));
        assert!(!untrue, "{:?}", loaded.report);
    }
    let copy = small(&format!(r#""pbrMetallicRoughness": {{ "metallicFactor": 0.5 }}, {extension}"#));
    assert_eq!(copy.scene.materials[0].metallic, 0.5, "a copy that says something is used");
}

#[test]
fn variants_are_chosen_by_name() {
    let Some(scenes) = scenes("variants_are_chosen_by_name") else { return };
    let path = scenes.join("bio_18_variants/18_variants.gltf");
    let names = |variant: Option<&str>| {
        let options = LoadOptions { variant: variant.map(Into::into), ..LoadOptions::default() };
        let loaded = scene::load::load(&path, &options)?;
        Ok::<Vec<String>, LoadError>(loaded.scene.materials.into_iter().map(|m| m.name).collect())
    };
    assert_eq!(names(None).expect("default"), ["Blue", "Green", "White"]);
    assert_eq!(names(Some("Variant_Red")).expect("red"), ["Red", "Orange", "White"]);
    let message = names(Some("Variant_Mauve")).expect_err("unknown").to_string();
    assert!(message.contains("Variant_Mauve") && message.contains("`Variant_Blue`"), "{message}");
}

#[test]
fn all_factors_arrive() {
    let m = small(
        r#""pbrMetallicRoughness": { "metallicFactor": 0 }, "extensions": {
        "KHR_materials_specular": { "specularFactor": 0.7, "specularColorFactor": [2, 0.5, 0] },
        "KHR_materials_ior": { "ior": 1.4 },
        "KHR_materials_transmission": { "transmissionFactor": 0.5 },
        "KHR_materials_volume": { "thicknessFactor": 1, "attenuationDistance": 3, "attenuationColor": [1, 0.5, 0] },
        "KHR_materials_dispersion": { "dispersion": 0.4 },
        "KHR_materials_iridescence": { "iridescenceFactor": 0.6, "iridescenceIor": 1.6,
            "iridescenceThicknessMinimum": 200, "iridescenceThicknessMaximum": 500 },
        "KHR_materials_anisotropy": { "anisotropyStrength": 0.3, "anisotropyRotation": 1.5 },
        "KHR_materials_diffuse_transmission": { "diffuseTransmissionFactor": 0.2,
            "diffuseTransmissionColorFactor": [1, 0, 0.5] },
        "KHR_materials_clearcoat": { "clearcoatFactor": 0.9, "clearcoatRoughnessFactor": 0.1 },
        "KHR_materials_sheen": { "sheenColorFactor": [0.1, 0.2, 0.3], "sheenRoughnessFactor": 0.4 } }"#,
    );
    // A triangle encloses no volume; the material stays what it is.
    let is_about_volume = |n: &scene::Note| n.message.contains("treated as a thin wall");
    assert!(m.report.notes.iter().all(is_about_volume), "{:?}", m.report);
    let (l, m) = (&m.scene.materials[0].layers, &m.scene.materials[0]);
    assert_eq!((m.specular, m.ior, m.transmission, m.thin_walled), (0.7, 1.4, 0.5, false));
    assert_eq!((l.specular_color, l.dispersion), (vec3(2.0, 0.5, 0.0), 0.4));
    assert_eq!(
        (l.iridescence.strength, l.iridescence.ior, l.iridescence.thickness),
        (0.6, 1.6, [200.0, 500.0])
    );
    assert_eq!((l.anisotropy.strength, l.anisotropy.rotation), (0.3, 1.5));
    let through = &l.diffuse_transmission;
    assert_eq!((through.strength, through.color), (0.2, vec3(1.0, 0.0, 0.5)));
    assert_eq!((l.clearcoat.strength, l.clearcoat.roughness), (0.9, 0.1));
    assert_eq!((l.sheen.color, l.sheen.roughness), (vec3(0.1, 0.2, 0.3), 0.4));
    assert_eq!(m.interior.attenuation_distance, 3.0);
}

/// What a file may say and should not.
#[test]
fn nonsense_is_mended_and_reported() {
    let m = small(
        r#""extensions": { "KHR_materials_clearcoat": { "clearcoatFactor": -1 },
        "KHR_materials_specular": { "specularColorFactor": [-1, 0, 0] },
        "KHR_materials_transmission": { "transmissionFactor": 2 },
        "KHR_materials_volume": { "thicknessFactor": 1, "attenuationDistance": -3 } }"#,
    );
    let repaired = m.report.notes.iter().filter(|n| n.severity == Severity::Repaired).count();
    assert!(repaired >= 4, "{:?}", m.report);
    let m = &m.scene.materials[0];
    assert!(!m.layers.are_present() && m.interior.absorption() == Vec3::ZERO && m.transmission == 1.0);
    let unknown = small(r#""extensions": { "KHR_materials_of_tomorrow": {} }"#);
    assert!(unknown.report.notes.iter().any(|n| n.message.contains("KHR_materials_of_tomorrow")));
}

/// The same picture as PNG and as KTX2, whose pixels a reference decoder has written into the PNG.
#[test]
fn compressed_and_plain_textures_give_the_same_pixels() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ktx2");
    let base64 = |name: &str| {
        use base64::Engine;
        let bytes = std::fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        base64::engine::general_purpose::STANDARD.encode(bytes)
    };
    let pixels = |texture: &str, images: &str| {
        let material = r#""pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } }"#;
        let rest = format!(r#" }}], "textures": [{{ {texture} }}], "images": [{images}], "extras": [{{ "#);
        let loaded = small(&format!("{material}{rest}"));
        let scene::Pixels::Rgba8(pixels) = &loaded.scene.images[0].pixels else { panic!("bytes") };
        (pixels.clone(), loaded.report)
    };
    for name in ["etc1s_opaque", "etc1s_alpha", "uastc_zstd", "uastc_plain"] {
        let png = format!(r#"{{ "uri": "data:image/png;base64,{}" }}"#, base64(&format!("{name}.png")));
        let ktx = format!(r#"{{ "uri": "data:image/ktx2;base64,{}" }}"#, base64(&format!("{name}.ktx2")));
        let (plain, plain_report) = pixels(r#""source": 0"#, &png);
        let basisu = r#""extensions": { "KHR_texture_basisu": { "source": 0 } }"#;
        let (compressed, report) = pixels(basisu, &ktx);
        assert!(plain.len() == 46 * 38 && compressed == plain, "{name}");
        assert_eq!(report.notes, plain_report.notes, "{name}");
        // With a copy for readers without the extension, the copy is taken.
        let both = r#""source": 1, "extensions": { "KHR_texture_basisu": { "source": 0 } }"#;
        let (copy, report) = pixels(both, &format!("{ktx}, {png}"));
        assert!(
            copy == plain && report.notes[0].message.contains("KHR_texture_basisu"),
            "{name}: {report:?}"
        );
    }
}

/// What glass reflects is scaled by a layered surface; other glass stays a plain interface.
#[test]
fn glass_whose_reflection_is_scaled_is_layered() {
    let model = |extensions: &str| {
        let material = format!(
            r#""pbrMetallicRoughness": {{ "metallicFactor": 0, "roughnessFactor": 0 }}, "extensions": {{
            "KHR_materials_transmission": {{ "transmissionFactor": 1 }} {extensions} }}"#
        );
        SceneTables::build(&small(&material).scene).materials[0].model
    };
    assert_eq!(model(""), ModelTag::Dielectric);
    assert_eq!(model(r#", "KHR_materials_specular": {}"#), ModelTag::Dielectric);
    assert_eq!(model(r#", "KHR_materials_specular": { "specularFactor": 0.5 }"#), ModelTag::Layered);
    assert_eq!(model(r#", "KHR_materials_specular": { "specularFactor": 0 }"#), ModelTag::Layered);
    let colored = r#", "KHR_materials_specular": { "specularColorFactor": [1, 0.5, 0.5] }"#;
    assert_eq!(model(colored), ModelTag::Layered);
}

/// Points, lines and splats are left out, and the report says of which mesh; scattering in bodies is named, too.
#[test]
fn what_is_not_drawn_is_named_and_counted() {
    let positions = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let text = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scenes": [{{ "nodes": [0, 1] }}],
        "extensionsUsed": ["KHR_gaussian_splatting"],
        "nodes": [{{ "mesh": 0 }}, {{ "mesh": 0 }}], "meshes": [{{ "name": "cloud", "primitives": [
            {{ "attributes": {{ "POSITION": 0 }}, "mode": 0 }}, {{ "attributes": {{ "POSITION": 0 }}, "mode": 3 }},
            {{ "attributes": {{ "POSITION": 0 }}, "mode": 1 }}, {{ "attributes": {{ "POSITION": 0 }} }}] }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 36 }}],
        "buffers": [{{ "byteLength": 36, "uri": "data:application/octet-stream;base64,{positions}" }}] }}"#
    );
    let loaded =
        scene::load::gltf::load_bytes(Path::new("cloud.gltf"), text.as_bytes(), &LoadOptions::default());
    let loaded = loaded.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((loaded.report.undrawn_primitives, loaded.scene.unique_triangles()), (3, 1));
    let messages: Vec<_> = loaded.report.notes.iter().map(|n| n.message.as_str()).collect();
    let of_mesh = "mesh 0 `cloud`: 3 of 4 primitives are not drawn: 1 of points, 2 of lines";
    assert!(messages.contains(&of_mesh), "{messages:?}");
    assert!(messages.iter().any(|m| m.contains("KHR_gaussian_splatting is not rendered")), "{messages:?}");
    let scattering =
        small(r#""extensions": { "KHR_materials_volume_scatter": { "multiscatterColor": [1, 0, 0] } }"#);
    let named = |n: &scene::Note| n.message.contains("KHR_materials_volume_scatter is not rendered");
    assert!(scattering.report.notes.iter().any(named), "{:?}", scattering.report);
}
