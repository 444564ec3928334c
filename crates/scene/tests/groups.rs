//! What files group is kept for people: its names, its tree, and edits of both.

use glam::Vec2;
use scene::edits::file::EditedFile;
use scene::edits::{Addition, EditError, Editable, Edits, Resources, UvTransformRecord};
use scene::load::packed::{pack, unpack};
use scene::load::scene_file::{self, open_edited};
use scene::load::{gltf, pbrt};
use scene::tables::SceneTables;
use scene::{
    ColorSpace, Image, LoadOptions, Pixels, Scene, Texture, TextureRef, TextureSlot, UvTransform, builtin,
};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

/// Each object as the path of its groups and its own name.
fn paths(scene: &Scene) -> Vec<String> {
    let name = |id: u32| scene.groups.list[id as usize].name.clone();
    let path = |(id, instance): (u32, &scene::Instance)| {
        let mut names: Vec<String> = scene.groups.upwards(scene.groups.of(id)).map(name).collect();
        names.reverse();
        names.push(instance.name.clone());
        names.join("/")
    };
    (0..).zip(&scene.instances).map(path).collect()
}

/// Nodes that all have the same triangle.
fn gltf_of(nodes: Value, roots: &[u32]) -> Scene {
    let positions: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let bytes: Vec<u8> = positions.iter().flat_map(|v| v.to_le_bytes()).collect();
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.bin"), bytes).expect("written");
    let file = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": roots }],
        "nodes": nodes,
        "meshes": [{ "name": "hull", "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": "a.bin" }],
    });
    let path = folder.path().join("a.gltf");
    let bytes = file.to_string();
    gltf::load_bytes(&path, bytes.as_bytes(), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene
}

#[test]
fn nodes_of_gltf_are_groups_where_objects_are_below_them() {
    let nodes = json!([
        { "name": "car", "children": [1, 2, 4] },
        { "name": "wheels", "children": [3] },
        { "name": "empty", "children": [5] },
        { "name": "left", "mesh": 0 },
        { "name": "door", "mesh": 0, "children": [6] },
        { "name": "nothing" },
        { "mesh": 0 },
        { "name": "alone", "mesh": 0 },
    ]);
    let scene = gltf_of(nodes, &[7, 0]);
    let expected = ["alone", "car/wheels/left", "car/door/door", "car/door/hull"];
    assert_eq!(paths(&scene), expected);
    let names: Vec<_> = scene.groups.list.iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["car", "wheels", "door"], "what holds no objects is no group");
}

#[test]
fn deep_hierarchies_end() {
    let chain = (0..20_000).map(|i| json!({ "name": "n", "children": [i + 1] }));
    let nodes: Vec<Value> = chain.chain([json!({ "name": "leaf", "mesh": 0 })]).collect();
    let scene = gltf_of(nodes.into(), &[0]);
    assert_eq!(scene.groups.list.len(), 20_000);
    assert_eq!(scene.groups.upwards(scene.groups.of(0)).count(), 20_000);
}

#[test]
fn objects_of_pbrt_group_their_instances() {
    let shape = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]\n";
    let text = format!(
        "WorldBegin\n{shape}ObjectBegin \"tree\"\n{shape}{shape}ObjectEnd\n\
         ObjectInstance \"tree\"\nObjectInstance \"tree\"\n"
    );
    let path = Path::new("a.pbrt");
    let scene = pbrt::load_bytes(path, text.into(), &LoadOptions::default()).expect("sound").scene;
    let groups: Vec<_> = (0..5).map(|i| scene.groups.of(i)).collect();
    assert_eq!(groups, [None, Some(0), Some(0), Some(0), Some(0)]);
    assert_eq!((scene.groups.list.len(), scene.groups.list[0].name.as_str()), (1, "tree"));
}

