//! Scattering of paths one by one, at whatever surface.

use crate::batch::streams::{Connection, Path};
use crate::batch::vertices::PlainPoint;
use crate::fetch::surface::Surface;
use crate::guided::vertex::GuidedVertex;
use crate::shade::closures::{Incoming, layers_at, wants_model_number};
use crate::shade::features::Continuation;
use crate::shade::lights::sample_light;
use crate::shade::material::{base_color, shade};
use crate::shade::path_batch::{Context, PathBatch};
use crate::shade::scattering::Scattering;
use crate::shade::stages::ScatterDiffuse;
use crate::simd::Instructions;
use accel::Ray;
use optics::frame::{Frame, to_local, to_world};
use optics::light::LightSample;
use optics::light_tree::{ALL_SIDES, sampling_normal};
use optics::path::path_light_contribution;
use optics::scatter::{BSDF_NONE, BsdfSample};
use optics::vector::dot;
use optics::vertex::{
    PAIR_BSDF, PAIR_LIGHT, PAIR_LOBE, PAIR_MODEL, continue_from_surface, leaves_surface, light_side,
    shadow_way,
};
use optics::{Vec3f, vec2f};
use scene::tables::{ModelTag, SceneTables};

impl PathBatch {
    /// Next-event estimation and the path's continuation at a surface. Tells how it goes on.
    #[inline(always)]
    pub(crate) fn scatter<I: Instructions>(
        &mut self,
        i: I,
        context: &Context,
        surface: &Surface,
        path: Path,
        footprint: f32,
    ) -> Continuation {
        let tables = &*context.scene.tables;
        let material = &tables.materials[surface.material as usize];
        if material.model == ModelTag::Lambert {
            let albedo = base_color(tables, material, surface, footprint);
            let point = PlainPoint {
                position: surface.origin,
                clearance: surface.clearance,
                normal: surface.horizon,
                shading_normal: surface.shading_normal,
                color: albedo,
                wo: surface.wo,
                eta: 1.0,
                binding: 0,
            };
            self.diffuse.push(&point, &path);
            if self.diffuse.is_full() {
                i.call(ScatterDiffuse(self, context));
            }
            return Continuation::Other;
        }
        if material.model == ModelTag::Layered {
            return self.scatter_layered(context, surface, path, footprint);
        }
        // Numbers are drawn only where something depends on them: they cost as much as the rest of the shading.
        let wants_number = wants_model_number(tables, material);
        let u_model = if wants_number { context.draw(&path, PAIR_MODEL).x } else { 0.0 };
        let bsdf = shade(tables, material, surface, &context.shading, footprint, material.ior, u_model);
        if bsdf.kind == BSDF_NONE {
            return Continuation::Other;
        }
        self.scatter_by(context, surface, surface.frame(), bsdf, path)
    }

    /// As above, on a surface with layers. Out of line: plain surfaces pay nothing for it.
    #[inline(never)]
    fn scatter_layered(
        &mut self,
        context: &Context,
        surface: &Surface,
        path: Path,
        footprint: f32,
    ) -> Continuation {
        let tables = &*context.scene.tables;
        let material = &tables.materials[surface.material as usize];
        let wants_number = wants_model_number(tables, material);
        let u_model = if wants_number { context.draw(&path, PAIR_MODEL).x } else { 0.0 };
        let incoming = Incoming { footprint, ior: material.ior, throughput: path.throughput, u_model };
        let layers = layers_at(tables, material, surface, &context.shading, incoming);
        self.scatter_by(context, surface, layers.frame, layers, path)
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
    ) -> Continuation {
        let tables = &*context.scene.tables;
        let wo = to_local(frame, surface.wo);
        let smooth = bsdf.has_smooth_part();
        let guided = if smooth { context.guided_at(surface.origin) } else { None };
        if smooth && !tables.lights.is_empty() {
            path.sampling_normal = normal_for_lights(tables, bsdf, frame.normal);
            self.add_connection(context, surface, &frame, bsdf, wo, &path, guided);
        }
        let zero = vec2f(0.0, 0.0);
        let wants_lobe = context.meets_roulette() || bsdf.has_lobes() || guided.is_some();
        let u_lobe = if wants_lobe { context.draw(&path, PAIR_LOBE) } else { zero };
        let u = if bsdf.is_delta() { zero } else { context.draw(&path, PAIR_BSDF) };
        let mut state = path.state(context.depth);
        let sample = match guided {
            None => bsdf.sample(wo, u_lobe.x, u),
            Some(guided) => {
                let by_both = guided.sample(bsdf, frame, wo, u_lobe.x, u);
                state.eta_scale *= by_both.survival();
                if context.learns() && leaves(&by_both.sample, frame, surface) {
                    let wi = to_world(frame, by_both.sample.wi);
                    by_both.note(&guided, path.slot, path.throughput, wi, &mut self.finds);
                }
                by_both.sample
            }
        };
        let next = continue_from_surface(
            state,
            sample,
            frame,
            surface.horizon,
            bsdf.eta(),
            context.roulette(),
            u_lobe.y,
        );
        if !next.alive {
            return Continuation::Other;
        }
        path = path.with_state(&next.state);
        self.next.push(surface.ray_origin(next.above), next.wi, &path);
        if bsdf.is_sharp() { Continuation::Sharp(path.throughput) } else { Continuation::Other }
    }

    /// Samples a light and queues the shadow ray, if the light could contribute.
    #[inline(always)]
    fn add_connection<S: Scattering>(
        &mut self,
        context: &Context,
        surface: &Surface,
        frame: &Frame,
        bsdf: S,
        wo: Vec3f,
        path: &Path,
        guided: Option<GuidedVertex>,
    ) {
        let u = context.draw(path, PAIR_LIGHT);
        let (normal, time) = (path.sampling_normal, self.time_of(path.slot));
        let sample = sample_light(context.scene, surface.origin, normal, u, time);
        let Some(light) = &sample else { return };
        let side = light_side(light.wi, light.pdf, *frame, surface.horizon, bsdf.transmits());
        if !side.possible {
            return;
        }
        let value = bsdf.eval(wo, side.wi);
        let value = guided.map_or(value, |guided| guided.value(value, light.wi));
        let LightSample { radiance, pdf, delta, .. } = *light;
        let contribution =
            path_light_contribution(path.throughput, value, radiance, pdf, delta, context.mis());
        self.ask(Connection { slot: path.slot, contribution }, shadow_ray(surface, light, side.above));
    }
}

/// Whether a path goes where a direction was sampled.
#[inline(always)]
fn leaves(sample: &BsdfSample, frame: Frame, surface: &Surface) -> bool {
    leaves_surface(*sample, dot(to_world(frame, sample.wi), surface.horizon) > 0.0)
}

/// What the choice of a light is to know of a surface of unit `normal`; nothing where it does not ask.
#[inline(always)]
pub(crate) fn normal_for_lights<S: Scattering>(tables: &SceneTables, bsdf: S, normal: Vec3f) -> u32 {
    if tables.light_tree.is_empty() { ALL_SIDES } else { sampling_normal(normal, bsdf.transmits()) }
}

/// The ray from a surface to a light sample; `above`: on the side of the surface's normal.
#[inline(always)]
pub(crate) fn shadow_ray(surface: &Surface, light: &LightSample, above: bool) -> Ray {
    let origin = surface.ray_origin(above);
    let way = shadow_way(light.wi, light.distance, origin - surface.origin);
    Ray { origin: origin.to_array(), t_min: 0.0, direction: way.direction.to_array(), t_max: way.distance }
}
