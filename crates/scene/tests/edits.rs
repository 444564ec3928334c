//! Scenes with edits on top: what is written loads as the very scene that was edited.

use glam::{Affine3A, Vec3};
use proptest::prelude::*;
use scene::edits::file::EditedFile;
use scene::edits::{
    Addition, CameraRecord, EditError, Editable, Edits, EnvironmentRecord, GraphRecord, InputRecord,
    MaterialRecord, ParameterRecord, PlacementRecord, Resources, ShownRecord, SkyRecord, SunRecord,
};
use scene::load::scene_file::{self, open_edited};
use scene::tables::SceneTables;
use scene::{
    Camera, EnvironmentPreset, Light, LightKind, LightProfile, LoadError, LoadOptions, Photometry,
    RenderDefaults, Scene, Texture, TextureRef, builtin,
};
use std::path::Path;
use std::sync::Arc;

fn cornell() -> Scene {
    builtin::load("cornell", &Default::default(), &LoadOptions::default()).expect("built in").scene
}

fn fingerprint(scene: &Scene) -> String {
    SceneTables::build(scene).fingerprint()
}

/// A profile whose numbers have no short decimals, turned so that its axes have none either.
fn lamp() -> Photometry {
    let values = (0..3 * 4).map(|i| 1.0 / (i + 1) as f32).collect();
    let profile = LightProfile::new(3, 4, values, 1000.0 / 3.0).expect("a profile");
    Photometry::aimed(Arc::new(profile), Vec3::new(0.3, -1.0, 0.2).normalize(), 0.4)
}

/// Edits of everything that can be edited, of the scene `cornell`, with a model from `folder`.
fn all_edits(scene: &Scene, folder: &Path) -> (Edits, Resources) {
    let model = folder.join("model.obj");
    std::fs::write(&model, "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0.3\nf 1 2 3\n").expect("written");
    let loaded = scene::load::load(&model, &LoadOptions::default()).expect("a triangle").scene;
    let mut resources = Resources::default();
    resources.models.insert(model.clone(), Arc::new(loaded));
    let objects = scene.instances.len() as u32;
    let materials = scene.materials.len() as u32;
    let mut edits = Edits {
        additions: vec![
            Addition::Model { file: model },
            Addition::Copy { of: 0 },
            Addition::Lamp { radius: 0.1, radiance: [1.0, 0.3, 0.1] },
            Addition::Material { of: 0 },
        ],
        ..Edits::default()
    };
    let record = MaterialRecord { roughness: 0.1, metallic: 1.0 / 3.0, ..(&scene.materials[0]).into() };
    edits.materials.insert(0, record);
    edits.object(0).set_transform(&Affine3A::from_rotation_y(0.7));
    edits.object(1).visible = Some(false);
    edits.object(2).removed = true;
    edits.object(objects + 1).material = Some(materials + 2);
    edits.object(objects + 2).set_transform(&Affine3A::from_translation(Vec3::new(0.1, 0.2, 0.7)));
    let (position, intensity) = (Vec3::new(0.1, 0.2, 0.3), Vec3::new(1.0, 2.0, 3.0));
    let direction = Vec3::new(0.3, -1.0, 0.2).normalize();
    edits.lights = Some(vec![
        Light { profile: Some(lamp()), ..Light::new("p", LightKind::Point { position, intensity }) },
        Light::new(
            "s",
            LightKind::Spot { position, direction, intensity, inner_angle: 0.2, outer_angle: 0.7 },
        ),
        Light::new(
            "r",
            LightKind::Projector {
                position,
                direction,
                up: Vec3::Y,
                intensity,
                field_of_view: 0.3,
                picture: TextureRef { uv_set: 1, ..TextureRef::new(3) },
            },
        ),
    ]);
    edits.environment = Some(EnvironmentRecord::Sky(SkyRecord {
        horizon: [0.1; 3],
        zenith: [0.2, 0.3, 0.7],
        ground: [0.0; 3],
        sun: Some(SunRecord {
            direction: Vec3::new(0.3, 0.9, 0.1).normalize().to_array(),
            irradiance: [1.0; 3],
            angular_radius: 0.01,
        }),
    }));
    let camera = Camera::perspective("mine", Vec3::new(0.1, 0.2, 0.9), Vec3::ZERO, 0.7);
    edits.cameras = Some(vec![CameraRecord::from(&camera)]);
    (edits, resources)
}

