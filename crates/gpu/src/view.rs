//! What is to be rendered, as shaders see it: the uniform of bind group 2.

use crate::batch::{Batch, BatchPixels};
use crate::gbuffer::Picture;
use backend::{DirectSettings, Highlights, Integrator, PathSettings};
use bytemuck::{Pod, Zeroable};
use optics::camera::camera_pixel_spread;

/// The optics' camera as shaders see it.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct CameraFrame {
    kind: u32,
    padding0: [u32; 3],
    origin: [f32; 3],
    padding1: u32,
    right: [f32; 3],
    padding2: u32,
    up: [f32; 3],
    padding3: u32,
    forward: [f32; 3],
    padding4: u32,
    half_size: [f32; 2],
    lens_radius: f32,
    focus_distance: f32,
    distortion: Distortion,
}

/// The optics' distortion as shaders see it.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Distortion {
    model: u32,
    skew: f32,
    limit: f32,
    padding: u32,
    radial: [f32; 4],
    rest: [f32; 4],
}

impl From<optics::distortion::Distortion> for Distortion {
    fn from(d: optics::distortion::Distortion) -> Self {
        let (radial, rest) = (d.radial.to_array(), d.rest.to_array());
        Self { model: d.model, skew: d.skew, limit: d.limit, padding: 0, radial, rest }
    }
}

impl From<optics::camera::CameraFrame> for CameraFrame {
    fn from(c: optics::camera::CameraFrame) -> Self {
        Self {
            kind: c.kind,
            origin: c.origin.to_array(),
            right: c.right.to_array(),
            up: c.up.to_array(),
            forward: c.forward.to_array(),
            half_size: c.half_size.to_array(),
            lens_radius: c.lens_radius,
            focus_distance: c.focus_distance,
            distortion: c.distortion.into(),
            ..Self::default()
        }
    }
}

/// What is to be rendered, as shaders see it; see `shaders/film.wgsl` for the fields.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct View {
    camera: CameraFrame,
    width: u32,
    height: u32,
    window_x: u32,
    window_y: u32,
    window_width: u32,
    window_height: u32,
    first_row: u32,
    row_count: u32,
    first_sample: u32,
    sample_count: u32,
    seed: u32,
    pixel_spread: f32,
    single_scatter: u32,
    max_depth: u32,
    roulette_start: u32,
    roulette_min_survival: f32,
    splitting: u32,
    shadow_samples: u32,
    soft_shadows: u32,
    reflection_samples: u32,
    ambient_samples: u32,
    ambient_distance: f32,
    list_length: u32,
    first_in_list: u32,
    light_cutoff: f32,
    shadows: u32,
    phong: u32,
    reflection_survival: f32,
    falloff: [f32; 3],
    portion_samples: u32,
    most_indirect: f32,
    padding0: u32,
    padding1: u32,
    padding2: u32,
}

/// Segments of a camera's motion that shaders have room for.
pub const MOST_CAMERA_SEGMENTS: usize = 16;

/// What follows the [`View`] where camera rays leave at times of their own; see
/// `shaders/film.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct ViewMotion {
    shutter: [f32; 4],
    shutter_delays: [f32; 4],
    camera_motion: [[[f32; 4]; 12]; MOST_CAMERA_SEGMENTS],
}

impl ViewMotion {
    /// Of a view whose camera has no more than [`MOST_CAMERA_SEGMENTS`]; `None` of an instant.
    pub fn new(view: &backend::View) -> Option<Self> {
        let shutter = view.shutter.as_ref()?;
        let timing = shutter.timing;
        let mut camera_motion = [[[0.0; 4]; 12]; MOST_CAMERA_SEGMENTS];
        for (to, from) in camera_motion.iter_mut().zip(&*shutter.camera) {
            *to = *bytemuck::from_bytes(bytemuck::bytes_of(from));
        }
        let segments = shutter.camera.len().min(MOST_CAMERA_SEGMENTS) as f32;
        Some(Self {
            shutter: [timing.open, timing.duration, timing.rise, timing.fall],
            shutter_delays: [timing.row_delay, timing.column_delay, segments, 0.0],
            camera_motion,
        })
    }
}

impl View {
    /// Width of the window in pixels.
    pub fn window_width(&self) -> u32 {
        self.window_width
    }

    /// Longest path in segments.
    pub fn max_depth(&self) -> u32 {
        self.max_depth
    }

    /// Paths that go on from the first vertex of each camera ray, at least 1.
    pub fn splitting(&self) -> u32 {
        self.splitting.max(1)
    }

    /// What shaders need to know of `view`; the batch is filled in for each dispatch.
    pub fn new(view: &backend::View) -> Self {
        let mut out = Self {
            camera: view.camera.into(),
            width: view.width,
            height: view.height,
            window_x: view.window.x,
            window_y: view.window.y,
            window_width: view.window.width,
            window_height: view.window.height,
            seed: view.seed,
            pixel_spread: camera_pixel_spread(view.camera, view.height as f32),
            single_scatter: u32::from(view.single_scatter),
            ..Self::default()
        };
        match &view.integrator {
            Integrator::Path(settings) => out.set_path(settings),
            Integrator::Direct(settings) => out.set_direct(settings),
            Integrator::Hybrid(settings) => {
                out.set_direct(&settings.rays);
                out.light_cutoff = settings.light_cutoff.max(0.0);
                out.shadows = u32::from(settings.shadows);
                out.reflection_survival = settings.reflection_survival.clamp(1e-3, 1.0);
            }
            Integrator::Realtime(settings) => {
                out.set_path(&PathSettings { splitting: 1, clamp_indirect: None, ..settings.path });
            }
            _ => {}
        }
        if let Some(ambient) = view.integrator.ambient() {
            out.ambient_samples = ambient.samples;
            // Shader compilers may assume that nothing is infinite.
            out.ambient_distance = ambient.distance.min(f32::MAX);
        }
        out
    }

