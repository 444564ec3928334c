// What a choice among lights comes to.

/// A light that was chosen.
struct LightChoice {
    index: u32,
    /// Probability of that; 0: no light can be chosen.
    probability: f32,
    /// A fresh uniform number in [0, 1).
    remainder: f32,
}
