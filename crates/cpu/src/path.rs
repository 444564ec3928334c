//! Path tracing of a batch of samples, one segment of all paths at a time.
//!
//! The batch is a small wavefront: trace all rays as a stream, shade all hits, trace all shadow rays as a stream, go on
//! with the paths that live. Streams let the acceleration structure use its packets where rays are alike, and keep each
//! stage's code and data in the caches. What happens at a vertex is the optics' `path` module; this is only the loop.

use crate::aov::aov_sample;
use crate::lanes::{ALL_LANES, CameraLanes, LANES, Vectors};
use crate::layers::shade_layered;
use crate::light_lanes::sample_lights;
use crate::lights::{for_each_distant, sample_light, surface_light_pdf};
use crate::material::{Shading, base_color, emission, mixes_models, shade};
use crate::scatter_lanes::{CosineLobes, play_roulette, sample_cosine_lobes, sample_smooth_interfaces};
use crate::scattering::Scattering;
use crate::scene::{CpuScene, vec3};
use crate::simd::Instructions;
use crate::sites::Arrival;
use crate::streams::{HitStream, Path, PathStream, ShadowStream};
use crate::surface::Surface;
use crate::triangles::TriangleLanes;
use crate::vertices::{PlainPoint, VertexQueue};
use accel::{Coherence, HitFilter, Ray};
use backend::{PathSettings, View};
use film::AovSample;
use optics::camera::{CAMERA_PERSPECTIVE, CameraFrame, camera_pixel_spread};
use optics::frame::{Frame, to_local, to_world};
use optics::light::LightSample;
use optics::light_tree::{ALL_SIDES, octahedral_encode};
use optics::medium::transmittance;
use optics::path::{path_add_emission, path_light_contribution, path_scatter, roulette_survival};
use optics::random::{
    PixelSampler, SAMPLER_BLUE_NOISE, SAMPLER_INDEPENDENT, SAMPLER_SOBOL, hash_combine, sample_2d,
    sampler_new,
};
use optics::scatter::BSDF_NONE;
use optics::vector::dot;
use optics::{Vec2f, Vec3f, vec2f, vec3f};
use scene::tables::{ModelTag, SceneTables};

/// Pairs of random numbers: where on the pixel and on the lens, then a fixed number for each vertex.
pub(crate) const PAIR_FILM: u32 = 0;
pub(crate) const PAIR_LENS: u32 = 1;
pub(crate) const PAIRS_BEFORE_VERTICES: u32 = 2;
const PAIRS_PER_VERTEX: u32 = 4;
pub(crate) const PAIR_BSDF: u32 = 0;
pub(crate) const PAIR_LIGHT: u32 = 1;
/// x: which lobe. y: Russian roulette.
pub(crate) const PAIR_LOBE: u32 = 2;
/// x: which of the models that a material mixes.
pub(crate) const PAIR_MODEL: u32 = 3;

/// Shadow rays end this share of the way before the light, so that they do not hit the light itself.
pub(crate) const SHADOW_END: f32 = 0.9999;

/// One sample to be made: its pixel and its index.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampleId {
    pub x: u32,
    pub y: u32,
    pub index: u32,
}

/// Neighbours in a batch that belong to one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    /// Place of the pixel's estimate.
    pub place: u32,
    /// Number of samples.
    pub count: u32,
}

/// What a shadow ray brings if nothing is in its way.
#[derive(Clone, Copy)]
pub(crate) struct Connection {
    /// Place of the sample in the batch.
    pub slot: u32,
    pub contribution: Vec3f,
}

/// Scratch memory of one worker. Everything is reused: a path allocates nothing.
#[derive(Default)]
pub(crate) struct PathBatch {
    pub(crate) paths: PathStream,
    hits: HitStream,
    next: PathStream,
    pub(crate) shadows: ShadowStream,
    occluded: Vec<bool>,
    triangles: TriangleLanes,
    diffuse: VertexQueue,
    smooth: VertexQueue,
    /// The samples being made; kept here between bands for its memory only.
    pub ids: Vec<SampleId>,
    /// How `ids` is divided among pixels; kept for its memory, too.
    pub runs: Vec<Run>,
    /// Radiance of each sample of the batch.
    pub radiance: Vec<Vec3f>,
    /// First hits, parallel to `radiance`, if the view asks for auxiliary layers.
    pub aovs: Vec<AovSample>,
    /// Rays traced since the batch was made.
    pub rays_traced: u64,
}

