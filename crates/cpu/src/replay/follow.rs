//! Follows one path and writes down what happens. The order of sums is that of `integrate::path`.

use super::describe::{found_light, light_record, model_name};
use super::record::{
    FoundLight, LightSampleRecord, LightVisibility, PathEnd, PathRecord, SampleRecord, ScatteringRecord,
    SurfaceRecord, VertexPlace, VertexRecord,
};
use crate::batch::samples::{SampleId, new_sampler, sampler_kind};
use crate::batch::streams::{HitStream, Path, PathStream};
use crate::fetch::filter::AlphaFilter;
use crate::fetch::surface::Surface;
use crate::fetch::triangles::TriangleRows;
use crate::integrate::last_segment::may_meet_emitter;
use crate::queries::RayQueries;
use crate::scene::vec3;
use crate::shade::closures::{Incoming, closure_at, wants_model_number};
use crate::shade::lights::{choose_light, for_each_distant, sample_one_light, surface_light_pdf};
use crate::shade::material::{Shading, emission};
use crate::shade::path_batch::Context;
use crate::shade::scatter::{normal_for_lights, shadow_ray};
use crate::simd::{Instructions, Stage, call_with_best};
use accel::{Coherence, Hit, Opaque, Ray};
use backend::{PathSettings, View};
use optics::camera::{camera_pixel_spread, camera_ray};
use optics::closure::{
    Closure, closure_eta, closure_eval, closure_has_lobes, closure_has_smooth_part, closure_is_delta,
    closure_sample, closure_scatters, closure_transmits,
};
use optics::frame::{to_local, to_world};
use optics::light_tree::octahedral_decode;
use optics::medium::transmittance;
use optics::mis::light_sample_weight;
use optics::motion::MOTION_MIDDLE;
use optics::path::{
    PathState, limit_indirect, path_light_contribution, path_scatter, path_start, roulette_survival,
};
use optics::random::{hash_combine, sample_2d};
use optics::scatter::BsdfSample;
use optics::vector::dot;
use optics::vertex::{
    PAIR_BSDF, PAIR_FILM, PAIR_LENS, PAIR_LIGHT, PAIR_LOBE, PAIR_MODEL, continue_from_surface,
    leaves_surface, light_side, path_branch,
};
use optics::{Vec3f, vec2f, vec3f};

const BLACK: Vec3f = vec3f(0.0, 0.0, 0.0);

/// Follows paths of a view, one at a time.
pub(super) struct Follower<'a> {
    queries: &'a RayQueries,
    view: &'a View,
    context: Context<'a>,
    segment: Segment,
    /// Rays traced so far.
    rays: u64,
}

/// The segment that a path is on, as a batch of one path has it: lanes find surfaces in an order of operations of their own.
#[derive(Default)]
struct Segment {
    paths: PathStream,
    hits: HitStream,
    triangles: TriangleRows,
}

/// Finds the surface at the end of a segment.
struct FindSurface<'a> {
    segment: &'a mut Segment,
    queries: &'a RayQueries,
    surface: &'a mut Option<Surface>,
}

impl Stage for FindSurface<'_> {
    #[inline(always)]
    fn run<I: Instructions>(self, i: I) {
        let Segment { paths, hits, triangles } = self.segment;
        let scene = self.queries.scene();
        triangles.begin(i, scene, hits, 1);
        triangles.compute(i, scene, paths, hits, &[], 0, 1);
        *self.surface = triangles.row(0).surface(scene, 0, false);
    }
}

/// A path under way, with what is written down of it.
struct Walk {
    ray: Ray,
    path: Path,
    radiance: Vec3f,
    /// What `radiance` was before the current step; see `PathBatch::limit_found`.
    gathered: Vec3f,
    vertices: Vec<VertexRecord>,
}

impl<'a> Follower<'a> {
    pub fn new(queries: &'a RayQueries, view: &'a View, settings: &'a PathSettings) -> Self {
        let pixel_spread = camera_pixel_spread(view.camera, view.height as f32);
        let shading = Shading { single_scatter: view.single_scatter, pixel_spread };
        let context = Context {
            scene: queries.scene(),
            sampler_kind: sampler_kind(view),
            depth: 1,
            branches: settings.splitting.max(1),
            settings,
            shading,
            wants_aovs: false,
            wants_features: false,
        };
        Self { queries, view, context, segment: Segment::default(), rays: 0 }
    }