#[test]
fn what_is_written_loads_as_the_edited_scene() {
    let folder = tempfile::tempdir().expect("a folder");
    let (edits, resources) = all_edits(&cornell(), folder.path());
    let mut edited = Editable::new(cornell());
    edited.set(&edits, &resources).expect("valid");
    let render = RenderDefaults { spp: Some(7), ..RenderDefaults::default() };
    let file = EditedFile {
        name: "mine".into(),
        builtin: Some("cornell".into()),
        render,
        edits,
        ..EditedFile::default()
    };
    let path = folder.path().join("edited.toml");
    let text = file.to_text(folder.path()).expect("text");
    assert!(text.contains("file = \"model.obj\""), "paths are relative: {text}");
    std::fs::write(&path, &text).expect("written");
    let loaded =
        scene_file::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}\n{text}")).scene;
    assert_eq!(fingerprint(&loaded), fingerprint(edited.scene()));
    assert_eq!(loaded.cameras, edited.scene().cameras);
    assert_eq!((loaded.name.as_str(), loaded.defaults.spp), ("mine", Some(7)));
    let names = |s: &Scene| s.instances.iter().map(|i| i.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&loaded), names(edited.scene()));
    // And its parts come back apart, so that it can be edited further.
    let opened = open_edited(&path, &LoadOptions::default()).expect("loads").expect("has a base");
    assert_eq!(opened.edits.objects, file.edits.objects);
    assert_eq!(opened.base_builtin.as_deref(), Some("cornell"));
    assert_eq!(fingerprint(&opened.base), fingerprint(&cornell()));
}

#[test]
fn edits_are_taken_back_without_a_trace() {
    let folder = tempfile::tempdir().expect("a folder");
    let before = fingerprint(&cornell());
    let (edits, resources) = all_edits(&cornell(), folder.path());
    let mut scene = Editable::new(cornell());
    scene.set(&edits, &resources).expect("valid");
    let all = fingerprint(scene.scene());
    assert_ne!(all, before);
    scene.set(&Edits::default(), &resources).expect("valid");
    assert_eq!(fingerprint(scene.scene()), before);
    scene.set(&edits, &resources).expect("valid");
    scene.set(&edits, &resources).expect("the same again, without adding anew");
    assert_eq!(fingerprint(scene.scene()), all);
}

#[test]
fn impossible_edits_are_named() {
    let mut scene = Editable::new(cornell());
    let mut attempt = |change: &dyn Fn(&mut Edits)| {
        let mut edits = Edits::default();
        change(&mut edits);
        scene.set(&edits, &Resources::default()).expect_err("impossible")
    };
    assert!(matches!(attempt(&|e| e.object(77).removed = true), EditError::Object { id: 77, .. }));
    assert!(matches!(attempt(&|e| e.object(0).material = Some(99)), EditError::Material { id: 99, .. }));
    let file = |e: &mut Edits| e.additions.push(Addition::Model { file: "x.obj".into() });
    assert!(attempt(&file).to_string().contains("x.obj"));
    let nan = |e: &mut Edits| e.object(0).transform = Some([f32::NAN; 12]);
    assert!(attempt(&nan).to_string().contains("finite"));
    let rough = MaterialRecord { roughness: 2.0, ..(&cornell().materials[0]).into() };
    let error = attempt(&|e| drop(e.materials.insert(0, rough.clone())));
    assert!(error.to_string().contains("`roughness`"), "{error}");
    let own = EnvironmentRecord::Own { rotation: 0.0, intensity: 1.0 };
    assert!(attempt(&|e| e.environment = Some(own.clone())).to_string().contains("picture of its own"));
}

