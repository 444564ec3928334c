//! Path tracing of a batch of samples, one segment of all paths at a time.
//!
//! The batch is a small wavefront: trace all rays as a stream, shade all hits, trace all shadow rays as a stream, go on
//! with the paths that live. Streams let the acceleration structure use its packets where rays are alike, and keep each
//! stage's code and data in the caches. What happens at a vertex is the optics' `path` module; this is only the loop.

use crate::aov::aov_sample;
use crate::lanes::{
    DiffusePoint, DiffuseVertices, LANES, LightLanes, NextLanes, Pairs, draw, sample_cosine_lobes,
    sample_triangle_lights,
};
use crate::lights::{for_each_distant, sample_light, surface_light_pdf};
use crate::material::{Shading, base_color, emission, mixes_models, shade};
use crate::scene::{CpuScene, vec3};
use crate::surface::Surface;
use crate::triangles::TriangleLanes;
use accel::{Coherence, Hit, HitFilter, MISS, Ray};
use backend::{PathSettings, View};
use film::AovSample;
use optics::bsdf::{bsdf_eval, bsdf_has_lobes, bsdf_has_smooth_part, bsdf_sample, bsdf_transmits};
use optics::camera::{camera_pixel_spread, camera_ray};
use optics::frame::{Frame, to_local, to_world};
use optics::light::LightSample;
use optics::path::{
    PathState, path_add_emission, path_light_contribution, path_scatter, path_start, roulette_survival,
};
use optics::random::{PixelSampler, SAMPLER_INDEPENDENT, SAMPLER_SOBOL, sample_2d, sampler_new};
use optics::scatter::{BSDF_NONE, Bsdf, BsdfSample};
use optics::vector::dot;
use optics::{Vec3f, vec2f, vec3f};
use scene::tables::ModelTag;

/// Pairs of random numbers: where on the pixel and on the lens, then a fixed number for each vertex.
const PAIR_FILM: u32 = 0;
const PAIR_LENS: u32 = 1;
const PAIRS_BEFORE_VERTICES: u32 = 2;
const PAIRS_PER_VERTEX: u32 = 4;
const PAIR_BSDF: u32 = 0;
const PAIR_LIGHT: u32 = 1;
/// x: which lobe. y: Russian roulette.
const PAIR_LOBE: u32 = 2;
/// x: which of the models that a material mixes.
const PAIR_MODEL: u32 = 3;

/// Shadow rays end this share of the way before the light, so that they do not hit the light itself.
const SHADOW_END: f32 = 0.9999;

/// One sample to be made: its pixel and its index.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampleId {
    pub x: u32,
    pub y: u32,
    pub index: u32,
}

/// A path between two vertices; its ray stands beside it in another array.
#[derive(Clone, Copy)]
struct Path {
    state: PathState,
    sampler: PixelSampler,
    /// Which sample of the batch it belongs to.
    slot: u32,
    /// Length of the path so far, for footprints.
    length: f32,
}

/// What a shadow ray brings if nothing is in its way.
#[derive(Clone, Copy)]
struct Connection {
    slot: u32,
    contribution: Vec3f,
}

/// Scratch memory of one worker. Everything is reused: a path allocates nothing.
#[derive(Default)]
pub(crate) struct PathBatch {
    rays: Vec<Ray>,
    paths: Vec<Path>,
    hits: Vec<Hit>,
    next_rays: Vec<Ray>,
    next_paths: Vec<Path>,
    shadow_rays: Vec<Ray>,
    connections: Vec<Connection>,
    occluded: Vec<bool>,
    triangles: TriangleLanes,
    diffuse: DiffuseQueue,
    /// The samples being made; kept here between bands for its memory only.
    pub ids: Vec<SampleId>,
    /// Radiance of each sample of the batch.
    pub radiance: Vec<Vec3f>,
    /// First hits, parallel to `radiance`, if the view asks for auxiliary layers.
    pub aovs: Vec<AovSample>,
    /// Rays traced since the batch was made.
    pub rays_traced: u64,
}