/// What all paths of a batch share.
pub(crate) struct Context<'a> {
    pub scene: &'a CpuScene,
    sampler_kind: u32,
    /// Segments of the paths so far: 1 after the camera ray.
    pub depth: u32,
    settings: &'a PathSettings,
    shading: Shading,
    wants_aovs: bool,
}

impl Context<'_> {
    /// The first dimension pair of this vertex.
    #[inline(always)]
    fn pair(&self) -> u32 {
        PAIRS_BEFORE_VERTICES + PAIRS_PER_VERTEX * (self.depth - 1)
    }

    /// Random numbers of a path's vertex.
    #[inline(always)]
    fn draw(&self, path: &Path, pair: u32) -> Vec2f {
        let sampler = PixelSampler { kind: self.sampler_kind, scramble: path.scramble, index: path.index };
        sample_2d(sampler, self.pair() + pair)
    }

    /// Whether paths end where they arrive, and nobody looks at that place for anything but its light: layers show first surfaces, and
    /// the filters of GPUs, which trace the same rays, want to know how far away from them second ones are.
    #[inline(always)]
    fn are_last_segments(&self) -> bool {
        self.depth >= self.settings.max_depth && self.depth > 2
    }

    /// Whether Russian roulette may end paths at this vertex.
    #[inline(always)]
    fn meets_roulette(&self) -> bool {
        self.depth + 1 >= self.settings.roulette_start
    }
}

impl PathBatch {
    /// Makes the samples; the results are in `radiance` and `aovs`, in the order of `samples`.
    #[inline(always)]
    pub fn run<I: Instructions, F: HitFilter>(
        &mut self,
        i: I,
        scene: &CpuScene,
        view: &View,
        settings: &PathSettings,
        filter: &F,
        samples: &[SampleId],
    ) {
        let pixel_spread = camera_pixel_spread(view.camera, view.height as f32);
        let shading = Shading { single_scatter: view.single_scatter, pixel_spread };
        let wants_aovs = !view.aovs.is_empty();
        let sampler_kind = sampler_kind(view);
        let mut context = Context { scene, sampler_kind, depth: 1, settings, shading, wants_aovs };
        self.shadows.clear();
        self.next.clear();
        self.generate(i, view, samples);
        let mut coherence = Coherence::Coherent;
        while self.paths.len() > 0 {
            if context.are_last_segments() {
                self.follow_into_the_sky(&context, filter);
            }
            let count = self.paths.len();
            scene.tlas.closest_stream(&self.paths.rays(), &mut self.hits.columns(count), filter, coherence);
            self.rays_traced += count as u64;
            for first in (0..count).step_by(LANES) {
                self.arrive(i, &context, first, LANES.min(count - first));
            }
            self.scatter_diffuse(i, &context);
            self.scatter_smooth(i, &context);
            self.connect(scene, filter);
            std::mem::swap(&mut self.paths, &mut self.next);
            self.next.clear();
            context.depth += 1;
            coherence = Coherence::Incoherent;
        }
    }

    /// Camera rays.
    #[inline(always)]
    fn generate<I: Instructions>(&mut self, i: I, view: &View, samples: &[SampleId]) {
        self.paths.clear();
        self.radiance.clear();
        self.radiance.resize(samples.len(), vec3f(0.0, 0.0, 0.0));
        self.aovs.clear();
        if !view.aovs.is_empty() {
            self.aovs.resize(samples.len(), AovSample::default());
        }
        let camera = view.camera;
        if camera.kind == CAMERA_PERSPECTIVE && camera.lens_radius <= 0.0 {
            // With these known the lanes have no branches.
            let pinhole = CameraFrame { kind: CAMERA_PERSPECTIVE, lens_radius: 0.0, ..camera };
            self.generate_from(i, view, pinhole, samples);
        } else {
            self.generate_from(i, view, camera, samples);
        }
    }

    #[inline(always)]
    fn generate_from<I: Instructions>(
        &mut self,
        i: I,
        view: &View,
        camera: CameraFrame,
        samples: &[SampleId],
    ) {
        let mut lanes = CameraLanes::default();
        for samples in samples.chunks(LANES) {
            lanes.compute(view, camera, samples);
            self.paths.begin(i, &lanes, samples.len());
        }
    }