/// The studio is a picture that no file has: whoever loads what was written makes it again.
#[test]
fn ready_made_environments_are_written_and_made_again() {
    let folder = tempfile::tempdir().expect("a folder");
    for preset in EnvironmentPreset::ALL {
        let edits = Edits { environment: Some(preset.into()), ..Edits::default() };
        let mut edited = Editable::new(cornell());
        edited.set(&edits, &Resources::default()).expect("valid");
        let mut expected = cornell();
        preset.put_around(&mut expected, 0.0, 1.0);
        assert_eq!(edited.scene().environment, expected.environment);
        assert_eq!(edited.scene().images.len(), expected.images.len());
        let render = RenderDefaults::default();
        let (file, parameters) = (None, Default::default());
        let builtin = Some("cornell".to_owned());
        let written = EditedFile { name: String::new(), file, builtin, parameters, render, edits };
        let path = folder.path().join(format!("{}.toml", preset.name()));
        std::fs::write(&path, written.to_text(folder.path()).expect("text")).expect("written");
        let loaded = scene_file::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(loaded.scene.environment, expected.environment);
        let pixels = |scene: &Scene| scene.images.last().map(|image| format!("{:?}", image.pixels));
        assert!(pixels(&loaded.scene) == pixels(&expected));
    }
}

/// A scene with graphs of many kinds of nodes, one of which shows an image; textures 0 and 1 are images.
fn graphs(folder: &Path) -> Scene {
    let png = picture_file(folder);
    let text = format!(
        r#"
        [textures.cloud]
        node = "noise"
        kind = "simplex"
        turbulence = true
        octaves = 5.3
        space = "object"
        scale = [3, 2, 0.7]
        rotate = [10, 20, 30]
        offset = {{ node = "wave", shape = "rings" }}

        [[shape]]
        kind = "sphere"
        material = {{ base-color-texture = "{png}", emission-texture = "{png}", emission = 0.1, roughness = {{ node = "mix", a = "cloud", b = [0.1, 0.2, 0.3], factor = {{ node = "triplanar", image = {{ file = "{png}", scale = [3, 1], rotate = 20 }} }} }} }}
        "#
    );
    let file = folder.join("graphs.toml");
    std::fs::write(&file, text).expect("written");
    scene_file::load(&file, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene
}

/// The name of a picture of one pixel.
fn picture_file(folder: &Path) -> String {
    image::RgbImage::from_pixel(1, 1, image::Rgb([200, 100, 50]))
        .save(folder.join("p.png"))
        .expect("written");
    "p.png".into()
}

/// The graphs of a scene, by the numbers of their textures.
fn records(scene: &Scene) -> Vec<(u32, GraphRecord)> {
    let graph = |(id, texture): (u32, &Texture)| match texture {
        Texture::Graph(graph) => Some((id, GraphRecord::from(graph))),
        Texture::Image(_) => None,
    };
    (0..).zip(&scene.textures).filter_map(graph).collect()
}

/// The record of the first node of a kind.
fn node_of<'a>(record: &'a mut GraphRecord, kind: &str) -> &'a mut scene::edits::NodeRecord {
    record.nodes.iter_mut().find(|node| node.node == kind).expect("there is one")
}

