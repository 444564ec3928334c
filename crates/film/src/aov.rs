//! Auxiliary pictures ("arbitrary output variables"): what the camera saw besides colour.

use std::fmt;
use std::str::FromStr;

/// The id of nothing: what an id layer holds where the first sample hit nothing, or was never taken.
pub const NO_ID: u32 = u32::MAX;

/// An auxiliary picture that a render can make beside colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Aov {
    /// Distance from the camera along the ray, in metres. Zero where nothing was hit.
    Depth,
    /// World position of the first hit, in metres. Zero where nothing was hit.
    Position,
    /// Shading normal at the first hit (after normal mapping), unit length, world space, facing the viewer. The
    /// mean over the samples, so it is shorter than one at edges; a sample that hits nothing counts as zero.
    Normal,
    /// As [`Aov::Normal`], but of the geometry: no interpolation and no normal map.
    GeometricNormal,
    /// First texture coordinates at the first hit. Zero where nothing was hit.
    Uv,
    /// Directional-hemispherical reflectance estimate at the first hit, in `[0, 1]`, linear RGB: base colour for
    /// common materials. The mean over the samples; one that hits nothing counts as zero.
    Albedo,
    /// What guides denoisers: as [`Aov::Albedo`], but of the first surface that is neither mirror nor clear glass, seen
    /// in those before it, and multiplied by what they let through. What shines counts as white there.
    DenoisingAlbedo,
    /// As [`Aov::Normal`], of the surface that [`Aov::DenoisingAlbedo`] is of.
    DenoisingNormal,
    /// Index of the material at the first hit, or [`NO_ID`].
    MaterialId,
    /// Index of the instance at the first hit, or [`NO_ID`].
    InstanceId,
    /// Index of the primitive within its mesh at the first hit, or [`NO_ID`].
    PrimitiveId,
    /// The share of the pixel's samples that saw each instance first: a Cryptomatte in EXR files.
    ObjectMatte,
    /// As [`Aov::ObjectMatte`], of materials.
    MaterialMatte,
    /// How many valid samples the pixel's colour has.
    SampleCount,
    /// Standard error of the pixel's colour, linear RGB. Zero below two samples.
    StandardError,
}

/// How the values of an [`Aov`] come together in a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AovKind {
    /// The mean over all samples of the pixel.
    Mean,
    /// The value of sample 0 of the pixel: a mean would mix surfaces.
    First,
    /// As [`AovKind::First`], for whole numbers.
    FirstId,
    /// Which ids the samples of the pixel saw, and how many of them each.
    Shares,
    /// Not added by the back end: the film derives it from the colour's statistics.
    Derived,
}

impl Aov {
    /// All of them, in the order in which they are listed to users.
    pub const ALL: [Self; 15] = [
        Self::Depth,
        Self::Position,
        Self::Normal,
        Self::GeometricNormal,
        Self::Uv,
        Self::Albedo,
        Self::DenoisingAlbedo,
        Self::DenoisingNormal,
        Self::MaterialId,
        Self::InstanceId,
        Self::PrimitiveId,
        Self::ObjectMatte,
        Self::MaterialMatte,
        Self::SampleCount,
        Self::StandardError,
    ];