    /// Everything that happens where `count` paths from `first` on arrive, at most sixteen.
    #[inline(always)]
    fn arrive<I: Instructions>(&mut self, i: I, context: &Context, first: usize, count: usize) {
        self.triangles.compute(i, context.scene, &self.paths, &self.hits, first, count);
        let mut rest = ALL_LANES & !self.triangles.which(i, Arrival::Nothing);
        if context.scene.plain_sky {
            let sky = self.triangles.which(i, Arrival::Sky);
            rest &= !sky;
            self.find_plain_sky(context, sky, first);
        }
        // First vertices that are looked at, or at which paths divide, take the way that knows of that.
        let special = context.depth == 1 && (context.wants_aovs || context.settings.splitting > 1);
        if !special {
            let diffuse = self.triangles.which(i, Arrival::Lambert);
            let smooth = self.triangles.which(i, Arrival::Smooth);
            rest &= !(diffuse | smooth);
            // Plain surfaces do not shine: on its last segment a path finds nothing there.
            if context.depth < context.settings.max_depth {
                self.queue_diffuse(i, context, diffuse, first);
                self.queue_smooth(i, context, smooth, first);
            }
        }
        while rest != 0 {
            self.arrive_one(i, context, first, rest.trailing_zeros() as usize);
            rest &= rest - 1;
        }
    }

