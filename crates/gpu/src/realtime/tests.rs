//! Real-time frames against what is known of them: what stands still and what moves, what is noise, and what `path` shows.

mod filtering;
mod learned;
mod past;
mod samples;
mod tiles;

use super::*;
use crate::open_for_test;
use crate::tracer::Instances;
use crate::tracer::bvh::BvhTracer;
use backend::{AllocationSettings, PathSettings, SamplerKind, View};
use bytemuck::Pod;
use film::{Film, Rect};
use glam::{Vec2, Vec3};
use optics::camera::{CAMERA_PERSPECTIVE, CameraFrame};
use optics::{vec2f, vec3f};
use scene::tables::SceneTables;
use std::sync::Arc;

const WIDTH: u32 = 48;
const HEIGHT: u32 = 32;
const AREA: usize = (WIDTH * HEIGHT) as usize;
const HALF: Vec2 = Vec2::new(0.6, 0.4);
const BALL: (Vec3, f32) = (Vec3::new(0.0, 0.9, 0.0), 0.6);
const WALL: f32 = -2.0;

/// A ball above a floor, before a wall, under a lamp.
fn scene() -> scene::Scene {
    use testkit::scenes::{Build, emitter, ground, lambert, metallic_roughness, quads, sphere};
    let mut scene = scene::Scene { name: "a ball before a wall".into(), ..scene::Scene::default() };
    let floor = scene.add_material(lambert("floor", [0.6, 0.5, 0.4]));
    let wall = scene.add_material(lambert("wall", [0.4, 0.5, 0.6]));
    let ball = scene.add_material(metallic_roughness("ball", [0.8, 0.3, 0.3], 0.0, 0.5));
    let lamp = scene.add_material(emitter("lamp", [12.0, 11.0, 9.0]));
    scene.add_mesh("floor", ground(0.0, 20.0), floor);
    let (z, w) = (f64::from(WALL), 20.0);
    let wall_shape = quads(&[[[-w, -1.0, z], [w, -1.0, z], [w, w, z], [-w, w, z]]]);
    scene.add_mesh("wall", wall_shape, wall);
    scene.add_shape("ball", sphere(BALL.0.to_array(), BALL.1), ball, glam::Affine3A::IDENTITY);
    let lamp_shape = quads(&[[[-0.7, 4.0, 0.5], [0.7, 4.0, 0.5], [0.7, 4.0, 1.9], [-0.7, 4.0, 1.9]]]);
    scene.add_mesh("lamp", lamp_shape, lamp);
    scene
}

/// A camera `right` of the middle that looks straight at the wall.
fn camera(right: f32) -> CameraFrame {
    CameraFrame {
        kind: CAMERA_PERSPECTIVE,
        origin: vec3f(right, 1.2, 4.0),
        right: vec3f(1.0, 0.0, 0.0),
        up: vec3f(0.0, 1.0, 0.0),
        forward: vec3f(0.0, 0.0, -1.0),
        half_size: vec2f(HALF.x, HALF.y),
        lens_radius: 0.0,
        focus_distance: 1.0,
        distortion: optics::distortion::no_distortion(),
    }
}

fn view(right: f32, settings: RealtimeSettings) -> View {
    View {
        camera: camera(right),
        width: WIDTH,
        height: HEIGHT,
        window: Rect { x: 0, y: 0, width: WIDTH, height: HEIGHT },
        integrator: Integrator::Realtime(settings),
        single_scatter: false,
        sampler: SamplerKind::Sobol,
        seed: 5,
        first_sample: 0,
        aovs: Vec::new(),
        shutter: None,
    }
}

fn settings() -> RealtimeSettings {
    let path = PathSettings { max_depth: 3, ..PathSettings::default() };
    RealtimeSettings { path, ..RealtimeSettings::default() }
}

/// What is kept of a pixel, as in `shaders/realtime_frame.wgsl`.
#[derive(Clone, Copy, Debug)]
struct History {
    diffuse_count: f32,
    hit_distance: f32,
    /// All numbers of it.
    numbers: [f32; 13],
}

/// A device with the scene, and frames that go to a film.
struct Stage {
    gpu: testkit::Exclusive<Gpu>,
    kernel: RealtimeKernel,
    film: FilmBuffers,
    timer: Timer,
    sample: u32,
}

impl Stage {
    /// `None` and a visible skip where there is no device.
    fn new(test: &str, scene: &scene::Scene) -> Option<Self> {
        let gpu = open_for_test(test, &crate::GpuOptions::default())?;
        let scene = GpuScene::upload(&gpu, Arc::new(SceneTables::build(scene))).expect("upload");
        let tracer = BvhTracer::new(&gpu, &scene, Instances::StandStill).expect("structures");
        // Settings of frames that come later need more passes: those are compiled then.
        let (variant, pixels) = (scene.variant(), WIDTH * HEIGHT);
        let kernel = RealtimeKernel::new(&gpu, variant, &scene, &tracer, &settings(), pixels);
        let kernel = kernel.expect("a kernel");
        let film = FilmBuffers::new(&gpu, &view(0.0, settings()), false).expect("memory");
        let timer = Timer::new(&gpu).expect("memory");
        Some(Self { gpu, kernel, film, timer, sample: 0 })
    }

