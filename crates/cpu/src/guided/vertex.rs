//! Guided directions at a vertex, whatever scatters there.

use crate::guided::finds::{Find, Finds};
use crate::shade::path_batch::Context;
use crate::shade::scattering::Scattering;
use guiding::{Guide, GuideLeaf};
use optics::frame::{Frame, to_local, to_world};
use optics::guiding::{guide_rest, guided_bsdf_sample, guided_guide_sample, guided_survival, guided_value};
use optics::scatter::{BsdfSample, BsdfValue};
use optics::{Vec2f, Vec3f, vec3f};

/// See [`guided_survival`]. Not less than one: whose directions the guide does not like count more already, and would still more if
/// they had to be lucky, too.
#[inline(always)]
pub(crate) fn survival(bsdf_pdf: f32, pdf: f32) -> f32 {
    guided_survival(bsdf_pdf, pdf).max(1.0)
}

/// What is known of the light at a vertex.
#[derive(Clone, Copy)]
pub(crate) struct GuidedVertex<'a> {
    guide: &'a Guide,
    leaf: GuideLeaf,
    position: Vec3f,
}

/// A direction that BSDF and guide have sampled together.
#[derive(Clone, Copy)]
pub(crate) struct GuidedSample {
    pub sample: BsdfSample,
    /// Densities of both alone; of delta lobes, they mean nothing.
    bsdf_pdf: f32,
    guide_pdf: f32,
}

impl Context<'_> {
    /// What is known at a place; `None` where paths do not follow a guide.
    #[inline(always)]
    pub(crate) fn guided_at(&self, position: Vec3f) -> Option<GuidedVertex<'_>> {
        let guide = self.scene.guide.as_deref()?;
        Some(GuidedVertex { guide, leaf: guide.leaf(position), position })
    }

    /// Whether what paths find is to be learned from.
    #[inline(always)]
    pub(crate) fn learns(&self) -> bool {
        self.scene.learner.is_some()
    }
}

impl GuidedVertex<'_> {
    /// What a BSDF says of the unit direction `wi`, world space, where the guide takes part.
    pub fn value(&self, value: BsdfValue, wi: Vec3f) -> BsdfValue {
        guided_value(value, self.guide.pdf(self.leaf, wi), self.leaf.fraction)
    }

    /// Samples a direction. The arguments are those of [`Scattering::sample`]; `frame`: for shading.
    #[inline(never)]
    pub fn sample<S: Scattering>(
        &self,
        bsdf: S,
        frame: Frame,
        wo: Vec3f,
        u_lobe: f32,
        u: Vec2f,
    ) -> GuidedSample {
        let fraction = self.leaf.fraction;
        if u_lobe < fraction {
            let guided = self.guide.sample(self.leaf, u);
            let wi = to_local(frame, guided.wi);
            let value = bsdf.eval(wo, wi);
            let sample = guided_guide_sample(wo, wi, value, guided.pdf, fraction);
            return GuidedSample { sample, bsdf_pdf: value.pdf, guide_pdf: guided.pdf };
        }
        let sample = bsdf.sample(wo, guide_rest(u_lobe, fraction), u);
        let guide_pdf = self.guide.pdf(self.leaf, to_world(frame, sample.wi));
        GuidedSample {
            sample: guided_bsdf_sample(sample, guide_pdf, fraction),
            bsdf_pdf: sample.pdf,
            guide_pdf,
        }
    }
}

impl GuidedSample {
    /// See [`survival`].
    pub fn survival(&self) -> f32 {
        if self.sample.delta { 1.0 } else { survival(self.bsdf_pdf, self.sample.pdf) }
    }

    /// Remembers the direction, `wi` in world space, for who learns. `throughput`: of the path as it arrived.
    pub fn note(&self, vertex: &GuidedVertex, slot: u32, throughput: Vec3f, wi: Vec3f, finds: &mut Finds) {
        if self.sample.delta {
            return;
        }
        finds.push(Find {
            slot,
            position: vertex.position,
            wi,
            pdf: self.sample.pdf,
            bsdf_pdf: self.bsdf_pdf,
            guide_pdf: self.guide_pdf,
            throughput: throughput * self.sample.weight,
            before: vec3f(0.0, 0.0, 0.0),
        });
    }
}
