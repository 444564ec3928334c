//! Guided directions at sixteen vertices at once.
//!
//! Each walks down trees of its own, so what is guided is done one by one; the lanes have sampled their surfaces before.

use crate::batch::lanes::{LANES, Pairs};
use crate::batch::vertices::{VertexQueue, Vertices};
use crate::guided::finds::{Find, Finds};
use crate::guided::vertex::survival;
use crate::shade::scatter_lanes::Lobes;
use guiding::{Guide, GuideLeaf};
use optics::guiding::{guide_rest, guided_bsdf_sample, guided_guide_sample, guided_value};
use optics::scatter::{BsdfSample, BsdfValue};
use optics::vector::dot;
use optics::{Vec3f, vec3f};

/// What is known of the light at the vertices in the lanes.
pub(crate) struct GuidedLanes<'a> {
    guide: &'a Guide,
    leaves: [GuideLeaf; LANES],
    /// Whether the guide is followed.
    chosen: [bool; LANES],
}

impl<'a> GuidedLanes<'a> {
    /// For the first `waiting` vertices.
    #[inline(never)]
    pub fn find(guide: &'a Guide, v: &Vertices, waiting: usize) -> Self {
        let mut leaves = [GuideLeaf::default(); LANES];
        for (lane, leaf) in leaves.iter_mut().enumerate().take(waiting) {
            *leaf = guide.leaf(v.position.get(lane));
        }
        Self { guide, leaves, chosen: [false; LANES] }
    }

    /// Decides in which lanes the guide is followed, by the first of two random numbers, of which the rest is left.
    #[inline(always)]
    pub fn choose(&mut self, u: &mut Pairs) {
        for lane in 0..LANES {
            let (number, fraction) = (u.x.0[lane], self.leaves[lane].fraction);
            self.chosen[lane] = number < fraction;
            u.x.0[lane] = guide_rest(number, fraction);
        }
    }

    /// Follows the guide where it was chosen, in place of the direction that was sampled for the surface, and counts every
    /// direction as what both may sample. `finds`: for who wants to learn what the directions bring.
    #[inline(always)]
    pub fn redirect(&self, lobes: &impl Lobes, queue: &mut VertexQueue, mut finds: Option<&mut Finds>) {
        for lane in 0..queue.waiting() {
            let leaf = self.leaves[lane];
            if leaf.fraction <= 0.0 && finds.is_none() {
                continue;
            }
            let bsdf_pdf =
                if self.chosen[lane] { self.follow(lobes, queue, lane) } else { self.weigh(queue, lane) };
            let (v, next) = (&queue.vertices, &mut queue.next);
            if next.alive.0[lane] == 0 {
                continue;
            }
            next.eta_scale.0[lane] *= survival(bsdf_pdf, next.pdf.0[lane]);
            if let Some(finds) = &mut finds {
                let wi = next.wi.get(lane);
                finds.push(Find {
                    slot: v.slot.0[lane],
                    position: v.position.get(lane),
                    wi,
                    pdf: next.pdf.0[lane],
                    bsdf_pdf,
                    guide_pdf: self.guide.pdf(leaf, wi),
                    throughput: next.throughput.get(lane),
                    before: vec3f(0.0, 0.0, 0.0),
                });
            }
        }
    }

    /// Sends a lane where the guide says; returns the density of the BSDF there.
    #[inline(always)]
    fn follow(&self, lobes: &impl Lobes, queue: &mut VertexQueue, lane: usize) -> f32 {
        let leaf = self.leaves[lane];
        let guided = self.guide.sample(leaf, queue.u.get(lane));
        let (v, next) = (&queue.vertices, &mut queue.next);
        let up = v.shading_normal.get(lane);
        let above = dot(guided.wi, up) > 0.0 && dot(guided.wi, v.normal.get(lane)) > 0.0;
        let value = if above { lobes.eval(v, lane, guided.wi) } else { BLACK };
        // In the world as in the shading frame: nothing but the side counts, and it is the same for both.
        let sample = guided_guide_sample(up, up, value, guided.pdf, leaf.fraction);
        next.wi.set(lane, guided.wi);
        next.alive.0[lane] = u32::from(sample.pdf > 0.0);
        next.pdf.0[lane] = sample.pdf;
        next.throughput.set(lane, v.throughput.get(lane) * sample.weight);
        value.pdf
    }

    /// Counts the direction of a lane's surface as one that the guide could have sampled; returns the density of the BSDF.
    #[inline(always)]
    fn weigh(&self, queue: &mut VertexQueue, lane: usize) -> f32 {
        let (leaf, next) = (self.leaves[lane], &mut queue.next);
        if next.alive.0[lane] == 0 || leaf.fraction <= 0.0 {
            return next.pdf.0[lane];
        }
        let (wi, pdf) = (next.wi.get(lane), next.pdf.0[lane]);
        let weight = next.throughput.get(lane);
        let sample = BsdfSample { wi, weight, pdf, delta: false, transmitted: false };
        let sample = guided_bsdf_sample(sample, self.guide.pdf(leaf, wi), leaf.fraction);
        next.pdf.0[lane] = sample.pdf;
        next.throughput.set(lane, sample.weight);
        pdf
    }
}

const BLACK: BsdfValue = BsdfValue { value_cos: vec3f(0.0, 0.0, 0.0), pdf: 0.0 };

/// Surfaces at which a guide takes part in sampling.
pub(crate) struct GuidedLobes<'a, 'g, L>(pub &'a L, pub &'a GuidedLanes<'g>);

impl<L: Lobes> Lobes for GuidedLobes<'_, '_, L> {
    #[inline(always)]
    fn eval(&self, v: &Vertices, lane: usize, wi: Vec3f) -> BsdfValue {
        let value = self.0.eval(v, lane, wi);
        let leaf = self.1.leaves[lane];
        if leaf.fraction <= 0.0 || value.pdf <= 0.0 {
            return value;
        }
        guided_value(value, self.1.guide.pdf(leaf, wi), leaf.fraction)
    }
}
