//! From arguments to a picture: environment, camera, integrator, limits.

use super::args::{HighlightsName, RenderArgs, VisibilityName};
use super::parsing::{Numbers, parse_vector};
use super::shutter::bring;
use crate::exit::Exit;
use alhazen::{
    Adaptive, Camera, CameraPath, Daylight, DirectSettings, Environment, EnvironmentPreset, Highlights,
    HybridSettings, Integrator, Job, Limits, LoadOptions, Loaded, Mis, Motion, NoisyPicture, PathSettings,
    Projection, Quantity, Rect, Sampling, Scene, SequenceDenoiser, Switch, Visibility, add_daylight_if_dark,
    check_default_camera,
};
use anyhow::{Context, bail, ensure};
use elementary::{atan2, hypot, tan};
use std::path::Path;

/// Puts the environment that the arguments name around the scene, or a sky around a dark one.
pub fn set_environment(args: &RenderArgs, loaded: &mut Loaded, options: &LoadOptions) -> anyhow::Result<()> {
    if let Some(sun) = args.sun {
        let ground = [0.2; 3].into();
        let daylight = Daylight { sun, turbidity: args.turbidity, ground, intensity: 1.0 };
        loaded.scene.environment = Environment::Daylight(daylight);
        return Ok(());
    }
    let Some(text) = &args.environment else {
        add_daylight_if_dark(&mut loaded.scene, &mut loaded.report, args.tone.exposure());
        return Ok(());
    };
    if let Some(preset) = environment_preset(text) {
        let (rotation, intensity) = (args.environment_rotation.to_radians(), args.environment_intensity);
        preset.put_around(&mut loaded.scene, rotation, intensity);
        return Ok(());
    }
    loaded.scene.environment = match parse_vector(text) {
        Ok(color) if !Path::new(text).exists() => {
            ensure!(color.iter().all(|c| *c >= 0.0), "--environment {text}: radiance cannot be negative");
            Environment::Constant(color.into())
        }
        _ => {
            let image = alhazen::load_environment(Path::new(text), options, &mut loaded.report)
                .with_context(|| format!("cannot load the environment {text}"))?;
            loaded.scene.images.push(image);
            Environment::Image {
                image: loaded.scene.images.len() as u32 - 1,
                rotation: args.environment_rotation.to_radians(),
                intensity: args.environment_intensity,
            }
        }
    };
    Ok(())
}

/// The environment of our own that has this name, unless there is a file of that name.
pub fn environment_preset(text: &str) -> Option<EnvironmentPreset> {
    EnvironmentPreset::from_name(text).filter(|_| !Path::new(text).exists())
}

