use super::*;
use glam::{Affine3A, Quat, Vec3};
use scene::{AlphaMode, Instance, Material, Mesh, Model, Part, Scene, Shape, shapes};

fn queries(scene: &Scene) -> RayQueries {
    RayQueries::new(SceneTables::build(scene), Some(2)).expect("threads")
}

/// A mesh of a floor and a smaller rectangle above it, which stands twice in the world, and a sphere.
fn scene() -> Scene {
    let mut scene = Scene::default();
    let white = Material {
        model: Model::Lambert,
        base_color: glam::vec4(0.5, 0.25, 1.0, 1.0),
        ..Material::default()
    };
    scene.materials.push(white);
    let rectangle = |size: f32, height: f32| {
        let lift = Affine3A::from_translation(Vec3::Y * height);
        Part {
            shape: Shape::Triangles(shapes::transformed(shapes::rectangle(glam::Vec2::splat(size)), &lift)),
            material: 0,
        }
    };
    scene.meshes.push(Mesh { name: "layers".into(), parts: vec![rectangle(4.0, 0.0), rectangle(1.0, 1.0)] });
    scene.meshes.push(Mesh::single("ball", shapes::sphere(0.5), 0));
    scene.instances.push(Instance::new("far", 0, Affine3A::from_translation(Vec3::X * 100.0)));
    scene.instances.push(Instance::new("here", 0, Affine3A::IDENTITY));
    scene.instances.push(Instance::new("ball", 1, Affine3A::from_translation(Vec3::new(0.0, 5.0, 0.0))));
    scene
}

#[test]
fn hits_name_what_the_user_knows() {
    let origins = [[1.0, 3.0, 0.5], [0.1, 3.0, 0.2], [100.0, 3.0, 0.2], [9.0, 3.0, 0.0], [0.0, 9.0, 0.0]];
    let directions =
        [[0.0, -2.0, 0.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0]];
    let rays = Rays::new(&origins, &directions).expect("as many");
    let queries = queries(&scene());
    let hits = queries.intersect(&rays, true, &Control::new());
    assert_eq!(hits.instance, [1, 1, 0, -1, 2]);
    assert_eq!(hits.t, [1.5, 2.0, 2.0, f32::INFINITY, 3.5], "in units of the direction");
    // The upper rectangle is the second part: its two triangles follow those of the floor.
    assert!((0..2).contains(&hits.primitive[0]) && (2..4).contains(&hits.primitive[1]), "{hits:?}");
    assert_eq!((hits.primitive[3], hits.primitive[4]), (-1, 0));
    let up = [0.0, 1.0, 0.0];
    assert_eq!(hits.normals, [up, up, up, [0.0; 3], up]);
    assert_eq!(queries.occluded(&rays, &Control::new()), [true, true, true, false, true]);
    let short = Rays { t_max: 1.9, ..rays };
    assert_eq!(queries.occluded(&short, &Control::new()), [true, false, false, false, false]);
}

#[test]
fn normals_face_as_the_winding_does_under_any_transform() {
    let mut scene = scene();
    let turned = Affine3A::from_scale_rotation_translation(
        Vec3::new(-2.0, 1.0, 3.0),
        Quat::from_rotation_z(std::f32::consts::FRAC_PI_2),
        Vec3::ZERO,
    );
    scene.instances[1].transform = turned;
    let (origins, directions) = ([[5.0, 0.1, 0.1], [-5.0, 0.1, 0.1]], [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    let rays = Rays::new(&origins, &directions).expect("as many");
    let normals = queries(&scene).intersect(&rays, true, &Control::new()).normals;
    for n in normals {
        let error = (Vec3::from(n) - Vec3::NEG_X).length();
        assert!(error < 1e-6, "the mesh's +Y became -X; got {n:?}");
    }
}

#[test]
fn barycentrics_lead_back_to_the_point() {
    let scene = scene();
    let Shape::Triangles(floor) = &scene.meshes[0].parts[0].shape else { panic!("triangles") };
    let origins: Vec<_> = (0..100).map(|i| [0.03 * i as f32 - 1.4, 0.5, 0.017 * i as f32 - 0.9]).collect();
    let directions = vec![[0.0, -1.0, 0.0]; origins.len()];
    let hits = queries(&scene).intersect(
        &Rays::new(&origins, &directions).expect("as many"),
        false,
        &Control::new(),
    );
    assert!(hits.normals.is_empty());
    for (i, origin) in origins.iter().enumerate() {
        let [a, b, c] = floor.indices[hits.primitive[i] as usize].map(|v| floor.positions[v as usize]);
        let [u, v] = hits.barycentrics[i];
        let expected = Vec3::new(origin[0], 0.0, origin[2]);
        let actual = a * (1.0 - u - v) + b * u + c * v;
        assert!((actual - expected).length() < 1e-5, "ray {i}: {actual} instead of {expected}");
    }
}

#[test]
fn holes_let_rays_through() {
    let mut scene = scene();
    scene.materials.push(Material {
        base_color: glam::vec4(1.0, 1.0, 1.0, 0.25),
        alpha_mode: AlphaMode::Mask(0.5),
        ..Material::default()
    });
    scene.meshes[0].parts[1].material = 1;
    let (origins, directions) = ([[0.1, 3.0, 0.2]], [[0.0, -1.0, 0.0]]);
    let hits =
        queries(&scene).intersect(&Rays::new(&origins, &directions).expect("one"), false, &Control::new());
    assert_eq!(hits.t, [3.0]);
}

#[test]
fn points_know_material_and_backscatter() {
    let scene = scene();
    let queries = queries(&scene);
    let s = 0.5f32.sqrt();
    let rays = [Ray::new([1.5, 2.0, 0.0], [0.0, -1.0, 0.0]), Ray::new([1.5, 2.0, 0.0], [0.0, -s, s])];
    let values = queries.map(
        3,
        &Control::new(),
        |i| rays[i % 2],
        |i, point| point.map(|p| (i, p.backscatter(), p.material(), p.position(), p.base_color())),
    );
    let (_, [r, g, b], material, position, color) = values[0].expect("the floor");
    assert_eq!((material, color), (0, [0.5, 0.25, 1.0]));
    assert!(Vec3::from(position).distance(Vec3::new(1.5, 0.0, 0.0)) < 1e-6);
    // A diffuse surface sends back its albedo, times the cosine.
    assert!((r - 0.5).abs() < 1e-5 && (g - 0.25).abs() < 1e-5 && (b - 1.0).abs() < 1e-5);
    assert_eq!(values[2].expect("the floor").1, [r, g, b]);
    assert!(values[1].is_none_or(|v| (v.1[0] - 0.5 * s).abs() < 1e-5));
}

#[test]
fn a_cancelled_call_ends_early() {
    let control = Control::new();
    control.cancel();
    let (origins, directions) = ([[0.1, 3.0, 0.2]], [[0.0, -1.0, 0.0]]);
    let hits = queries(&scene()).intersect(&Rays::new(&origins, &directions).expect("one"), true, &control);
    assert_eq!((hits.t[0], control.progress().samples_done), (0.0, 0));
}

#[test]
fn arrays_of_different_lengths_are_refused() {
    let error = Rays::new(&[[0.0; 3]; 2], &[[0.0; 3]]).expect_err("two and one");
    assert_eq!(error.to_string(), "there are 2 origins but 1 directions");
}