    /// Adds what paths that have left the scene find in a sky that is no light to be sampled.
    #[inline(always)]
    fn find_plain_sky(&mut self, context: &Context, mut mask: u32, first: usize) {
        let sky = &context.scene.tables.environment;
        if mask == 0 || sky.is_black() {
            return;
        }
        let (directions, throughputs) =
            (self.paths.direction.lanes(first), self.paths.throughput.lanes(first));
        let mut found = Vectors::<LANES>::default();
        for lane in 0..LANES {
            found.set(lane, throughputs.get(lane) * sky.gradient(directions.get(lane)));
        }
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            self.radiance[self.paths.slot.get(first + lane) as usize] += found.get(lane);
        }
    }

    /// Collects the diffuse vertices of some lanes; scatters all that are waiting when the lanes are full.
    #[inline(always)]
    fn queue_diffuse<I: Instructions>(&mut self, i: I, context: &Context, mask: u32, first: usize) {
        if mask != 0 {
            self.diffuse.append(i, mask, &self.triangles, &self.paths, first);
            if self.diffuse.is_full() {
                self.scatter_diffuse(i, context);
            }
        }
    }

    /// Collects vertices on smooth interfaces, likewise.
    #[inline(always)]
    fn queue_smooth<I: Instructions>(&mut self, i: I, context: &Context, mask: u32, first: usize) {
        if mask != 0 {
            self.smooth.append(i, mask, &self.triangles, &self.paths, first);
            if self.smooth.is_full() {
                self.scatter_smooth(i, context);
            }
        }
    }

    /// What happens where the path of one lane arrives, wherever that is.
    #[inline(always)]
    fn arrive_one<I: Instructions>(&mut self, i: I, context: &Context, first: usize, lane: usize) {
        let (ray, hit) = (self.paths.ray(first + lane), self.hits.get(first + lane));
        let mut path = self.paths.path(first + lane);
        let scene = context.scene;
        if hit.is_miss() {
            for_each_distant(scene, vec3(ray.origin), vec3(ray.direction), |d| {
                self.found(context, &path, d.radiance, d.pdf);
            });
            return;
        }
        let tables = &*scene.tables;
        let first_hit = context.depth == 1 && context.wants_aovs;
        path.length += hit.t;
        let in_lanes = self.triangles.surface(scene, lane, first_hit);
        let surface = in_lanes.unwrap_or_else(|| Surface::new(scene, &ray, &hit));
        let material = &tables.materials[surface.material as usize];
        if !surface.front && material.absorbs() {
            // The far side of a body tells what the light has come through.
            path.throughput *= transmittance(vec3(material.absorption), hit.t);
        }
        let footprint = context.shading.pixel_spread * path.length;
        if first_hit {
            self.aovs[path.slot as usize] = aov_sample(tables, material, &surface, path.length, footprint);
        }
        let emitted = emission(tables, material, &surface, footprint);
        if emitted.x + emitted.y + emitted.z > 0.0 {
            let (from, wi) = (vec3(ray.origin), vec3(ray.direction));
            let pdf = surface_light_pdf(scene, &surface, from, path.receiver, wi, hit.t);
            self.found(context, &path, emitted, pdf);
        }
        if context.depth >= context.settings.max_depth {
            return;
        }
        let branches = if context.depth == 1 { context.settings.splitting.max(1) } else { 1 };
        if branches == 1 {
            self.scatter(i, context, &surface, path, footprint);
            return;
        }
        // The branches share what comes.
        path.throughput *= 1.0 / branches as f32;
        for branch in 0..branches {
            let mut child = path;
            child.scramble = hash_combine(path.scramble, branch);
            self.scatter(i, context, &surface, child, footprint);
        }
    }

    /// Next-event estimation and the path's continuation at a surface.
    #[inline(always)]
    fn scatter<I: Instructions>(
        &mut self,
        i: I,
        context: &Context,
        surface: &Surface,
        path: Path,
        footprint: f32,
    ) {
        let tables = &*context.scene.tables;
        let material = &tables.materials[surface.material as usize];
        if material.model == ModelTag::Lambert {
            let albedo = base_color(tables, material, surface, footprint);
            let point = PlainPoint {
                position: surface.position,
                extent: surface.extent,
                normal: surface.normal,
                shading_normal: surface.shading_normal,
                color: albedo,
                wo: surface.wo,
                eta: 1.0,
                binding: 0,
            };
            self.diffuse.push(&point, &path);
            if self.diffuse.is_full() {
                self.scatter_diffuse(i, context);
            }
            return;
        }
        if material.model == ModelTag::Layered {
            self.scatter_layered(context, surface, path, footprint);
            return;
        }
        // Numbers are drawn only where something depends on them: they cost as much as the rest of the shading.
        let u_model = if mixes_models(material) { context.draw(&path, PAIR_MODEL).x } else { 0.0 };
        let bsdf = shade(tables, material, surface, &context.shading, footprint, u_model);
        if bsdf.kind == BSDF_NONE {
            return;
        }
        self.scatter_by(context, surface, surface.frame(), bsdf, path);
    }

    /// As above, on a surface with layers. Out of line: plain surfaces pay nothing for it.
    #[inline(never)]
    fn scatter_layered(&mut self, context: &Context, surface: &Surface, path: Path, footprint: f32) {
        let tables = &*context.scene.tables;
        let material = &tables.materials[surface.material as usize];
        let disperses = tables.layers[material.layers as usize].dispersion > 0.0;
        let u = if disperses { context.draw(&path, PAIR_MODEL).x } else { 0.0 };
        let shading = &context.shading;
        let s = shade_layered(tables, material, surface, shading, footprint, path.throughput, u);
        self.scatter_by(context, surface, s.frame, s.bsdf, path);
    }

    /// Next-event estimation and the path's continuation where it is known what scatters.
    #[inline(always)]
    fn scatter_by<S: Scattering>(
        &mut self,
        context: &Context,
        surface: &Surface,
        frame: Frame,
        bsdf: S,
        mut path: Path,
    ) {
        let tables = &*context.scene.tables;
        let wo = to_local(frame, surface.wo);
        if bsdf.has_smooth_part() && !tables.lights.is_empty() {
            let u = context.draw(&path, PAIR_LIGHT);
            path.receiver = receiver(tables, bsdf, frame.normal);
            if let Some(light) = sample_light(context.scene, surface.position, path.receiver, u) {
                self.add_connection(surface, &frame, bsdf, wo, &path, &light);
            }
        }
        let zero = vec2f(0.0, 0.0);
        let wants_lobe = context.meets_roulette() || bsdf.has_lobes();
        let u_lobe = if wants_lobe { context.draw(&path, PAIR_LOBE) } else { zero };
        let u = if bsdf.is_delta() { zero } else { context.draw(&path, PAIR_BSDF) };
        let sample = bsdf.sample(wo, u_lobe.x, u);
        let wi = to_world(frame, sample.wi);
        let above = dot(wi, surface.normal) > 0.0;
        // Between shading and geometric normal there are directions that would leak through the surface.
        if sample.pdf <= 0.0 || above == sample.transmitted {
            return;
        }
        let state = path_scatter(path.state(context.depth), sample, bsdf.eta());
        let settings = context.settings;
        let survival = roulette_survival(state, settings.roulette_start, settings.roulette_min_survival);
        if u_lobe.y >= survival {
            return;
        }
        path = path.with_state(&state);
        path.throughput *= 1.0 / survival;
        self.next.push(surface.ray_origin(above), wi, &path);
    }

    /// What [`PathBatch::scatter`] does, for the diffuse vertices in the lanes at once. Lanes without a vertex compute
    /// something that nobody reads.
    #[inline(always)]
    fn scatter_diffuse<I: Instructions>(&mut self, i: I, context: &Context) {
        let queue = &mut self.diffuse;
        let waiting = queue.waiting();
        if waiting == 0 {
            return;
        }
        queue.find_above();
        if !context.scene.tables.lights.is_empty() {
            queue.draw(context.sampler_kind, context.pair() + PAIR_LIGHT);
            sample_lights(context.scene, &mut queue.vertices, waiting, &queue.u, &mut queue.lights);
            queue.connections.compute(&queue.vertices, &queue.above, &queue.lights, &CosineLobes);
            let asking = queue.connections.asking(i, waiting);
            self.shadows.append(i, asking, &queue.connections, queue.paths().slot);
        }
        queue.draw(context.sampler_kind, context.pair() + PAIR_BSDF);
        sample_cosine_lobes(&queue.vertices, &queue.above, &queue.u, &mut queue.next);
        if context.meets_roulette() {
            queue.draw(context.sampler_kind, context.pair() + PAIR_LOBE);
            play_roulette(&queue.u, context.depth, context.settings, &mut queue.next);
        }
        self.next.append(i, queue.next.alive(i, waiting), &queue.next, queue.paths());
        queue.advance();
    }

    /// The same for smooth interfaces, which no light can be sampled for.
    #[inline(always)]
    fn scatter_smooth<I: Instructions>(&mut self, i: I, context: &Context) {
        let queue = &mut self.smooth;
        let waiting = queue.waiting();
        if waiting == 0 {
            return;
        }
        queue.draw(context.sampler_kind, context.pair() + PAIR_LOBE);
        sample_smooth_interfaces(&queue.vertices, &queue.u, &mut queue.next);
        if context.meets_roulette() {
            play_roulette(&queue.u, context.depth, context.settings, &mut queue.next);
        }
        self.next.append(i, queue.next.alive(i, waiting), &queue.next, queue.paths());
        queue.advance();
    }

    /// Queues the shadow ray of a light sample, if the light could contribute.
    #[inline(always)]
    fn add_connection<S: Scattering>(
        &mut self,
        surface: &Surface,
        frame: &Frame,
        bsdf: S,
        wo: Vec3f,
        path: &Path,
        light: &LightSample,
    ) {
        let above = dot(light.wi, surface.normal) > 0.0;
        if light.pdf <= 0.0 || !(above || bsdf.transmits()) {
            return;
        }
        let wi = to_local(*frame, light.wi);
        if above != (wi.z > 0.0) {
            return;
        }
        let value = bsdf.eval(wo, wi);
        let contribution =
            path_light_contribution(path.throughput, value, light.radiance, light.pdf, light.delta);
        self.ask(Connection { slot: path.slot, contribution }, shadow_ray(surface, light, above));
    }

    /// Queues a shadow ray, unless it brings nothing.
    #[inline(always)]
    pub(crate) fn ask(&mut self, connection: Connection, ray: Ray) {
        let Vec3f { x, y, z } = connection.contribution;
        // Not `> 0`: NaN must reach the film, where it is counted.
        if x + y + z != 0.0 {
            self.shadows.push(&ray, &connection);
        }
    }

    /// Traces the queued shadow rays and adds what is not occluded.
    #[inline(always)]
    pub(crate) fn connect<F: HitFilter>(&mut self, scene: &CpuScene, filter: &F) {
        let count = self.shadows.len();
        // The queries write all of it.
        self.occluded.resize(count, false);
        scene.tlas.any_stream(&self.shadows.rays(), &mut self.occluded, filter, Coherence::Incoherent);
        self.rays_traced += count as u64;
        for (at, occluded) in self.occluded.iter().enumerate() {
            if !occluded {
                let Connection { slot, contribution } = self.shadows.connection(at);
                self.radiance[slot as usize] += contribution;
            }
        }
        self.shadows.clear();
    }

    /// Adds light that a path has found by following its own direction; see [`path_add_emission`].
    #[inline(always)]
    fn found(&mut self, context: &Context, path: &Path, emitted: Vec3f, light_pdf: f32) {
        let sum = &mut self.radiance[path.slot as usize];
        *sum += path_add_emission(path.state(context.depth), emitted, light_pdf).radiance;
    }
}

/// What the choice of a light is to know of a surface of unit `normal`; nothing where it does not ask.
#[inline(always)]
pub(crate) fn receiver<S: Scattering>(tables: &SceneTables, bsdf: S, normal: Vec3f) -> u32 {
    if tables.light_tree.is_empty() || bsdf.transmits() { ALL_SIDES } else { octahedral_encode(normal) }
}

/// How the view draws its samples, as the optics know it.
pub(crate) fn sampler_kind(view: &View) -> u32 {
    match view.sampler {
        backend::SamplerKind::Sobol => SAMPLER_SOBOL,
        backend::SamplerKind::Independent => SAMPLER_INDEPENDENT,
        backend::SamplerKind::BlueNoise => SAMPLER_BLUE_NOISE,
    }
}

/// The random numbers of a sample.
#[inline(always)]
pub(crate) fn new_sampler(view: &View, sample: &SampleId) -> PixelSampler {
    sampler_new(sampler_kind(view), sample.x, sample.y, view.width, sample.index, view.seed)
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
