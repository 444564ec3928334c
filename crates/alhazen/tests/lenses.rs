//! Cameras with lenses that bend lines: what they see, and that what lies outside of their field is
//! black.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod common;

use alhazen::{
    Aov, AovData, Camera, DirectSettings, Distortion, Environment, Fog, Integrator, Job, Medium, Scene,
};
use common::{job, render};
use glam::Vec3;

const SIZE: u32 = 33;

/// Light from everywhere, with a lens whose field ends at a third of the picture's width: r (1 −
/// r²) ≤ 0.385 focal lengths.
fn seen(scene: &Scene, distortion: Distortion, integrator: Integrator) -> alhazen::Film {
    let mut camera = Camera::perspective("lens", Vec3::ZERO, Vec3::NEG_Z, 1.2);
    camera.distortion = Some(distortion);
    let job = Job { camera, integrator, aovs: vec![Aov::Depth], ..job(scene, SIZE, SIZE, 4) };
    render(scene, &job, 2)
}

fn white() -> Scene {
    Scene { environment: Environment::Constant(Vec3::ONE), ..Scene::default() }
}

#[test]
fn what_lies_outside_of_the_field_is_black() {
    let folds = Distortion::BrownConrady { k: [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0], p: [0.0; 2] };
    let mut foggy = white();
    let thin = Medium { absorption: Vec3::splat(1e-30), ..Medium::default() };
    foggy.fog = Some(Fog { medium: thin, top: f32::INFINITY });
    let path = job(&white(), 1, 1, 4).integrator;
    let cases = [
        ("path", white(), path),
        ("volumes", foggy, path),
        ("direct", white(), Integrator::Direct(DirectSettings::default())),
        ("aov", white(), Integrator::Aov),
    ];
    for (name, scene, integrator) in cases {
        let film = seen(&scene, folds, integrator);
        let picture = film.to_image();
        for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
            let focal = |i: u32| ((i as f32 + 0.5) / SIZE as f32 * 2.0 - 1.0) * 0.6f32.tan();
            let radius = focal(x).hypot(focal(y));
            // A pixel is 0.042 focal lengths wide.
            let expected = if radius > 0.385 + 0.03 { 0.0 } else { 1.0 };
            if (radius - 0.385).abs() > 0.03 {
                assert!((picture.rgb(x, y)[1] - expected).abs() < 1e-3, "{name}: ({x}, {y}), {radius}");
            }
        }
        let Some(AovData::Float(depth)) = film.aov(Aov::Depth) else { panic!("no depth") };
        assert!(depth.data().iter().all(|d| *d == 0.0), "{name}: nothing is there to be seen");
    }
}

#[test]
fn a_fisheye_sees_what_is_behind_it() {
    // An equidistant one whose picture's corners are more than 180° from the axis.
    let mut camera = Camera::perspective("fisheye", Vec3::ZERO, Vec3::NEG_Z, 1.2);
    camera.projection =
        alhazen::Projection::Intrinsics { focal: glam::Vec2::splat(0.25), center: glam::Vec2::splat(0.5) };
    camera.distortion = Some(Distortion::Fisheye { k: [0.0; 4] });
    let frame = alhazen::camera_frame(&camera, 100, 100);
    // 2.5 radians to the right are 2.5 · 25 pixels, minus 50: outside; 1.9 radians are behind the
    // camera and in the picture.
    let ray = alhazen::picture_ray(&frame, 100, 100, 50.0 + 25.0 * 1.9, 50.0);
    let expected = Vec3::new(1.9f32.sin(), 0.0, -1.9f32.cos());
    assert!(Vec3::from(ray.direction).distance(expected) < 1e-5, "{:?}", ray.direction);
}