    /// Its name on the command line and in files, for example `"geometric-normal"`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Position => "position",
            Self::Normal => "normal",
            Self::GeometricNormal => "geometric-normal",
            Self::Uv => "uv",
            Self::Albedo => "albedo",
            Self::DenoisingAlbedo => "denoising-albedo",
            Self::DenoisingNormal => "denoising-normal",
            Self::MaterialId => "material",
            Self::InstanceId => "instance",
            Self::PrimitiveId => "primitive",
            Self::ObjectMatte => "cryptomatte-object",
            Self::MaterialMatte => "cryptomatte-material",
            Self::SampleCount => "samples",
            Self::StandardError => "standard-error",
        }
    }

    /// The names of its channels. In an EXR file the channel is called `name.channel`. Mattes have none here: theirs are
    /// those of [`crate::ExrFile::push_cryptomatte`].
    #[must_use]
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Depth => &["Z"],
            Self::Position | Self::Normal | Self::GeometricNormal | Self::DenoisingNormal => &["X", "Y", "Z"],
            Self::Uv => &["U", "V"],
            Self::Albedo | Self::DenoisingAlbedo | Self::StandardError => &["R", "G", "B"],
            Self::MaterialId | Self::InstanceId | Self::PrimitiveId => &["I"],
            Self::SampleCount => &["N"],
            Self::ObjectMatte | Self::MaterialMatte => &[],
        }
    }

    /// How its values come together in a pixel.
    #[must_use]
    pub fn kind(self) -> AovKind {
        match self {
            Self::Depth | Self::Position | Self::Uv => AovKind::First,
            Self::Normal
            | Self::GeometricNormal
            | Self::Albedo
            | Self::DenoisingAlbedo
            | Self::DenoisingNormal => AovKind::Mean,
            Self::MaterialId | Self::InstanceId | Self::PrimitiveId => AovKind::FirstId,
            Self::ObjectMatte | Self::MaterialMatte => AovKind::Shares,
            Self::SampleCount | Self::StandardError => AovKind::Derived,
        }
    }

    /// Whether it is made for denoisers: not of the first hit, where that shows a sharp picture of other things.
    #[must_use]
    pub fn guides_denoisers(self) -> bool {
        matches!(self, Self::DenoisingAlbedo | Self::DenoisingNormal)
    }

    /// Whether its values are whole numbers, stored as `u32` in files.
    #[must_use]
    pub fn is_integer(self) -> bool {
        self.kind() == AovKind::FirstId || self == Self::SampleCount
    }
}

impl fmt::Display for Aov {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that no [`Aov`] has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown layer `{0}`; there are: {names}", names = Aov::ALL.map(Aov::name).join(", "))]
pub struct UnknownAov(pub String);

impl FromStr for Aov {
    type Err = UnknownAov;

    /// Finds the layer called `name` (see [`Aov::name`]).
    fn from_str(name: &str) -> Result<Self, UnknownAov> {
        Self::ALL.into_iter().find(|a| a.name() == name).ok_or_else(|| UnknownAov(name.to_owned()))
    }
}

/// What one camera sample saw first. The default is a sample that hit nothing.
///
/// Fields are as the [`Aov`] of the same name says. A back end may leave out what [`crate::Film::aovs`] does not
/// ask for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AovSample {
    /// See [`Aov::Depth`].
    pub depth: f32,
    /// See [`Aov::Position`].
    pub position: [f32; 3],
    /// See [`Aov::Normal`].
    pub normal: [f32; 3],
    /// See [`Aov::GeometricNormal`].
    pub geometric_normal: [f32; 3],
    /// See [`Aov::Uv`].
    pub uv: [f32; 2],
    /// See [`Aov::Albedo`].
    pub albedo: [f32; 3],
    /// See [`Aov::DenoisingAlbedo`].
    pub denoising_albedo: [f32; 3],
    /// See [`Aov::DenoisingNormal`].
    pub denoising_normal: [f32; 3],
    /// See [`Aov::MaterialId`].
    pub material_id: u32,
    /// See [`Aov::InstanceId`].
    pub instance_id: u32,
    /// See [`Aov::PrimitiveId`].
    pub primitive_id: u32,
}

impl Default for AovSample {
    fn default() -> Self {
        Self {
            depth: 0.0,
            position: [0.0; 3],
            normal: [0.0; 3],
            geometric_normal: [0.0; 3],
            uv: [0.0; 2],
            albedo: [0.0; 3],
            denoising_albedo: [0.0; 3],
            denoising_normal: [0.0; 3],
            material_id: NO_ID,
            instance_id: NO_ID,
            primitive_id: NO_ID,
        }
    }
}

