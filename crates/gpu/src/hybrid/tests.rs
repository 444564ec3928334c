//! The hybrid renderer against the integrator `direct` and against itself: raster against rays, clusters against none.

use super::*;
use crate::kernel::KernelKind;
use crate::live::LiveScene;
use crate::megakernel::Megakernel;
use crate::open_for_test;
use crate::tracer::bvh::BvhTracer;
use crate::tracer::{Instances, TracerKind};
use backend::{AmbientOcclusion, DirectSettings, SamplerKind};
use film::{Aov, AovData, Film, Rect};
use glam::Vec3;
use optics::camera::{CAMERA_ORTHOGRAPHIC, CAMERA_PERSPECTIVE};
use optics::{Vec3f, vec2f, vec3f};
use scene::tables::SceneTables;
use std::sync::Arc;

const WIDTH: u32 = 48;
const HEIGHT: u32 = 40;

/// A camera at `eye` that looks at `target`; `half_height` of its film.
fn camera(kind: u32, eye: Vec3, target: Vec3, half_height: f32, lens_radius: f32) -> CameraFrame {
    let forward = (target - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let optics = |v: Vec3| -> Vec3f { vec3f(v.x, v.y, v.z) };
    CameraFrame {
        kind,
        origin: optics(eye),
        right: optics(right),
        up: optics(right.cross(forward)),
        forward: optics(forward),
        half_size: vec2f(half_height * WIDTH as f32 / HEIGHT as f32, half_height),
        lens_radius,
        focus_distance: (target - eye).length(),
        distortion: optics::distortion::no_distortion(),
    }
}

pub(super) fn view(camera: CameraFrame, integrator: Integrator) -> backend::View {
    backend::View {
        camera,
        width: WIDTH,
        height: HEIGHT,
        window: Rect { x: 0, y: 0, width: WIDTH, height: HEIGHT },
        integrator,
        single_scatter: false,
        sampler: SamplerKind::Sobol,
        seed: 3,
        first_sample: 0,
        aovs: Vec::new(),
        shutter: None,
    }
}

/// Ambient occlusion without a limit of distance.
fn occlusion(samples: u32) -> AmbientOcclusion {
    AmbientOcclusion { samples, ..AmbientOcclusion::default() }
}

/// Lights, and nothing that is reflected or comes from all around.
pub(super) fn only_lights(shadow_samples: u32) -> DirectSettings {
    DirectSettings {
        shadow_samples,
        reflection_samples: 0,
        ambient: occlusion(0),
        max_depth: 1,
        ..DirectSettings::default()
    }
}

/// The whole of the assortment.
pub(super) fn overview() -> CameraFrame {
    camera(CAMERA_PERSPECTIVE, Vec3::new(0.0, 2.2, 6.5), Vec3::new(0.0, 0.9, 0.0), 0.38, 0.0)
}

/// A device with a scene.
pub(super) struct Setup {
    pub gpu: testkit::Exclusive<Gpu>,
    pub scene: GpuScene,
    tracer: BvhTracer,
}

impl Setup {
    /// With the scene that has one of everything; `None` and a visible skip where there is no device.
    fn new(test: &str) -> Option<Self> {
        Self::with_scene(test, &testkit::scenes::assortment())
    }

    /// As [`Setup::new`], with any scene.
    pub fn with_scene(test: &str, scene: &scene::Scene) -> Option<Self> {
        let gpu = open_for_test(test, &crate::GpuOptions::default())?;
        let tables = Arc::new(SceneTables::build(scene));
        let scene = GpuScene::upload(&gpu, tables).expect("upload");
        let tracer = BvhTracer::new(&gpu, &scene, Instances::StandStill).expect("structures");
        Some(Self { gpu, scene, tracer })
    }

    fn variant(&self, view: &backend::View) -> Variant {
        Variant { aovs: !view.aovs.is_empty(), ..self.scene.variant() }
    }

    pub fn hybrid(&self, view: &backend::View) -> HybridKernel {
        let settings =
            if let Integrator::Hybrid(settings) = view.integrator { settings } else { Default::default() };
        HybridKernel::new(&self.gpu, self.variant(view), &self.scene, &self.tracer, &settings)
            .expect("a kernel")
    }

    /// The film after `samples` samples, and rays.
    pub fn render(&self, kernel: &mut dyn Kernel, view: &backend::View, samples: u32) -> (Film, u64) {
        let mut buffers = FilmBuffers::new(&self.gpu, view, !view.aovs.is_empty()).expect("memory");
        let mut timer = Timer::new(&self.gpu).expect("memory");
        // In parts: rows, and few samples at a time, because Mesa's software driver ends a shader's loops after 65,536
        // rounds in all.
        const AT_A_TIME: u32 = 8;
        let upper = view.window.height / 2;
        for first_sample in (0..samples).step_by(AT_A_TIME as usize) {
            let sample_count = AT_A_TIME.min(samples - first_sample);
            for (first, count) in [(0, upper), (upper, view.window.height - upper)] {
                let pixels = BatchPixels::Rows { first, count };
                let batch = Batch { pixels, first_sample, sample_count };
                kernel.submit(&self.gpu, &mut buffers, batch, &mut timer).expect("submit");
            }
        }
        timer.collect(&self.gpu).expect("times");
        let mut film = Film::with_window(view.width, view.height, view.window, &view.aovs).expect("a film");
        let rays = buffers.fold_into(&self.gpu, &mut film).expect("read").rays();
        let expected = u64::from(samples) * view.window.area() as u64;
        assert_eq!(film.total_samples() + film.invalid_samples(), expected);
        (film, rays)
    }
}

pub(super) fn hybrid(settings: HybridSettings) -> Integrator {
    Integrator::Hybrid(settings)
}

/// Whether the colours of a pixel are further apart than rounding puts them.
fn far_apart(a: &Film, b: &Film, pixel: usize) -> bool {
    let level = b.mean().iter().sum::<f64>() / 3.0;
    let far = |(a, b): (f64, f64)| (a - b).abs() > 2e-3 * (a.abs() + b.abs()) + 1e-3 * level;
    a.pixels()[pixel].mean().into_iter().zip(b.pixels()[pixel].mean()).any(far)
}

/// Share of the pixels whose colours are further apart than rounding puts them.
pub(super) fn differing_share(a: &Film, b: &Film) -> f64 {
    let count = a.pixels().len();
    (0..count).filter(|&i| far_apart(a, b, i)).count() as f64 / count as f64
}

/// The largest difference of the means of 8 × 8 pixels, over the picture's mean.
fn worst_block(a: &Film, b: &Film) -> f64 {
    let width = a.window().width as usize;
    let mean = |film: &Film, x: usize, y: usize| {
        let pixels =
            (0..64).map(|i| film.pixels()[(y + i / 8) * width + x + i % 8].mean().iter().sum::<f64>());
        pixels.sum::<f64>() / 192.0
    };
    let level = b.mean().iter().sum::<f64>() / 3.0;
    let blocks =
        (0..a.window().height as usize / 8).flat_map(|y| (0..width / 8).map(move |x| (8 * x, 8 * y)));
    blocks.map(|(x, y)| (mean(a, x, y) - mean(b, x, y)).abs() / level).fold(0.0, f64::max)
}

/// With as many rays of each kind, the expected picture is that of `direct`; and the comparison notices a missing effect.
#[test]
fn the_expected_picture_is_that_of_direct() {
    let Some(setup) = Setup::new("the_expected_picture_is_that_of_direct") else { return };
    const SAMPLES: u32 = 128;
    let rays = DirectSettings {
        shadow_samples: 2,
        reflection_samples: 2,
        ambient: occlusion(2),
        ..Default::default()
    };
    let direct = view(overview(), Integrator::Direct(rays));
    let variant = setup.variant(&direct);
    let mut megakernel =
        Megakernel::new(&setup.gpu, KernelKind::Direct, variant, &setup.scene, &setup.tracer)
            .expect("a kernel");
    let (expected, expected_rays) = setup.render(&mut megakernel, &direct, SAMPLES);
    let settings = HybridSettings { rays, reflection_survival: 1.0, ..HybridSettings::default() };
    let mut kernel = setup.hybrid(&direct);
    let mut differs = |settings| {
        let (film, rays) = setup.render(&mut kernel, &view(overview(), hybrid(settings)), SAMPLES);
        assert_eq!(film.invalid_samples(), 0);
        let means = film.mean().into_iter().zip(expected.mean());
        let whole = means.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
        println!("{settings:?}: whole {whole:.4}, block {:.4}, {rays} rays", worst_block(&film, &expected));
        (whole, worst_block(&film, &expected), rays as f64 / expected_rays as f64)
    };
    // 128 samples leave a block of 64 pixels with about a hundredth of noise at edges and soft shadows.
    let (whole, block, rays) = differs(settings);
    assert!(whole < 0.006 && block < 0.06, "{whole} {block}");
    // All but the camera's rays, which the rasteriser saves.
    assert!((0.85..1.0).contains(&rays), "{rays}");
    // Roulette leaves out most reflection rays of surfaces that reflect little, and adds noise.
    let (whole, block, fewer) = differs(HybridSettings { reflection_survival: 0.05, ..settings });
    assert!(whole < 0.006 && block < 0.08 && fewer < 0.97 * rays, "{whole} {block} {fewer} of {rays}");
    let without = [
        HybridSettings { shadows: false, ..settings },
        HybridSettings { rays: DirectSettings { reflection_samples: 0, ..settings.rays }, ..settings },
        HybridSettings { rays: DirectSettings { ambient: occlusion(0), ..settings.rays }, ..settings },
    ];
    for settings in without {
        let (whole, block, fewer) = differs(settings);
        assert!(
            (whole > 0.006 || block > 0.06) && fewer < rays,
            "not noticed: {settings:?}, {whole} {block}"
        );
    }
}

/// The assortment with layers on all that has none of glass or mirrors.
fn layered_assortment() -> scene::Scene {
    let mut scene = testkit::scenes::assortment();
    for material in scene.materials.iter_mut().filter(|m| m.model == scene::Model::MetallicRoughness) {
        let layers = &mut material.layers;
        (layers.clearcoat.strength, layers.clearcoat.roughness) = (0.8, 0.4);
        (layers.sheen.color, layers.sheen.roughness) = (Vec3::new(0.3, 0.6, 0.2), 0.7);
        layers.diffuse_transmission.strength = 0.3;
    }
    scene
}

/// Layers as `direct` has them: all lobes in lights, sky and reflections.
#[test]
fn layers_are_those_of_direct() {
    let Some(setup) = Setup::with_scene("layers_are_those_of_direct", &layered_assortment()) else { return };
    const SAMPLES: u32 = 128;
    let rays = DirectSettings {
        shadow_samples: 2,
        reflection_samples: 2,
        ambient: occlusion(2),
        ..Default::default()
    };
    let direct = view(overview(), Integrator::Direct(rays));
    let variant = setup.variant(&direct);
    assert!(variant.layers);
    let mut megakernel =
        Megakernel::new(&setup.gpu, KernelKind::Direct, variant, &setup.scene, &setup.tracer)
            .expect("a kernel");
    let (expected, _) = setup.render(&mut megakernel, &direct, SAMPLES);
    let settings = HybridSettings { rays, reflection_survival: 1.0, ..HybridSettings::default() };
    let mut kernel = setup.hybrid(&direct);
    let (film, _) = setup.render(&mut kernel, &view(overview(), hybrid(settings)), SAMPLES);
    let means = film.mean().into_iter().zip(expected.mean());
    let whole = means.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    let block = worst_block(&film, &expected);
    assert!(whole < 0.006 && block < 0.06, "{whole} {block}");
}

/// The rasteriser sees what rays see, with every projection, and what follows is the same picture.
#[test]
fn the_rasteriser_sees_what_rays_see() {
    let Some(setup) = Setup::new("the_rasteriser_sees_what_rays_see") else { return };
    let low = Vec3::new(1.5, 1.2, 5.0);
    let center = Vec3::new(0.0, 0.7, 0.0);
    let cameras = [
        overview(),
        camera(CAMERA_PERSPECTIVE, low, center, 0.3, 0.1),
        camera(CAMERA_ORTHOGRAPHIC, low, center, 1.5, 0.0),
    ];
    // Where a surface covers by halves, the last bits of the weights decide, and those are not the same.
    let tables = &setup.scene.tables;
    let halves: std::collections::HashSet<u32> = tables
        .bindings
        .iter()
        .filter(|b| {
            let partial = scene::tables::MATERIAL_ALPHA_BLEND | scene::tables::MATERIAL_CHECKERBOARD_FADES;
            tables.materials[b.material as usize].flags & partial != 0
        })
        .map(|b| b.object)
        .collect();
    let layers = vec![Aov::InstanceId, Aov::PrimitiveId, Aov::Depth];
    let mut kernel = None;
    for (number, camera) in cameras.into_iter().enumerate() {
        let settings = |visibility| HybridSettings { visibility, ..HybridSettings::default() };
        let of = |visibility| backend::View {
            aovs: layers.clone(),
            window: Rect { x: 3, y: 2, width: WIDTH - 8, height: HEIGHT - 6 },
            ..view(camera, hybrid(settings(visibility)))
        };
        let kernel = kernel.get_or_insert_with(|| setup.hybrid(&of(Visibility::Raster)));
        let (drawn, drawn_rays) = setup.render(kernel, &of(Visibility::Raster), 1);
        let (traced, traced_rays) = setup.render(kernel, &of(Visibility::Rays), 1);
        let ids = |film: &Film, aov| match film.aov(aov) {
            Some(AovData::Integer(ids)) => ids,
            _ => panic!("integers"),
        };
        let (seen, expected) = (ids(&drawn, Aov::InstanceId), ids(&traced, Aov::InstanceId));
        let is_whole = |i: usize| !halves.contains(&seen[i]) && !halves.contains(&expected[i]);
        let whole: Vec<usize> = (0..seen.len()).filter(|&i| is_whole(i)).collect();
        assert!(whole.len() * 2 > seen.len(), "{} pixels are left", whole.len());
        let share = |differs: &dyn Fn(usize) -> bool| {
            whole.iter().filter(|&&i| differs(i)).count() as f64 / whole.len() as f64
        };
        let (drawn_primitives, traced_primitives) =
            (ids(&drawn, Aov::PrimitiveId), ids(&traced, Aov::PrimitiveId));
        let instances = share(&|i| seen[i] != expected[i]);
        let primitives = share(&|i| drawn_primitives[i] != traced_primitives[i]);
        let pixels = share(&|i| far_apart(&drawn, &traced, i));
        let saved = (traced_rays - drawn_rays) as f64 / drawn.pixels().len() as f64;
        println!(
            "camera {number}: {instances:.4} instances, {primitives:.4} primitives, {pixels:.4} pixels, {saved:.3} rays saved"
        );
        // At silhouettes a rasteriser's fixed-point corners decide otherwise.
        assert!(instances < 0.02 && primitives < 0.04, "{number}: {instances} {primitives}");
        assert!(pixels < 0.05, "{number}: {pixels}");
        assert!((0.9..1.1).contains(&saved), "{number}: a ray a pixel is saved: {saved}");
    }
}

/// Clusters change no picture and no ray; leaving weak light out saves rays.
#[test]
fn clusters_find_all_lights_that_count() {
    let Some(setup) = Setup::new("clusters_find_all_lights_that_count") else { return };
    let rays = only_lights(DirectSettings::default().shadow_samples);
    let of = |light_cutoff| {
        view(overview(), hybrid(HybridSettings { rays, light_cutoff, ..HybridSettings::default() }))
    };
    let mut kernel = setup.hybrid(&of(0.0));
    let (_, all_rays) = setup.render(&mut kernel, &of(0.0), 1);
    let mut saved = false;
    for cutoff in [0.05, 0.5, 5.0] {
        kernel.clusters_lights = true;
        let (clustered, clustered_rays) = setup.render(&mut kernel, &of(cutoff), 1);
        kernel.clusters_lights = false;
        let (plain, plain_rays) = setup.render(&mut kernel, &of(cutoff), 1);
        assert_eq!(clustered_rays, plain_rays, "{cutoff}");
        let same = clustered.pixels().iter().zip(plain.pixels()).all(|(a, b)| a.mean() == b.mean());
        assert!(same, "{cutoff}: {}", differing_share(&clustered, &plain));
        saved |= clustered_rays < all_rays;
        println!("cutoff {cutoff}: {clustered_rays} of {all_rays} rays");
    }
    assert!(saved, "some light is weak somewhere");
}

/// Shading lights after asking for all of their shadows is shading each as it is asked for: the same picture and the same rays.
#[test]
fn lights_asked_first_are_the_same_lights() {
    let Some(setup) = Setup::new("lights_asked_first_are_the_same_lights") else { return };
    let of = |shadow_samples, light_cutoff, shadows| {
        let rays = only_lights(shadow_samples);
        view(overview(), hybrid(HybridSettings { rays, light_cutoff, shadows, ..HybridSettings::default() }))
    };
    let mut kernel = setup.hybrid(&of(1, 0.0, true));
    let mut render = |view: &backend::View, asks_first| {
        kernel.asks_lights_first = Some(asks_first);
        setup.render(&mut kernel, view, 1)
    };
    let (bare, _) = render(&of(1, 0.0, false), true);
    for (samples, cutoff) in [(1, 0.0), (3, 0.5)] {
        let (asked, asked_rays) = render(&of(samples, cutoff, true), true);
        let (traced, traced_rays) = render(&of(samples, cutoff, true), false);
        let more = asked_rays as f64 / traced_rays as f64;
        println!("{samples} samples, cutoff {cutoff}: {asked_rays} and {traced_rays} rays");
        assert_eq!(differing_share(&asked, &traced), 0.0, "{samples}, {cutoff}");
        // Materials are not looked at before: black ones are asked for in vain.
        assert!((1.0..1.05).contains(&more), "{more} times as many rays");
        assert!(differing_share(&asked, &bare) > 0.1, "shadows change nothing");
    }
    let (unshaded, rays) = render(&of(1, 0.0, false), false);
    assert_eq!(differing_share(&unshaded, &bare), 0.0);
    assert_eq!(rays, render(&of(1, 0.0, false), true).1);
    // Few lights are not asked for, nor what is too much for a buffer.
    let words = kernel.gbuffer.light_words();
    (kernel.asks_lights_first, kernel.light_count) = (None, MANY_LIGHTS - 1);
    assert_eq!(kernel.light_words_of([8, 8], u64::MAX, 1).hidden, 0);
    kernel.light_count = MANY_LIGHTS;
    assert!(kernel.light_words_of([8, 8], u64::MAX, MOST_HIDDEN_WORDS / words).hidden > 0);
    assert_eq!(kernel.light_words_of([8, 8], u64::MAX, MOST_HIDDEN_WORDS / words + 1).hidden, 0);
    assert_eq!(kernel.light_words_of([8, 8], 256, 1).hidden, 0);
}

/// A floor and spinning boxes, all in places that the test gives, below a lamp and so many more lights.
fn moving_scene(more_lights: u32) -> Arc<SceneTables> {
    use scene::{Camera, Instance, Light, LightKind, Shape};
    use testkit::scenes::{Build, cuboid, lambert};
    let mut scene = scene::Scene::default();
    let grey = scene.add_material(lambert("grey", [0.6; 3]));
    let red = scene.add_material(lambert("red", [0.7, 0.2, 0.1]));
    let still = glam::Affine3A::IDENTITY;
    scene.add_shape("floor", Shape::Triangles(cuboid([-4.0, -0.2, -4.0], [4.0, 0.0, 4.0])), grey, still);
    let cube = scene.add_shape("box", Shape::Triangles(cuboid([-0.4; 3], [0.4; 3])), red, still);
    (1..12).for_each(|i| scene.instances.push(Instance::new(format!("{i}"), cube, still)));
    scene.instances.iter_mut().for_each(|i| i.dynamic = true);
    let kind = LightKind::Point { position: Vec3::new(2.0, 5.0, 3.0), intensity: Vec3::splat(60.0) };
    scene.lights.push(Light::new("lamp", kind));
    scene.lights.extend((0..more_lights).map(|i| {
        let (sin, cos) = (i as f32 * 2.4).sin_cos();
        let (position, intensity) =
            (Vec3::new(3.0 * cos, 2.0, 3.0 * sin), Vec3::new(5.0, 3.0, 1.0 + i as f32));
        let (direction, irradiance) = (Vec3::new(sin, -1.0, cos).normalize(), intensity * 0.02);
        let kind = match i % 3 {
            0 => LightKind::Point { position, intensity },
            1 => LightKind::Directional { direction, irradiance, angular_diameter: 0.02 },
            _ => {
                let (inner_angle, outer_angle) = (0.3, 0.6);
                LightKind::Spot { position, direction, intensity, inner_angle, outer_angle }
            }
        };
        Light::new(format!("light {i}"), kind)
    }));
    scene.cameras.push(Camera::perspective("c", Vec3::new(0.0, 4.0, 7.0), Vec3::ZERO, 0.8));
    Arc::new(SceneTables::build(&scene))
}

/// Places of [`moving_scene`]'s instances in a frame: the first is the floor.
fn places(frame: u32) -> Vec<crate::tracer::upper::Place> {
    let place = |i: u32| {
        if i == 0 {
            return [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        }
        let angle = i as f32 * 0.5 + frame as f32 * 0.11;
        let (sin, cos) = angle.sin_cos();
        [[cos, 0.0, sin, 2.5 * cos], [0.0, 1.0, 0.0, 0.5 + 0.1 * i as f32], [-sin, 0.0, cos, 2.5 * sin]]
    };
    (0..13).map(place).collect()
}

/// Frame N rendered at once is frame N reached by steps, by rebuilds and refits, whatever the number of frames in flight; points
/// move as their instances do.
#[test]
fn frames_do_not_depend_on_how_they_are_reached() {
    let name = "frames_do_not_depend_on_how_they_are_reached";
    let rays =
        DirectSettings { reflection_samples: 0, ambient: occlusion(0), ..HybridSettings::default().rays };
    let camera = camera(CAMERA_PERSPECTIVE, Vec3::new(0.0, 4.0, 7.0), Vec3::ZERO, 0.4, 0.0);
    let view = |sample| backend::View {
        first_sample: sample,
        ..view(camera, hybrid(HybridSettings { rays, ..HybridSettings::default() }))
    };
    use crate::tracer::upper::UpperUpdate::{Rebuild, Refit};
    let open = |depth| {
        let gpu = open_for_test(name, &crate::GpuOptions::default())?;
        let live = |gpu| {
            let (tables, kind) = (moving_scene(0), TracerKind::Bvh);
            LiveScene::with_room(gpu, tables, kind, &view(0), depth, MOST_LIGHTS).expect("a scene")
        };
        Some(gpu.map(live))
    };
    let Some(mut at_once) = open(1) else { return };
    at_once.frame(&view(LAST), Some((&places(LAST), Rebuild))).expect("a frame");
    let expected = at_once.read(&view(LAST)).expect("a film");
    assert!(at_once.update(&moving_scene(CROWDED)).expect("an update"));
    at_once.frame(&view(LAST), Some((&without(places(LAST), 5), Rebuild))).expect("a frame");
    let crowded = at_once.read(&view(LAST)).expect("a film");
    assert!(differing_share(&crowded, &expected) > 0.1, "lights change nothing");
    drop(at_once);
    let Some(mut live) = open(3) else { return };
    for frame in 0..=LAST {
        let update = if frame % 4 == 0 { Rebuild } else { Refit };
        live.frame(&view(frame), Some((&places(frame), update))).expect("a frame");
    }
    let stepped = live.read(&view(LAST)).expect("a film");
    let level = expected.mean().iter().sum::<f64>();
    assert!(level > 0.05, "{level}");
    assert_eq!(differing_share(&stepped, &expected), 0.0);
    // The other frames are other pictures.
    live.frame(&view(LAST), Some((&places(LAST + 3), Refit))).expect("a frame");
    let other = live.read(&view(LAST)).expect("a film");
    assert!(differing_share(&other, &expected) > 0.02);
    assert_eq!(live.frames().take_reports().len(), LAST as usize + 2);

    let pixels = live.read_pixels().expect("pixels");
    let moved = |p: &&HybridPixel| p.motion().iter().any(|m| m.abs() > 0.05);
    let boxes = pixels.iter().filter(|p| p.instance().is_some_and(|i| i > 0));
    let (boxes, floor): (Vec<_>, Vec<_>) =
        (boxes.collect(), pixels.iter().filter(|p| p.instance() == Some(0)).collect());
    assert!(boxes.len() > 20 && floor.len() > 100, "{} {}", boxes.len(), floor.len());
    assert!(boxes.iter().filter(|p| moved(p)).count() * 10 >= 9 * boxes.len(), "boxes move");
    assert!(!floor.iter().any(moved), "the floor does not");

    come_and_go(&mut live, &view(LAST), &expected, &crowded);
}

/// The frame that is compared.
const LAST: u32 = 9;
/// Most lights that [`come_and_go`] adds.
const MOST_LIGHTS: u32 = 12;
/// How many there are in the picture that it compares: so many that they are in a tree.
const CROWDED: u32 = 11;

/// `places` without one of the instances.
fn without(mut places: Vec<crate::tracer::upper::Place>, gone: usize) -> Vec<crate::tracer::upper::Place> {
    places[gone] = [[0.0; 4]; 3];
    places
}

/// Lights and objects come and go thousands of times, with frames in flight: the pictures are those of scenes that were so from the
/// beginning, nothing is left behind on the device, and it has nothing to complain of.
fn come_and_go(live: &mut LiveScene, last: &backend::View, expected: &Film, crowded: &Film) {
    use crate::tracer::upper::UpperUpdate::{Rebuild, Refit};
    const ROUNDS: u32 = 3000;
    let versions: Vec<_> = (0..=MOST_LIGHTS).map(moving_scene).collect();
    assert!(!live.update(&moving_scene(MOST_LIGHTS + 1)).expect("an answer"), "there is no room for that");
    let small = backend::View {
        width: 8,
        height: 8,
        window: Rect { x: 0, y: 0, width: 8, height: 8 },
        ..last.clone()
    };
    let allocated = |live: &LiveScene| {
        let report = live.gpu().device.generate_allocator_report();
        report.map(|r| (r.allocations.len(), r.allocations.iter().map(|a| a.size).sum::<u64>()))
    };
    let mut early = None;
    for round in 0..ROUNDS {
        let version = &versions[(round * 7 % (MOST_LIGHTS + 1)) as usize];
        assert!(live.update(version).expect("an update"), "round {round}");
        let here = without(without(places(round), (1 + round % 12) as usize), (1 + round * 5 % 12) as usize);
        let how = if round % 5 == 0 { Rebuild } else { Refit };
        // What changes between frames counts as much as what changes with each of them.
        if round % 2 == 0 {
            live.frame(&backend::View { first_sample: round, ..small.clone() }, Some((&here, how)))
                .expect("a frame");
        }
        if round == ROUNDS / 10 {
            live.finish().expect("frames");
            early = allocated(live).map(|a| (a, live.memory_bytes()));
        }
    }
    live.finish().expect("frames");
    if let (Some(((pieces, bytes), known)), Some((pieces_after, bytes_after))) = (early, allocated(live)) {
        println!("{pieces} pieces of {bytes} bytes, then {pieces_after} of {bytes_after}");
        assert!(pieces > 10, "the allocator knows of nothing");
        assert!(
            pieces_after <= pieces + 4 && bytes_after <= bytes + (1 << 20),
            "{pieces_after}, {bytes_after}"
        );
        assert_eq!(live.memory_bytes(), known);
    }
    for (lights, here, picture) in [(CROWDED, without(places(LAST), 5), crowded), (0, places(LAST), expected)]
    {
        assert!(live.update(&versions[lights as usize]).expect("an update"));
        live.frame(last, Some((&here, Rebuild))).expect("a frame");
        let film = live.read(last).expect("a film");
        assert_eq!(differing_share(&film, picture), 0.0, "{lights} lights");
    }
    live.gpu().check("coming and going").expect("no error of the device");
}