#[test]
fn graphs_are_written_changed_and_brought_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let base = graphs(folder.path());
    let (id, record) = records(&base).pop().expect("a graph");
    // What nobody has changed is the same graph.
    assert_eq!(Texture::Graph(record.graph().expect("a graph")), base.textures[id as usize]);

    let mut changed = record;
    let noise = node_of(&mut changed, "noise");
    noise.parameters.insert("gain".into(), ParameterRecord::Number(1.0 / 3.0));
    noise.parameters.insert("kind".into(), ParameterRecord::Choice("perlin".into()));
    placement_of(&mut changed).map[11] = 0.1;
    node_of(&mut changed, "mix").inputs.insert("b".into(), InputRecord::Color([0.1, 0.2, 0.7, 1.0]));
    let mut edits = Edits::default();
    edits.textures.insert(id, changed);
    let mut edited = Editable::new(base.clone());
    edited.set(&edits, &Resources::default()).expect("valid");
    assert_ne!(fingerprint(edited.scene()), fingerprint(&base));

    let file = folder.path().join("graphs.toml");
    let file =
        EditedFile { name: base.name.clone(), file: Some(file), edits: edits.clone(), ..Default::default() };
    let text = file.to_text(folder.path()).expect("text");
    assert!(text.contains("kind = \"perlin\"") && text.contains("space = \"object\""), "{text}");
    let path = folder.path().join("edited.toml");
    std::fs::write(&path, &text).expect("written");
    let opened = open_edited(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert_eq!(opened.expect("has a base").edits.textures, edits.textures);
    let loaded = scene_file::load(&path, &LoadOptions::default()).expect("loads").scene;
    assert_eq!(loaded.textures, edited.scene().textures);
    assert_eq!(fingerprint(&loaded), fingerprint(edited.scene()));

    edited.set(&Edits::default(), &Resources::default()).expect("valid");
    assert_eq!(edited.scene().textures, base.textures, "taken back");
}

#[test]
fn textures_keep_their_numbers_when_models_come() {
    let folder = tempfile::tempdir().expect("a folder");
    let base = graphs(folder.path());
    let (id, mut record) = records(&base).pop().expect("a graph");
    node_of(&mut record, "noise").parameters.insert("seed".into(), ParameterRecord::Number(9.0));
    let mut resources = Resources::default();
    resources.models.insert("model.toml".into(), Arc::new(base.clone()));
    let addition = Addition::Model { file: "model.toml".into() };
    let mut edits = Edits { additions: vec![addition], ..Edits::default() };
    let count = base.textures.len() as u32;
    edits.textures.insert(id, record.clone());
    let mut edited = Editable::new(base.clone());
    edited.set(&edits, &resources).expect("valid");
    let graph = Texture::Graph(record.graph().expect("a graph"));
    assert_eq!(edited.scene().textures[id as usize], graph);
    assert_ne!(edited.scene().textures[(count + id) as usize], graph);
    // Graphs of the model can be changed as well, and what they show has moved with them.
    let Texture::Graph(added) = &edited.scene().textures[(count + id) as usize] else { panic!("a graph") };
    edits.textures.insert(count + id, GraphRecord::from(added));
    edited.set(&edits, &resources).expect("valid");
    edited.set(&Edits::default(), &resources).expect("valid");
    assert_eq!(edited.scene().textures, base.textures);
}

fn placement_of(record: &mut GraphRecord) -> &mut PlacementRecord {
    node_of(record, "noise").placement.as_mut().expect("placed")
}

fn shown_by(record: &mut GraphRecord) -> &mut ShownRecord {
    node_of(record, "triplanar").image.as_mut().expect("shown")
}

type Change = Box<dyn Fn(&mut GraphRecord)>;

