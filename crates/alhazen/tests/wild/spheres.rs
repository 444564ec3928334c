//! Exact spheres are like any other shape: textured lamps, holes.

use super::common::{assert_mean, estimate, from_above, job};
use super::parts::{add_floor, holes, masked, mesh_sphere, stripes, texture, unlit};
use alhazen::{AlphaMode, Environment, Material, Scene, Shape, TextureRef};
use glam::{Affine3A, Quat, Vec3};
use testkit::Estimate;
use testkit::scenes::{Build, camera, covering, emitter, sphere};

/// A lamp above a floor of which a spot is seen, lit by next-event estimation and by chance.
fn below_lamp(
    shape: Shape,
    material: impl FnOnce(&mut Scene) -> Material,
    place: Affine3A,
    spp: u32,
) -> Estimate {
    let mut scene = Scene::default();
    add_floor(&mut scene, -2.0);
    let material = material(&mut scene);
    let material = scene.add_material(material);
    scene.add_shape("lamp", shape, material, place);
    scene.cameras.push(from_above(0.9, 0.0, -1.6, 0.01));
    estimate(&scene, &job(&scene, 16, 16, 2), spp)
}

fn glowing(texture: TextureRef, two_sided: bool) -> Material {
    Material { emission_texture: Some(texture), emission_two_sided: two_sided, ..emitter("lamp", [10.0; 3]) }
}

/// Irradiance π L sin²θ cos φ of a sphere of radius 0.5 at (0, 0, 0), at (0.9, −2, 0).
#[test]
fn textured_lamps_light_as_they_look() {
    let d2 = 0.9f64 * 0.9 + 4.0;
    let expected = |radiance: f64| [0.5 * radiance * (0.25 / d2) * 2.0 / d2.sqrt(); 3];
    let grey = optics_of(137);
    let flat = |scene: &mut Scene| glowing(texture(scene, [1, 1], |_, _| [137, 137, 137, 255]), false);
    let lamp = || sphere([0.0; 3], 0.5);
    let e = below_lamp(lamp(), flat, Affine3A::IDENTITY, 256);
    assert_mean("a grey texture", &e, expected(10.0 * grey), 2e-3);
    let half = |scene: &mut Scene| {
        let texture = texture(scene, [1, 1], |_, _| [137, 137, 137, 255]);
        covering(glowing(texture, false), 0.5)
    };
    let e = below_lamp(lamp(), half, Affine3A::IDENTITY, 512);
    assert_mean("half of it covered", &e, expected(5.0 * grey), 2e-3);
    // Through what is open of the near side the far side shines, too.
    let both = |scene: &mut Scene| {
        let texture = texture(scene, [1, 1], |_, _| [137, 137, 137, 255]);
        covering(glowing(texture, true), 0.5)
    };
    let e = below_lamp(lamp(), both, Affine3A::IDENTITY, 4096);
    assert_mean("half of it covered, both sides", &e, expected(7.5 * grey), 4e-3);
}

fn optics_of(byte: u8) -> f64 {
    f64::from(optics::tonemap::srgb_decode_channel(f32::from(byte) / 255.0))
}

/// Turned, mirrored, with holes: an exact lamp lights as its mesh does.
#[test]
fn placed_lamps_light_as_their_meshes_do() {
    let turned = Affine3A::from_quat(Quat::from_euler(glam::EulerRot::XYZ, 0.4, 1.3, 0.7));
    let mirrored = turned * Affine3A::from_scale(Vec3::new(1.0, 1.0, -1.0));
    for (what, place) in [("turned", turned), ("mirrored", mirrored)] {
        for has_holes in [false, true] {
            let material = |scene: &mut Scene| {
                let lamp = glowing(texture(scene, [8, 4], stripes), false);
                let base_color_texture = has_holes.then(|| texture(scene, [8, 4], holes));
                let alpha_mode = if has_holes { AlphaMode::Mask(0.3) } else { AlphaMode::Opaque };
                Material { base_color_texture, alpha_mode, ..lamp }
            };
            let exact = below_lamp(sphere([0.0; 3], 0.5), material, place, 512);
            let mesh = below_lamp(Shape::Triangles(mesh_sphere(0.5, 96, false)), material, place, 512);
            let expected = mesh.mean_colour();
            assert_mean(&format!("{what}, holes: {has_holes}"), &exact, expected, 0.01);
        }
    }
}