/// Diffuse vertices that wait until there are enough of them to fill the lanes.
#[derive(Default)]
struct DiffuseQueue {
    vertices: DiffuseVertices,
    paths: Vec<Path>,
    u: Pairs,
    lights: LightLanes,
    next: NextLanes,
}

/// What all paths of a view share.
struct Context<'a> {
    scene: &'a CpuScene,
    sampler_kind: u32,
    settings: &'a PathSettings,
    shading: Shading,
    wants_aovs: bool,
}

impl PathBatch {
    /// Makes the samples; the results are in `radiance` and `aovs`, in the order of `samples`.
    #[inline(always)]
    pub fn run<F: HitFilter>(
        &mut self,
        scene: &CpuScene,
        view: &View,
        settings: &PathSettings,
        filter: &F,
        samples: &[SampleId],
    ) {
        let pixel_spread = camera_pixel_spread(view.camera, view.height as f32);
        let shading = Shading { single_scatter: view.single_scatter, pixel_spread };
        let wants_aovs = !view.aovs.is_empty();
        let context = Context { scene, sampler_kind: sampler_kind(view), settings, shading, wants_aovs };
        self.generate(view, samples);
        let mut coherence = Coherence::Coherent;
        while !self.paths.is_empty() {
            self.hits.clear();
            self.hits.resize(self.rays.len(), MISS);
            scene.tlas.closest_stream(&self.rays, &mut self.hits, filter, coherence);
            self.rays_traced += self.rays.len() as u64;
            for first in (0..self.paths.len()).step_by(LANES) {
                let end = (first + LANES).min(self.paths.len());
                self.triangles.compute(scene, &self.rays[first..end], &self.hits[first..end]);
                for i in first..end {
                    self.shade_one(&context, i);
                }
            }
            self.scatter_diffuse(&context);
            self.connect(scene, filter);
            std::mem::swap(&mut self.rays, &mut self.next_rays);
            std::mem::swap(&mut self.paths, &mut self.next_paths);
            self.next_rays.clear();
            self.next_paths.clear();
            coherence = Coherence::Incoherent;
        }
    }

    /// Camera rays.
    #[inline(always)]
    fn generate(&mut self, view: &View, samples: &[SampleId]) {
        self.rays.clear();
        self.paths.clear();
        self.radiance.clear();
        self.radiance.resize(samples.len(), vec3f(0.0, 0.0, 0.0));
        self.aovs.clear();
        if !view.aovs.is_empty() {
            self.aovs.resize(samples.len(), AovSample::default());
        }
        let size = vec2f(view.width as f32, view.height as f32);
        for (slot, sample) in (0..).zip(samples) {
            let sampler = new_sampler(view, sample);
            let jitter = sample_2d(sampler, PAIR_FILM);
            let lens = if view.camera.lens_radius > 0.0 { sample_2d(sampler, PAIR_LENS) } else { jitter };
            let film = vec2f((sample.x as f32 + jitter.x) / size.x, (sample.y as f32 + jitter.y) / size.y);
            let ray = camera_ray(view.camera, film, lens);
            self.rays.push(Ray::new(ray.origin.to_array(), ray.direction.to_array()));
            self.paths.push(Path { state: path_start(), sampler, slot, length: 0.0 });
        }
    }