#[test]
fn copies_and_models_of_scene_files_are_groups() {
    let folder = tempfile::tempdir().expect("a folder");
    let repeat = "repeat = { at = [[0, 0, 0], [2, 0, 0]] }\n";
    let pair = format!("[[shape]]\nname = \"seat\"\nkind = \"quad\"\n{repeat}[[shape]]\nkind = \"box\"\n");
    std::fs::write(folder.path().join("pair.toml"), pair).expect("written");
    let text = format!(
        "[[shape]]\nname = \"floor\"\nkind = \"quad\"\n\
         [[model]]\nfile = \"pair.toml\"\n[[model]]\nname = \"row\"\nfile = \"pair.toml\"\n{repeat}"
    );
    let path = folder.path().join("all.toml");
    std::fs::write(&path, text).expect("written");
    let scene = scene_file::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene;
    let expected = [
        "floor",
        "pair/seat/seat 1",
        "pair/seat/seat 2",
        "pair/box",
        "row/row 1/seat/seat 1",
        "row/row 1/seat/seat 2",
        "row/row 1/box",
        "row/row 2/seat/seat 1",
        "row/row 2/seat/seat 2",
        "row/row 2/box",
    ];
    assert_eq!(paths(&scene), expected);
    let again = unpack(Path::new("a.alhazen"), &pack(&scene).expect("bytes")).expect("sound");
    assert_eq!(paths(&again), expected);
}

fn car() -> Scene {
    let nodes = json!([
        { "name": "car", "children": [1, 2] },
        { "name": "wheels", "children": [3, 4] },
        { "name": "body", "mesh": 0 },
        { "name": "left", "mesh": 0 },
        { "name": "right", "mesh": 0 },
    ]);
    gltf_of(nodes, &[0])
}

fn visible(scene: &Scene) -> Vec<&str> {
    scene.instances.iter().filter(|i| i.visible).map(|i| i.name.as_str()).collect()
}

#[test]
fn groups_are_renamed_and_hidden_and_brought_back() {
    let mut scene = Editable::new(car());
    let mut edits = Edits::default();
    let set = |scene: &mut Editable, edits: &Edits| scene.set(edits, &Resources::default());
    edits.group(1).hidden = true;
    edits.group(1).name = Some("tyres".into());
    set(&mut scene, &edits).expect("valid");
    assert_eq!(visible(scene.scene()), ["body"]);
    assert_eq!(paths(scene.scene())[0], "car/tyres/left");
    edits.group(1).hidden = false;
    edits.object(1).visible = Some(false);
    set(&mut scene, &edits).expect("valid");
    assert_eq!(visible(scene.scene()), ["left", "body"], "what was hidden by itself stays so");
    edits.isolated.extend([0, 1]);
    set(&mut scene, &edits).expect("valid");
    assert_eq!(visible(scene.scene()), ["left"]);
    set(&mut scene, &Edits::default()).expect("valid");
    assert_eq!((visible(scene.scene()).len(), paths(scene.scene())[0].as_str()), (3, "car/wheels/left"));
    edits.group(9).hidden = true;
    assert_eq!(set(&mut scene, &edits), Err(EditError::Group { id: 9, count: 2 }));
}

#[test]
fn models_are_added_as_a_group_and_copies_stay_beside_what_they_copy() {
    let model = Path::new("garage/car.glb").to_owned();
    let mut resources = Resources::default();
    resources.models.insert(model.clone(), Arc::new(car()));
    let additions = vec![Addition::Model { file: model }, Addition::Copy { of: 0 }];
    let mut scene = Editable::new(car());
    scene.set(&Edits { additions, ..Edits::default() }, &resources).expect("valid");
    let all = paths(scene.scene());
    assert_eq!(
        all[3..],
        ["car/car/wheels/left", "car/car/wheels/right", "car/car/body", "car/wheels/left copy"]
    );
}

/// A scene with one textured material, and edits that give it another picture.
fn repainted(folder: &Path) -> (Scene, Edits, Resources) {
    for (name, level) in [("red.png", 200), ("new.png", 50)] {
        let picture = image::RgbImage::from_pixel(2, 1, image::Rgb([level, 0, 0]));
        picture.save(folder.join(name)).expect("written");
    }
    let text = "[[shape]]\nkind = \"quad\"\nmaterial = { base-color-texture = \"red.png\" }\n";
    std::fs::write(folder.join("base.toml"), text).expect("written");
    let base = scene_file::load(&folder.join("base.toml"), &LoadOptions::default()).expect("loads").scene;
    let material = base.meshes[0].parts[0].material;
    let file = folder.join("new.png");
    let mut edits = Edits::default();
    let slot = edits.slot(material, TextureSlot::BaseColor);
    slot.file = Some(file.clone());
    slot.transform = Some(UvTransformRecord { offset: [0.25, 0.5], rotation: 0.5, scale: [2.0, 3.0] });
    edits.slot(material, TextureSlot::MetallicRoughness).file = Some(file.clone());
    edits.slot(material, TextureSlot::MetallicRoughness).uv_set = Some(1);
    edits.object(0).visible = Some(true);
    edits.isolated.insert(0);
    let pixels = Pixels::Rgba8(vec![[50, 0, 0, 255]; 2]);
    let image = Image { name: "new.png".into(), width: 2, height: 1, pixels };
    let mut resources = Resources::default();
    resources.pictures.insert(file, Arc::new(image));
    (base, edits, resources)
}

