//! Batches of views: blocks of rows of all of them are shared by the threads, whichever view they belong to.

use crate::fetch::filter::AlphaFilter;
use crate::fetch::surface::Surface;
use crate::scene::{CpuScene, vec3};
use crate::schedule::row_blocks::{FirstHits, Work};
use crate::schedule::work::render_work;
use crate::shade::closures::surface_albedo;
use accel::{Coherence, Hit, MISS, Opaque, Ray};
use backend::{Control, View, ViewBatch, ViewLayer, ViewPictures, ViewValues};
use film::PixelStats;
use optics::camera::{
    CameraFrame, camera_depth, camera_pixel_spread, camera_ray, film_position, pixel_footprint, shown_motion,
};
use optics::motion::MOTION_MIDDLE;
use optics::{vec2f, vec3f};
use rayon::prelude::*;
use std::ops::Range;

/// Pixels of a block, about: enough for streams of rays, few enough to stay in the second-level cache.
const BLOCK_PIXELS: usize = 4096;

/// Rays and hits of a thread, kept from block to block.
#[derive(Default)]
struct Scratch {
    rays: Vec<Ray>,
    hits: Vec<Hit>,
    estimates: Vec<PixelStats>,
}

/// A layer's values in a block.
enum Values<'a> {
    Float(&'a mut [f32]),
    Id(&'a mut [u32]),
}

/// Some rows of a view, and where their values go.
struct Block<'a> {
    view: usize,
    rows: Range<u32>,
    layers: Vec<(ViewLayer, Values<'a>)>,
}

/// What was counted.
#[derive(Clone, Copy, Default)]
pub(crate) struct Counted {
    pub rays: u64,
    pub invalid_samples: u64,
}

/// Fills `pictures` by the threads of the current pool.
pub(crate) fn render(
    scene: &CpuScene,
    batch: &ViewBatch,
    pictures: &mut ViewPictures,
    control: &Control,
) -> Counted {
    let blocks = blocks(batch, pictures);
    let count = |scratch: &mut Scratch, mut block: Block<'_>| {
        if control.is_cancelled() {
            return Counted::default();
        }
        let exact = render_exact(scene, batch, &mut block, scratch);
        let mut counted = render_colors(scene, batch, &mut block, scratch);
        counted.rays += exact;
        let pixels = u64::from(batch.view.width) * block.rows.len() as u64;
        control.advance(pixels * batch.all_samples() / (batch.pixels() * batch.cameras.len()).max(1) as u64);
        counted
    };
    let add = |a: Counted, b: Counted| Counted {
        rays: a.rays + b.rays,
        invalid_samples: a.invalid_samples + b.invalid_samples,
    };
    blocks.into_par_iter().map_init(Scratch::default, count).reduce(Counted::default, add)
}

/// All rows of all views, with their part of every layer.
fn blocks<'a>(batch: &ViewBatch, pictures: &'a mut ViewPictures) -> Vec<Block<'a>> {
    let (width, height) = (batch.view.width as usize, batch.view.height as usize);
    let at_once = (BLOCK_PIXELS / width).clamp(1, height);
    let of_view = |view| {
        let rows = (0..height).step_by(at_once);
        rows.map(move |first| Block {
            view,
            rows: first as u32..(first + at_once).min(height) as u32,
            layers: Vec::new(),
        })
    };
    let mut blocks: Vec<_> = (0..batch.cameras.len()).flat_map(of_view).collect();
    for (layer, values) in &mut pictures.layers {
        let of_row = width * layer.channels();
        let (mut numbers, mut ids): (&mut [f32], &mut [u32]) = match values {
            ViewValues::Float(numbers) => (numbers, &mut []),
            ViewValues::Id(ids) => (&mut [], ids),
        };
        for block in &mut blocks {
            let length = of_row * block.rows.len();
            let part = if layer.is_id() {
                Values::Id(ids.split_off_mut(..length).unwrap_or_default())
            } else {
                Values::Float(numbers.split_off_mut(..length).unwrap_or_default())
            };
            block.layers.push((*layer, part));
        }
    }
    blocks
}

/// The colours of a block, if they are wanted: those of a film of the view.
fn render_colors(
    scene: &CpuScene,
    batch: &ViewBatch,
    block: &mut Block<'_>,
    scratch: &mut Scratch,
) -> Counted {
    let colors = block.layers.iter_mut().find_map(|(layer, values)| match values {
        Values::Float(numbers) if *layer == ViewLayer::Rgb => Some(numbers),
        _ => None,
    });
    let Some(colors) = colors else { return Counted::default() };
    let view = batch.single(block.view);
    let samples = view.first_sample..view.first_sample + batch.samples;
    let estimates = &mut scratch.estimates;
    estimates.clear();
    estimates.resize(view.width as usize * block.rows.len(), PixelStats::default());
    let mut first_hits = FirstHits::new();
    let work = Work::Rows { rows: block.rows.clone(), samples };
    let rays = render_work(scene, &view, None, work, estimates, &mut first_hits);
    for (color, estimate) in colors.as_chunks_mut::<3>().0.iter_mut().zip(estimates.iter()) {
        *color = estimate.mean().map(|c| c as f32);
    }
    Counted { rays, invalid_samples: estimates.iter().map(PixelStats::invalid).sum() }
}

