//! How light that can be found in two ways is weighted.

use optics::mis::MisHeuristic;

/// How the two ways to find light are weighted against each other: a sample of the lights, and the direction that the BSDF
/// is sampled for, which may meet one. The expected picture is the same with all; what differs is the noise.
///
/// Light that only one of them can find, such as that of a point or what is seen in a mirror, counts in full always.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mis {
    /// Multiple importance sampling by the power heuristic with exponent 2.
    #[default]
    Power,
    /// Multiple importance sampling by the balance heuristic.
    Balance,
    /// Samples of lights alone: noisy where a large light is seen in a glossy surface.
    Light,
    /// Samples of BSDFs alone: noisy where a light is small.
    Bsdf,
}

impl Mis {
    /// All of them, the default first.
    pub const ALL: [Self; 4] = [Self::Power, Self::Balance, Self::Light, Self::Bsdf];

    /// The name that users give it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Power => "power",
            Self::Balance => "balance",
            Self::Light => "light",
            Self::Bsdf => "bsdf",
        }
    }

    /// As the optics know it.
    #[inline]
    pub fn heuristic(self) -> MisHeuristic {
        let [lights, bsdfs] = match self {
            Self::Power | Self::Balance => [1.0, 1.0],
            Self::Light => [1.0, 0.0],
            Self::Bsdf => [0.0, 1.0],
        };
        MisHeuristic { lights, bsdfs, squared: self != Self::Balance }
    }
}

impl std::fmt::Display for Mis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for Mis {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let known = Self::ALL.into_iter().find(|mis| mis.name() == name);
        known.ok_or_else(|| format!("unknown `{name}`; there are: {}", Self::ALL.map(Self::name).join(", ")))
    }
}
