//! The environment sampled through portals: densities are those of the samples, and integrate to one.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

use glam::{Vec3, vec3};
use optics::{Vec3f, vec3f};
use scene::tables::{EnvironmentTable, SceneTables};
use scene::{Environment, Image, Pixels, Portal, Scene};
use std::f64::consts::PI;

/// A rectangle around `center`, spanned by half of its sides.
fn window(center: Vec3, u: Vec3, v: Vec3) -> Portal {
    Portal::new([center - u - v, center + u - v, center + u + v, center - u + v]).expect("a rectangle")
}

/// A window, one in another wall, and one half behind the first.
fn windows() -> [Portal; 3] {
    [
        window(vec3(2.0, 1.0, 0.0), vec3(0.0, 0.0, 0.5), vec3(0.0, 0.7, 0.0)),
        window(vec3(0.0, 1.5, -3.0), vec3(1.0, 0.1, 0.0), vec3(0.0, 0.4, 0.0)),
        window(vec3(3.0, 1.0, 0.8), vec3(0.0, 0.0, 0.8), vec3(0.3, 1.0, 0.0)),
    ]
}

fn table(portals: &[Portal], with_image: bool) -> EnvironmentTable {
    let mut scene = Scene { portals: portals.to_vec(), ..Scene::default() };
    scene.environment = Environment::Constant(Vec3::ONE);
    if with_image {
        let pixels = (0..16 * 8).map(|i| [0.2 + f32::from(u8::from(i == 37)) * 20.0; 3]).collect();
        scene.images.push(Image { name: "sky".into(), width: 16, height: 8, pixels: Pixels::Rgb32F(pixels) });
        scene.environment = Environment::Image { image: 0, rotation: 0.4, intensity: 1.0 };
    }
    SceneTables::build(&scene).environment
}

const SIDE: usize = 1000;

fn grid() -> impl Iterator<Item = [f32; 2]> {
    let at = |i: usize| (i as f32 + 0.5) / SIDE as f32;
    (0..SIDE * SIDE).map(move |i| [at(i % SIDE), at(i / SIDE)])
}

/// Integral of the density over all directions.
fn integral(table: &EnvironmentTable, p: Vec3f) -> f64 {
    let direction = |u: [f32; 2]| optics::warp::sample_sphere(optics::vec2f(u[0], u[1]));
    grid().map(|u| f64::from(table.pdf(p, direction(u)))).sum::<f64>() * 4.0 * PI / (SIDE * SIDE) as f64
}

/// What the samples say of the solid angle that they cover.
fn covered(table: &EnvironmentTable, p: Vec3f) -> f64 {
    let one = |u: [f32; 2]| {
        let (wi, pdf) = table.sample(p, u);
        if pdf > 0.0 {
            let again = table.pdf(p, wi);
            // At a triangle's edge rounding says whether it is passed.
            assert!((again / pdf - 1.0).abs() < 1e-3 || u[0].min(u[1]) < 0.01, "{wi:?}: {again} and {pdf}");
        }
        if pdf > 0.0 { 1.0 / f64::from(pdf) } else { 0.0 }
    };
    grid().step_by(37).map(one).sum::<f64>() / grid().step_by(37).count() as f64
}

#[test]
fn densities_integrate_to_one() {
    for p in [vec3f(0.0, 1.0, 0.0), vec3f(1.5, 0.2, -2.0), vec3f(-1.0, 2.4, 1.9)] {
        for (portals, image) in [(1, false), (2, false), (3, false), (1, true), (3, true), (0, true)] {
            let table = table(&windows()[..portals], image);
            let integral = integral(&table, p);
            assert!((integral - 1.0).abs() < 0.01, "{portals} portals, image: {image}: {integral} at {p:?}");
        }
    }
}

#[test]
fn samples_cover_what_is_seen_of_the_portals() {
    let p = vec3f(0.0, 1.0, 0.0);
    // A rectangle of half sides a and b at distance d: 4 asin(a b / √((a² + d²)(b² + d²))).
    let (a, b, d) = (0.5f64, 0.7f64, 2.0f64);
    let first = 4.0 * (a * b / ((a * a + d * d) * (b * b + d * d)).sqrt()).asin();
    let one = covered(&table(&windows()[..1], false), p);
    assert!((one / first - 1.0).abs() < 1e-3, "{one} instead of {first}");
    let two = covered(&table(&windows()[..2], false), p);
    let three = covered(&table(&windows(), false), p);
    let third = covered(&table(&windows()[2..], false), p);
    assert!(two > one && three > two, "{one}, {two}, {three}");
    assert!(three < 0.97 * (two + third), "what is behind another is counted once: {three}");
    let all = covered(&table(&windows(), true), p);
    assert!((all / (4.0 * PI) - 1.0).abs() < 0.02, "{all}: an image is sampled everywhere");
}

/// On a portal's plane and edges, and far away.
#[test]
fn samples_are_finite_wherever_they_are_asked_for() {
    for image in [false, true] {
        let table = table(&windows(), image);
        for p in [
            [2.0, 1.0, 0.0],
            [2.0, 1.7, 0.5],
            [2.0, 9.0, 0.0],
            [2.0, 1.7, 0.0],
            [1e9, 0.0, 3.0],
            [1.999_999, 1.0, 0.0],
        ] {
            let p = vec3f(p[0], p[1], p[2]);
            for u in grid().step_by(4999).chain([[0.0, 0.0], [0.999_999_94; 2]]) {
                let (wi, pdf) = table.sample(p, u);
                assert!(pdf.is_finite() && pdf >= 0.0, "{p:?}, {u:?}: {pdf}");
                let length2 = optics::vector::dot(wi, wi);
                assert!((length2 - 1.0).abs() < 1e-4, "{p:?}, {u:?}: {wi:?}");
            }
        }
    }
}

/// Portals of nothing are nothing.
#[test]
fn black_environments_have_no_light() {
    let scene = Scene { portals: windows().to_vec(), ..Scene::default() };
    let tables = SceneTables::build(&scene);
    assert!(tables.lights.is_empty() && tables.environment.portals.is_empty());
    assert_eq!(table(&windows(), false).portals.len(), 6);
}
