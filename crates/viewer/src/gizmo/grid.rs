//! A grid on the ground, the plane y = 0: lines that fade in the distance, the axes x and z in colour, and nothing of it
//! where something is in front.

use alhazen::{Camera, Control, RayQueries, camera_frame, picture_ray};
use egui::Color32;
use glam::{Vec2, Vec3};

/// The grid of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// From line to line, metres. Every tenth line is stronger.
    pub step: f32,
    /// What the camera looks at: the grid is strongest below it.
    pub center: Vec3,
    /// From there on nothing is seen of it, metres.
    pub reach: f32,
}

/// A surface that is nearer than the ground by less than this share of its distance is the ground itself.
const SAME: f32 = 1e-3;
/// Widths of lines, pixels: usual ones, every tenth, axes, and how much wider their dark border is.
const WIDTHS: [f32; 4] = [1.0, 1.4, 2.0, 1.6];
/// Lines that are nearer to each other than this (pixels) are not seen, and from so many on fully.
const DENSE: [f32; 2] = [3.0, 12.0];
const LINE: Vec3 = Vec3::new(205.0, 205.0, 205.0);
const X: Vec3 = Vec3::new(235.0, 80.0, 80.0);
const Z: Vec3 = Vec3::new(80.0, 140.0, 245.0);

/// The grid over a picture of `width`×`height` pixels, row 0 at the top. It is transparent where no line is seen.
pub fn picture(
    queries: &RayQueries,
    camera: &Camera,
    [width, height]: [u32; 2],
    grid: &Grid,
) -> Vec<Color32> {
    let frame = camera_frame(camera, width, height);
    let ray = |i: usize| {
        let (x, y) = (i as u32 % width, i as u32 / width);
        picture_ray(&frame, width, height, x as f32 + 0.5, y as f32 + 0.5)
    };
    // Where the ground is seen at a point of the picture, and how far away.
    let ground = |x: f32, y: f32| {
        let ray = picture_ray(&frame, width, height, x, y);
        let (origin, direction) = (Vec3::from_array(ray.origin), Vec3::from_array(ray.direction));
        let distance = -origin.y / direction.y;
        let is_seen = ray.t_max > 0.0 && distance.is_finite() && distance > 0.0;
        is_seen.then(|| (origin + direction * distance, distance))
    };
    let count = width as usize * height as usize;
    queries.map(count, &Control::new(), ray, |i, seen| {
        let (x, y) = ((i as u32 % width) as f32 + 0.5, (i as u32 / width) as f32 + 0.5);
        let Some((at, distance)) = ground(x, y) else { return Color32::TRANSPARENT };
        if seen.is_some_and(|seen| seen.distance() < distance * (1.0 - SAME)) {
            return Color32::TRANSPARENT;
        }
        let (Some((right, _)), Some((down, _))) = (ground(x + 1.0, y), ground(x, y + 1.0)) else {
            return Color32::TRANSPARENT;
        };
        let flat = |v: Vec3| Vec2::new(v.x, v.z);
        grid.colour(flat(at), (flat(right - at).abs() + flat(down - at).abs()).max(Vec2::splat(1e-9)))
    })
}