    /// Everything that happens where path `i` arrives.
    #[inline(always)]
    fn shade_one(&mut self, context: &Context, i: usize) {
        let (ray, hit) = (self.rays[i], self.hits[i]);
        let mut path = self.paths[i];
        let scene = context.scene;
        if hit.is_miss() {
            for_each_distant(scene, vec3(ray.direction), |d| {
                path.state = path_add_emission(path.state, d.radiance, d.pdf);
            });
            self.finish(&path);
            return;
        }
        let tables = &*scene.tables;
        let first_hit = path.state.depth == 1 && context.wants_aovs;
        path.length += hit.t;
        if self.shade_plain(context, i % LANES, &path) {
            return;
        }
        let in_lanes = self.triangles.surface(tables, i % LANES, first_hit);
        let surface = in_lanes.unwrap_or_else(|| Surface::new(scene, &ray, &hit));
        let material = &tables.materials[surface.material as usize];
        let footprint = context.shading.pixel_spread * path.length;
        if first_hit {
            self.aovs[path.slot as usize] = aov_sample(tables, material, &surface, path.length, footprint);
        }
        let emitted = emission(tables, material, &surface, footprint);
        if emitted.x + emitted.y + emitted.z > 0.0 {
            let from = vec3(ray.origin);
            let pdf = surface_light_pdf(scene, &surface, from, vec3(ray.direction), hit.t);
            path.state = path_add_emission(path.state, emitted, pdf);
        }
        if path.state.depth >= context.settings.max_depth {
            self.finish(&path);
            return;
        }
        let branches = if path.state.depth == 1 { context.settings.splitting.max(1) } else { 1 };
        if branches == 1 {
            self.scatter(context, &surface, path, footprint);
            return;
        }
        // Light found so far belongs to the path once; the branches share what comes.
        self.finish(&path);
        path.state.radiance = vec3f(0.0, 0.0, 0.0);
        path.state.throughput *= 1.0 / branches as f32;
        for branch in 0..branches {
            let mut child = path;
            child.sampler.scramble = optics::random::hash_combine(path.sampler.scramble, branch);
            self.scatter(context, &surface, child, footprint);
        }
    }

    /// The short way for what most vertices of most pictures are: an ideal diffuse surface of one colour. Returns
    /// whether the path could take it.
    #[inline(always)]
    fn shade_plain(&mut self, context: &Context, lane: usize, path: &Path) -> bool {
        let Some(material) = self.triangles.plain_material(&context.scene.tables, lane) else { return false };
        let special_first = path.state.depth == 1 && (context.wants_aovs || context.settings.splitting > 1);
        if special_first || !context.scene.plain_lights || !material.is_plain_lambert() {
            return false;
        }
        if path.state.depth >= context.settings.max_depth {
            self.finish(path);
            return true;
        }
        let [r, g, b, _] = material.base_color;
        let point = self.triangles.diffuse_point(lane, vec3f(r, g, b));
        self.queue_diffuse(context, &point, *path);
        true
    }

    /// Next-event estimation and the path's continuation at a surface.
    #[inline(always)]
    fn scatter(&mut self, context: &Context, surface: &Surface, mut path: Path, footprint: f32) {
        let tables = &*context.scene.tables;
        let material = &tables.materials[surface.material as usize];
        if material.model == ModelTag::Lambert && context.scene.plain_lights {
            let albedo = base_color(tables, material, surface, footprint);
            let point = DiffusePoint {
                position: surface.position,
                extent: surface.extent,
                normal: surface.normal,
                shading_normal: surface.shading_normal,
                albedo,
            };
            self.queue_diffuse(context, &point, path);
            return;
        }
        // Numbers are drawn only where something depends on them: they cost as much as the rest of the shading.
        let pair = PAIRS_BEFORE_VERTICES + PAIRS_PER_VERTEX * (path.state.depth - 1);
        let u_model = if mixes_models(material) { sample_2d(path.sampler, pair + PAIR_MODEL).x } else { 0.0 };
        let bsdf = shade(tables, material, surface, &context.shading, footprint, u_model);
        if bsdf.kind == BSDF_NONE {
            self.finish(&path);
            return;
        }
        let frame = surface.frame();
        let wo = to_local(frame, surface.wo);
        if bsdf_has_smooth_part(bsdf) && !tables.lights.is_empty() {
            let u = sample_2d(path.sampler, pair + PAIR_LIGHT);
            if let Some(light) = sample_light(context.scene, surface.position, u) {
                self.add_connection(surface, &frame, &bsdf, wo, &path, &light);
            }
        }
        let meets_roulette = path.state.depth + 1 >= context.settings.roulette_start;
        let u_lobe = if meets_roulette || bsdf_has_lobes(bsdf) {
            sample_2d(path.sampler, pair + PAIR_LOBE)
        } else {
            vec2f(0.0, 0.0)
        };
        let sample = bsdf_sample(bsdf, wo, u_lobe.x, sample_2d(path.sampler, pair + PAIR_BSDF));
        let wi = to_world(frame, sample.wi);
        let above = dot(wi, surface.normal) > 0.0;
        // Between shading and geometric normal there are directions that would leak through the surface.
        if sample.pdf <= 0.0 || above == sample.transmitted {
            self.finish(&path);
            return;
        }
        path.state = path_scatter(path.state, sample, bsdf.eta);
        let survival = roulette_survival(
            path.state,
            context.settings.roulette_start,
            context.settings.roulette_min_survival,
        );
        if u_lobe.y >= survival {
            self.finish(&path);
            return;
        }
        path.state.throughput *= 1.0 / survival;
        let origin = surface.ray_origin(above);
        self.next_rays.push(Ray::new(origin.to_array(), wi.to_array()));
        self.next_paths.push(path);
    }

