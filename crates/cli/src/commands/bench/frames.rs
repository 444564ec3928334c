//! What measurements of real-time frames have in common: arguments, times, and scenes that are made for them. The loop is
//! [`Stage`](super::stage::Stage)'s.

use super::report::{Cell, Percentiles};
use crate::commands::render::parsing::parse_share;
use alhazen::gpu::frames::FrameReport;
use alhazen::gpu::screen::PresentMode;
use alhazen::gpu::tracer::TracerKind;
use alhazen::gpu::tracer::upper::Place;
use alhazen::gpu::{Gpu, GpuOptions, has_hardware};
use alhazen::{
    Camera, HybridSettings, Instance, Integrator, Job, Light, LightKind, Material, Mesh, Model, Scene, Shape,
    TriangleMesh, View,
};
use clap::{Args, ValueEnum};
use glam::{Affine3A, Vec3};
use std::path::PathBuf;
use std::time::Duration;

/// How frames are measured.
#[derive(Debug, Args)]
pub struct FrameArgs {
    /// Width of the frames in pixels [default: 1920, or 320 where there is no GPU].
    #[arg(long, value_parser = clap::value_parser!(u32).range(16..=16384))]
    width: Option<u32>,
    /// Height of the frames in pixels [default: 1080, or 180 where there is no GPU].
    #[arg(long, value_parser = clap::value_parser!(u32).range(16..=16384))]
    height: Option<u32>,
    /// Frames before those that are measured [default: 2000, or 1 where there is no GPU].
    #[arg(long, value_name = "N")]
    warm_up: Option<u32>,
    /// Frames that are measured [default: 5000, or 5 where there is no GPU].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    frames: Option<u32>,
    /// How first hits are found.
    #[arg(long, value_enum, default_value_t = Visibility::Raster)]
    pub visibility: Visibility,
    /// Least probability with which a glossy surface sends out reflection rays; 1 sends them all.
    #[arg(long, value_name = "SHARE", default_value_t = 0.04, value_parser = parse_share)]
    pub reflection_survival: f32,
    /// Which back end traces: gpu-bvh or gpu-query. Instances move on the device with gpu-bvh only.
    #[arg(long, value_name = "NAME", default_value = "gpu-bvh")]
    pub tracer: Tracer,
    /// Which GPU: a part of its name.
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
    /// Write what host and device did in the last measured frames to this file, for chrome://tracing.
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// Show the frames in a window. Escape ends the measurement, and nothing is written then.
    #[arg(long)]
    pub windowed: bool,
    /// When pictures reach the screen: auto is the first that the window has of immediate, mailbox and fifo.
    #[arg(long, value_enum, value_name = "MODE", default_value_t = Presenting::Auto, requires = "windowed")]
    pub present_mode: Presenting,
}

/// When pictures reach the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Presenting {
    /// Without waiting for the screen, if that can be.
    Auto,
    /// Each in its turn, with the screen's refresh.
    Fifo,
    /// The latest, with the screen's refresh.
    Mailbox,
    /// At once.
    Immediate,
}

/// How first hits are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Visibility {
    /// By the rasteriser.
    Raster,
    /// By a ray through each pixel.
    Rays,
}

/// Which back end traces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Tracer {
    /// Our own hierarchy.
    #[value(name = "gpu-bvh")]
    Bvh,
    /// The driver's, by ray queries.
    #[value(name = "gpu-query")]
    Query,
}

/// Times of frames, a value each, in milliseconds.
#[derive(Debug, Default)]
pub struct Measured {
    /// Wall time of all of them, in seconds.
    pub seconds: f64,
    /// The host's; waiting for a slot of the ring and for the window is not counted.
    pub host: Vec<f64>,
    /// That the host waited.
    pub waited: Vec<f64>,
    /// The device's, in passes.
    pub device: Vec<f64>,
    /// From the host's beginning to the device's end.
    pub latency: Vec<f64>,
    /// Until the host had a picture of the window to draw on, which includes waiting for the screen; empty without a window.
    pub acquired: Vec<f64>,
    /// Until the host had given the picture back; empty without a window.
    pub presented: Vec<f64>,
    /// By pass.
    pub passes: Vec<(&'static str, Vec<f64>)>,
}

/// A duration in milliseconds.
pub fn milliseconds(d: Duration) -> f64 {
    d.as_secs_f64() * 1e3
}

impl Measured {
    /// Frames a second.
    pub fn rate(&self) -> f64 {
        self.host.len() as f64 / self.seconds
    }

    /// Median time of a pass, 0 if there was none.
    pub fn pass(&self, name: &str) -> f64 {
        self.passes.iter().find(|(n, _)| *n == name).map_or(0.0, |(_, times)| Percentiles::of(times).p50)
    }

    /// Cells of [`Stage::columns`](super::stage::Stage::columns).
    pub fn shown(&self) -> impl Iterator<Item = Cell> {
        let times = [&self.acquired, &self.presented].into_iter().filter(|times| !times.is_empty());
        times.map(|times| Percentiles::of(times).p50.into())
    }

