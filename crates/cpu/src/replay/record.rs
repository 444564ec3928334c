//! What a path did, vertex by vertex. As JSON, numbers that are not finite are `null`.

use serde::Serialize;

/// A sample of a pixel, as [`replay`](crate::RayQueries::replay) makes it again.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SampleRecord {
    /// Column and row in the whole picture, from the upper left.
    pub pixel: [u32; 2],
    /// Index of the sample.
    pub sample: u32,
    /// What goes to the film, linear RGB, W·sr⁻¹·m⁻²: the sum of what its paths have found.
    pub radiance: [f32; 3],
    /// The sample's paths: one, or as many as part at the first vertex with `splitting`. Each begins at the camera.
    pub paths: Vec<PathRecord>,
    /// Rays that were traced.
    pub rays: u64,
}

/// A path from the camera to its end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PathRecord {
    /// Where the camera ray begins, metres.
    pub origin: [f32; 3],
    /// What the path has found: the sum of the contributions at its vertices, in their order, after any limit of indirect
    /// light. Of paths that part at the first vertex, what is seen there counts for the first one only.
    pub radiance: [f32; 3],
    /// Its vertices behind the camera.
    pub vertices: Vec<VertexRecord>,
    /// Why there are no more.
    pub end: PathEnd,
}

/// Why a path ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PathEnd {
    /// It has left the scene.
    Miss,
    /// It has as many segments as it may have.
    MaxDepth,
    /// What it has hit scatters nothing.
    Absorbed,
    /// The direction that was sampled lies below the surface, or no direction could be sampled.
    NoDirection,
    /// Russian roulette.
    Roulette,
}

impl PathEnd {
    /// In words.
    pub fn description(self) -> &'static str {
        match self {
            Self::Miss => "it has left the scene",
            Self::MaxDepth => "it has as many segments as it may have",
            Self::Absorbed => "the surface scatters nothing",
            Self::NoDirection => "the sampled direction lies below the surface",
            Self::Roulette => "Russian roulette",
        }
    }
}

/// A vertex of a path. World space.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VertexRecord {
    /// Segments from the camera to here: 1 at the first.
    pub depth: u32,
    /// What the path has come to.
    pub place: VertexPlace,
    /// Length of the segment that ends here, metres; infinite where nothing was hit.
    pub distance: f32,
    /// Unit direction of that segment.
    pub direction: [f32; 3],
    /// What light that is found here counts for, by component.
    pub throughput: [f32; 3],
    /// Light that the path has come upon: what a surface emits, and what is infinitely far away.
    pub found: Vec<FoundLight>,
    /// Next-event estimation.
    pub light_sample: Option<LightSampleRecord>,
    /// How the path goes on, or would have gone on.
    pub scattering: Option<ScatteringRecord>,
}

/// What a path has come to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum VertexPlace {
    /// A surface.
    Surface(SurfaceRecord),
    /// Nothing: what is infinitely far away.
    Distant,
}

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SurfaceRecord {
    /// Metres.
    pub position: [f32; 3],
    /// Unit normal of the geometry, on the side that the path has come from.
    pub normal: [f32; 3],
    /// The same for shading.
    pub shading_normal: [f32; 3],
    /// Whether the path has come to the front.
    pub front: bool,
    /// Index into the scene's instances.
    pub instance: u32,
    /// Number of the primitive in its mesh.
    pub primitive: u32,
    /// Index into the scene's materials.
    pub material: u32,
}

/// Light that a path has come upon by following its own direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FoundLight {
    /// Towards the path.
    pub radiance: [f32; 3],
    /// Density over solid angle with which the direction was sampled; `None` from the camera and from mirrors, where no other
    /// technique could have found it.
    pub scattering_pdf: Option<f32>,
    /// Density with which next-event estimation would have sampled it, 0 if it could not have.
    pub light_pdf: f32,
    /// Weight of multiple importance sampling.
    pub weight: f32,
    /// Throughput × radiance × weight.
    pub contribution: [f32; 3],
}

/// A light that was sampled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LightSampleRecord {
    /// Number of the light among those of the scene's tables.
    pub light: u32,
    /// What it is, in a word.
    pub kind: &'static str,
    /// Unit direction towards it.
    pub direction: [f32; 3],
    /// Metres; infinite where the light is infinitely far away.
    pub distance: f32,
    /// That arrives if nothing is in between; irradiance at normal incidence of lights without size.
    pub radiance: [f32; 3],
    /// Density over solid angle, the choice of the light included.
    pub pdf: f32,
    /// Whether no path could come upon it.
    pub delta: bool,
    /// Value of the BSDF times the cosine.
    pub scattering: [f32; 3],
    /// Density with which the BSDF would have sampled the direction.
    pub scattering_pdf: f32,
    /// Weight of multiple importance sampling.
    pub weight: f32,
    /// What has become of it.
    pub visibility: LightVisibility,
    /// Throughput × scattering × radiance × weight / pdf, where the light is visible; else 0.
    pub contribution: [f32; 3],
}

/// What has become of a light sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightVisibility {
    /// Nothing is in between.
    Visible,
    /// Something is.
    Occluded,
    /// The light is behind the surface.
    Behind,
    /// It would bring nothing: no ray was traced.
    Dark,
}

impl LightVisibility {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Visible => "visible",
            Self::Occluded => "occluded",
            Self::Behind => "behind the surface",
            Self::Dark => "dark",
        }
    }
}

/// A direction that was sampled at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ScatteringRecord {
    /// The model that scatters.
    pub model: &'static str,
    /// Unit direction.
    pub direction: [f32; 3],
    /// Density over solid angle, of all lobes together; 1 if `delta`.
    pub pdf: f32,
    /// Whether it comes from a mirror or a smooth interface.
    pub delta: bool,
    /// Whether it goes through the surface.
    pub transmitted: bool,
    /// BSDF × cosine / density.
    pub weight: [f32; 3],
    /// Probability with which Russian roulette lets the path live; 1: it was not played.
    pub survival: f32,
    /// Whether the path goes on.
    pub alive: bool,
}
