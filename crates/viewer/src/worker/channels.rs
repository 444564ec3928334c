//! Which channels of a picture are shown.

use alhazen::luminance;

/// Channels of the rendered radiance; one alone is shown as grey.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Channels {
    /// Red, green and blue as a colour.
    #[default]
    All,
    /// Red alone.
    Red,
    /// Green alone.
    Green,
    /// Blue alone.
    Blue,
    /// Luminance (Rec. 709).
    Luminance,
}

impl Channels {
    /// All choices.
    pub const ALL: [Self; 5] = [Self::All, Self::Red, Self::Green, Self::Blue, Self::Luminance];

    /// What the user calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Red => "red",
            Self::Green => "green",
            Self::Blue => "blue",
            Self::Luminance => "luminance",
        }
    }

    /// The value that is shown for a linear colour.
    pub fn of(self, rgb: [f32; 3]) -> [f32; 3] {
        match self {
            Self::All => rgb,
            Self::Red => [rgb[0]; 3],
            Self::Green => [rgb[1]; 3],
            Self::Blue => [rgb[2]; 3],
            Self::Luminance => [luminance(rgb); 3],
        }
    }
}
