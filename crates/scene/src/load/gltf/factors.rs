//! Numbers of materials, brought into the range that the specification gives them.

use crate::LoadReport;
use glam::Vec4;

/// Reads factors and notes those that had to be mended.
pub(super) struct Factors<'r> {
    pub report: &'r mut LoadReport,
}

impl Factors<'_> {
    /// A finite number; what is not finite becomes the default.
    pub fn finite(&mut self, value: Option<f32>, default: f32, what: &str) -> f32 {
        let value = value.unwrap_or(default);
        if value.is_finite() {
            return value;
        }
        self.report.repaired(format!("a {what} that is not finite was set to {default}"));
        default
    }

    /// A number in `range`; what is beyond becomes its end.
    pub fn within(&mut self, value: Option<f32>, default: f32, range: [f32; 2], what: &str) -> f32 {
        let value = self.finite(value, default, what);
        let [least, most] = range;
        if !(least..=most).contains(&value) {
            self.report.repaired(format!("a {what} outside [{least}, {most}] was clamped"));
        }
        value.clamp(least, most)
    }

    /// A number in `[0, 1]`.
    pub fn unit(&mut self, value: Option<f32>, default: f32, what: &str) -> f32 {
        self.within(value, default, [0.0, 1.0], what)
    }

    /// A colour with alpha, white by default.
    pub fn color(&mut self, value: Option<[f32; 4]>, what: &str) -> Vec4 {
        Vec4::from(value.unwrap_or([1.0; 4]).map(|c| self.unit(Some(c), 1.0, what)))
    }
}
