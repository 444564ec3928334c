//! Whether paths follow what was learned of the light.

/// Whether paths follow a guide: before the picture, training paths learn from where light arrives at places of the scene, and
/// the picture's paths go there more often. The expected picture is the same; what differs is the noise.
///
/// What is learned depends on scene, camera, settings and seed alone, so samples are the same however they are divided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Guiding {
    /// Paths follow the surfaces' scattering alone.
    #[default]
    Off,
    /// They follow a guide where that is worth something.
    On,
    /// They follow a guide if the training says that it is worth its time.
    Auto,
}

impl Guiding {
    /// All of them, in the order in which users read them.
    pub const ALL: [Self; 3] = [Self::Off, Self::On, Self::Auto];

    /// The name that users give it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::On => "on",
            Self::Auto => "auto",
        }
    }
}

impl std::fmt::Display for Guiding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for Guiding {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let known = Self::ALL.into_iter().find(|guiding| guiding.name() == name);
        known.ok_or_else(|| format!("unknown `{name}`; there are: {}", Self::ALL.map(Self::name).join(", ")))
    }
}