    /// Takes a batch: what the next dispatch works on.
    pub(crate) fn set_batch(&mut self, batch: Batch) {
        let (rows, portions) = match batch.pixels {
            BatchPixels::Rows { first, count } => ((first, count), (0, 0, 0)),
            BatchPixels::Portions { first, count, samples } => ((0, 0), (first, count, samples)),
        };
        (self.first_row, self.row_count) = rows;
        (self.first_in_list, self.list_length, self.portion_samples) = portions;
        self.first_sample = batch.first_sample;
        self.sample_count = batch.sample_count;
    }

    fn set_path(&mut self, settings: &PathSettings) {
        self.max_depth = settings.max_depth;
        self.roulette_start = settings.roulette_start;
        self.roulette_min_survival = settings.roulette_min_survival;
        self.splitting = settings.splitting.max(1);
        self.most_indirect = settings.most_indirect();
    }

    /// Radius of a pixel's footprint per metre of distance.
    pub(crate) fn pixel_spread(&self) -> f32 {
        self.pixel_spread
    }

    /// The picture and the window.
    pub(crate) fn picture(&self) -> Picture {
        Picture {
            size: [self.width, self.height],
            window_at: [self.window_x, self.window_y],
            window_size: [self.window_width, self.window_height],
        }
    }

    /// What changes the noise.
    pub(crate) fn seed(&self) -> u32 {
        self.seed
    }

    fn set_direct(&mut self, settings: &DirectSettings) {
        self.max_depth = settings.max_depth;
        self.shadow_samples = settings.shadow_samples.max(1);
        self.soft_shadows = u32::from(settings.soft_shadows);
        self.reflection_samples = settings.reflection_samples;
        self.shadows = 1;
        self.phong = u32::from(settings.highlights == Highlights::Phong);
        self.falloff = settings.falloff;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::assert_layout;

    #[test]
    fn layouts_match_the_shader() {
        let module = crate::shader::check::module("film");
        assert_layout!(
            module,
            View {
                camera,
                width,
                height,
                window_x,
                window_y,
                window_width,
                window_height,
                first_row,
                row_count,
                first_sample,
                sample_count,
                seed,
                pixel_spread,
                single_scatter,
                max_depth,
                roulette_start,
                roulette_min_survival,
                splitting,
                shadow_samples,
                soft_shadows,
                reflection_samples,
                ambient_samples,
                ambient_distance,
                list_length,
                first_in_list,
                light_cutoff,
                shadows,
                phong,
                reflection_survival,
                falloff,
                portion_samples,
                most_indirect,
                padding0,
                padding1,
                padding2,
            }
        );
        let moving = crate::shader::check::module_with("film", "MOTION");
        let (fields, size) = crate::layout::layout_of(&moving, "View");
        let view = size_of::<View>();
        let rust = [
            ("shutter", view + std::mem::offset_of!(ViewMotion, shutter)),
            ("shutter_delays", view + std::mem::offset_of!(ViewMotion, shutter_delays)),
            ("camera_motion", view + std::mem::offset_of!(ViewMotion, camera_motion)),
        ];
        assert_eq!(fields[fields.len() - 3..], rust.map(|(name, offset)| (name.to_owned(), offset)));
        assert_eq!(size, view + size_of::<ViewMotion>());
        // The optics' structure has gaps where Rust has fields of padding.
        let (fields, size) = crate::layout::layout_of(&module, "CameraFrame");
        let rust = [
            ("kind", std::mem::offset_of!(CameraFrame, kind)),
            ("origin", std::mem::offset_of!(CameraFrame, origin)),
            ("right", std::mem::offset_of!(CameraFrame, right)),
            ("up", std::mem::offset_of!(CameraFrame, up)),
            ("forward", std::mem::offset_of!(CameraFrame, forward)),
            ("half_size", std::mem::offset_of!(CameraFrame, half_size)),
            ("lens_radius", std::mem::offset_of!(CameraFrame, lens_radius)),
            ("focus_distance", std::mem::offset_of!(CameraFrame, focus_distance)),
            ("distortion", std::mem::offset_of!(CameraFrame, distortion)),
        ];
        assert_eq!(fields, rust.map(|(name, offset)| (name.to_owned(), offset)));
        assert_eq!(size, size_of::<CameraFrame>());
        let (fields, size) = crate::layout::layout_of(&module, "Distortion");
        let rust = [
            ("model", std::mem::offset_of!(Distortion, model)),
            ("skew", std::mem::offset_of!(Distortion, skew)),
            ("limit", std::mem::offset_of!(Distortion, limit)),
            ("radial", std::mem::offset_of!(Distortion, radial)),
            ("rest", std::mem::offset_of!(Distortion, rest)),
        ];
        assert_eq!(fields, rust.map(|(name, offset)| (name.to_owned(), offset)));
        assert_eq!(size, size_of::<Distortion>());
    }
}
