//! Path tracing through media, one sample after the other.
//!
//! What `path` does, for scenes with something between the surfaces. A path knows what it is inside of. On its way to the
//! next surface it may scatter in the medium there, and boundaries of media let it pass without counting as vertices.
//! Light is sampled from every vertex, with the transmittance of the way to it.

mod gather;
mod grid;
pub(crate) mod interiors;
mod optical_depth;
mod photons;
mod shadow;

pub(crate) use interiors::{crossed, interiors_around, ior_along, passes, relative_ior, segment};
pub(crate) use optical_depth::optical_depth;

use crate::batch::samples::{SampleId, new_sampler, ray_time};
use crate::fetch::filter::{AlphaFilter, BoundaryFilter};
use crate::fetch::surface::Surface;
use crate::photons::PhotonMap;
use crate::scene::{CpuScene, vec3};
use crate::shade::aov::aov_sample;
use crate::shade::closures::{Incoming, closure_at, wants_model_number};
use crate::shade::lights::{for_each_distant, sample_light, surface_light_pdf};
use crate::shade::material::{Shading, emission};
use crate::shade::path_batch::roulette;
use crate::shade::scatter::{normal_for_lights, shadow_ray};
use accel::{Hit, Ray};
use backend::{PathSettings, View};
use film::AovSample;
use interiors::Segment;
use optics::camera::{camera_pixel_spread, camera_ray};
use optics::closure::{
    Closure, closure_eta, closure_eval, closure_has_smooth_part, closure_is_delta, closure_is_sharp,
    closure_sample, closure_scatters, closure_transmits,
};
use optics::constants::FAR;
use optics::frame::to_local;
use optics::interiors::Interiors;
use optics::light_tree::ALL_SIDES;
use optics::medium::transmittance;
use optics::mis::MisHeuristic;
use optics::motion::MOTION_MIDDLE;
use optics::path::{PathState, limit_indirect, path_add_emission, path_light_contribution, path_start};
use optics::random::{PixelSampler, hash_combine, sample_2d};
use optics::vertex::{
    PAIR_BSDF, PAIR_FILM, PAIR_LENS, PAIR_LIGHT, PAIR_LOBE, PAIR_MODEL, SHADOW_END, continue_from_surface,
    light_side, path_branch,
};
use optics::volume::{
    MOST_SEGMENTS, PAIR_DISTANCE, STREAM_SHADOW, continue_in_medium, medium_emitted, medium_extinction,
    medium_sample, medium_scatters, phase_scatter, phase_value, segment_pair, stopping_distance,
    stream_start,
};
use optics::{Vec2f, Vec3f, vec2f, vec3f};
use scene::tables::{MaterialRecord, NONE};

const BLACK: Vec3f = vec3f(0.0, 0.0, 0.0);
const WHITE: Vec3f = vec3f(1.0, 1.0, 1.0);

/// Makes single samples of the scene with its media.
pub(crate) struct VolumeTracer<'a> {
    scene: &'a CpuScene,
    view: &'a View,
    settings: &'a PathSettings,
    shading: Shading,
    /// Photons that paths gather, if the view wants caustics from them.
    photons: Option<&'a PhotonMap>,
    /// What the camera stands in.
    around_camera: Interiors,
    /// Radiance of the sample that is being made.
    radiance: Vec3f,
    /// Rays traced so far.
    pub rays_traced: u64,
}

/// A path on its way.
#[derive(Clone, Copy)]
struct VolumePath {
    ray: Ray,
    state: PathState,
    sampler: PixelSampler,
    /// When it leaves the camera, see [`ray_time`].
    time: f32,
    inside: Interiors,
    /// Segments so far, whatever they ended at.
    segments: u32,
    /// Where the path took its direction, and how far it has come since then.
    vertex: Vec3f,
    since_vertex: f32,
    /// Length from the camera, for footprints.
    length: f32,
    /// See `sample_light`.
    sampling_normal: u32,
    /// Since the last vertex where photons were gathered: `expected_photons`, per étendue here; 0 without such a vertex.
    merge: f32,
    /// Whether it has been scattered by specular surfaces since then.
    by_specular: bool,
}

