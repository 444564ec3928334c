//! Diffuse and GGX reflection at sixteen vertices at once: see `lanes`.

use crate::batch::departures::NextLanes;
use crate::batch::lanes::{LANES, Lanes, Pairs, Vectors, first_lanes};
use crate::batch::vertices::Vertices;
use crate::scene::CpuScene;
use crate::shade::scatter_lanes::Lobes;
use crate::simd::Instructions;
use optics::Vec3f;
use optics::albedo::{GgxAlbedo, GgxAlbedoCell};
use optics::frame::{Frame, frame_from_normal, to_local, to_world};
use optics::glossy::{MetallicRoughness, glossy_eval, glossy_sample, metallic_roughness_bsdf};
use optics::scatter::{BSDF_GLOSSY, Bsdf, BsdfValue, black_bsdf};
use optics::vector::dot;

/// The surfaces at vertices, prepared for their viewing directions: the fields of [`Bsdf`] that glossy ones use.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GlossyLanes {
    alpha: Lanes<f32>,
    diffuse: Vectors,
    diffuse_scale: Lanes<f32>,
    diffuse_falloff: Lanes<f32>,
    specular: Vectors,
    specular_grazing: Vectors,
    specular_probability: Lanes<f32>,
}

/// Parameters of [`MetallicRoughness`] but the colour.
#[derive(Clone, Copy, Debug, Default)]
struct MaterialLanes {
    metallic: Lanes<f32>,
    roughness: Lanes<f32>,
    specular: Lanes<f32>,
    ior: Lanes<f32>,
}

impl MaterialLanes {
    /// Those of the first `waiting` vertices.
    #[inline(always)]
    fn load<I: Instructions>(&mut self, i: I, scene: &CpuScene, v: &Vertices, waiting: usize) {
        let mut rows = [[0u32; LANES]; LANES];
        let binding = v.binding.0.first_chunk().expect("a row is longer");
        scene.hit_records.fetch(i, binding, first_lanes(waiting), rows.each_mut());
        // In the order of the fields of `HitRecord`, of which these are the last.
        let [.., ior, _, metallic, roughness, specular] = rows;
        self.ior.0 = ior.map(f32::from_bits);
        self.metallic.0 = metallic.map(f32::from_bits);
        self.roughness.0 = roughness.map(f32::from_bits);
        self.specular.0 = specular.map(f32::from_bits);
    }
}

impl GlossyLanes {
    /// Prepares the first `waiting` vertices.
    #[inline(always)]
    pub fn prepare<I: Instructions>(
        &mut self,
        i: I,
        scene: &CpuScene,
        v: &Vertices,
        waiting: usize,
        single_scatter: bool,
    ) {
        let mut m = MaterialLanes::default();
        m.load(i, scene, v, waiting);
        let albedo = look_up_albedo(v, &m.roughness);
        for lane in 0..LANES {
            let material = MetallicRoughness {
                base_color: v.color.get(lane),
                metallic: m.metallic.0[lane],
                roughness: m.roughness.0[lane],
                specular: m.specular.0[lane],
                ior: m.ior.0[lane],
            };
            let b = metallic_roughness_bsdf(material, albedo.get(lane), single_scatter);
            self.alpha.0[lane] = b.alpha;
            self.diffuse.set(lane, b.diffuse);
            self.diffuse_scale.0[lane] = b.diffuse_scale;
            self.diffuse_falloff.0[lane] = b.diffuse_falloff;
            self.specular.set(lane, b.specular);
            self.specular_grazing.set(lane, b.specular_grazing);
            self.specular_probability.0[lane] = b.specular_probability;
        }
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> Bsdf {
        Bsdf {
            kind: BSDF_GLOSSY,
            alpha: self.alpha.0[lane],
            diffuse: self.diffuse.get(lane),
            diffuse_scale: self.diffuse_scale.0[lane],
            diffuse_falloff: self.diffuse_falloff.0[lane],
            specular: self.specular.get(lane),
            specular_grazing: self.specular_grazing.get(lane),
            specular_probability: self.specular_probability.0[lane],
            ..black_bsdf()
        }
    }

    /// Samples a lobe of every lane. `origin`: where rays start that leave on the side of the viewer; `u_lobe`: its first number chooses
    /// the lobe.
    #[inline(always)]
    pub fn sample(&self, v: &Vertices, origin: &Vectors, u_lobe: &Pairs, u: &Pairs, out: &mut NextLanes) {
        for lane in 0..LANES {
            let (frame, wo) = local(v, lane);
            let sample = glossy_sample(self.get(lane), wo, u_lobe.x.0[lane], u.get(lane));
            let wi = to_world(frame, sample.wi);
            out.wi.set(lane, wi);
            out.pdf.0[lane] = sample.pdf;
            out.alive.0[lane] = u32::from(sample.pdf > 0.0 && dot(wi, v.normal.get(lane)) > 0.0);
            out.origin.set(lane, origin.get(lane));
            out.throughput.set(lane, v.throughput.get(lane) * sample.weight);
            out.eta_scale.0[lane] = v.eta_scale.0[lane];
        }
    }
}

impl Lobes for GlossyLanes {
    #[inline(always)]
    fn eval(&self, v: &Vertices, lane: usize, wi: Vec3f) -> BsdfValue {
        let (frame, wo) = local(v, lane);
        glossy_eval(self.get(lane), wo, to_local(frame, wi))
    }
}

/// The shading frame at a vertex, and the viewing direction in it.
#[inline(always)]
fn local(v: &Vertices, lane: usize) -> (Frame, Vec3f) {
    let frame = frame_from_normal(v.shading_normal.get(lane));
    (frame, to_local(frame, v.wo.get(lane)))
}

/// The table's values for all viewing directions, as [`metallic_roughness_bsdf`] takes them.
#[inline(always)]
fn look_up_albedo(v: &Vertices, roughness: &Lanes<f32>) -> Pairs {
    let (mut first, mut right, mut up) =
        (Lanes::<u32>::default(), Lanes::<f32>::default(), Lanes::<f32>::default());
    for lane in 0..LANES {
        let cos_o = dot(v.wo.get(lane), v.shading_normal.get(lane)).clamp(0.0, 1.0);
        let cell = GgxAlbedo::cell(cos_o, roughness.0[lane]);
        (first.0[lane], right.0[lane], up.0[lane]) = (cell.first, cell.right, cell.up);
    }
    let table = GgxAlbedo::shared();
    // One by one, not by a closure: see `FlatSampling`.
    let [mut a, mut b, mut c, mut d] = [Pairs::default(); 4];
    for lane in 0..LANES {
        let corners = table.corners(first.0[lane]);
        (a.x.0[lane], a.y.0[lane]) = (corners[0][0], corners[0][1]);
        (b.x.0[lane], b.y.0[lane]) = (corners[1][0], corners[1][1]);
        (c.x.0[lane], c.y.0[lane]) = (corners[2][0], corners[2][1]);
        (d.x.0[lane], d.y.0[lane]) = (corners[3][0], corners[3][1]);
    }
    let mut albedo = Pairs::default();
    for lane in 0..LANES {
        let cell = GgxAlbedoCell { first: first.0[lane], right: right.0[lane], up: up.0[lane] };
        let corners = [
            [a.x.0[lane], a.y.0[lane]],
            [b.x.0[lane], b.y.0[lane]],
            [c.x.0[lane], c.y.0[lane]],
            [d.x.0[lane], d.y.0[lane]],
        ];
        albedo.set(lane, cell.mix(corners));
    }
    albedo
}
