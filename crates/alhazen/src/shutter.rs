//! Cameras while the shutter is open.

use crate::camera_frame;
use backend::ViewShutter;
use glam::{Affine3A, Mat3, Vec3};
use optics::camera::CameraFrame;
use optics::motion::MotionSegment;
use optics::moving_camera::CameraSegment;
use optics::{Vec3f, vec4f};
use scene::animation::decompose::motion_through;
use scene::{Camera, CameraKey, Shutter};

/// Moments, and one more, at which a camera on a path is looked at.
const MOMENTS: u32 = 16;

/// The camera in the middle of the time that `shutter` is open around `time`, seconds, and how it
/// moves then. Without a shutter, or with one that opens for an instant, it is at `time`.
pub(crate) fn open_camera(
    camera: &Camera,
    shutter: Option<&Shutter>,
    time: f32,
    [width, height]: [u32; 2],
) -> (CameraFrame, Option<ViewShutter>) {
    let Some((shutter, timing)) = shutter.and_then(|shutter| Some((shutter, shutter.timing()?))) else {
        return (camera_frame(&camera.at(time), width, height), None);
    };
    let middle = camera_frame(&camera.at(time + shutter.moment(0.5)), width, height);
    let frames: Vec<CameraFrame> = if camera.path.is_some() {
        let moments = (0..=MOMENTS).map(|i| time + shutter.moment(i as f32 / MOMENTS as f32));
        moments.map(|moment| camera_frame(&camera.at(moment), width, height)).collect()
    } else {
        camera.keys.iter().map(|key| camera_frame(&at_key(camera, key), width, height)).collect()
    };
    (middle, Some(ViewShutter { timing, camera: segments(&frames).into() }))
}

/// The camera at one of its keys.
fn at_key(camera: &Camera, key: &CameraKey) -> Camera {
    Camera {
        eye: key.eye,
        target: key.target,
        up: key.up,
        projection: key.projection.unwrap_or(camera.projection),
        ..camera.clone()
    }
}

/// Segments between frames; none if they are all the same.
fn segments(frames: &[CameraFrame]) -> Vec<CameraSegment> {
    if frames.windows(2).all(|pair| pair[0] == pair[1]) {
        return Vec::new();
    }
    let places: Vec<Affine3A> = frames.iter().map(place).collect();
    let motion = motion_through(&places);
    motion.into_iter().zip(frames.windows(2)).map(|(place, pair)| segment(place, pair)).collect()
}

/// From the space of a camera to the world.
fn place(frame: &CameraFrame) -> Affine3A {
    let [right, up] = [frame.right, frame.up].map(vector);
    Affine3A::from_mat3_translation(Mat3::from_cols(right, up, right.cross(up)), vector(frame.origin))
}

/// A segment with what the lens does meanwhile.
fn segment(place: MotionSegment, pair: &[CameraFrame]) -> CameraSegment {
    let film = |frame: &CameraFrame| {
        let [right, up, forward] = [frame.right, frame.up, frame.forward].map(vector);
        [frame.half_size.x, frame.half_size.y, forward.dot(right), forward.dot(up)]
    };
    let lens = |frame: &CameraFrame| [frame.lens_radius, frame.focus_distance, 0.0, 0.0];
    let step = |a: [f32; 4], b: [f32; 4]| vec4f(b[0] - a[0], b[1] - a[1], b[2] - a[2], b[3] - a[3]);
    let [film_start, film_end] = [film(&pair[0]), film(&pair[1])];
    let [lens_start, lens_end] = [lens(&pair[0]), lens(&pair[1])];
    CameraSegment {
        place,
        film: film_start.into(),
        film_step: step(film_start, film_end),
        lens: lens_start.into(),
        lens_step: step(lens_start, lens_end),
    }
}

fn vector(v: Vec3f) -> Vec3 {
    Vec3::from(v.to_array())
}

#[cfg(test)]
mod tests {
    use super::*;
    use backend::View;
    use scene::{CameraPath, Projection, Scene};

    fn view(camera: Camera, shutter: Shutter) -> View {
        let scene = Scene { cameras: vec![camera], ..Scene::default() };
        crate::Job { shutter: Some(shutter), ..crate::Job::for_scene(&scene) }.view(2.0)
    }

    /// On its path the camera is where it is at that moment, between keys too.
    #[test]
    fn a_camera_on_a_circle_keeps_its_radius() {
        let mut camera = Camera::perspective("c", Vec3::new(0.0, 1.0, 3.0), Vec3::ZERO, 0.8);
        camera.path = Some(CameraPath::Orbit {
            center: Vec3::ZERO,
            radius: 3.0,
            height: 1.0,
            bob: 0.0,
            period: 10.0,
            start: 0.0,
        });
        let shutter = Shutter::new(-0.5, 1.5).expect("a shutter");
        let view = view(camera.clone(), shutter);
        for i in 0..=100 {
            let share = i as f32 / 100.0;
            let exact = camera_frame(&camera.at(2.0 + shutter.moment(share)), view.width, view.height);
            let found = view.camera_at(share);
            let apart = (vector(exact.origin) - vector(found.origin)).length();
            assert!(apart < 0.003, "{share}: {apart}");
            assert!((vector(exact.forward) - vector(found.forward)).length() < 1e-4, "{share}");
        }
        assert_eq!(view.camera, camera_frame(&camera.at(2.5), view.width, view.height));
    }

    #[test]
    fn a_zoom_keeps_the_place_and_changes_the_field() {
        let mut camera = Camera::perspective("c", Vec3::Z, Vec3::ZERO, 0.8);
        let key = |fov_y: f32| CameraKey {
            eye: camera.eye,
            target: camera.target,
            up: camera.up,
            projection: Some(Projection::Perspective { fov_y }),
        };
        camera.keys = vec![key(0.4), key(1.2)];
        let view = view(camera, Shutter::new(0.0, 1.0).expect("a shutter"));
        let [start, end] = [0.0, 1.0].map(|time| view.camera_at(time));
        assert!((start.half_size.y - 0.2f32.tan()).abs() < 1e-6);
        assert!((end.half_size.y - 0.6f32.tan()).abs() < 1e-6);
        assert!((vector(start.origin) - Vec3::Z).length() < 1e-6);
    }
}
