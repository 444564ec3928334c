//! Cameras for scenes without one: what the picture's film shows, whatever its shape and its lens.

use crate::{Job, camera_frame, picture_ray};
use elementary::hypot;
use glam::Vec3;
use scene::{Camera, FilmWindow, Motion, Projection, Scene};

/// Directions farther from the optical axis than this do not count: tangent of 75°.
const WIDEST: f64 = 3.7;
/// Points at which each side of the film is looked at.
const POINTS: u32 = 16;
/// Steps from the film's middle to its sides, in search of where a lens ends.
const STEPS: u32 = 64;

impl Job {
    /// Places the camera where it shows all of a scene that has none of its own: from the front right, slightly above, with
    /// the picture's shape, field of view and lens. See [`Scene::frame`] for `motion` and `time`.
    pub fn frame(&mut self, scene: &mut Scene, motion: Motion, time: f32) {
        let film = film_window(&self.camera, self.width, self.height);
        scene.frame(&mut self.camera, film, motion, time);
    }
}

/// What a camera's film shows. Of a lens, a window that lies within its field.
fn film_window(camera: &Camera, width: u32, height: u32) -> FilmWindow {
    if let Projection::Perspective { fov_y } = camera.projection
        && camera.distortion.is_none()
        && camera.skew == 0.0
    {
        return FilmWindow::perspective(fov_y, width as f32 / height as f32);
    }
    let level = Camera { eye: Vec3::ZERO, target: Vec3::NEG_Z, up: Vec3::Y, path: None, ..camera.clone() };
    let frame = camera_frame(&level, width, height);
    let tangents = |x: f32, y: f32| {
        let ray = picture_ray(&frame, width, height, x * width as f32, y * height as f32);
        let [dx, dy, dz] = ray.direction.map(f64::from);
        let forward = (-dz).max(hypot(dx, dy) / WIDEST);
        (ray.t_max > 0.0 && forward > 0.0).then(|| (dx / forward, dy / forward))
    };
    // The last direction that is seen on the way from the film's middle to a point on its side.
    let outermost = |x: f32, y: f32| {
        let shares = (0..=STEPS).rev().map(|i| i as f32 / STEPS as f32);
        let mut seen = shares.filter_map(|share| tangents(0.5 + (x - 0.5) * share, 0.5 + (y - 0.5) * share));
        seen.next().unwrap_or((0.0, 0.0))
    };
    let side = |point: &dyn Fn(f32) -> (f64, f64), of: fn((f64, f64)) -> f64| {
        let along = (0..=POINTS).map(|i| i as f32 / POINTS as f32);
        along.map(|s| of(point(s))).fold(f64::INFINITY, f64::min)
    };
    let window = FilmWindow {
        left: side(&|s| outermost(0.0, s), |(x, _)| -x),
        right: side(&|s| outermost(1.0, s), |(x, _)| x),
        bottom: side(&|s| outermost(s, 1.0), |(_, y)| -y),
        top: side(&|s| outermost(s, 0.0), |(_, y)| y),
    };
    let is_seen = window.left + window.right > 1e-3 && window.bottom + window.top > 1e-3;
    if is_seen { window } else { FilmWindow::perspective(0.01, width as f32 / height as f32) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Affine3A, Vec2};
    use scene::{Distortion, Instance, Mesh, Shape};

    const CORNERS: [Vec3; 8] = {
        let (a, b) = (1.5, 0.5);
        [
            Vec3::new(a, b, b),
            Vec3::new(a, b, -b),
            Vec3::new(a, -b, b),
            Vec3::new(a, -b, -b),
            Vec3::new(-a, b, b),
            Vec3::new(-a, b, -b),
            Vec3::new(-a, -b, b),
            Vec3::new(-a, -b, -b),
        ]
    };

    fn scene() -> Scene {
        let indices = vec![[0, 1, 2], [3, 4, 5], [5, 6, 7]];
        let mesh = scene::TriangleMesh { positions: CORNERS.to_vec(), indices, ..Default::default() };
        let meshes = vec![Mesh::single("box", Shape::Triangles(mesh), 0)];
        let instances = vec![Instance::new("box", 0, Affine3A::from_translation(Vec3::new(4.0, 5.0, 6.0)))];
        Scene { meshes, instances, ..Scene::default() }
    }

    /// Where on the film a point appears, in shares of width and height, by looking at all of the film.
    fn on_film(job: &Job, point: Vec3) -> Option<(f32, f32)> {
        const GRID: u32 = 200;
        let frame = camera_frame(&job.camera, job.width, job.height);
        let direction = (point - job.camera.eye).normalize();
        let at = |i: u32| i as f32 / GRID as f32;
        let places = (0..=GRID).flat_map(|y| (0..=GRID).map(move |x| (at(x), at(y))));
        let angles = places.filter_map(|(x, y)| {
            let ray = picture_ray(&frame, job.width, job.height, x * job.width as f32, y * job.height as f32);
            let angle = Vec3::from(ray.direction).normalize_or_zero().distance(direction);
            (ray.t_max > 0.0).then_some((angle, (x, y)))
        });
        let (angle, place) = angles.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (angle < 2.0 / GRID as f32).then_some(place)
    }

    #[test]
    fn the_box_fills_every_film() {
        let lens = |k1: f32| Some(Distortion::BrownConrady { k: [k1, 0.0, 0.0, 0.0, 0.0, 0.0], p: [0.0; 2] });
        let fisheye = Some(Distortion::Fisheye { k: [0.0; 4] });
        let wide = Projection::Perspective { fov_y: 1.6 };
        let shifted = Projection::Intrinsics { focal: Vec2::new(0.8, 1.2), center: Vec2::new(0.3, 0.6) };
        let normal = Projection::Perspective { fov_y: 0.7 };
        let films = [
            (normal, None, 0.0, [160, 90], 0.9),
            (normal, None, 0.0, [60, 120], 0.9),
            (normal, None, 0.2, [160, 90], 0.7),
            (normal, lens(-0.25), 0.0, [160, 90], 0.8),
            (normal, lens(0.2), 0.0, [160, 90], 0.8),
            // So wide a film could show it larger from nearer than the camera goes.
            (wide, fisheye, 0.0, [120, 90], 0.5),
            (shifted, None, 0.0, [120, 90], 0.9),
        ];
        for (projection, distortion, skew, [width, height], least) in films {
            let mut scene = scene();
            let mut job = Job { width, height, ..Job::for_scene(&scene) };
            job.camera = Camera { projection, distortion, skew, ..job.camera };
            job.frame(&mut scene, Motion::default(), 0.0);
            let corners = CORNERS.map(|corner| on_film(&job, corner + Vec3::new(4.0, 5.0, 6.0)));
            let what = format!("{projection:?} {distortion:?} skewed {skew}");
            let seen: Vec<_> = corners.iter().flatten().collect();
            assert_eq!(seen.len(), 8, "{what}: {corners:?}");
            let extent = |of: fn(&(f32, f32)) -> f32| {
                let all = || seen.iter().map(|p| of(p));
                all().fold(0.0, f32::max) - all().fold(1.0, f32::min)
            };
            let filled = extent(|p| p.0).max(extent(|p| p.1));
            assert!(filled > least, "{what}: {filled} of the picture: {corners:?}");
        }
    }
}