#[test]
fn textures_are_replaced_moved_saved_and_brought_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let (base, edits, resources) = repainted(folder.path());
    let material = base.meshes[0].parts[0].material as usize;
    let mut edited = Editable::new(base.clone());
    edited.set(&edits, &resources).expect("valid");
    let scene = edited.scene();
    assert_eq!(scene.images.len(), base.images.len() + 1, "a picture of two slots is there once");
    let colour = scene.materials[material].base_color_texture.expect("a texture");
    assert_eq!(colour.transform, UvTransform::new(Vec2::new(0.25, 0.5), 0.5, Vec2::new(2.0, 3.0)));
    let rough = scene.materials[material].metallic_roughness_texture.expect("a texture");
    assert_eq!(rough.uv_set, 1);
    let space = |shown: TextureRef| match &scene.textures[shown.texture as usize] {
        Texture::Image(texture) => (texture.image as usize, texture.color_space),
        Texture::Graph(_) => panic!("an image"),
    };
    let image = base.images.len();
    assert_eq!(space(colour), (image, ColorSpace::Srgb));
    assert_eq!(space(rough), (image, ColorSpace::Linear));
    let file = EditedFile {
        name: base.name.clone(),
        file: Some(folder.path().join("base.toml")),
        edits: edits.clone(),
        ..EditedFile::default()
    };
    let text = file.to_text(folder.path()).expect("text");
    let path = folder.path().join("edited.toml");
    std::fs::write(&path, &text).expect("written");
    let opened = open_edited(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert_eq!(opened.expect("has a base").edits, edits, "{text}");
    let loaded = scene_file::load(&path, &LoadOptions::default()).expect("loads").scene;
    let fingerprint = |scene: &Scene| SceneTables::build(scene).fingerprint();
    assert_eq!(fingerprint(&loaded), fingerprint(edited.scene()));
    edited.set(&Edits::default(), &resources).expect("valid");
    assert_eq!(fingerprint(edited.scene()), fingerprint(&base));
}

#[test]
fn impossible_textures_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let (base, mut edits, resources) = repainted(folder.path());
    let material = base.meshes[0].parts[0].material;
    let mut scene = Editable::new(base);
    let error = scene.set(&edits, &Resources::default()).expect_err("not loaded").to_string();
    assert!(error.contains("new.png"), "{error}");
    edits.slot(material, TextureSlot::BaseColor).uv_set = Some(7);
    let error = scene.set(&edits, &resources).expect_err("no such set").to_string();
    assert!(error.contains("BaseColor") && error.contains("not 7"), "{error}");
    let mut edits = Edits::default();
    edits.slot(99, TextureSlot::Normal).uv_set = Some(0);
    assert!(matches!(scene.set(&edits, &resources), Err(EditError::Material { id: 99, .. })));
}

#[test]
fn transforms_of_coordinates_are_read_back() {
    for (rotation, scale) in [(0.0, [1.0, 1.0]), (2.5, [0.5, 3.0]), (-1.2, [2.0, -1.5])] {
        let transform = UvTransform::new(Vec2::new(0.1, -4.0), rotation, scale.into());
        let again = UvTransformRecord::from(&transform).transform();
        for row in 0..2 {
            assert!((again.rows[row] - transform.rows[row]).length() < 1e-5, "{rotation} {scale:?}");
        }
        assert_eq!(again.offset, transform.offset);
    }
}

#[test]
fn built_in_scenes_have_groups_for_their_copies() {
    let load =
        |name: &str| builtin::load(name, &Default::default(), &LoadOptions::default()).expect("built in");
    let atrium = load("atrium").scene;
    assert!(atrium.groups.list.len() > 1, "{:?}", atrium.groups.list);
    assert!(atrium.groups.of_instances.len() <= atrium.instances.len());
}