    /// Collects a diffuse vertex; scatters all that are waiting when the lanes are full.
    #[inline(always)]
    fn queue_diffuse(&mut self, context: &Context, point: &DiffusePoint, path: Path) {
        let lane = self.diffuse.paths.len();
        let v = &mut self.diffuse.vertices;
        v.set_point(lane, point);
        v.throughput.set(lane, path.state.throughput);
        v.scramble.0[lane] = path.sampler.scramble;
        v.index.0[lane] = path.sampler.index;
        v.pair.0[lane] = PAIRS_BEFORE_VERTICES + PAIRS_PER_VERTEX * (path.state.depth - 1);
        self.diffuse.paths.push(path);
        if lane + 1 == LANES {
            self.scatter_diffuse(context);
        }
    }

    /// What [`PathBatch::scatter`] does, for all waiting diffuse vertices at once. Lanes without a vertex compute
    /// something that nobody reads.
    #[inline(always)]
    fn scatter_diffuse(&mut self, context: &Context) {
        let queue = &mut self.diffuse;
        if queue.paths.is_empty() {
            return;
        }
        let v = &queue.vertices;
        let draw_pair = |offset: u32, u: &mut Pairs| {
            draw(context.sampler_kind, &v.scramble, &v.index, &v.pair, offset, u)
        };
        if !context.scene.tables.lights.is_empty() {
            draw_pair(PAIR_LIGHT, &mut queue.u);
            sample_triangle_lights(&context.scene.tables, v, &queue.u, &mut queue.lights);
            for (lane, path) in queue.paths.iter().enumerate() {
                let contribution = queue.lights.contribution.get(lane);
                if contribution.x + contribution.y + contribution.z != 0.0 {
                    self.connections.push(Connection { slot: path.slot, contribution });
                    self.shadow_rays.push(Ray {
                        origin: queue.lights.origin.get(lane).to_array(),
                        t_min: 0.0,
                        direction: queue.lights.wi.get(lane).to_array(),
                        t_max: queue.lights.distance.0[lane] * SHADOW_END,
                    });
                }
            }
        }
        draw_pair(PAIR_BSDF, &mut queue.u);
        sample_cosine_lobes(v, &queue.u, &mut queue.next);
        if queue.paths.iter().any(|path| path.state.depth + 1 >= context.settings.roulette_start) {
            draw_pair(PAIR_LOBE, &mut queue.u);
        }
        for (lane, path) in queue.paths.iter_mut().enumerate() {
            let (wi, pdf) = (queue.next.wi.get(lane), queue.next.pdf.0[lane]);
            let weight = v.albedo.get(lane);
            let sample = BsdfSample { wi, weight, pdf, delta: false, transmitted: false };
            path.state = path_scatter(path.state, sample, 1.0);
            let settings = context.settings;
            let survival =
                roulette_survival(path.state, settings.roulette_start, settings.roulette_min_survival);
            if queue.next.alive.0[lane] == 0 || (survival < 1.0 && queue.u.get(lane).y >= survival) {
                let sum = &mut self.radiance[path.slot as usize];
                *sum += path.state.radiance;
                continue;
            }
            path.state.throughput *= 1.0 / survival;
            self.next_rays.push(Ray::new(queue.next.origin.get(lane).to_array(), wi.to_array()));
            self.next_paths.push(*path);
        }
        queue.paths.clear();
    }