/// A textured sphere before a white sky, seen by a parallel projection, exact and as a mesh.
#[test]
fn textures_and_holes_lie_on_spheres_as_on_their_meshes() {
    let picture = |exact: bool, blend: bool| {
        let mut scene = Scene { environment: Environment::Constant(Vec3::ONE), ..Scene::default() };
        let image = texture(
            &mut scene,
            [8, 4],
            if blend {
                stripes
            } else {
                |x, y| {
                    let ([r, g, b, _], [.., alpha]) = (stripes(x, y), holes(x, y));
                    [r, g, b, alpha]
                }
            },
        );
        let material = Material { base_color_texture: Some(image), ..unlit([0.9; 3]) };
        let material = if blend { covering(material, 0.3) } else { masked(material) };
        let material = scene.add_material(material);
        let shape =
            if exact { sphere([0.0; 3], 1.0) } else { Shape::Triangles(mesh_sphere(1.0, 192, false)) };
        let place = Affine3A::from_quat(Quat::from_euler(glam::EulerRot::XYZ, 0.5, 0.4, -0.2));
        scene.add_shape("ball", shape, material, place);
        scene.cameras.push(camera([0.0, 0.0, 5.0], [0.0; 3], 30.0));
        estimate(&scene, &job(&scene, 24, 24, 4), 256)
    };
    for blend in [false, true] {
        let (exact, mesh) = (picture(true, blend), picture(false, blend));
        let difference = mean_difference(&exact, &mesh);
        assert!(difference < 0.02, "blend: {blend}: {difference}");
    }
}

/// Mean difference of pixels' colours.
fn mean_difference(a: &Estimate, b: &Estimate) -> f64 {
    let of = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|c| (a[c] - b[c]).abs()).sum::<f64>() / 3.0;
    a.mean.iter().zip(&b.mean).map(of).sum::<f64>() / a.mean.len() as f64
}

/// A ball of coverage 0.3 over white: what is behind it shines through both of its sides, 0.7².
#[test]
fn coverage_of_spheres_counts_at_both_crossings_and_for_shadows() {
    let mut scene = Scene { environment: Environment::Constant(Vec3::ONE), ..Scene::default() };
    let ball = scene.add_material(covering(unlit([1.0, 0.0, 0.0]), 0.3));
    scene.add_shape("ball", sphere([0.0; 3], 1.0), ball, Affine3A::IDENTITY);
    scene.cameras.push(from_above(0.0, 0.0, 3.0, 0.01));
    let e = estimate(&scene, &job(&scene, 32, 32, 3), 256);
    let through = 0.7 * 0.7;
    assert_mean("a ball of coverage 0.3", &e, [1.0, through, through], 2e-3);

    let mut scene = Scene::default();
    add_floor(&mut scene, -2.0);
    let ball = scene.add_material(covering(unlit([0.0; 3]), 0.3));
    scene.add_shape("ball", sphere([0.0; 3], 1.0), ball, Affine3A::IDENTITY);
    super::parts::light(&mut scene, 0.0, Vec3::Y);
    scene.cameras.push(from_above(0.0, 0.0, -1.5, 0.01));
    let e = estimate(&scene, &job(&scene, 32, 32, 2), 256);
    let lit = 0.5 * 3.0 / std::f64::consts::PI * through;
    assert_mean("its shadow", &e, [lit; 3], 3e-3);
}