/// The picture that the arguments ask for, with the scene's own wishes as defaults. `time`: when the scene is, in seconds, if
/// a moment or a sequence was asked for.
pub fn job(args: &RenderArgs, loaded: &mut Loaded, time: Option<f32>) -> anyhow::Result<Job> {
    let mut scene_job = Job::for_scene(&loaded.scene);
    choose_camera(args, &loaded.scene, &mut scene_job)?;
    let aspect = scene_job.width as f32 / scene_job.height as f32;
    let along = |side: u32, factor: f32| ((side as f32 * factor).round() as u32).max(1);
    (scene_job.width, scene_job.height) = match (args.width, args.height) {
        (Some(w), Some(h)) => (w, h),
        (Some(w), None) => (w, along(w, 1.0 / aspect)),
        (None, Some(h)) => (along(h, aspect), h),
        (None, None) => (scene_job.width, scene_job.height),
    };
    calibrate(args, &mut scene_job)?;
    scene_job.shutter = args.shutter(&loaded.scene)?;
    place_camera(args, &mut loaded.scene, &mut scene_job, time)?;
    if let Some(crop) = args.crop {
        let whole = Rect::full(scene_job.width, scene_job.height);
        let Rect { x, y, width, height } = crop;
        ensure!(
            whole.contains_rect(&crop) && crop.area() > 0,
            "--crop {x},{y},{width},{height} is not inside the picture of {}×{} pixels",
            whole.width,
            whole.height
        );
        scene_job.crop = Some(crop);
    }
    scene_job.integrator = integrator(args, scene_job.integrator);
    ensure!(
        args.clamp_indirect.is_none() || matches!(scene_job.integrator, Integrator::Path(_)),
        "--clamp-indirect is for the integrator `path`, not for `{}`",
        scene_job.integrator.name()
    );
    ensure!(
        args.mis == Mis::default() || matches!(scene_job.integrator, Integrator::Path(_)),
        "--mis is for the integrator `path`, not for `{}`",
        scene_job.integrator.name()
    );
    for (option, switch) in [("caustics", args.caustics), ("guiding", args.guiding)] {
        ensure!(
            switch.is_none_or(|switch| switch == Switch::Off)
                || matches!(scene_job.integrator, Integrator::Path(_)),
            "--{option} is for the integrator `path`, not for `{}`",
            scene_job.integrator.name()
        );
    }
    scene_job.single_scatter = args.single_scatter;
    scene_job.sampler = args.sampler;
    scene_job.seed = args.seed;
    scene_job.aovs = args.aov.clone();
    if args.denoise.is_some() {
        // Layers that are there already are not made twice.
        scene_job.aovs.extend(NoisyPicture::LAYERS);
    }
    if args.denoises_sequence() {
        scene_job.aovs.extend(SequenceDenoiser::LAYERS);
    }
    args.tone.apply(&mut scene_job.tone);
    if let Integrator::Realtime(settings) = &mut scene_job.integrator {
        // Noise is judged as it will be seen.
        settings.allocation.white = 1.0 / scene_job.tone.exposure.max(1e-6);
    }
    Ok(scene_job)
}

/// Takes the camera that the arguments name, with their field of view and lens.
fn choose_camera(args: &RenderArgs, scene: &Scene, job: &mut Job) -> anyhow::Result<()> {
    let cameras = &scene.cameras;
    if let Some(name) = &args.camera {
        let by_number = || name.parse().ok().and_then(|i: usize| cameras.get(i));
        let found = cameras.iter().find(|c| c.name == *name).or_else(by_number);
        let known: Vec<_> = cameras.iter().map(|c| c.name.as_str()).collect();
        job.camera =
            found.with_context(|| format!("there is no camera {name:?}; the scene has {known:?}"))?.clone();
    }
    choose_projection(args, &mut job.camera)?;
    if let Some(f_number) = args.f_number {
        let Projection::Perspective { fov_y } = job.camera.projection else {
            bail!("--f-number needs a perspective camera");
        };
        let focal_length = 0.012 / tan(fov_y * 0.5);
        job.camera.lens_radius = focal_length / (2.0 * f_number);
    }
    Ok(())
}

/// Gives a camera the projection and the field of view that the arguments name. One without a field of view becomes a
/// perspective.
fn choose_projection(args: &RenderArgs, camera: &mut Camera) -> anyhow::Result<()> {
    if let Some(named) = args.projection.filter(|named| named.name() != camera.projection.name()) {
        let seen_height = camera.projection.seen_height((camera.target - camera.eye).length());
        camera.projection = named;
        if let Projection::Orthographic { height } = &mut camera.projection {
            *height = seen_height;
        }
    }
    let Some(fov) = args.fov else { return Ok(()) };
    let has_angle = |p: &Projection| p.parameter().is_some_and(|(p, _)| p.quantity == Quantity::Angle);
    if !has_angle(&camera.projection) {
        ensure!(args.projection.is_none(), "--fov has no meaning for a camera that is {}", camera.projection);
        camera.projection = Projection::NAMED[0];
    }
    if let Some((parameter, angle)) = camera.projection.parameter_mut() {
        let [low, high] = parameter.range;
        let within = parameter.from_user(fov);
        *angle = within.with_context(|| format!("--fov: {fov}° is not between {low}° and {high}°"))?;
    }
    Ok(())
}