    /// Makes a sample.
    pub fn sample(mut self, id: &SampleId) -> SampleRecord {
        let walk = self.camera(id);
        let origin = walk.ray.origin;
        let mut ends = Vec::new();
        self.follow(walk, &mut ends);
        let radiance = match &ends[..] {
            [(only, _)] => only.radiance,
            branches => branches.iter().fold(BLACK, |sum, (branch, _)| sum + branch.radiance),
        };
        let record = |(walk, end): (Walk, PathEnd)| PathRecord {
            origin,
            radiance: walk.radiance.to_array(),
            vertices: walk.vertices,
            end,
        };
        SampleRecord {
            pixel: [id.x, id.y],
            sample: id.index,
            radiance: radiance.to_array(),
            paths: ends.into_iter().map(record).collect(),
            rays: self.rays,
        }
    }

    /// A path that leaves the camera.
    fn camera(&self, id: &SampleId) -> Walk {
        let sampler = new_sampler(self.view, id);
        let (jitter, lens) = (sample_2d(sampler, PAIR_FILM), sample_2d(sampler, PAIR_LENS));
        let film = vec2f(
            (id.x as f32 + jitter.x) / self.view.width as f32,
            (id.y as f32 + jitter.y) / self.view.height as f32,
        );
        let ray = camera_ray(self.view.camera, film, lens);
        let start = path_start();
        let state = PathState { throughput: start.throughput * ray.weight, ..start };
        Walk {
            ray: Ray::new(ray.origin.to_array(), ray.direction.to_array()),
            path: Path::start(0, sampler.scramble, sampler.index).with_state(&state),
            radiance: BLACK,
            gathered: BLACK,
            vertices: Vec::new(),
        }
    }

    /// Follows a path to its end, or those that it parts in to theirs.
    fn follow(&mut self, mut walk: Walk, ends: &mut Vec<(Walk, PathEnd)>) {
        let end = loop {
            walk.gathered = walk.radiance;
            let scene = self.context.scene;
            let ends_in_sky = self.context.are_last_segments() && !may_meet_emitter(scene, &walk.ray);
            if ends_in_sky {
                break self.look_at_sky(&mut walk);
            }
            let hit = self.closest(&walk);
            let Some(surface) = self.arrive(&mut walk, &hit) else { break PathEnd::Miss };
            if self.context.depth >= self.context.settings.max_depth {
                break PathEnd::MaxDepth;
            }
            if self.context.depth == 1 && self.context.branches > 1 {
                return self.part(walk, &surface, ends);
            }
            if let Some(end) = self.scatter(&mut walk, &surface) {
                break end;
            }
            self.context.depth += 1;
        };
        ends.push((walk, end));
    }

    /// Follows the paths that a path parts in at its first vertex.
    fn part(&mut self, walk: Walk, surface: &Surface, ends: &mut Vec<(Walk, PathEnd)>) {
        let branches = self.context.branches;
        let path = walk.path.with_state(&path_branch(walk.path.state(1), branches));
        for branch in 0..branches {
            self.context.depth = 1;
            let mut child = Walk { path, vertices: walk.vertices.clone(), ..walk };
            child.path.scramble = hash_combine(path.scramble, branch);
            if branch > 0 {
                (child.radiance, child.gathered) = (BLACK, BLACK);
                child.vertices.iter_mut().for_each(|vertex| vertex.found.clear());
            }
            match self.scatter(&mut child, surface) {
                Some(end) => ends.push((child, end)),
                None => {
                    self.context.depth = 2;
                    self.follow(child, ends);
                }
            }
        }
    }

    /// The last segment of a path that can meet nothing that shines.
    fn look_at_sky(&mut self, walk: &mut Walk) -> PathEnd {
        let found = self.distant(walk);
        let contribution = found.iter().fold(BLACK, |sum, light| sum + vec3(light.contribution));
        if contribution.x + contribution.y + contribution.z != 0.0 && self.occluded(&walk.ray) {
            return PathEnd::MaxDepth;
        }
        walk.radiance += contribution;
        walk.limit_found(self.context.settings, self.context.depth);
        walk.vertices.push(self.vertex(walk, VertexPlace::Distant, f32::INFINITY, found));
        PathEnd::Miss
    }

