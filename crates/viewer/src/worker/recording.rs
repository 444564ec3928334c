//! Pictures that are rendered into files: sequences along a path of the camera, or a single one.

use alhazen::{Adaptive, Camera, Denoiser, Job, Sampling};
use std::path::PathBuf;
use std::time::Instant;

/// Pictures to render into files.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// What is the same in all pictures.
    pub job: Job,
    /// The camera of each picture.
    pub cameras: Vec<Camera>,
    /// Samples per pixel, at most.
    pub spp: u32,
    /// How they are spread over each picture.
    pub sampling: Sampling,
    /// Relative standard error at which a picture is done.
    pub noise: Option<f64>,
    /// What takes the noise out of pictures; the job has the layers for it then.
    pub denoiser: Option<Denoiser>,
    /// Where the pictures go. Those of sequences have numbers; see [`alhazen::output::frame_path`].
    pub path: PathBuf,
    /// Whether it is one picture, whose file has the name as it is.
    pub is_single: bool,
}

/// A sequence that is being rendered.
pub(super) struct Sequence {
    pub recording: Recording,
    /// The next picture.
    pub next: usize,
    /// Samples that it has.
    pub spp: u32,
    /// When it was begun.
    pub begun: Instant,
}

impl Sequence {
    pub fn new(recording: Recording) -> Self {
        Self { recording, next: 0, spp: 0, begun: Instant::now() }
    }

    /// The picture that is being rendered; `None` after the last.
    pub fn job(&self) -> Option<Job> {
        let camera = self.recording.cameras.get(self.next)?.clone();
        Some(Job { camera, ..self.recording.job.clone() })
    }

    /// How the next pass chooses its pixels; `None` gives all the same.
    pub fn adaptive(&self) -> Option<Adaptive> {
        match self.recording.sampling {
            Sampling::Adaptive(adaptive) if self.spp >= adaptive.pilot() => Some(adaptive),
            _ => None,
        }
    }

    /// Samples per pixel of the next pass: few, so that somebody who waits sees progress.
    pub fn samples(&self) -> u32 {
        let end = match self.recording.sampling {
            Sampling::Adaptive(adaptive) if self.spp < adaptive.pilot() => adaptive.pilot(),
            _ => self.recording.spp,
        };
        end.min(self.recording.spp).saturating_sub(self.spp).clamp(1, 16)
    }

    pub fn path(&self) -> PathBuf {
        if self.recording.is_single {
            return self.recording.path.clone();
        }
        alhazen::output::frame_path(&self.recording.path, self.next as u32)
    }
}

impl Recording {
    /// Cameras of a whole turn about the target, `count` of them.
    pub fn turntable(camera: &Camera, count: usize) -> Vec<Camera> {
        let mut turning = camera.clone();
        turning.path = Some(alhazen::navigation::orbit_path(camera, 0.0, 1.0));
        Self::along(&turning, count, 1.0)
    }

    /// Cameras along a camera's own path, `count` of them in `seconds`.
    pub fn along(camera: &Camera, count: usize, seconds: f32) -> Vec<Camera> {
        let at = |i: usize| Camera { path: None, ..camera.at(seconds * i as f32 / count.max(1) as f32) };
        (0..count).map(at).collect()
    }

    /// Cameras on a smooth way through saved views (Catmull-Rom), `count` of them; the first and the last are reached.
    pub fn through(views: &[Camera], count: usize) -> Vec<Camera> {
        let Some(last) = views.len().checked_sub(1) else { return Vec::new() };
        let view = |i: isize| &views[i.clamp(0, last as isize) as usize];
        let place = |i: usize| {
            let t = last as f32 * i as f32 / count.saturating_sub(1).max(1) as f32;
            let segment = (t as isize).min(last as isize - 1).max(0);
            let share = t - segment as f32;
            let around = [-1, 0, 1, 2].map(|o| view(segment + o));
            let nearest = if share < 0.5 { around[1] } else { around[2] };
            Camera {
                eye: catmull_rom(around.map(|c| c.eye), share),
                target: catmull_rom(around.map(|c| c.target), share),
                up: catmull_rom(around.map(|c| c.up), share).normalize_or(nearest.up),
                path: None,
                ..nearest.clone()
            }
        };
        (0..count).map(place).collect()
    }
}

/// The curve through `p[1]` (t = 0) and `p[2]` (t = 1).
fn catmull_rom(p: [glam::Vec3; 4], t: f32) -> glam::Vec3 {
    let (t2, t3) = (t * t, t * t * t);
    0.5 * (2.0 * p[1]
        + (p[2] - p[0]) * t
        + (2.0 * p[0] - 5.0 * p[1] + 4.0 * p[2] - p[3]) * t2
        + (3.0 * p[1] - p[0] - 3.0 * p[2] + p[3]) * t3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn camera(x: f32) -> Camera {
        Camera::perspective("c", Vec3::new(x, 1.0, 4.0), Vec3::new(x, 0.0, 0.0), 0.8)
    }

    #[test]
    fn turntables_begin_at_the_camera_and_go_once_around() {
        let cameras = Recording::turntable(&camera(0.0), 8);
        assert!(cameras[0].eye.distance(Vec3::new(0.0, 1.0, 4.0)) < 1e-5);
        assert!(cameras[4].eye.distance(Vec3::new(0.0, 1.0, -4.0)) < 1e-4, "{}", cameras[4].eye);
        assert!(cameras.iter().all(|c| c.path.is_none() && (c.eye.y - 1.0).abs() < 1e-5));
    }

    #[test]
    fn paths_reach_every_view() {
        let cameras = Recording::through(&[camera(0.0), camera(1.0), camera(5.0)], 5);
        let x: Vec<f32> = cameras.iter().map(|c| c.eye.x).collect();
        assert!((x[0] - 0.0).abs() < 1e-5 && (x[2] - 1.0).abs() < 1e-5 && (x[4] - 5.0).abs() < 1e-5, "{x:?}");
        assert!(x.is_sorted(), "{x:?}");
        assert_eq!(Recording::through(&[camera(2.0)], 3).len(), 3);
        assert!(Recording::through(&[], 3).is_empty());
    }

    #[test]
    fn frames_are_numbered_and_single_pictures_are_not() {
        let job = Job::for_scene(&alhazen::Scene::default());
        let mut recording = Recording {
            cameras: vec![camera(0.0)],
            job,
            spp: 40,
            sampling: Sampling::Adaptive(Adaptive { min_spp: 8, ..Adaptive::default() }),
            noise: None,
            denoiser: None,
            path: "a.png".into(),
            is_single: false,
        };
        assert_eq!(Sequence::new(recording.clone()).path(), PathBuf::from("a.0000.png"));
        recording.is_single = true;
        let mut sequence = Sequence::new(recording);
        assert_eq!(sequence.path(), PathBuf::from("a.png"));
        // Every pixel has its first samples before they are spread.
        assert_eq!((sequence.samples(), sequence.adaptive()), (8, None));
        sequence.spp = 8;
        assert!(sequence.samples() == 16 && sequence.adaptive().is_some());
        sequence.spp = 39;
        assert_eq!(sequence.samples(), 1);
    }
}