/// The other layers of a block; returns the number of rays.
fn render_exact(scene: &CpuScene, batch: &ViewBatch, block: &mut Block<'_>, scratch: &mut Scratch) -> u64 {
    if batch.exact_layers().next().is_none() {
        return 0;
    }
    let pixels = Pixels::new(scene, batch, block);
    let Scratch { rays, hits, .. } = scratch;
    rays.clear();
    rays.extend((0..pixels.count()).map(|i| pixels.ray(i)));
    hits.clear();
    hits.resize(rays.len(), MISS);
    if scene.tables.has_alpha {
        scene.tlas.closest_stream(&rays[..], &mut hits[..], &AlphaFilter(scene), Coherence::Coherent);
    } else {
        scene.tlas.closest_stream(&rays[..], &mut hits[..], &Opaque, Coherence::Coherent);
    }
    for (i, (ray, hit)) in rays.iter().zip(hits.iter()).enumerate() {
        let surface = (!hit.is_miss()).then(|| Surface::new(scene, ray, hit, MOTION_MIDDLE));
        for (layer, values) in &mut block.layers {
            match values {
                Values::Float(_) if *layer == ViewLayer::Rgb => {}
                Values::Float(numbers) => {
                    let channels = layer.channels();
                    let value = pixels.numbers(*layer, i, ray, hit, surface.as_ref());
                    numbers[channels * i..channels * (i + 1)].copy_from_slice(&value[..channels]);
                }
                Values::Id(ids) => ids[i] = id(*layer, surface.as_ref()),
            }
        }
    }
    rays.len() as u64
}

fn id(layer: ViewLayer, surface: Option<&Surface>) -> u32 {
    let Some(s) = surface else { return ViewLayer::NOTHING };
    match layer {
        ViewLayer::Material => s.material,
        ViewLayer::Primitive => s.primitive,
        _ => s.object,
    }
}

/// The pixels of a block, and the rays through their centres.
struct Pixels<'a> {
    scene: &'a CpuScene,
    view: &'a View,
    camera: CameraFrame,
    next: Option<CameraFrame>,
    spread: f32,
    rows: Range<u32>,
}

impl<'a> Pixels<'a> {
    fn new(scene: &'a CpuScene, batch: &'a ViewBatch, block: &Block<'_>) -> Self {
        // Through the centre of a lens.
        let camera = CameraFrame { lens_radius: 0.0, ..batch.cameras[block.view] };
        let spread = camera_pixel_spread(camera, batch.view.height as f32);
        let next = batch.next.get(block.view).copied();
        Self { scene, view: &batch.view, camera, next, spread, rows: block.rows.clone() }
    }

    fn count(&self) -> u32 {
        self.view.width * self.rows.len() as u32
    }

    /// The centre of pixel `i` of the block, in pixels from the view's upper left.
    fn center(&self, i: u32) -> optics::Vec2f {
        let (x, y) = (i % self.view.width, self.rows.start + i / self.view.width);
        vec2f(x as f32 + 0.5, y as f32 + 0.5)
    }

    fn size(&self) -> optics::Vec2f {
        vec2f(self.view.width as f32, self.view.height as f32)
    }

    /// The ray through it; outside of a lens' field it hits nothing.
    fn ray(&self, i: u32) -> Ray {
        let ray = camera_ray(self.camera, film_position(self.center(i), self.size()), vec2f(0.5, 0.5));
        Ray::new(ray.origin.to_array(), ray.direction.to_array())
    }

    /// A layer's channels at pixel `i`.
    fn numbers(
        &self,
        layer: ViewLayer,
        i: usize,
        ray: &Ray,
        hit: &Hit,
        surface: Option<&Surface>,
    ) -> [f32; 3] {
        let direction = vec3(ray.direction);
        if layer == ViewLayer::Flow {
            let offset = surface.map_or(direction, |s| s.position - self.next_origin());
            return self.flow(i as u32, offset);
        }
        let Some(s) = surface else { return [0.0; 3] };
        match layer {
            ViewLayer::Depth => [camera_depth(self.camera, direction, hit.t), 0.0, 0.0],
            ViewLayer::Normal => s.shading_normal.to_array(),
            ViewLayer::Position => s.position.to_array(),
            _ => {
                let tables = &*self.scene.tables;
                let material = &tables.materials[s.material as usize];
                surface_albedo(tables, material, s, pixel_footprint(self.spread, hit.t)).to_array()
            }
        }
    }

    fn next_origin(&self) -> optics::Vec3f {
        self.next.map_or(vec3f(0.0, 0.0, 0.0), |next| next.origin)
    }

    fn flow(&self, i: u32, offset: optics::Vec3f) -> [f32; 3] {
        let center = self.center(i);
        let seen = camera_ray(self.camera, film_position(center, self.size()), vec2f(0.5, 0.5)).weight > 0.0;
        let Some(next) = self.next.filter(|_| seen) else { return [f32::NAN; 3] };
        let moved = shown_motion(next, offset, center, self.size());
        if moved.z > 0.0 { [moved.x, moved.y, 0.0] } else { [f32::NAN; 3] }
    }
}
