//! Where paths arrive: what they find there, and who is to scatter them.

use crate::batch::lanes::{ALL_LANES, LANES};
use crate::batch::streams::Path;
use crate::fetch::hit_records::ShadingClass;
use crate::fetch::surface::Surface;
use crate::scene::vec3;
use crate::shade::aov::aov_sample;
use crate::shade::features::Continuation;
use crate::shade::lights::{for_each_distant, surface_light_pdf};
use crate::shade::material::emission;
use crate::shade::path_batch::{Context, PathBatch};
use crate::shade::stages::{ScatterDiffuse, ScatterGlossy, ScatterSmooth};
use crate::simd::{Instructions, Stage};
use optics::Vec3f;
use optics::medium::transmittance;
use optics::path::path_add_emission;
use optics::random::hash_combine;
use optics::vertex::path_branch;

/// All paths arrive where their rays have hit, and those that go on leave.
pub(crate) struct ShadeHits<'a, 'c>(pub &'a mut PathBatch, pub &'a Context<'c>);

impl Stage for ShadeHits<'_, '_> {
    #[inline(always)]
    fn run<I: Instructions>(self, i: I) {
        let ShadeHits(batch, context) = self;
        batch.shade_misses(i, context);
        let count = batch.paths.len();
        batch.triangles.begin(i, context.scene, &batch.hits, count);
        for first in (0..count).step_by(LANES) {
            batch.shade_hits(i, context, first, count);
        }
        if batch.diffuse.waiting() > 0 {
            i.call(ScatterDiffuse(batch, context));
        }
        if batch.smooth.waiting() > 0 {
            i.call(ScatterSmooth(batch, context));
        }
        if batch.glossy.waiting() > 0 {
            i.call(ScatterGlossy(batch, context));
        }
    }
}

impl PathBatch {
    /// Everything that happens where the row of paths from `first` on arrives, of `count` in all.
    #[inline(always)]
    fn shade_hits<I: Instructions>(&mut self, i: I, context: &Context, first: usize, count: usize) {
        self.triangles.compute(i, context.scene, &self.paths, &self.hits, &self.times, first, count);
        let triangles = self.triangles.row(first);
        let mut rest = ALL_LANES & !triangles.which(i, ShadingClass::Nothing);
        // One by one: what iterators call is not compiled for these instructions unless it happens to be inlined.
        let special = self.special_lanes(context, first, count);
        let plain = [
            !special & triangles.which(i, ShadingClass::Lambert),
            !special & triangles.which(i, ShadingClass::Smooth),
            !special & triangles.which(i, ShadingClass::Glossy),
        ];
        if context.scene.plain_sky {
            let sky = triangles.which(i, ShadingClass::Sky);
            rest &= !sky;
            self.find_plain_sky(context, sky, first);
        }
        rest &= !plain.iter().fold(0, |all, lanes| all | lanes);
        // Plain surfaces do not shine: on its last segment a path finds nothing there.
        if context.depth < context.settings.max_depth {
            self.queue_plain(i, context, plain, first);
        }
        while rest != 0 {
            self.shade_hit(i, context, first, rest.trailing_zeros() as usize);
            rest &= rest - 1;
        }
    }

    /// Which lanes of the row from `first` on, of `count` paths in all, are at vertices that are looked at, or at which paths divide,
    /// as bits. They take the way that knows of that.
    #[inline(always)]
    fn special_lanes(&self, context: &Context, first: usize, count: usize) -> u32 {
        if context.depth == 1 {
            return if context.wants_aovs || context.branches > 1 { ALL_LANES } else { 0 };
        }
        if !context.wants_features {
            return 0;
        }
        let looks = |lane: usize| self.looking[self.paths.slot.get(first + lane) as usize];
        (0..LANES.min(count - first)).fold(0, |all, lane| all | u32::from(looks(lane)) << lane)
    }

    /// Collects the vertices of some lanes by the way in which their surfaces scatter; scatters those of which the lanes are full.
    #[inline(always)]
    fn queue_plain<I: Instructions>(
        &mut self,
        i: I,
        context: &Context,
        [diffuse, smooth, glossy]: [u32; 3],
        first: usize,
    ) {
        if diffuse != 0 {
            self.diffuse.append(i, diffuse, self.triangles.row(first), &self.paths, first);
            if self.diffuse.is_full() {
                i.call(ScatterDiffuse(self, context));
            }
        }
        if smooth != 0 {
            self.smooth.append(i, smooth, self.triangles.row(first), &self.paths, first);
            if self.smooth.is_full() {
                i.call(ScatterSmooth(self, context));
            }
        }
        if glossy != 0 {
            self.glossy.append(i, glossy, self.triangles.row(first), &self.paths, first);
            if self.glossy.is_full() {
                i.call(ScatterGlossy(self, context));
            }
        }
    }

    /// What happens where the path of one lane arrives, wherever that is.
    #[inline(always)]
    fn shade_hit<I: Instructions>(&mut self, i: I, context: &Context, first: usize, lane: usize) {
        let (ray, hit) = (self.paths.ray(first + lane), self.hits.get(first + lane));
        let mut path = self.paths.path(first + lane);
        let scene = context.scene;
        let time = self.time_of(path.slot);
        if hit.is_miss() {
            for_each_distant(scene, vec3(ray.origin), path.sampling_normal, vec3(ray.direction), time, |d| {
                self.found(context, &path, d.radiance, d.pdf);
            });
            return;
        }
        let tables = &*scene.tables;
        let first_hit = context.depth == 1 && context.wants_aovs;
        let (slot, throughput) = (path.slot, path.throughput);
        path.length += hit.t;
        let in_lanes = self.triangles.row(first).surface(scene, lane, first_hit);
        let surface = in_lanes.unwrap_or_else(|| Surface::new(scene, &ray, &hit, time));
        let material = &tables.materials[surface.material as usize];
        if !surface.front && material.absorbs() {
            // The far side of a body tells what the light has come through.
            path.throughput *= transmittance(material.absorption, hit.t);
        }
        let footprint = context.shading.pixel_spread * path.length;
        if first_hit {
            self.aovs[(path.slot / context.branches) as usize] =
                aov_sample(tables, material, &surface, path.length, footprint);
        }
        let emitted = emission(tables, material, &surface, footprint);
        if emitted.x + emitted.y + emitted.z > 0.0 {
            let (from, wi) = (vec3(ray.origin), vec3(ray.direction));
            let pdf = surface_light_pdf(scene, &surface, from, path.sampling_normal, wi, hit.t, time);
            self.found(context, &path, emitted, pdf);
        }
        let continuation = self.depart(i, context, &surface, path, footprint);
        if context.wants_features && self.looking[slot as usize] {
            self.find_features(context, slot, throughput, &surface, footprint, continuation);
        }
    }

    /// Lets a path go on from a surface, in several if it is the first; tells how the first of them does.
    #[inline(always)]
    fn depart<I: Instructions>(
        &mut self,
        i: I,
        context: &Context,
        surface: &Surface,
        path: Path,
        footprint: f32,
    ) -> Continuation {
        if context.depth >= context.settings.max_depth {
            return Continuation::Other;
        }
        let branches = if context.depth == 1 { context.branches } else { 1 };
        if branches == 1 {
            return self.scatter(i, context, surface, path, footprint);
        }
        let path = path.with_state(&path_branch(path.state(context.depth), branches));
        let mut first = Continuation::Other;
        for branch in 0..branches {
            let mut child = path;
            child.scramble = hash_combine(path.scramble, branch);
            child.slot += branch;
            let continuation = self.scatter(i, context, surface, child, footprint);
            if branch == 0 {
                first = continuation;
            }
        }
        first
    }

    /// Adds light that a path has found by following its own direction; see [`path_add_emission`].
    #[inline(always)]
    fn found(&mut self, context: &Context, path: &Path, emitted: Vec3f, light_pdf: f32) {
        let sum = &mut self.radiance[path.slot as usize];
        *sum += path_add_emission(path.state(context.depth), emitted, light_pdf, context.mis()).radiance;
    }
}