    /// What is found where the path arrives; the surface there, if there is one.
    fn arrive(&mut self, walk: &mut Walk, hit: &Hit) -> Option<Surface> {
        let depth = self.context.depth;
        if hit.is_miss() {
            let found = self.distant(walk);
            found.iter().for_each(|light| walk.radiance += vec3(light.contribution));
            walk.limit_found(self.context.settings, depth);
            walk.vertices.push(self.vertex(walk, VertexPlace::Distant, f32::INFINITY, found));
            return None;
        }
        let scene = self.context.scene;
        let tables = &*scene.tables;
        walk.path.length += hit.t;
        let surface = self.surface(&walk.ray, hit);
        let material = &tables.materials[surface.material as usize];
        if !surface.front && material.absorbs() {
            walk.path.throughput *= transmittance(material.absorption, hit.t);
        }
        let footprint = self.context.shading.pixel_spread * walk.path.length;
        let emitted = emission(tables, material, &surface, footprint);
        let mut found = Vec::new();
        if emitted.x + emitted.y + emitted.z > 0.0 {
            let (from, wi) = (vec3(walk.ray.origin), vec3(walk.ray.direction));
            let pdf =
                surface_light_pdf(scene, &surface, from, walk.path.sampling_normal, wi, hit.t, MOTION_MIDDLE);
            let light = found_light(&walk.path.state(depth), emitted, pdf, self.context.mis());
            walk.radiance += vec3(light.contribution);
            found.push(light);
        }
        walk.limit_found(self.context.settings, depth);
        let (instance, primitive) = self.queries.instance_and_primitive(hit);
        let place = VertexPlace::Surface(SurfaceRecord {
            position: surface.position.to_array(),
            normal: surface.normal.to_array(),
            shading_normal: surface.shading_normal.to_array(),
            front: surface.front,
            instance,
            primitive,
            material: surface.material,
        });
        walk.vertices.push(self.vertex(walk, place, hit.t, found));
        Some(surface)
    }

    /// Next-event estimation and the path's continuation. Returns why the path ends, if it does.
    fn scatter(&mut self, walk: &mut Walk, surface: &Surface) -> Option<PathEnd> {
        let tables = &*self.context.scene.tables;
        let material = &tables.materials[surface.material as usize];
        let wants_number = wants_model_number(tables, material);
        let u_model = if wants_number { self.context.draw(&walk.path, PAIR_MODEL).x } else { 0.0 };
        let footprint = self.context.shading.pixel_spread * walk.path.length;
        let incoming = Incoming { footprint, ior: material.ior, throughput: walk.path.throughput, u_model };
        let closure = closure_at(tables, material, surface, &self.context.shading, incoming);
        if !closure_scatters(closure) {
            return Some(PathEnd::Absorbed);
        }
        let wo = to_local(closure.frame, surface.wo);
        if closure_has_smooth_part(closure) && !tables.lights.is_empty() {
            walk.path.sampling_normal = normal_for_lights(tables, closure, closure.frame.normal);
            let record = self.sample_light(walk, surface, &closure, wo);
            walk.note(|vertex| vertex.light_sample = record);
            walk.limit_found(self.context.settings, self.context.depth + 1);
        }
        let zero = vec2f(0.0, 0.0);
        let wants_lobe = self.context.meets_roulette() || closure_has_lobes(closure);
        let u_lobe = if wants_lobe { self.context.draw(&walk.path, PAIR_LOBE) } else { zero };
        let delta = closure_is_delta(closure);
        let u = if delta { zero } else { self.context.draw(&walk.path, PAIR_BSDF) };
        let sample = closure_sample(closure, wo, u_lobe.x, u);
        self.go_on(walk, surface, &closure, &sample, u_lobe.y)
    }

    /// Lets the path go on in a sampled direction. Returns why it ends, if it does; `u`: uniform number for roulette.
    fn go_on(
        &self,
        walk: &mut Walk,
        surface: &Surface,
        closure: &Closure,
        sample: &BsdfSample,
        u: f32,
    ) -> Option<PathEnd> {
        let (frame, eta, roulette) = (closure.frame, closure_eta(*closure), self.context.roulette());
        let state = walk.path.state(self.context.depth);
        let next = continue_from_surface(state, *sample, frame, surface.horizon, eta, roulette, u);
        let leaves = leaves_surface(*sample, dot(to_world(frame, sample.wi), surface.horizon) > 0.0);
        let judged = path_scatter(state, *sample, eta);
        let scattering = ScatteringRecord {
            model: model_name(closure),
            direction: next.wi.to_array(),
            pdf: sample.pdf,
            delta: sample.delta,
            transmitted: sample.transmitted,
            weight: sample.weight.to_array(),
            survival: if leaves {
                roulette_survival(judged, roulette.start, roulette.min_survival)
            } else {
                1.0
            },
            alive: next.alive,
        };
        walk.note(|vertex| vertex.scattering = Some(scattering));
        if !next.alive {
            return Some(if leaves { PathEnd::Roulette } else { PathEnd::NoDirection });
        }
        walk.path = walk.path.with_state(&next.state);
        walk.ray = Ray::new(surface.ray_origin(next.above).to_array(), next.wi.to_array());
        None
    }