/// Places the camera where the arguments say, or where it shows all of a scene that has none: of one that moves, all that is
/// seen while its animation plays, so that a moment's picture is framed as the frames of a sequence are.
fn place_camera(
    args: &RenderArgs,
    scene: &mut Scene,
    job: &mut Job,
    time: Option<f32>,
) -> anyhow::Result<()> {
    if scene.cameras.is_empty() && (args.eye.is_none() || args.target.is_none()) {
        check_default_camera(scene).map_err(|error| Exit::Input.with(error.into()))?;
        let motion = Motion { plays: time.is_some(), turns: args.turntable.is_some() };
        let is_open = scene.motion.is_some();
        job.frame(scene, motion, time.unwrap_or(0.0));
        if is_open {
            // What frames the scene looks at it at many moments.
            bring(scene, time.unwrap_or(0.0), job.shutter.as_ref());
        }
    }
    let camera = &mut job.camera;
    if args.eye.is_some() || args.target.is_some() {
        let place = |given: Option<[f64; 3]>, own| given.map_or(own, |p| scene.from_world(p.into()));
        camera.eye = place(args.eye, camera.eye);
        camera.target = place(args.target, camera.target);
        ensure!(camera.eye != camera.target, "--eye and --target are the same point");
        camera.focus_distance = (camera.target - camera.eye).length();
        camera.path = None;
        camera.keys.clear();
    }
    camera.focus_distance = args.focus.unwrap_or(camera.focus_distance);
    if let Some(period) = args.turntable {
        camera.path = Some(turntable(camera, period));
    }
    Ok(())
}

/// Gives the picture's camera the intrinsics and the lens that the arguments ask for.
fn calibrate(args: &RenderArgs, job: &mut Job) -> anyhow::Result<()> {
    const LEVEL: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    if args.intrinsics.is_none() && args.distortion.is_none() && args.fisheye.is_none() {
        return Ok(());
    }
    let is_perspective =
        matches!(job.camera.projection, Projection::Perspective { .. } | Projection::Intrinsics { .. });
    ensure!(is_perspective, "--intrinsics, --distortion and --fisheye need a perspective camera");
    if let Some(Numbers(numbers)) = &args.intrinsics {
        let (fx, fy, cx, cy, skew) = match numbers[..] {
            [fx, fy, cx, cy] => (fx, fy, cx, cy, 0.0),
            [fx, fy, cx, cy, skew] => (fx, fy, cx, cy, skew),
            _ => bail!("--intrinsics: expected FX,FY,CX,CY or FX,FY,CX,CY,S"),
        };
        let matrix = [[fx, skew, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]];
        let calibrated = Camera::from_opencv(matrix, LEVEL, job.width, job.height).context("--intrinsics")?;
        (job.camera.projection, job.camera.skew) = (calibrated.projection, calibrated.skew);
    }
    for (option, given, fisheye) in
        [("--distortion", &args.distortion, false), ("--fisheye", &args.fisheye, true)]
    {
        if let Some(Numbers(coefficients)) = given {
            let camera = job.camera.clone().with_opencv_distortion(coefficients, fisheye);
            job.camera = camera.with_context(|| option)?;
        }
    }
    Ok(())
}

/// A turn around the target, which begins where the camera is.
fn turntable(camera: &Camera, period: f32) -> CameraPath {
    let offset = camera.eye - camera.target;
    CameraPath::Orbit {
        center: camera.target,
        radius: hypot(offset.x, offset.z),
        height: offset.y,
        bob: 0.0,
        period,
        start: atan2(offset.x, offset.z),
    }
}

