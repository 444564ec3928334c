//! From the world to the window, as a rasteriser does it: the inverse of the optics' `camera_ray`.

use glam::{DVec2, DVec3};
use optics::camera::{CAMERA_ORTHOGRAPHIC, CAMERA_PERSPECTIVE, CameraFrame};
use optics::warp::sample_disk;
use optics::{Vec2f, Vec3f};

/// The picture that a window is cut out of, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Picture {
    /// Width and height of the whole.
    pub size: [u32; 2],
    /// Upper left corner of the window.
    pub window_at: [u32; 2],
    /// Width and height of the window.
    pub window_size: [u32; 2],
}

impl Picture {
    /// Pixels of the window.
    pub fn pixels(self) -> u32 {
        self.window_size[0] * self.window_size[1]
    }
}

/// A linear projection: `clip = clip_from_world · (world − eye, 1)`.
///
/// x and y span the window; z is reversed, 1 at the near end and 0 at infinity (at `reach` for parallel projections), so that
/// floating-point depth keeps its relative precision everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Columns.
    pub clip_from_world: [[f32; 4]; 4],
    /// Where camera rays start, or for parallel projections the centre of where they start. World space, metres.
    pub eye: [f32; 3],
    /// Unit viewing direction, at right angles to the film.
    pub axis: [f32; 3],
}

impl Projection {
    /// The projection by which a pixel's centre shows what `camera_ray` sees through the point `jitter` of the pixel, in
    /// `[0, 1)²`, and the point of the lens that `lens` chooses. `None` for panoramas and the like
    /// and for lenses that bend lines, which no linear map makes.
    ///
    /// - `near`: distance along the axis at which the view begins, metres, positive. `reach`: where a parallel one ends.
    pub fn new(
        camera: &CameraFrame,
        picture: &Picture,
        jitter: Vec2f,
        lens: Vec2f,
        near: f32,
        reach: f32,
    ) -> Option<Self> {
        let parallel = camera.kind == CAMERA_ORTHOGRAPHIC;
        let pinhole = camera.kind == CAMERA_PERSPECTIVE && camera.distortion.is_none();
        if !parallel && !pinhole {
            return None;
        }
        let (right, up, forward) = (vector(camera.right), vector(camera.up), vector(camera.forward));
        let axis = (forward - right * forward.dot(right) - up * forward.dot(up)).normalize();
        let on_lens = if parallel || camera.lens_radius <= 0.0 {
            DVec2::ZERO
        } else {
            let disk = sample_disk(lens);
            DVec2::new(f64::from(disk.x), f64::from(disk.y)) * f64::from(camera.lens_radius)
        };
        let eye = vector(camera.origin) + right * on_lens.x + up * on_lens.y;
        // Position on the film, −1 to 1, times depth: rows over (world − eye). Rays through a point of the lens meet the others
        // in the plane in focus; a shifted film is seen aslant.
        let focus = f64::from(camera.focus_distance);
        let aslant = |direction: DVec3, shift: f64| {
            if parallel { direction } else { direction + axis * (shift / focus - forward.dot(direction)) }
        };
        let half = DVec2::new(f64::from(camera.half_size.x), f64::from(camera.half_size.y));
        let across = aslant(right, on_lens.x) / half.x;
        let upwards = aslant(up, on_lens.y) / half.y;
        // From the film to the window.
        let along = |i: usize, jitter: f32| {
            let (size, window) = (f64::from(picture.size[i]), f64::from(picture.window_size[i]));
            let place = f64::from(picture.window_at[i]) + f64::from(jitter) - 0.5;
            (size / window, (size - 2.0 * place) / window - 1.0)
        };
        let ((scale_x, shift_x), (scale_y, shift_y)) = (along(0, jitter.x), along(1, jitter.y));
        let depth = if parallel { (DVec3::ZERO, 1.0) } else { (axis, 0.0) };
        let row = |film: DVec3, scale: f64, shift: f64| {
            (film * scale + depth.0 * shift).extend(depth.1 * shift).to_array()
        };
        let z = if parallel {
            (axis / -f64::from(reach)).extend(1.0).to_array()
        } else {
            [0.0, 0.0, 0.0, f64::from(near)]
        };
        let rows = [
            row(across, scale_x, shift_x),
            row(upwards, scale_y, -shift_y),
            z,
            depth.0.extend(depth.1).to_array(),
        ];
        Some(Self {
            clip_from_world: std::array::from_fn(|column| rows.map(|row| row[column] as f32)),
            eye: eye.as_vec3().to_array(),
            axis: axis.as_vec3().to_array(),
        })
    }
}