impl VolumePath {
    /// Random numbers of the current segment and the vertex at its end.
    fn draw(&self, pair: u32) -> Vec2f {
        sample_2d(self.sampler, segment_pair(self.segments) + pair)
    }

    /// Goes on from `origin` after scattering at `vertex`.
    fn leave(&mut self, vertex: Vec3f, origin: Vec3f, wi: Vec3f) {
        self.ray = Ray::new(origin.to_array(), wi.to_array());
        (self.vertex, self.since_vertex) = (vertex, 0.0);
    }
}

/// What a path scatters at.
enum Vertex<'s> {
    Surface(&'s Surface),
    /// A point of the medium of a segment.
    Medium(Vec3f, Segment),
}

impl<'a> VolumeTracer<'a> {
    pub fn new(
        scene: &'a CpuScene,
        view: &'a View,
        settings: &'a PathSettings,
        photons: Option<&'a PhotonMap>,
    ) -> Self {
        let pixel_spread = camera_pixel_spread(view.camera, view.height as f32);
        Self {
            scene,
            view,
            settings,
            shading: Shading { single_scatter: view.single_scatter, pixel_spread },
            photons,
            around_camera: interiors_around(scene, view.camera.origin, MOTION_MIDDLE),
            radiance: BLACK,
            rays_traced: 0,
        }
    }

    /// The radiance of one sample.
    pub fn sample(&mut self, id: &SampleId) -> Vec3f {
        self.radiance = BLACK;
        let (ray, sampler, time, weight) = self.camera(id);
        if self.scene.tables.motion.is_some() || self.view.camera_moves() {
            self.around_camera = interiors_around(self.scene, vec3(ray.origin), time);
        }
        self.follow(VolumePath {
            ray,
            state: PathState { throughput: WHITE * weight, ..path_start() },
            sampler,
            time,
            inside: self.around_camera,
            segments: 0,
            vertex: vec3(ray.origin),
            since_vertex: 0.0,
            length: 0.0,
            sampling_normal: ALL_SIDES,
            merge: 0.0,
            by_specular: false,
        });
        self.radiance
    }

    /// The first surface that the sample's camera ray sees, behind all media.
    pub fn first_hit(&mut self, id: &SampleId) -> AovSample {
        let (ray, _, time, _) = self.camera(id);
        self.rays_traced += 1;
        let hit = self.scene.tlas.closest_at(&ray, time, &AlphaFilter(self.scene));
        if hit.is_miss() {
            return AovSample::default();
        }
        let surface = Surface::new(self.scene, &ray, &hit, time);
        let footprint = self.shading.pixel_spread * hit.t;
        aov_sample(&self.scene.tables, self.material(&surface), &surface, hit.t, footprint)
    }

    /// The camera ray of a sample, its random numbers, its time, and the ray's weight.
    fn camera(&self, id: &SampleId) -> (Ray, PixelSampler, f32, f32) {
        let sampler = new_sampler(self.view, id);
        let (jitter, lens) = (sample_2d(sampler, PAIR_FILM), sample_2d(sampler, PAIR_LENS));
        let film = vec2f(
            (id.x as f32 + jitter.x) / self.view.width as f32,
            (id.y as f32 + jitter.y) / self.view.height as f32,
        );
        let time = ray_time(self.view, sampler, id);
        let ray = camera_ray(self.view.camera_at(time), film, lens);
        (Ray::new(ray.origin.to_array(), ray.direction.to_array()), sampler, time, ray.weight)
    }

    fn closest(&mut self, ray: &Ray, time: f32) -> Hit {
        self.rays_traced += 1;
        self.scene.tlas.closest_at(ray, time, &BoundaryFilter(self.scene))
    }

