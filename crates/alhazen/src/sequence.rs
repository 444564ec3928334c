//! Denoising the frames of a sequence, each with what those before have found.

use crate::{DenoiseFilmError, Denoised, Denoiser, Renderer, picture_point, picture_ray};
use backend::View;
use film::{Aov, AovData, Film, Image};
use glam::{Affine3A, DAffine3, DVec2, DVec3, Vec3};
use optics::camera::CameraFrame;
use post::{DenoiseError, Frame, History, NoisyPicture, Surface};
use rayon::prelude::*;
use scene::Scene;

/// Denoises frame after frame of a sequence.
///
/// The light that frames before have found is looked up where it was, by the motion of camera and
/// instances, and counts as far as it agrees with the new frame ([`History`]). The first frame is
/// denoised alone. Frames need noise of their own: the seed of [`frame_seed`].
#[derive(Debug, Default)]
pub struct SequenceDenoiser {
    history: History,
    last: Option<Moment>,
}

/// Where everything is in a frame.
#[derive(Clone, Debug)]
pub struct Moment {
    camera: CameraFrame,
    size: (u32, u32),
    /// The upper left corner of what is rendered.
    corner: (u32, u32),
    /// Object to world of each instance; `None` of one that changes its shape. Empty if none moves.
    transforms: Vec<Option<Affine3A>>,
}

impl SequenceDenoiser {
    /// Layers that the films of frames must have.
    pub const LAYERS: [Aov; 6] =
        [Aov::Albedo, Aov::DenoisingNormal, Aov::Depth, Aov::Position, Aov::MaterialId, Aov::InstanceId];

    /// Removes the noise of the next frame, on the device that renders where that can do it.
    ///
    /// # Errors
    /// As [`Denoiser::run_on`].
    pub fn denoise(
        &mut self,
        renderer: &mut Renderer,
        denoiser: Denoiser,
        film: &FrameFilm,
    ) -> Result<Denoised, DenoiseFilmError> {
        let surfaces = film.surfaces(self.last.as_ref());
        let mut by = String::new();
        let frame = Frame { noisy: &film.noisy, surfaces: &surfaces };
        let picture = self.history.denoise(frame, |combined| {
            let denoised = renderer.denoise(denoiser, combined)?;
            by = denoised.by;
            Ok::<_, DenoiseFilmError>(denoised.picture)
        })?;
        self.last = Some(film.moment.clone());
        Ok(Denoised { picture, by })
    }
}

/// What the film of a frame knows.
#[derive(Clone, Debug)]
pub struct FrameFilm {
    noisy: NoisyPicture,
    moment: Moment,
    depth: Vec<f32>,
    position: Image,
    material: Vec<u32>,
    instance: Vec<u32>,
}

impl FrameFilm {
    /// Of a film that shows `view`. `scene`: as it is in this frame; `None` if nothing but the
    /// camera moves.
    ///
    /// # Errors
    /// When the film lacks one of [`SequenceDenoiser::LAYERS`].
    pub fn new(film: &Film, view: &View, scene: Option<&Scene>) -> Result<Self, DenoiseError> {
        let missing = DenoiseError::MissingLayer;
        let numbers = |aov| match film.aov(aov) {
            Some(AovData::Float(image)) => Ok(image),
            _ => Err(missing(aov)),
        };
        let ids = |aov| match film.aov(aov) {
            Some(AovData::Integer(ids)) => Ok(ids),
            _ => Err(missing(aov)),
        };
        Ok(Self {
            noisy: NoisyPicture::of_film(film)?,
            moment: Moment {
                camera: view.camera,
                size: (view.width, view.height),
                corner: (view.window.x, view.window.y),
                transforms: scene.map(transforms).unwrap_or_default(),
            },
            depth: numbers(Aov::Depth)?.into_data(),
            position: numbers(Aov::Position)?,
            material: ids(Aov::MaterialId)?,
            instance: ids(Aov::InstanceId)?,
        })
    }

    /// The frame by itself.
    #[must_use]
    pub fn noisy(&self) -> &NoisyPicture {
        &self.noisy
    }

    /// Where everything is.
    #[must_use]
    pub fn moment(&self) -> &Moment {
        &self.moment
    }

