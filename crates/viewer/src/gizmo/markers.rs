//! Signs over the picture for what cannot be seen itself: lights without a surface, the sun, and cameras.

use super::Lens;
use alhazen::{LightKind, Scene};
use egui::{Color32, Painter, Pos2, Shape, Stroke, Vec2, pos2, vec2};
use glam::Vec3;
use std::f32::consts::TAU;

/// How near (points) the pointer has to be.
const REACH: f32 = 11.0;
/// How large a sign is, points.
const SIZE: f32 = 8.0;
/// The cone of a spot light is drawn so long, in shares of the scene's size.
const CONE: f32 = 0.12;
const LIGHT: Color32 = Color32::from_rgb(255, 225, 120);
const CAMERA: Color32 = Color32::from_rgb(150, 200, 255);
const SELECTED: Color32 = Color32::from_rgb(255, 170, 30);

/// What a sign stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// A light of the scene, by number.
    Light(usize),
    /// The sun of the sky.
    Sun,
    /// A camera of the scene, by number.
    Camera(usize),
}

/// A sign as it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marker {
    /// What it stands for.
    pub of: Of,
    /// Where it is in the window.
    pub at: Pos2,
}

/// All signs that are in sight. Lights without a place are seen where they come from.
pub fn markers(scene: &Scene, lens: &Lens) -> Vec<Marker> {
    let mut found = Vec::new();
    let mut add = |of: Of, at: Option<Pos2>| {
        let seen = at.filter(|at| lens.place.contains(*at));
        found.extend(seen.map(|at| Marker { of, at }));
    };
    for (i, light) in scene.lights.iter().enumerate() {
        let at = match light.kind {
            LightKind::Directional { direction, .. } => lens.project_direction(-direction),
            LightKind::Point { position, .. }
            | LightKind::Spot { position, .. }
            | LightKind::Projector { position, .. } => lens.project(position),
        };
        add(Of::Light(i), at);
    }
    add(Of::Sun, scene.environment.sun().and_then(|sun| lens.project_direction(sun.direction)));
    for (i, camera) in scene.cameras.iter().enumerate() {
        // The one that is looked through would be in the middle of everything.
        let away = (camera.eye - lens.camera.eye).length();
        let is_other = away > 1e-3 * (camera.target - camera.eye).length();
        add(Of::Camera(i), is_other.then(|| lens.project(camera.eye)).flatten());
    }
    found
}

/// The sign that the pointer is on.
pub fn nearest(markers: &[Marker], pointer: Pos2) -> Option<Of> {
    let near = markers.iter().map(|m| (m.of, (m.at - pointer).length())).filter(|(_, d)| *d <= REACH);
    near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(of, _)| of)
}

/// Draws all signs, and the shape of the light that is selected.
pub fn paint(painter: &Painter, scene: &Scene, lens: &Lens, selected: Option<usize>, size: f32) {
    for marker in markers(scene, lens) {
        match marker.of {
            Of::Light(i) => {
                let colour = if selected == Some(i) { SELECTED } else { LIGHT };
                let is_sun = matches!(scene.lights[i].kind, LightKind::Directional { .. });
                bulb(painter, marker.at, colour, is_sun);
            }
            Of::Sun => bulb(painter, marker.at, LIGHT, true),
            Of::Camera(_) => camera(painter, marker.at),
        }
    }
    if let Some(light) = selected.and_then(|i| scene.lights.get(i)) {
        extent(painter, &light.kind, lens, size);
    }
}

/// A disc, with rays where it stands for a light that is far away.
fn bulb(painter: &Painter, at: Pos2, colour: Color32, is_far: bool) {
    painter.circle(at, SIZE * 0.55, colour, Stroke::new(1.5, Color32::from_black_alpha(180)));
    if is_far {
        for i in 0..8 {
            let direction = Vec2::angled(TAU * i as f32 / 8.0);
            let ray = [at + direction * SIZE * 0.8, at + direction * SIZE * 1.25];
            line(painter, &ray, colour);
        }
    } else {
        painter.circle_stroke(at, SIZE, Stroke::new(1.0, colour));
    }
}

