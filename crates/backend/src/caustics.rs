//! Whether caustics come from photons.

/// How [`PathSettings`](crate::PathSettings) find light that comes by mirrors or through glass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Caustics {
    /// By chance, as all other light.
    #[default]
    Off,
    /// By photons, too.
    On,
    /// By photons, too, where the scene has surfaces that mirror or refract and a light that is small.
    Auto,
}

impl Caustics {
    /// All of them, in the order in which users read them.
    pub const ALL: [Self; 3] = [Self::Off, Self::On, Self::Auto];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::On => "on",
            Self::Auto => "auto",
        }
    }
}

impl std::fmt::Display for Caustics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for Caustics {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let known = Self::ALL.into_iter().find(|caustics| caustics.name() == name);
        known.ok_or_else(|| format!("unknown `{name}`; there are: {}", Self::ALL.map(Self::name).join(", ")))
    }
}