    /// Queues the shadow ray of a light sample, if the light could contribute.
    #[inline(always)]
    fn add_connection(
        &mut self,
        surface: &Surface,
        frame: &Frame,
        bsdf: &Bsdf,
        wo: Vec3f,
        path: &Path,
        light: &LightSample,
    ) {
        let above = dot(light.wi, surface.normal) > 0.0;
        if light.pdf <= 0.0 || !(above || bsdf_transmits(*bsdf)) {
            return;
        }
        let wi = to_local(*frame, light.wi);
        if above != (wi.z > 0.0) {
            return;
        }
        let value = bsdf_eval(*bsdf, wo, wi);
        let contribution =
            path_light_contribution(path.state.throughput, value, light.radiance, light.pdf, light.delta);
        // Not `> 0`: NaN must reach the film, where it is counted.
        if contribution.x + contribution.y + contribution.z == 0.0 {
            return;
        }
        self.connections.push(Connection { slot: path.slot, contribution });
        self.shadow_rays.push(shadow_ray(surface, light, above));
    }

    /// Traces the queued shadow rays and adds what is not occluded.
    #[inline(always)]
    fn connect<F: HitFilter>(&mut self, scene: &CpuScene, filter: &F) {
        self.occluded.clear();
        self.occluded.resize(self.shadow_rays.len(), false);
        scene.tlas.any_stream(&self.shadow_rays, &mut self.occluded, filter, Coherence::Incoherent);
        self.rays_traced += self.shadow_rays.len() as u64;
        for (connection, occluded) in self.connections.iter().zip(&self.occluded) {
            if !occluded {
                let sum = &mut self.radiance[connection.slot as usize];
                *sum += connection.contribution;
            }
        }
        self.connections.clear();
        self.shadow_rays.clear();
    }

    /// Hands over what a path has gathered.
    #[inline(always)]
    fn finish(&mut self, path: &Path) {
        let sum = &mut self.radiance[path.slot as usize];
        *sum += path.state.radiance;
    }
}

/// How the view draws its samples, as the optics know it.
fn sampler_kind(view: &View) -> u32 {
    match view.sampler {
        backend::SamplerKind::Sobol => SAMPLER_SOBOL,
        backend::SamplerKind::Independent => SAMPLER_INDEPENDENT,
    }
}

/// The random numbers of a sample.
#[inline(always)]
pub(crate) fn new_sampler(view: &View, sample: &SampleId) -> PixelSampler {
    sampler_new(sampler_kind(view), sample.y * view.width + sample.x, sample.index, view.seed)
}

/// The ray from a surface to a light sample; `above`: on the side of the surface's normal.
#[inline(always)]
pub(crate) fn shadow_ray(surface: &Surface, light: &LightSample, above: bool) -> Ray {
    let origin = surface.ray_origin(above);
    // The offset may be longer than the way to a light that is very near.
    let distance = light.distance - dot(origin - surface.position, light.wi);
    Ray {
        origin: origin.to_array(),
        t_min: 0.0,
        direction: light.wi.to_array(),
        t_max: distance * SHADOW_END,
    }
}