    pub(super) fn add(&mut self, report: &FrameReport) {
        self.waited.push(milliseconds(report.waited));
        self.device.push(milliseconds(report.device()));
        self.latency.extend(report.latency.map(milliseconds));
        for pass in &report.passes {
            let at = self.passes.iter().position(|(name, _)| *name == pass.name).unwrap_or_else(|| {
                self.passes.push((pass.name, Vec::new()));
                self.passes.len() - 1
            });
            self.passes[at].1.push(milliseconds(pass.duration));
        }
    }
}

/// What is usual on a GPU, or on a software driver, which takes a thousand times as long.
pub fn usual<T>(on_gpu: T, on_software: T) -> T {
    if has_hardware() { on_gpu } else { on_software }
}

impl FrameArgs {
    /// Width and height of the frames in pixels.
    pub fn size(&self) -> [u32; 2] {
        let [width, height] = usual([1920, 1080], [320, 180]);
        [self.width.unwrap_or(width), self.height.unwrap_or(height)]
    }

    /// Frames before those that are measured.
    pub fn warm_up(&self) -> u32 {
        self.warm_up.unwrap_or(usual(2000, 1))
    }

    /// Frames that are measured.
    pub fn frames(&self) -> u32 {
        self.frames.unwrap_or(usual(5000, 5))
    }

    /// What reports say of the arguments.
    pub fn settings(&self, gpu: &Gpu) -> Vec<(&'static str, String)> {
        vec![
            ("device", gpu.describe()),
            ("tracer", self.kind().name().to_owned()),
            ("size", format!("{}×{}", self.size()[0], self.size()[1])),
            ("frames", format!("{} after {}", self.frames(), self.warm_up())),
            ("least share of reflections", self.reflection_survival.to_string()),
            ("visibility", self.settings_of(HybridSettings::default()).visibility.name().to_owned()),
        ]
    }

    pub(super) fn kind(&self) -> TracerKind {
        match self.tracer {
            Tracer::Bvh => TracerKind::Bvh,
            Tracer::Query => TracerKind::Query,
        }
    }

    /// How the device is chosen.
    pub(super) fn gpu_options(&self) -> GpuOptions {
        GpuOptions { adapter: self.adapter.clone(), ..GpuOptions::default() }
    }

    /// When pictures reach the screen.
    pub(super) fn presenting(&self) -> PresentMode {
        match self.present_mode {
            Presenting::Auto => PresentMode::Auto,
            Presenting::Fifo => PresentMode::Fifo,
            Presenting::Mailbox => PresentMode::Mailbox,
            Presenting::Immediate => PresentMode::Immediate,
        }
    }

    /// Settings with what the arguments say.
    pub fn settings_of(&self, settings: HybridSettings) -> HybridSettings {
        let visibility = match self.visibility {
            Visibility::Raster => alhazen::Visibility::Raster,
            Visibility::Rays => alhazen::Visibility::Rays,
        };
        HybridSettings { visibility, reflection_survival: self.reflection_survival, ..settings }
    }