    fn material(&self, surface: &Surface) -> &'a MaterialRecord {
        &self.scene.tables.materials[surface.material as usize]
    }

    /// Follows a path to its end.
    fn follow(&mut self, mut path: VolumePath) {
        while path.segments < MOST_SEGMENTS {
            path.segments += 1;
            let hit = self.closest(&path.ray, path.time);
            let surface = (!hit.is_miss()).then(|| Surface::new(self.scene, &path.ray, &hit, path.time));
            let end = if hit.is_miss() { FAR } else { hit.t };
            let segment = segment(path.inside, &self.scene.tables, &path.ray, end, surface.as_ref());
            let scattered = segment.and_then(|segment| self.pass(&mut path, &segment));
            if let Some(vertex) = &scattered {
                if !self.scatter(&mut path, vertex) {
                    return;
                }
                continue;
            }
            let Some(surface) = surface else {
                let wi = vec3(path.ray.direction);
                let (mut found, mis) = (BLACK, self.settings.mis.heuristic());
                for_each_distant(self.scene, path.vertex, path.sampling_normal, wi, path.time, |d| {
                    let chance = self.chance(&path, || self.density_of_distant(&path, d.light, wi));
                    found += path.found(d.radiance, d.pdf, mis, chance);
                });
                self.gather(found, path.state.depth);
                return;
            };
            path.since_vertex += hit.t;
            path.length += hit.t;
            if passes(&self.scene.tables, &surface, path.inside) {
                path.inside = crossed(path.inside, &self.scene.tables, &surface);
                path.ray.origin = surface.ray_origin(false).to_array();
                continue;
            }
            self.find(&path, &surface);
            if !self.scatter(&mut path, &Vertex::Surface(&surface)) {
                return;
            }
        }
    }

    /// Goes through a medium: adds what it emits, and returns where the path scatters in it, if it does.
    fn pass(&mut self, path: &mut VolumePath, segment: &Segment) -> Option<Vertex<'static>> {
        let Segment { medium, start, end, .. } = *segment;
        if segment.grid != NONE {
            let (distance, here) = self.track(path, segment)?;
            return Some(stop(path, distance, here));
        }
        let state = &mut path.state;
        self.radiance += state.throughput * medium_emitted(medium, end - start);
        if !medium_scatters(medium) {
            state.throughput *= transmittance(medium_extinction(medium), end - start);
            return None;
        }
        let u = path.draw(PAIR_DISTANCE);
        let sample = medium_sample(medium, path.state.throughput, end - start, u);
        path.state.throughput *= sample.weight;
        if !sample.scattered {
            return None;
        }
        Some(stop(path, start + sample.distance, *segment))
    }

    /// Light that the path has come upon.
    fn find(&mut self, path: &VolumePath, surface: &Surface) {
        let tables = &*self.scene.tables;
        let footprint = self.shading.pixel_spread * path.length;
        let emitted = emission(tables, self.material(surface), surface, footprint);
        if emitted.x + emitted.y + emitted.z > 0.0 {
            let wi = vec3(path.ray.direction);
            let pdf = surface_light_pdf(
                self.scene,
                surface,
                path.vertex,
                path.sampling_normal,
                wi,
                path.since_vertex,
                path.time,
            );
            let mis = self.settings.mis.heuristic();
            let chance = self.chance(path, || self.density_of_surface(surface));
            let found = path.found(emitted, pdf, mis, chance);
            self.gather(found, path.state.depth);
        }
    }

    /// Adds light that has come by so many segments, limited as the settings say.
    fn gather(&mut self, found: Vec3f, segments: u32) {
        self.radiance += limit_indirect(found, segments, self.settings.most_indirect());
    }

    /// Scatters the path, in several if it is the first vertex and the settings say so. Returns whether it goes on.
    fn scatter(&mut self, path: &mut VolumePath, vertex: &Vertex) -> bool {
        let walks = matches!(vertex, Vertex::Medium(_, segment) if segment.subsurface);
        if path.state.depth >= self.settings.max_depth && !walks {
            return false;
        }
        let branches = if path.state.depth == 1 && !walks { self.settings.splitting.max(1) } else { 1 };
        if branches == 1 {
            return self.scatter_once(path, vertex);
        }
        path.state = path_branch(path.state, branches);
        for branch in 0..branches {
            let mut child = *path;
            child.sampler.scramble = hash_combine(path.sampler.scramble, branch);
            if self.scatter_once(&mut child, vertex) {
                self.follow(child);
            }
        }
        false
    }

    fn scatter_once(&mut self, path: &mut VolumePath, vertex: &Vertex) -> bool {
        match vertex {
            Vertex::Medium(position, segment) => self.scatter_in(path, *position, segment),
            Vertex::Surface(surface) => self.scatter_on(path, surface),
        }
    }

    /// Next-event estimation and the path's continuation at a point of a medium.
    ///
    /// Inside of what looks like a surface that is a step of a random walk, which does not count as a vertex. Where that
    /// surface hides all lights, none is sampled, and what the path finds counts in full.
    fn scatter_in(&mut self, path: &mut VolumePath, position: Vec3f, segment: &Segment) -> bool {
        let wo = -vec3(path.ray.direction);
        let anisotropy = segment.medium.anisotropy;
        let hidden = segment.subsurface && !segment.open;
        let walk = if segment.subsurface { path.segments } else { 0 };
        if !hidden {
            path.sampling_normal = ALL_SIDES;
            self.light_in(path, position, wo, anisotropy, path.state.depth.max(walk));
        }
        // In media no photons are gathered.
        path.merge = 0.0;
        let sample = phase_scatter(wo, anisotropy, hidden, path.draw(PAIR_BSDF));
        let u = path.draw(PAIR_LOBE).y;
        let next = continue_in_medium(path.state, sample, walk, roulette(self.settings), u);
        path.state = next.state;
        path.leave(position, position, next.wi);
        next.alive
    }

    /// Next-event estimation at a point of a medium. `depth`: of the path for limits of indirect light.
    fn light_in(&mut self, path: &VolumePath, position: Vec3f, wo: Vec3f, anisotropy: f32, depth: u32) {
        if self.scene.tables.lights.is_empty() {
            return;
        }
        let u = path.draw(PAIR_LIGHT);
        let Some(light) = sample_light(self.scene, position, ALL_SIDES, u, path.time) else { return };
        let phase = phase_value(wo, light.wi, anisotropy);
        let ray = Ray {
            origin: position.to_array(),
            t_min: 0.0,
            direction: light.wi.to_array(),
            t_max: light.distance * SHADOW_END,
        };
        let (throughput, mis) = (path.state.throughput, self.settings.mis.heuristic());
        let c = path_light_contribution(throughput, phase, light.radiance, light.pdf, light.delta, mis);
        self.connect(path, ray, path.inside, c, depth);
    }

    /// The same on a surface.
    fn scatter_on(&mut self, path: &mut VolumePath, surface: &Surface) -> bool {
        let tables = &*self.scene.tables;
        let material = self.material(surface);
        let closure = self.closure_at(path, surface, material);
        if !closure_scatters(closure) {
            return false;
        }
        let through = if material.is_body() { crossed(path.inside, tables, surface) } else { path.inside };
        let wo = to_local(closure.frame, surface.wo);
        if self.photons.is_some() && !closure_is_sharp(closure) {
            self.gather_photons(path, surface, &closure, wo);
        }
        let samples_lights = closure_has_smooth_part(closure) && !self.photons_bring_lights(path, &closure);
        if samples_lights && !tables.lights.is_empty() {
            path.sampling_normal = normal_for_lights(tables, closure, closure.frame.normal);
            self.light_on(path, surface, &closure, wo, through);
        }
        let u_lobe = path.draw(PAIR_LOBE);
        let u = if closure_is_delta(closure) { vec2f(0.0, 0.0) } else { path.draw(PAIR_BSDF) };
        let sample = closure_sample(closure, wo, u_lobe.x, u);
        let (frame, eta, chance) = (closure.frame, closure_eta(closure), roulette(self.settings));
        let next = continue_from_surface(path.state, sample, frame, surface.horizon, eta, chance, u_lobe.y);
        if !next.alive {
            return false;
        }
        path.state = next.state;
        self.note_scattering(path, surface, &closure, &sample, next.wi);
        if sample.transmitted {
            path.inside = through;
        }
        path.leave(surface.origin, surface.ray_origin(next.above), next.wi);
        true
    }

    /// What scatters at a surface where a path arrives.
    fn closure_at(&self, path: &VolumePath, surface: &Surface, material: &MaterialRecord) -> Closure {
        let tables = &*self.scene.tables;
        let nested = tables.nested && material.is_body();
        let ior = if nested { relative_ior(path.inside, tables, surface) } else { material.ior };
        let footprint = self.shading.pixel_spread * path.length;
        let wants_number = wants_model_number(tables, material);
        let u_model = if wants_number { path.draw(PAIR_MODEL).x } else { 0.0 };
        let incoming = Incoming { footprint, ior, throughput: path.state.throughput, u_model };
        closure_at(tables, material, surface, &self.shading, incoming)
    }

    /// Next-event estimation on a surface. `through`: what is behind it.
    fn light_on(
        &mut self,
        path: &VolumePath,
        surface: &Surface,
        closure: &Closure,
        wo: Vec3f,
        through: Interiors,
    ) {
        let u = path.draw(PAIR_LIGHT);
        let (normal, time) = (path.sampling_normal, path.time);
        let Some(light) = sample_light(self.scene, surface.origin, normal, u, time) else { return };
        let transmits = closure_transmits(*closure);
        let side = light_side(light.wi, light.pdf, closure.frame, surface.horizon, transmits);
        if !side.possible {
            return;
        }
        let value = closure_eval(*closure, wo, side.wi);
        let (throughput, mis) = (path.state.throughput, self.settings.mis.heuristic());
        let c = path_light_contribution(throughput, value, light.radiance, light.pdf, light.delta, mis);
        let inside = if side.above { path.inside } else { through };
        self.connect(path, shadow_ray(surface, &light, side.above), inside, c, path.state.depth);
    }

    /// Adds what a light sample brings through what is between. `depth`: of the path for limits of indirect light.
    fn connect(&mut self, path: &VolumePath, ray: Ray, inside: Interiors, contribution: Vec3f, depth: u32) {
        // Not `> 0`: NaN must reach the film, where it is counted.
        if contribution.x + contribution.y + contribution.z != 0.0 {
            let mut stream = stream_start(path.sampler, path.segments, STREAM_SHADOW);
            let left = self.visibility(ray, path.time, inside, &mut stream);
            self.radiance += limit_indirect(contribution, depth + 1, self.settings.most_indirect()) * left;
        }
    }
}

/// The point of a segment at `distance` along the path's ray.
fn stop(path: &mut VolumePath, distance: f32, segment: Segment) -> Vertex<'static> {
    let (origin, direction) = (vec3(path.ray.origin), vec3(path.ray.direction));
    let distance = stopping_distance(origin, distance, segment.end);
    path.length += distance;
    Vertex::Medium(origin + direction * distance, segment)
}

impl VolumePath {
    /// The state without the light found so far, which goes to the sample at once.
    fn light_state(&self) -> PathState {
        PathState { radiance: BLACK, ..self.state }
    }

    /// What light adds that the path has come upon.
    ///
    /// - `emitted`, `light_pdf`: see [`path_add_emission`]. `chance`: see [`VolumeTracer::chance`]; what photons bring, too,
    ///   is not sampled at specular surfaces.
    fn found(&self, emitted: Vec3f, light_pdf: f32, mis: MisHeuristic, chance: Option<f32>) -> Vec3f {
        let pdf = if chance.is_some() { 0.0 } else { light_pdf };
        path_add_emission(self.light_state(), emitted, pdf, mis).radiance * chance.unwrap_or(1.0)
    }
}