/// First hits of several samples of one pixel, of which only sums are known, as a GPU keeps them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AovSums {
    /// How many samples there were, those that hit nothing included.
    pub count: u32,
    /// Sum over the samples, see [`Aov::Normal`].
    pub normal: [f64; 3],
    /// Sum over the samples, see [`Aov::GeometricNormal`].
    pub geometric_normal: [f64; 3],
    /// Sum over the samples, see [`Aov::Albedo`].
    pub albedo: [f64; 3],
    /// Sum over the samples, see [`Aov::DenoisingAlbedo`].
    pub denoising_albedo: [f64; 3],
    /// Sum over the samples, see [`Aov::DenoisingNormal`].
    pub denoising_normal: [f64; 3],
    /// Sample 0, if it is one of them: only layers of kind [`AovKind::First`] and [`AovKind::FirstId`] count.
    pub first: Option<AovSample>,
}

impl AovSums {
    /// The sums of `aov`, if it is a mean.
    pub(crate) fn sums(&self, aov: Aov) -> Option<&[f64; 3]> {
        match aov {
            Aov::Normal => Some(&self.normal),
            Aov::GeometricNormal => Some(&self.geometric_normal),
            Aov::Albedo => Some(&self.albedo),
            Aov::DenoisingAlbedo => Some(&self.denoising_albedo),
            Aov::DenoisingNormal => Some(&self.denoising_normal),
            Aov::Depth
            | Aov::Position
            | Aov::Uv
            | Aov::MaterialId
            | Aov::InstanceId
            | Aov::PrimitiveId
            | Aov::ObjectMatte
            | Aov::MaterialMatte
            | Aov::SampleCount
            | Aov::StandardError => None,
        }
    }
}

impl AovSample {
    /// The floating-point channels of `aov`; empty for ids and derived layers.
    pub(crate) fn values(&self, aov: Aov) -> &[f32] {
        match aov {
            Aov::Depth => std::slice::from_ref(&self.depth),
            Aov::Position => &self.position,
            Aov::Normal => &self.normal,
            Aov::GeometricNormal => &self.geometric_normal,
            Aov::Uv => &self.uv,
            Aov::Albedo => &self.albedo,
            Aov::DenoisingAlbedo => &self.denoising_albedo,
            Aov::DenoisingNormal => &self.denoising_normal,
            Aov::MaterialId
            | Aov::InstanceId
            | Aov::PrimitiveId
            | Aov::ObjectMatte
            | Aov::MaterialMatte
            | Aov::SampleCount
            | Aov::StandardError => &[],
        }
    }

    /// The id that `aov` asks for, if it asks for one.
    pub(crate) fn id(&self, aov: Aov) -> Option<u32> {
        match aov {
            Aov::MaterialId | Aov::MaterialMatte => Some(self.material_id),
            Aov::InstanceId | Aov::ObjectMatte => Some(self.instance_id),
            Aov::PrimitiveId => Some(self.primitive_id),
            Aov::Depth
            | Aov::Position
            | Aov::Normal
            | Aov::GeometricNormal
            | Aov::Uv
            | Aov::Albedo
            | Aov::DenoisingAlbedo
            | Aov::DenoisingNormal
            | Aov::SampleCount
            | Aov::StandardError => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_parse_back() {
        for aov in Aov::ALL {
            assert_eq!(aov.name().parse(), Ok(aov));
            assert_eq!(Aov::ALL.iter().filter(|a| a.name() == aov.name()).count(), 1);
        }
        let error = "dephts".parse::<Aov>().unwrap_err().to_string();
        assert!(error.contains("`dephts`") && error.contains("geometric-normal"), "{error}");
    }

    #[test]
    fn samples_have_as_many_values_as_their_layer_has_channels() {
        for aov in Aov::ALL {
            let sample = AovSample::default();
            let values = match aov.kind() {
                AovKind::Mean | AovKind::First => sample.values(aov).len(),
                AovKind::FirstId => sample.id(aov).into_iter().count(),
                AovKind::Shares => {
                    assert!(sample.id(aov).is_some());
                    0
                }
                AovKind::Derived => aov.channels().len(),
            };
            assert_eq!(values, aov.channels().len(), "{aov}");
        }
    }
}