    /// The view of a scene's camera.
    pub fn view(&self, scene: &Scene, camera: Camera, settings: HybridSettings) -> View {
        let integrator = Integrator::Hybrid(self.settings_of(settings));
        let [width, height] = self.size();
        Job { camera, width, height, integrator, ..Job::for_scene(scene) }.view(0.0)
    }
}

/// A grey material.
fn grey(name: &str) -> Material {
    Material {
        name: name.into(),
        model: Model::Lambert,
        base_color: Vec3::splat(0.6).extend(1.0),
        ..Material::default()
    }
}

/// The unit sphere of `around` × `rings` quadrilaterals.
fn ball(around: u32, rings: u32) -> TriangleMesh {
    use std::f32::consts::{PI, TAU};
    let point = |ring: u32, i: u32| {
        let (theta, phi) = (PI * ring as f32 / rings as f32, TAU * i as f32 / around as f32);
        Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    };
    let positions: Vec<Vec3> = (0..=rings).flat_map(|r| (0..=around).map(move |i| point(r, i))).collect();
    let quads = (0..rings).flat_map(|r| (0..around).map(move |i| r * (around + 1) + i));
    let indices = quads.flat_map(|a| {
        let b = a + around + 1;
        [[a, a + 1, b], [a + 1, b + 1, b]]
    });
    TriangleMesh {
        normals: positions.clone(),
        positions,
        indices: indices.collect(),
        ..TriangleMesh::default()
    }
}

/// Hills of about `triangles` triangles, 20 m wide.
fn hills(triangles: u32) -> TriangleMesh {
    let side = (triangles as f32 / 2.0).sqrt().round().max(1.0) as u32;
    let height = |x: f32, z: f32| {
        0.6 * (0.7 * x).sin() * (0.6 * z).cos()
            + 0.15 * (3.1 * x + 1.7 * z).sin()
            + 0.02 * (23.0 * x).sin() * (29.0 * z).sin()
    };
    let at = |i: u32| 20.0 * (i as f32 / side as f32 - 0.5);
    let positions = (0..=side)
        .flat_map(|j| (0..=side).map(move |i| Vec3::new(at(i), height(at(i), at(j)), at(j))))
        .collect();
    let quads = (0..side).flat_map(|j| (0..side).map(move |i| j * (side + 1) + i));
    let indices = quads.flat_map(|a| {
        let b = a + side + 1;
        [[a, b, a + 1], [a + 1, b, b + 1]]
    });
    TriangleMesh { positions, indices: indices.collect(), ..TriangleMesh::default() }
}

fn add(scene: &mut Scene, name: &str, mesh: TriangleMesh) -> u32 {
    let material = scene.materials.len() as u32;
    scene.materials.push(grey(name));
    scene.meshes.push(Mesh::single(name, Shape::Triangles(mesh), material));
    scene.meshes.len() as u32 - 1
}

fn add_lamp(scene: &mut Scene, position: Vec3, intensity: f32) {
    let kind = LightKind::Point { position, intensity: Vec3::splat(intensity) };
    scene.lights.push(Light::new(format!("lamp {}", scene.lights.len()), kind));
}

/// Balls of 1369 vertices each that move, above a floor, under one lamp.
pub fn crowd(count: u32) -> Scene {
    let mut scene = Scene { name: format!("{count} models"), ..Scene::default() };
    let floor = add(&mut scene, "floor", hills(2));
    let model = add(&mut scene, "model", ball(36, 36));
    scene.instances.push(Instance::new("floor", floor, Affine3A::from_translation(Vec3::Y * -3.0)));
    let names = (0..count).map(|i| Instance::new(format!("{i}"), model, Affine3A::IDENTITY));
    scene.instances.extend(names);
    scene.instances.iter_mut().for_each(|i| i.dynamic = true);
    add_lamp(&mut scene, Vec3::new(3.0, 12.0, 5.0), 400.0);
    scene.cameras.push(Camera::perspective(
        "above",
        Vec3::new(0.0, 7.0, 13.0),
        Vec3::new(0.0, -1.0, 0.0),
        0.9,
    ));
    scene
}

/// Where [`crowd`]'s instances stand in a frame.
pub fn crowd_places(count: u32, frame: u32, places: &mut Vec<Place>) {
    let side = (count as f32).sqrt().ceil();
    let spacing = 18.0 / side;
    let time = frame as f32 / 60.0;
    places.clear();
    places.push([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, -3.0], [0.0, 0.0, 1.0, 0.0]]);
    places.extend((0..count).map(|i| {
        let (column, row) = (i as f32 % side, (i as f32 / side).floor());
        let (sin, cos) = (time + 0.37 * i as f32).sin_cos();
        let size = 0.35 * spacing;
        let x = spacing * (column - 0.5 * (side - 1.0) + 0.3 * sin);
        let z = spacing * (row - 0.5 * (side - 1.0) + 0.3 * cos);
        [[size * cos, 0.0, size * sin, x], [0.0, size, 0.0, -1.5 + sin], [-size * sin, 0.0, size * cos, z]]
    }));
}

/// Hills of `indices` vertex indices with a ball of 4000 above them, seen from above, under `lights` lamps that all reach
/// everything.
pub fn lit_hills(indices: u32, lights: u32) -> Scene {
    let mut scene = Scene { name: format!("{indices} indices, {lights} lights"), ..Scene::default() };
    let ball_indices = 4000;
    let hills = add(&mut scene, "hills", hills(indices.saturating_sub(ball_indices) / 3));
    let ball = add(&mut scene, "ball", ball(26, 26));
    scene.instances.push(Instance::new("hills", hills, Affine3A::IDENTITY));
    scene.instances.push(Instance::new("ball", ball, Affine3A::from_translation(Vec3::Y * 2.5)));
    for i in 0..lights {
        let (sin, cos) = (i as f32 * 2.4).sin_cos();
        let radius = 2.0 + 0.5 * (i % 8) as f32;
        add_lamp(
            &mut scene,
            Vec3::new(radius * cos, 6.0 + 0.2 * (i % 5) as f32, radius * sin),
            60.0 / lights as f32,
        );
    }
    scene.cameras.push(Camera::perspective(
        "above",
        Vec3::new(0.0, 6.5, 8.0),
        Vec3::new(0.0, 0.0, 0.5),
        0.85,
    ));
    scene
}

/// Adds `count` small lamps to a scene, spread through its inside on a grid.
pub fn add_small_lamps(scene: &mut Scene, count: u32) {
    let Some((low, high)) = scene.bounds() else { return };
    // Plastic numbers spread points evenly (Roberts 2018).
    let at = |i: u32, step: f32| (0.5 + step * i as f32).fract();
    for i in 0..count {
        let u = Vec3::new(at(i, 0.819_172_5), at(i, 0.671_043_6), at(i, 0.549_700_5));
        let position = low + (high - low) * (0.1 + 0.8 * u * Vec3::new(1.0, 0.8, 1.0));
        add_lamp(scene, position, 0.5);
    }
}