fn vector(v: Vec3f) -> DVec3 {
    DVec3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use optics::camera::{CAMERA_PANORAMA, camera_ray};
    use optics::{vec2f, vec3f};
    use testkit::Random;

    const PICTURE: Picture = Picture { size: [640, 360], window_at: [100, 50], window_size: [300, 200] };

    fn camera(kind: u32, lens_radius: f32) -> CameraFrame {
        let shifted = if kind == CAMERA_PERSPECTIVE { 0.3 } else { 0.0 };
        CameraFrame {
            kind,
            origin: vec3f(1.0, 2.0, 3.0),
            right: vec3f(0.6, 0.0, 0.8),
            up: vec3f(0.0, 1.0, 0.0),
            forward: vec3f(0.8 + shifted * 0.6, 0.1 * shifted, -0.6 + shifted * 0.8),
            half_size: vec2f(0.8, 0.45),
            lens_radius,
            focus_distance: 4.0,
            distortion: optics::distortion::no_distortion(),
        }
    }

    /// What a camera ray passes is drawn where the ray comes from.
    #[test]
    fn projections_undo_camera_rays() {
        let mut random = Random::new(5);
        let mut u = || random.uniform_f32();
        for (kind, radius) in
            [(CAMERA_PERSPECTIVE, 0.0), (CAMERA_PERSPECTIVE, 0.2), (CAMERA_ORTHOGRAPHIC, 0.0)]
        {
            let camera = camera(kind, radius);
            for _ in 0..1000 {
                let (jitter, lens) = (vec2f(u(), u()), vec2f(u(), u()));
                let projection =
                    Projection::new(&camera, &PICTURE, jitter, lens, 1e-3, 100.0).expect("linear");
                let pixel = [(u() * 300.0).floor(), (u() * 200.0).floor()];
                let film = vec2f((100.0 + pixel[0] + jitter.x) / 640.0, (50.0 + pixel[1] + jitter.y) / 360.0);
                let ray = camera_ray(camera, film, lens);
                let t = 0.5 + 20.0 * u();
                let world = ray.origin + ray.direction * t;
                let v = [
                    world.x - projection.eye[0],
                    world.y - projection.eye[1],
                    world.z - projection.eye[2],
                    1.0,
                ];
                let clip: [f32; 4] = std::array::from_fn(|row| {
                    projection.clip_from_world.iter().zip(v).map(|(column, v)| column[row] * v).sum()
                });
                let x = 150.0 * (1.0 + clip[0] / clip[3]);
                let y = 100.0 * (1.0 - clip[1] / clip[3]);
                assert!((x - pixel[0] - 0.5).abs() < 2e-3, "{kind}: {x} for {pixel:?}");
                assert!((y - pixel[1] - 0.5).abs() < 2e-3, "{kind}: {y} for {pixel:?}");
                let depth = clip[2] / clip[3];
                assert!(0.0 < depth && depth < 1.0, "{kind}: {depth}");
            }
        }
        assert!(
            Projection::new(
                &camera(CAMERA_PANORAMA, 0.0),
                &PICTURE,
                vec2f(0.5, 0.5),
                vec2f(0.5, 0.5),
                1.0,
                1.0
            )
            .is_none()
        );
    }
}
