//! Where points of the world are in the window, and which rays go through points of the window.

use alhazen::{Camera, camera_frame, picture_point, picture_ray};
use egui::{Pos2, Rect, vec2};
use glam::Vec3;

/// A camera's picture as it lies in the window.
#[derive(Clone, Debug)]
pub struct Lens {
    /// The camera, without a path.
    pub camera: Camera,
    /// Width and height of the picture, pixels.
    pub size: [u32; 2],
    /// Where it is in the window, points.
    pub place: Rect,
}

/// A half-line through the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Where it begins, metres.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
}

impl Lens {
    /// Where a point of the world is in the window; `None` for what the camera cannot see, such as what is behind it.
    pub fn project(&self, point: Vec3) -> Option<Pos2> {
        self.project_offset(point - self.camera.eye)
    }

    /// As [`Lens::project`], for what is infinitely far away in a direction.
    pub fn project_direction(&self, direction: Vec3) -> Option<Pos2> {
        self.project_offset(direction)
    }

    fn project_offset(&self, offset: Vec3) -> Option<Pos2> {
        let [width, height] = self.size;
        let frame = camera_frame(&self.camera, width, height);
        let at = picture_point(&frame, width, height, offset.as_dvec3())?.as_vec2();
        let share = vec2(at.x / width as f32, at.y / height as f32);
        let is_near = share.x.abs() < 1e4 && share.y.abs() < 1e4;
        is_near.then_some(self.place.min + share * self.place.size())
    }

    /// The ray through a point of the window; `None` where the camera has none.
    pub fn ray(&self, at: Pos2) -> Option<Line> {
        let [width, height] = self.size;
        let share = (at - self.place.min) / self.place.size();
        let frame = camera_frame(&self.camera, width, height);
        let ray = picture_ray(&frame, width, height, share.x * width as f32, share.y * height as f32);
        let direction = Vec3::from_array(ray.direction).try_normalize()?;
        (ray.t_max > 0.0).then_some(Line { origin: Vec3::from_array(ray.origin), direction })
    }

    /// Unit direction from a point of the world to the camera.
    pub fn towards_camera(&self, point: Vec3) -> Vec3 {
        let axis = self.camera.eye - self.camera.target;
        let direction = match self.camera.projection {
            alhazen::Projection::Orthographic { .. } => axis,
            _ => self.camera.eye - point,
        };
        direction.try_normalize().or_else(|| axis.try_normalize()).unwrap_or(Vec3::Z)
    }

    /// Metres that a point of the window takes at a point of the world.
    pub fn metres_per_point(&self, point: Vec3) -> Option<f32> {
        let to_camera = self.towards_camera(point);
        let side = to_camera.any_orthonormal_vector();
        let step = ((self.camera.eye - point).length() * 0.01).max(1e-6);
        let apart = |side: Vec3| {
            let [a, b] = [self.project(point)?, self.project(point + side * step)?];
            Some((b - a).length())
        };
        let points = apart(side)?.max(apart(side.cross(to_camera))?);
        (points > 1e-6).then_some(step / points)
    }
}

impl Line {
    /// The parameter of the point of `point + parameter * direction` that is nearest to this line; `None` where both
    /// are nearly parallel. `direction`: unit length.
    pub fn nearest_on(&self, point: Vec3, direction: Vec3) -> Option<f32> {
        let (between, cosine) = (point - self.origin, direction.dot(self.direction));
        let sine2 = 1.0 - cosine * cosine;
        let along = cosine * self.direction.dot(between) - direction.dot(between);
        (sine2 > 1e-4).then_some(along / sine2)
    }

    /// Where the line meets a plane; `None` where it does not, or at a grazing angle.
    pub fn meets_plane(&self, point: Vec3, normal: Vec3) -> Option<Vec3> {
        let cosine = self.direction.dot(normal);
        if cosine.abs() < 0.02 {
            return None;
        }
        let distance = (point - self.origin).dot(normal) / cosine;
        (distance > 0.0).then_some(self.origin + self.direction * distance)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use egui::pos2;

    /// Looks along -Z from 10 m; a picture of 200 × 100 in the window at (50, 20), twice as large.
    pub fn lens() -> Lens {
        let camera = Camera::perspective("c", Vec3::new(0.0, 0.0, 10.0), Vec3::ZERO, 1.0);
        let place = Rect::from_min_size(pos2(50.0, 20.0), vec2(400.0, 200.0));
        Lens { camera, size: [200, 100], place }
    }

    #[test]
    fn rays_go_through_what_is_seen_at_their_point() {
        let lens = lens();
        assert!(lens.project(Vec3::ZERO).expect("seen").distance(pos2(250.0, 120.0)) < 1e-3);
        for point in [Vec3::new(1.0, 0.5, 0.0), Vec3::new(-3.0, 1.0, 2.0)] {
            let ray = lens.ray(lens.project(point).expect("seen")).expect("a ray");
            let off = (point - ray.origin).cross(ray.direction).length();
            assert!(off < 1e-4, "{off}");
        }
        assert_eq!(lens.project(Vec3::new(0.0, 0.0, 11.0)), None, "behind the camera");
        let far = lens.project_direction(Vec3::NEG_Z).expect("seen");
        assert!(far.distance(pos2(250.0, 120.0)) < 1e-3);
    }

    #[test]
    fn metres_per_point_are_those_of_the_projection() {
        let expected = 2.0 * 10.0 * 0.5f32.tan() / 200.0;
        let found = lens().metres_per_point(Vec3::ZERO).expect("seen");
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
    }

    #[test]
    fn lines_meet_axes_and_planes() {
        let line = Line { origin: Vec3::new(2.0, 5.0, 1.0), direction: Vec3::NEG_Y };
        assert_eq!(line.nearest_on(Vec3::ZERO, Vec3::X), Some(2.0));
        assert_eq!(line.nearest_on(Vec3::ZERO, Vec3::Y), None);
        assert_eq!(line.meets_plane(Vec3::ZERO, Vec3::Y), Some(Vec3::new(2.0, 0.0, 1.0)));
        assert_eq!(line.meets_plane(Vec3::ZERO, Vec3::X), None);
        assert_eq!(line.meets_plane(Vec3::Y * 9.0, Vec3::Y), None, "behind its beginning");
    }
}
