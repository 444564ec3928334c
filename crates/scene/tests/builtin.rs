//! Every built-in scene loads, is complete, and takes its parameters.

use scene::load::scene_file::Parameters;
use scene::{Environment, LightKind, LoadError, LoadOptions, Loaded, Severity, Shape, builtin};

fn load(name: &str, parameters: &[(&str, &str)]) -> Result<Loaded, LoadError> {
    let parameters: Parameters = parameters.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    builtin::load(name, &parameters, &LoadOptions::default())
}

fn loaded(name: &str, parameters: &[(&str, &str)]) -> Loaded {
    load(name, parameters).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[test]
fn every_scene_is_listed_and_described() {
    let names: Vec<_> = builtin::list().iter().map(|b| b.name).collect();
    assert_eq!(
        names,
        [
            "three-spheres",
            "cornell",
            "material-grid",
            "textures",
            "glass",
            "model",
            "lights",
            "layers",
            "lanterns",
            "offices",
            "atrium"
        ]
    );
    assert_eq!(builtin::DEFAULT, "three-spheres");
    for scene in builtin::list() {
        assert!(!scene.about.is_empty(), "{}: no description", scene.name);
        assert!(
            scene.parameters.iter().all(|p| !p.about.is_empty()),
            "{}: a parameter is not described",
            scene.name
        );
    }
}

#[test]
fn every_scene_loads_and_is_complete() {
    for builtin in builtin::list() {
        let name = builtin.name;
        let Loaded { scene, report } = loaded(name, &[]);
        assert_eq!(scene.name, name);
        let worst = report.notes.iter().find(|note| note.severity > Severity::Info);
        assert!(worst.is_none(), "{name}: {worst:?}");
        let (low, high) = scene.bounds().unwrap_or_else(|| panic!("{name}: empty"));
        assert!(low.is_finite() && high.is_finite(), "{name}: bounds {low} {high}");
        assert!(!scene.cameras.is_empty(), "{name}: no camera");
        let emits = scene.materials.iter().any(|m| m.is_emissive());
        let sky = matches!(scene.environment, Environment::Sky(_));
        assert!(emits || sky || !scene.lights.is_empty(), "{name}: no light");
        let material = |id: &u32| (*id as usize) < scene.materials.len();
        for instance in &scene.instances {
            let mesh = &scene.meshes[instance.mesh as usize];
            assert!(
                instance.materials.iter().all(|m| m.len() == mesh.parts.len() && m.iter().all(material)),
                "{name}"
            );
            assert!(mesh.parts.iter().all(|part| material(&part.material)), "{name}");
        }
    }
}

#[test]
fn three_spheres_has_its_numbers() {
    let scene = loaded("three-spheres", &[]).scene;
    let spheres =
        scene.meshes.iter().flat_map(|m| &m.parts).filter(|p| matches!(p.shape, Shape::Spheres(_))).count();
    assert_eq!(spheres, 3, "spheres are analytic");
    let Environment::Sky(sky) = scene.environment else { panic!("a gradient sky") };
    let sun = sky.sun.expect("a sun");
    assert!((sun.angular_radius - 0.04).abs() < 1e-5);
    let camera = scene.default_camera();
    let eye = camera.at(5.0).eye;
    assert!((glam::Vec2::new(eye.x, eye.z).length() - 12.0).abs() < 1e-4);
    assert!((eye.y - 5.0).abs() < 1e-4, "4 + sin at a quarter turn");
    assert_eq!(camera.at(0.0).eye, camera.eye);
}

#[test]
fn atrium_is_large_enough() {
    let scene = loaded("atrium", &[]).scene;
    let (unique, instanced) = (scene.unique_triangles(), scene.instanced_triangles());
    eprintln!("atrium: {unique} unique, {instanced} instanced triangles");
    assert!(unique >= 200_000, "{unique} unique triangles");
    assert!(instanced >= 600_000, "{instanced} instanced triangles");
}

#[test]
fn lights_has_as_many_models_and_lights_as_asked_for() {
    let scene = loaded("lights", &[("models", "7"), ("lights", "3")]).scene;
    assert_eq!(scene.instances.iter().filter(|i| i.name.starts_with("knot")).count(), 7);
    assert_eq!(scene.lights.len(), 3);
    assert!(scene.lights.iter().all(|l| matches!(l.kind, LightKind::Point { .. })));
    let scene = loaded("lights", &[("models", "0"), ("lights", "0")]).scene;
    assert_eq!(scene.lights.len(), 0);
}

#[test]
fn models_are_fitted_and_stand_on_the_ground() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("tall.toml");
    let text = "[[shape]]\nname = \"tall\"\nkind = \"box\"\nsize = [1, 10, 1]\ntranslate = [5, 5, 5]\n";
    std::fs::write(&file, text).expect("written");
    let file = file.to_string_lossy();
    let scene = loaded("model", &[("file", &file), ("size", "3")]).scene;
    let model = scene.instances.iter().find(|i| i.name == "tall").expect("the model");
    let (low, high) = scene.meshes[model.mesh as usize].bounds().expect("bounds");
    let (low, high) = (model.transform.transform_point3(low), model.transform.transform_point3(high));
    assert!(low.abs_diff_eq(glam::vec3(-0.15, 0.0, -0.15), 1e-4), "{low}");
    assert!(high.abs_diff_eq(glam::vec3(0.15, 3.0, 0.15), 1e-4), "{high}");
    assert!(scene.instances.iter().all(|i| i.name != "sculpture"), "the stand-in is gone");
    let scene = loaded("lights", &[("file", &file), ("models", "4")]).scene;
    assert_eq!(scene.instances.iter().filter(|i| i.name == "tall").count(), 4);
    assert_eq!(scene.meshes.iter().filter(|m| m.name == "tall").count(), 1, "stored once");
}

#[test]
fn wrong_parameters_are_named() {
    let message =
        |name, parameters: &[(&str, &str)]| load(name, parameters).expect_err("an error").to_string();
    let unknown = message("lights", &[("modles", "3")]);
    assert!(unknown.contains("modles") && unknown.contains("`models`"), "{unknown}");
    assert!(message("lights", &[("models", "three")]).contains("not a whole number"));
    assert!(message("lights", &[("models", "-1")]).contains("less than 0"));
    assert!(message("lights", &[("power", "nan")]).contains("finite"));
    assert!(message("cornell", &[("x", "1")]).contains("no parameters"));
    let unknown = message("cornel", &[]);
    assert!(unknown.contains("cornel") && unknown.contains("three-spheres"), "{unknown}");
    assert!(matches!(load("model", &[("file", "no such file.obj")]), Err(LoadError::Read { .. })));
}