    /// Renders frames of a view.
    fn frames(&mut self, view: &View, frames: u32) {
        assert!(self.film.set_view(view), "views are of one size");
        for _ in 0..frames {
            let pixels = BatchPixels::Rows { first: 0, count: HEIGHT };
            let batch = Batch { pixels, first_sample: self.sample, sample_count: 1 };
            self.kernel.submit(&self.gpu, &mut self.film, batch, &mut self.timer).expect("a frame");
            self.sample += 1;
            if self.timer.is_nearly_full() {
                self.timer.collect(&self.gpu).expect("times");
            }
        }
    }

    /// A new film, and no past.
    fn begin(&mut self) {
        let _ = self.film();
        self.kernel.forget_past();
        self.sample = 0;
    }

    /// What is on the film, which is empty afterwards.
    fn film(&mut self) -> Film {
        self.film_and_rays().0
    }

    /// The same, and the rays that it took.
    fn film_and_rays(&mut self) -> (Film, u64) {
        let window = Rect { x: 0, y: 0, width: WIDTH, height: HEIGHT };
        let mut film = Film::with_window(WIDTH, HEIGHT, window, &[]).expect("a film");
        let rays = self.film.fold_into(&self.gpu, &mut film).expect("read").rays();
        (film, rays)
    }

    fn read<T: Pod>(&self, buffer: &wgpu::Buffer) -> Vec<T> {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let readable = crate::scene::upload::empty_buffer(&self.gpu, "to read", buffer.size(), usage);
        let readable = readable.expect("memory");
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &readable, 0, buffer.size());
        self.gpu.queue.submit([encoder.finish()]);
        let bytes = buffer.size();
        crate::readback::read_mapped(&self.gpu, &readable, bytes, "testing", bytemuck::pod_collect_to_vec)
            .expect("read")
    }

    fn buffers(&self) -> &Buffers {
        self.kernel.buffers.as_ref().expect("a frame was rendered")
    }

    /// 0 or 1: whose the last frame's records are.
    fn odd(&self) -> usize {
        (self.kernel.number as usize + 1) % 2
    }

    fn histories(&self) -> Vec<History> {
        let planes: Vec<[f32; 4]> = self.read(&self.buffers().histories[self.odd()]);
        let history = |at: usize| {
            let [diffuse, specular, moments, owner] = [0, 1, 2, 3].map(|plane| planes[plane * AREA + at]);
            let numbers = [&diffuse[..], &specular, &moments, &owner[..1]].concat();
            let numbers = numbers.try_into().expect("as many");
            History { diffuse_count: diffuse[3], hit_distance: owner[0], numbers }
        };
        (0..AREA).map(history).collect()
    }
}

/// What the middle of a pixel shows of the wall, to a camera that stands `right`; `None` if the ball, `grown` by a factor, or
/// the floor is before it.
fn wall_behind(pixel: usize, right: f32, grown: f32) -> Option<Vec3> {
    let point = on_wall(pixel, right);
    (point.y > 0.15 && is_seen(point, right, grown)).then_some(point)
}

/// Where the ray through the middle of a pixel meets the plane of the wall.
fn on_wall(pixel: usize, right: f32) -> Vec3 {
    let (x, y) = (pixel as u32 % WIDTH, pixel as u32 / WIDTH);
    let film = Vec2::new((x as f32 + 0.5) / WIDTH as f32, (y as f32 + 0.5) / HEIGHT as f32) * 2.0 - 1.0;
    let eye = Vec3::new(right, 1.2, 4.0);
    let direction = Vec3::new(film.x * HALF.x, -film.y * HALF.y, -1.0);
    eye + direction * (eye.z - WALL)
}

/// Whether the ball, `grown` by a factor, leaves the way to a point free.
fn is_seen(point: Vec3, right: f32, grown: f32) -> bool {
    let eye = Vec3::new(right, 1.2, 4.0);
    let way = (point - eye).normalize();
    let nearest = eye + way * (BALL.0 - eye).dot(way);
    (nearest - BALL.0).length() > BALL.1 * grown
}

/// Where a point is in the window, in pixels.
fn place(point: Vec3, right: f32) -> Vec2 {
    let d = point - Vec3::new(right, 1.2, 4.0);
    let film = Vec2::new(d.x / (-d.z * HALF.x), -d.y / (-d.z * HALF.y));
    (film * 0.5 + 0.5) * Vec2::new(WIDTH as f32, HEIGHT as f32)
}

/// A part of the test below.
type Part = fn(&mut Stage);

/// One device and one compilation for all of it: software drivers take long for both.
#[test]
fn frames_keep_what_is_true() {
    let Some(mut stage) = Stage::new("frames_keep_what_is_true", &scene()) else { return };
    let begun = std::time::Instant::now();
    let parts: [(&str, Part); 11] = [
        ("still views", past::still_views_lose_nothing),
        ("moving views", past::moving_views_find_their_past),
        ("numbers", past::what_is_no_number_is_gone),
        ("the filter", filtering::constant_light_stays_and_noise_keeps_its_mean),
        ("bright light", filtering::light_beyond_sixteen_bits_stays_finite),
        ("the learned filter", learned::the_network_filters_what_frames_have_gathered),
        ("views", samples::views_show_what_they_say),
        ("budgets", samples::budgets_limit_samples),
        ("unfiltered frames", samples::unfiltered_frames_are_paths),
        ("waves", samples::waves_make_the_same_samples),
        ("gathered frames", samples::gathered_frames_converge_unless_they_stop_for_good),
    ];
    for (name, part) in parts {
        part(&mut stage);
        println!("{name}: done after {:.1} s", begun.elapsed().as_secs_f64());
    }
}