/// A box with a lens to its right.
fn camera(painter: &Painter, at: Pos2) {
    let body = egui::Rect::from_center_size(at - vec2(2.0, 0.0), vec2(SIZE * 1.5, SIZE * 1.1));
    painter.rect(
        body,
        2.0,
        CAMERA.gamma_multiply(0.6),
        Stroke::new(1.0, Color32::from_black_alpha(180)),
        egui::StrokeKind::Outside,
    );
    let right = body.right();
    let corners = [pos2(right, at.y), pos2(right + 6.0, at.y - 4.0), pos2(right + 6.0, at.y + 4.0)];
    painter.add(Shape::convex_polygon(corners.to_vec(), CAMERA, Stroke::NONE));
}

/// The cones of a spot light, and the edges of what a projector throws.
fn extent(painter: &Painter, kind: &LightKind, lens: &Lens, size: f32) {
    let length = size * CONE;
    match *kind {
        LightKind::Spot { position, direction, inner_angle, outer_angle, .. } => {
            for (angle, alpha) in [(outer_angle, 1.0), (inner_angle, 0.5)] {
                cone(painter, lens, (position, direction * length), angle, SELECTED.gamma_multiply(alpha));
            }
        }
        LightKind::Projector { position, direction, field_of_view, .. } => {
            cone(painter, lens, (position, direction * length), field_of_view * 0.5, SELECTED);
        }
        LightKind::Point { .. } | LightKind::Directional { .. } => {}
    }
}

/// A cone with its tip at a point, about an axis.
fn cone(painter: &Painter, lens: &Lens, (tip, axis): (Vec3, Vec3), angle: f32, colour: Color32) {
    let Some(direction) = axis.try_normalize() else { return };
    let (side, length) = (direction.any_orthonormal_vector(), axis.length());
    let other = direction.cross(side);
    let (along, across) = (angle.cos() * length, angle.sin() * length);
    let rim = |i: usize| {
        let turn = TAU * i as f32 / 32.0;
        lens.project(tip + direction * along + (side * turn.cos() + other * turn.sin()) * across)
    };
    for i in 0..32 {
        if let (Some(a), Some(b)) = (rim(i), rim(i + 1)) {
            line(painter, &[a, b], colour);
        }
        if let (true, Some(a), Some(b)) = (i % 8 == 0, lens.project(tip), rim(i)) {
            line(painter, &[a, b], colour);
        }
    }
}

fn line(painter: &Painter, ends: &[Pos2; 2], colour: Color32) {
    painter.line_segment(*ends, Stroke::new(1.5, colour));
}

#[cfg(test)]
mod tests {
    use super::super::lens::tests::lens;
    use super::*;
    use alhazen::{Camera, Light};

    #[test]
    fn lights_suns_and_other_cameras_are_seen_and_found() {
        let (lens, mut scene) = (lens(), Scene::default());
        let point = |position| LightKind::Point { position, intensity: Vec3::ONE };
        scene.lights = vec![
            Light::new("a", point(Vec3::new(1.0, 1.0, 0.0))),
            Light::new("behind", point(Vec3::new(0.0, 0.0, 20.0))),
        ];
        scene.cameras =
            vec![lens.camera.clone(), Camera::perspective("b", Vec3::new(-2.0, 0.0, 0.0), Vec3::ZERO, 1.0)];
        let sun = alhazen::Sun { direction: Vec3::NEG_Z, irradiance: Vec3::ONE, angular_radius: 0.005 };
        let colour = Vec3::ONE;
        let sky = alhazen::Sky { horizon: colour, zenith: colour, ground: colour, sun: Some(sun) };
        scene.environment = alhazen::Environment::Sky(sky);
        let all = markers(&scene, &lens);
        let of: Vec<_> = all.iter().map(|marker| marker.of).collect();
        assert_eq!(of, [Of::Light(0), Of::Sun, Of::Camera(1)]);
        for marker in &all {
            assert_eq!(nearest(&all, marker.at + vec2(3.0, 3.0)), Some(marker.of));
        }
        assert_eq!(nearest(&all, lens.place.left_bottom()), None);
    }
}