    /// Samples a light, and asks whether it is visible.
    fn sample_light(
        &mut self,
        walk: &mut Walk,
        surface: &Surface,
        closure: &Closure,
        wo: Vec3f,
    ) -> Option<LightSampleRecord> {
        let scene = self.context.scene;
        let u = self.context.draw(&walk.path, PAIR_LIGHT);
        let normal = octahedral_decode(walk.path.sampling_normal);
        let choice = choose_light(&scene.tables, surface.origin, normal, u)?;
        let mut light =
            sample_one_light(scene, choice.index, surface.origin, [choice.remainder, u.y], MOTION_MIDDLE);
        light.pdf *= choice.probability;
        let mut record =
            light_record(choice.index, scene.tables.lights[choice.index as usize].light.kind, &light);
        let transmits = closure_transmits(*closure);
        let side = light_side(light.wi, light.pdf, closure.frame, surface.horizon, transmits);
        if !side.possible {
            return Some(record);
        }
        let value = closure_eval(*closure, wo, side.wi);
        let throughput = walk.path.throughput;
        let mis = self.context.mis();
        let brings = path_light_contribution(throughput, value, light.radiance, light.pdf, light.delta, mis);
        record.scattering = value.value_cos.to_array();
        record.scattering_pdf = value.pdf;
        record.weight = if light.delta { 1.0 } else { light_sample_weight(mis, light.pdf, value.pdf) };
        // Not `> 0`: NaN must reach the film, where it is counted.
        record.visibility = if brings.x + brings.y + brings.z == 0.0 {
            LightVisibility::Dark
        } else if self.occluded(&shadow_ray(surface, &light, side.above)) {
            LightVisibility::Occluded
        } else {
            walk.radiance += brings;
            record.contribution = brings.to_array();
            LightVisibility::Visible
        };
        Some(record)
    }

    /// What the path finds infinitely far away.
    fn distant(&self, walk: &Walk) -> Vec<FoundLight> {
        let (ray, path) = (&walk.ray, &walk.path);
        let mut found = Vec::new();
        let (from, wi) = (vec3(ray.origin), vec3(ray.direction));
        for_each_distant(self.context.scene, from, path.sampling_normal, wi, MOTION_MIDDLE, |d| {
            found.push(found_light(&path.state(self.context.depth), d.radiance, d.pdf, self.context.mis()));
        });
        found
    }

    /// A vertex at the end of the path's ray.
    fn vertex(&self, walk: &Walk, place: VertexPlace, distance: f32, found: Vec<FoundLight>) -> VertexRecord {
        VertexRecord {
            depth: self.context.depth,
            place,
            distance,
            direction: walk.ray.direction,
            throughput: walk.path.throughput.to_array(),
            found,
            light_sample: None,
            scattering: None,
        }
    }

    /// What the path's ray hits.
    fn closest(&mut self, walk: &Walk) -> Hit {
        self.rays += 1;
        let scene = self.context.scene;
        let Segment { paths, hits, .. } = &mut self.segment;
        paths.clear();
        paths.push(vec3(walk.ray.origin), vec3(walk.ray.direction), &walk.path);
        let (rays, mut columns) = (paths.rays(&[]), hits.columns(1));
        if scene.tables.has_alpha {
            scene.tlas.closest_stream(&rays, &mut columns, &AlphaFilter(scene), Coherence::Incoherent);
        } else {
            scene.tlas.closest_stream(&rays, &mut columns, &Opaque, Coherence::Incoherent);
        }
        self.segment.hits.get(0)
    }

    /// The surface at the end of the segment that [`Follower::closest`] has followed.
    fn surface(&mut self, ray: &Ray, hit: &Hit) -> Surface {
        let mut surface = None;
        let segment = &mut self.segment;
        call_with_best(FindSurface { segment, queries: self.queries, surface: &mut surface });
        surface.unwrap_or_else(|| Surface::new(self.context.scene, ray, hit, MOTION_MIDDLE))
    }

    fn occluded(&mut self, ray: &Ray) -> bool {
        self.rays += 1;
        let mut hit = [false];
        self.queries.any_stream(&[*ray], &mut hit, Coherence::Incoherent);
        hit[0]
    }
}

impl Walk {
    /// Writes something down of the vertex that the path is at.
    fn note(&mut self, write: impl FnOnce(&mut VertexRecord)) {
        if let Some(vertex) = self.vertices.last_mut() {
            write(vertex);
        }
    }

    /// As `PathBatch::limit_found`.
    fn limit_found(&mut self, settings: &PathSettings, segments: u32) {
        if settings.clamp_indirect.is_none() {
            return;
        }
        let found = self.radiance - self.gathered;
        let limited = limit_indirect(found, segments, settings.most_indirect());
        if limited != found {
            self.radiance = self.gathered + limited;
        }
        self.gathered = self.radiance;
    }
}