fn integrator(args: &RenderArgs, of_scene: Integrator) -> Integrator {
    let path = || {
        let of_file = if let Integrator::Path(path) = of_scene { path } else { PathSettings::default() };
        Integrator::Path(args.roulette.apply(PathSettings {
            max_depth: args.max_depth.unwrap_or(of_file.max_depth),
            splitting: args.splitting,
            mis: args.mis,
            clamp_indirect: args.clamp_indirect,
            caustics: args.caustics.unwrap_or(of_file.caustics),
            guiding: args.guiding.unwrap_or(of_file.guiding),
            ..PathSettings::default()
        }))
    };
    let rays = |d: DirectSettings| DirectSettings {
        shadow_samples: args.shadow_samples.unwrap_or(d.shadow_samples),
        reflection_samples: args.reflection_samples.unwrap_or(d.reflection_samples),
        soft_shadows: !args.hard_shadows,
        max_depth: args.max_depth.unwrap_or(d.max_depth),
        highlights: match args.highlights {
            HighlightsName::Microfacets => Highlights::Microfacets,
            HighlightsName::Phong => Highlights::Phong,
        },
        falloff: args.falloff.unwrap_or(d.falloff),
        ..d
    };
    let direct = || Integrator::Direct(rays(DirectSettings::default()));
    let visibility = match args.visibility {
        VisibilityName::Raster => Visibility::Raster,
        VisibilityName::Rays => Visibility::Rays,
    };
    let hybrid = || {
        let d = HybridSettings::default();
        Integrator::Hybrid(HybridSettings {
            rays: rays(d.rays),
            visibility,
            shadows: !args.no_shadows,
            light_cutoff: args.light_cutoff,
            reflection_survival: args.reflection_survival,
        })
    };
    let realtime = || {
        let scene_depth = if let Integrator::Realtime(r) = of_scene { Some(r.path.max_depth) } else { None };
        let max_depth = args.max_depth.or(scene_depth);
        Integrator::Realtime(args.realtime.settings(max_depth, &args.roulette, visibility))
    };
    let mut integrator = match args.integrator.unwrap_or(of_scene) {
        Integrator::Path(_) => path(),
        Integrator::Direct(_) => direct(),
        Integrator::Hybrid(_) => hybrid(),
        Integrator::Realtime(_) => realtime(),
        other => other,
    };
    if let Some(ambient) = integrator.ambient_mut() {
        ambient.samples = args.ambient_samples.unwrap_or(ambient.samples);
        if let Some(metres) = args.ambient_distance {
            ambient.set_distance(metres);
        }
    }
    integrator
}

/// When the picture is done.
pub fn limits(args: &RenderArgs, loaded: &Loaded) -> Limits {
    let open_ended = args.time.is_some() || args.noise.is_some();
    let default = if open_ended { 65_536 } else { loaded.scene.defaults.spp.unwrap_or(64) };
    let adaptive = Adaptive { min_spp: args.min_spp, ..Adaptive::default() };
    let sampling = if args.is_adaptive() { Sampling::Adaptive(adaptive) } else { Sampling::Uniform };
    Limits { spp: args.spp.unwrap_or(default), time: args.time, noise: args.noise.map(f64::from), sampling }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turntable_begins_and_ends_where_the_camera_is() {
        let mut camera = Camera::perspective("c", [3.0, 2.0, -4.0].into(), [0.0, 1.0, 1.0].into(), 1.0);
        let eye = camera.eye;
        camera.path = Some(turntable(&camera, 8.0));
        let distance = |time: f32| (camera.at(time).eye - eye).length();
        assert!(distance(0.0) < 1e-5 && distance(8.0) < 1e-4);
        let diameter = 2.0 * 3f32.hypot(5.0);
        assert!((distance(4.0) - diameter).abs() < 1e-4, "half a turn is across");
        assert_eq!((camera.at(4.0).eye.y, camera.at(4.0).target), (2.0, camera.target));
    }
}