#[test]
fn broken_graphs_are_named_with_their_texture_and_node() {
    let folder = tempfile::tempdir().expect("a folder");
    let base = graphs(folder.path());
    let (id, record) = records(&base).pop().expect("a graph");
    let first = record.nodes.iter().position(|node| node.node == "noise").expect("there is one");
    let mut scene = Editable::new(base);
    let mut attempt = |id: u32, change: &dyn Fn(&mut GraphRecord)| {
        let mut edits = Edits::default();
        let mut record = record.clone();
        change(&mut record);
        edits.textures.insert(id, record);
        scene.set(&edits, &Resources::default()).expect_err("impossible")
    };
    assert!(matches!(attempt(99, &|_| {}), EditError::Texture { id: 99, .. }));
    assert_eq!(attempt(0, &|_| {}), EditError::NotAGraph(0));
    let gain = |value: f32| {
        move |r: &mut GraphRecord| {
            node_of(r, "noise").parameters.insert("gain".into(), ParameterRecord::Number(value));
        }
    };
    let error = attempt(id, &gain(2.0)).to_string();
    let place = format!("texture {id}: node {} (`noise`)", first);
    assert_eq!(error, format!("{place}: `gain`: it must be from 0 to 1, it is 2"));
    assert!(attempt(id, &gain(f32::NAN)).to_string().starts_with(&place));
    let number = InputRecord::Number;
    let input = |kind: &'static str, name: &'static str, value: InputRecord| -> Change {
        Box::new(move |r| {
            node_of(r, kind).inputs.insert(name.into(), value);
        })
    };
    let changes: [(&str, Change); 9] = [
        ("there is no such node", Box::new(|r| node_of(r, "noise").node = "nois".into())),
        ("there is no input `x`", input("noise", "x", number(1.0))),
        ("is too large", input("mix", "a", number(f32::INFINITY))),
        ("of a later node", input("mix", "a", InputRecord::Node { node: 60 })),
        ("could be placed", Box::new(|r| node_of(r, "mix").offset = Some(InputRecord::Number(1.0)))),
        ("is not finite", Box::new(|r| placement_of(r).map[0] = f32::NAN)),
        ("it has no image", Box::new(|r| node_of(r, "triplanar").image = None)),
        ("there is no texture 50", Box::new(|r| shown_by(r).texture = 50)),
        ("the texture has no nodes", Box::new(|r| r.nodes.clear())),
    ];
    for (words, change) in changes {
        let error = attempt(id, &change).to_string();
        assert!(error.starts_with(&format!("texture {id}: ")) && error.contains(words), "{words}: {error}");
    }
}

#[test]
fn wrong_files_are_refused_with_their_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    for (text, part) in [
        ("[base]\n", "one of `file` and `builtin`"),
        ("[base]\nbuiltin = \"nothing\"\n", "nothing"),
        ("[base]\nfile = \"scene.toml\"\n", "includes itself"),
        ("[base]\nbuiltin = \"cornell\"\n[[shape]]\nkind = \"sphere\"\n", "unknown key `shape`"),
        ("[base]\nbuiltin = \"cornell\"\n[edits.objects.x]\nremoved = true\n", "`x` is not a number"),
        ("[base]\nbuiltin = \"cornell\"\n[edits.objects.900]\nremoved = true\n", "no object 900"),
        (
            "[base]\nbuiltin = \"textures\"\n[[edits.textures.0.nodes]]\nnode = \"noise\"\nparameters = { octaves = 99 }\n",
            "texture 0: node 0 (`noise`): `octaves`: it must be from 1 to 16, it is 99",
        ),
        (
            "[base]\nbuiltin = \"textures\"\n[[edits.textures.0.nodes]]\nnode = \"mix\"\ninputs = { a = \"x\" }\n",
            "an input is a number, a colour of four numbers, or { node = N }",
        ),
        ("[base]\nbuiltin = \"cornell\"\n[[edits.add]]\nmodel = { file = \"none.obj\" }\n", "none.obj"),
    ] {
        std::fs::write(&path, text).expect("written");
        let error = scene_file::load(&path, &LoadOptions::default()).expect_err(text);
        assert!(
            error.to_string().contains(part) || matches!(error, LoadError::Read { .. }),
            "{text}: {error}"
        );
    }
}

proptest! {
    #[test]
    fn numbers_come_back_bit_for_bit(values in prop::array::uniform12(-1e15f32..1e15), small in -1e-20f32..1e-20) {
        let mut edits = Edits::default();
        let mut values = values;
        values[11] = small;
        edits.object(3).transform = Some(values);
        let file = EditedFile { builtin: Some("cornell".into()), edits: edits.clone(), ..Default::default() };
        let text = file.to_text(Path::new("")).expect("text");
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, text).expect("written");
        let opened = open_edited(&path, &LoadOptions::default()).expect("loads").expect("has a base");
        let bits = |e: &Edits| e.objects[&3].transform.map(|t| t.map(f32::to_bits));
        prop_assert_eq!(bits(&opened.edits), bits(&edits));
    }
}