impl Grid {
    /// The colour at a place of the ground, premultiplied.
    ///
    /// - `at`: x and z, metres.
    /// - `pixel`: how far a pixel of the picture reaches along x and z there, metres.
    fn colour(&self, at: Vec2, pixel: Vec2) -> Color32 {
        let distance = (at - Vec2::new(self.center.x, self.center.z)).length() / self.reach;
        let fade = (1.0 - distance).clamp(0.0, 1.0);
        let fade = fade * fade;
        if fade == 0.0 {
            return Color32::TRANSPARENT;
        }
        // Along x and along z: how many pixels the next line is away, which is seen as far as lines are apart.
        let lines = |step: f32, width: f32| {
            let cover = |axis: usize| {
                let (at, pixel) = (at[axis] / step, pixel[axis] / step);
                let away = (at - at.round()).abs() / pixel;
                covered(away, width) * ((1.0 / pixel - DENSE[0]) / (DENSE[1] - DENSE[0])).clamp(0.0, 1.0)
            };
            cover(0).max(cover(1))
        };
        let axis = |axis: usize, width: f32| covered(at[axis].abs() / pixel[axis], width);
        let [usual, tenth, wide, border] = WIDTHS;
        let strength = |wider: f32| {
            let lines =
                (0.35 * lines(self.step, usual + wider)).max(0.7 * lines(self.step * 10.0, tenth + wider));
            lines.max(axis(0, wide + wider)).max(axis(1, wide + wider)) * fade
        };
        let (inner, outer) = (strength(0.0), strength(border));
        // The axis x runs where z is 0.
        let is_axis = [1, 0].map(|of| axis(of, wide));
        let colour = match is_axis {
            [x, z] if x.max(z) == 0.0 => LINE,
            [x, z] if x >= z => X,
            _ => Z,
        };
        let alpha = inner + 0.5 * (outer - inner).max(0.0);
        let [r, g, b] = (colour * inner).to_array().map(|v| v as u8);
        Color32::from_rgba_premultiplied(r, g, b, (alpha * 255.0) as u8)
    }
}

/// How much of a pixel a line covers whose middle is `away` pixels from the pixel's.
fn covered(away: f32, width: f32) -> f32 {
    (0.5 * (width + 1.0) - away).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use alhazen::{LoadOptions, SceneTables, Source};

    const GRID: Grid = Grid { step: 1.0, center: Vec3::ZERO, reach: 100.0 };

    #[test]
    fn lines_are_where_whole_steps_are() {
        let pixel = Vec2::splat(0.01);
        let alpha = |x: f32, z: f32| GRID.colour(Vec2::new(x, z), pixel).a();
        assert!(alpha(3.0, 0.5) > 60 && alpha(0.5, 7.0) > 60 && alpha(0.5, 0.5) == 0);
        assert!(alpha(10.0, 0.5) > alpha(9.0, 0.5), "every tenth is stronger");
        assert!(alpha(3.0, 0.5) > alpha(63.0, 0.5) && alpha(101.0, 0.5) == 0, "they fade");
        // Where lines are denser than pixels there are none; the stronger ones remain.
        let far = Vec2::splat(0.5);
        assert!(
            GRID.colour(Vec2::new(3.0, 3.3), far).a() == 0 && GRID.colour(Vec2::new(10.0, 4.2), far).a() > 0
        );
        let [x, z] = [(4.5, 0.0), (0.0, 4.5)].map(|(x, z)| GRID.colour(Vec2::new(x, z), pixel));
        assert!(x.r() > x.b() && z.b() > z.r(), "{x:?} {z:?}");
    }

    /// Three spheres stand on a floor at y = 0: the grid lies on it, behind the spheres, and not in the sky.
    #[test]
    fn what_is_in_front_hides_the_grid() {
        let scene = Source::parse("three-spheres").load(&LoadOptions::default()).expect("built in").scene;
        let camera = Camera { path: None, ..scene.default_camera().at(0.0) };
        let queries = RayQueries::new(SceneTables::build(&scene), Some(2)).expect("threads");
        let (width, height) = (320, 180);
        let seen = picture(&queries, &camera, [width, height], &GRID);
        let rows: Vec<usize> = seen
            .chunks(width as usize)
            .map(|row| row.iter().filter(|c| **c != Color32::TRANSPARENT).count())
            .collect();
        assert!(rows[0] == 0 && rows[height as usize - 5] > 20, "{rows:?}");
        let empty =
            RayQueries::new(SceneTables::build(&alhazen::Scene::default()), Some(2)).expect("threads");
        let bare = picture(&empty, &camera, [width, height], &GRID);
        let hidden = bare.iter().zip(&seen).filter(|(bare, seen)| bare.a() > 0 && seen.a() == 0).count();
        let wrong = bare.iter().zip(&seen).filter(|(bare, seen)| seen.a() > 0 && bare != seen).count();
        assert!(hidden > 200 && wrong == 0, "{hidden} hidden, {wrong} wrong");
    }
}