    /// What each pixel sees, row by row, and where that was at the moment `last`.
    #[must_use]
    pub fn surfaces(&self, last: Option<&Moment>) -> Vec<Surface> {
        let moves = last.map(|last| Moves::between(&last.transforms, &self.moment.transforms));
        let surface = |i: usize| {
            let before = last.zip(moves.as_ref()).and_then(|(last, moves)| self.before(i, last, moves));
            let (back, distance_before) = before.unwrap_or(([f32::NAN; 2], f32::NAN));
            let distance = if self.depth[i] > 0.0 { self.depth[i] } else { f32::INFINITY };
            Surface { back, distance_before, distance, ids: [self.instance[i], self.material[i]] }
        };
        (0..self.depth.len()).into_par_iter().map(surface).collect()
    }

    /// How far back the surface of pixel `i` was at another moment, in pixels, and at which
    /// distance.
    fn before(&self, i: usize, last: &Moment, moves: &Moves) -> Option<([f32; 2], f32)> {
        let now = &self.moment;
        if now.camera == last.camera && !moves.moves(self.instance[i]) {
            let distance = if self.depth[i] > 0.0 { self.depth[i] } else { f32::INFINITY };
            return Some(([0.0; 2], distance));
        }
        let width = self.position.width() as usize;
        let corner = |c: (u32, u32)| DVec2::new(f64::from(c.0), f64::from(c.1));
        let eye = |camera: &CameraFrame| DVec3::from_array(camera.origin.to_array().map(f64::from));
        let (offset_now, offset_then) = if self.depth[i] > 0.0 {
            let [x, y, z] = self.position.rgb((i % width) as u32, (i / width) as u32);
            let point = Vec3::new(x, y, z).as_dvec3();
            (point - eye(&now.camera), moves.back(self.instance[i], point)? - eye(&last.camera))
        } else {
            // The sky is infinitely far away.
            let (x, y) = (i % width, i / width);
            let center = |at: usize, corner: u32| (at as u32 + corner) as f32 + 0.5;
            let (x, y) = (center(x, now.corner.0), center(y, now.corner.1));
            let ray = picture_ray(&now.camera, now.size.0, now.size.1, x, y);
            let direction = Vec3::from(ray.direction).as_dvec3();
            (direction, direction)
        };
        let here = picture_point(&now.camera, now.size.0, now.size.1, offset_now)? - corner(now.corner);
        let there = picture_point(&last.camera, last.size.0, last.size.1, offset_then)? - corner(last.corner);
        let distance = if self.depth[i] > 0.0 { offset_then.length() as f32 } else { f32::INFINITY };
        Some(((there - here).as_vec2().to_array(), distance))
    }
}

/// Object to world of each instance of a scene.
fn transforms(scene: &Scene) -> Vec<Option<Affine3A>> {
    let deformed = |mesh: u32| {
        let mut parts = scene.animations.iter().flat_map(|a| &a.deformations);
        parts.any(|part| part.mesh == mesh)
    };
    scene.instances.iter().map(|i| (!deformed(i.mesh)).then_some(i.transform)).collect()
}

/// How instances move from one frame to the next.
struct Moves(Vec<Step>);

/// How an instance moves.
enum Step {
    Stays,
    /// World now to world then.
    Back(DAffine3),
    Unknown,
}

impl Moves {
    fn between(then: &[Option<Affine3A>], now: &[Option<Affine3A>]) -> Self {
        let double = |a: Affine3A| {
            let columns = glam::Mat3::from(a.matrix3).as_dmat3();
            DAffine3::from_mat3_translation(columns, Vec3::from(a.translation).as_dvec3())
        };
        let step = |i: usize| match (then.get(i).copied().flatten(), now[i]) {
            (Some(then), Some(now)) if then == now => Step::Stays,
            (Some(then), Some(now)) => {
                let back = double(then) * double(now).inverse();
                if back.is_finite() { Step::Back(back) } else { Step::Unknown }
            }
            _ => Step::Unknown,
        };
        Self((0..now.len()).map(step).collect())
    }

    fn moves(&self, instance: u32) -> bool {
        !matches!(self.0.get(instance as usize), None | Some(Step::Stays))
    }

    /// Where a point of an instance was.
    fn back(&self, instance: u32, point: DVec3) -> Option<DVec3> {
        match self.0.get(instance as usize) {
            None | Some(Step::Stays) => Some(point),
            Some(Step::Back(back)) => Some(back.transform_point3(point)),
            Some(Step::Unknown) => None,
        }
    }
}

/// The seed of a frame of a sequence, so that each has noise of its own.
#[must_use]
pub fn frame_seed(seed: u32, frame: u32) -> u32 {
    // Frame 0 has the seed of a picture alone. The factor is odd: no two frames have the same.
    seed.wrapping_add(frame.wrapping_mul(0x9e37_79b1))
}
