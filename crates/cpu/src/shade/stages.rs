//! What happens to vertices that have waited until the lanes were full.
//!
//! What [`PathBatch::scatter`] does at one vertex, these stages do at sixteen. Lanes without a vertex compute something that nobody
//! reads.

use crate::batch::samples::time_of;
use crate::batch::streams::{PathStream, ShadowStream};
use crate::batch::vertices::VertexQueue;
use crate::guided::lanes::{GuidedLanes, GuidedLobes};
use crate::shade::light_lanes::sample_lights;
use crate::shade::path_batch::{Context, PathBatch};
use crate::shade::scatter_lanes::{
    CosineLobes, Lobes, play_roulette, sample_cosine_lobes, sample_smooth_interfaces,
};
use crate::simd::{Instructions, Stage};
use optics::vertex::{PAIR_BSDF, PAIR_LIGHT, PAIR_LOBE};

/// Scatters the diffuse vertices that are waiting, at most sixteen.
pub(crate) struct ScatterDiffuse<'a, 'c>(pub &'a mut PathBatch, pub &'a Context<'c>);

/// The same for smooth interfaces, which no light can be sampled for.
pub(crate) struct ScatterSmooth<'a, 'c>(pub &'a mut PathBatch, pub &'a Context<'c>);

/// The same for glossy vertices.
pub(crate) struct ScatterGlossy<'a, 'c>(pub &'a mut PathBatch, pub &'a Context<'c>);

impl Stage for ScatterDiffuse<'_, '_> {
    #[inline(always)]
    fn run<I: Instructions>(self, i: I) {
        let ScatterDiffuse(batch, context) = self;
        let queue = &mut batch.diffuse;
        queue.find_above();
        let mut guided = guided_lanes(context, queue);
        connect_lights(i, context, queue, &CosineLobes, &guided, &batch.times, &mut batch.shadows);
        queue.draw(context.sampler_kind, context.pair() + PAIR_BSDF);
        sample_cosine_lobes(&queue.vertices, &queue.above, &queue.u, &mut queue.next);
        if context.meets_roulette() || guided.is_some() {
            queue.draw_lobes(context.sampler_kind, context.pair() + PAIR_LOBE);
        }
        if let Some(guided) = &mut guided {
            guided.choose(&mut queue.u_lobe);
            guided.redirect(&CosineLobes, queue, context.learns().then_some(&mut batch.finds));
        }
        go_on(i, context, queue, &mut batch.next);
    }
}

impl Stage for ScatterSmooth<'_, '_> {
    #[inline(always)]
    fn run<I: Instructions>(self, i: I) {
        let ScatterSmooth(batch, context) = self;
        let queue = &mut batch.smooth;
        queue.draw_lobes(context.sampler_kind, context.pair() + PAIR_LOBE);
        sample_smooth_interfaces(&queue.vertices, &queue.u_lobe, &mut queue.next);
        go_on(i, context, queue, &mut batch.next);
    }
}

impl Stage for ScatterGlossy<'_, '_> {
    #[inline(always)]
    fn run<I: Instructions>(self, i: I) {
        let ScatterGlossy(batch, context) = self;
        let (queue, glossy) = (&mut batch.glossy, &mut batch.glossy_lanes);
        queue.find_above();
        glossy.prepare(i, context.scene, &queue.vertices, queue.waiting(), context.shading.single_scatter);
        let mut guided = guided_lanes(context, queue);
        connect_lights(i, context, queue, glossy, &guided, &batch.times, &mut batch.shadows);
        queue.draw_lobes(context.sampler_kind, context.pair() + PAIR_LOBE);
        if let Some(guided) = &mut guided {
            guided.choose(&mut queue.u_lobe);
        }
        queue.draw(context.sampler_kind, context.pair() + PAIR_BSDF);
        glossy.sample(&queue.vertices, &queue.above, &queue.u_lobe, &queue.u, &mut queue.next);
        if let Some(guided) = &guided {
            guided.redirect(glossy, queue, context.learns().then_some(&mut batch.finds));
        }
        go_on(i, context, queue, &mut batch.next);
    }
}

/// What is known of the light at the vertices that are waiting; `None` where paths do not follow a guide.
#[inline(always)]
fn guided_lanes<'a>(context: &Context<'a>, queue: &VertexQueue) -> Option<GuidedLanes<'a>> {
    let guide = context.scene.guide.as_deref()?;
    Some(GuidedLanes::find(guide, &queue.vertices, queue.waiting()))
}

/// Next-event estimation.
#[inline(always)]
fn connect_lights<I: Instructions>(
    i: I,
    context: &Context,
    queue: &mut VertexQueue,
    lobes: &impl Lobes,
    guided: &Option<GuidedLanes>,
    times: &[f32],
    shadows: &mut ShadowStream,
) {
    if context.scene.tables.lights.is_empty() {
        return;
    }
    let waiting = queue.waiting();
    queue.draw(context.sampler_kind, context.pair() + PAIR_LIGHT);
    let slots = *queue.paths().slot;
    let time = |lane: usize| time_of(times, slots[lane]);
    sample_lights(i, context.scene, &mut queue.vertices, waiting, &queue.u, time, &mut queue.lights);
    let (v, mis) = (&queue.vertices, context.mis());
    match guided {
        None => queue.connections.compute(v, &queue.above, &queue.lights, lobes, mis),
        Some(guided) => {
            queue.connections.compute(v, &queue.above, &queue.lights, &GuidedLobes(lobes, guided), mis)
        }
    }
    let asking = queue.connections.asking(i, waiting);
    shadows.append(i, asking, &queue.connections, queue.paths());
}

/// Lets the paths go on that live. Where roulette is played, numbers for it have been drawn.
#[inline(always)]
fn go_on<I: Instructions>(i: I, context: &Context, queue: &mut VertexQueue, next: &mut PathStream) {
    if context.meets_roulette() {
        play_roulette(&queue.u_lobe, context.depth, context.settings, &mut queue.next);
    }
    next.append(i, queue.next.alive(i, queue.waiting()), &queue.next, queue.paths());
    queue.advance();
}
