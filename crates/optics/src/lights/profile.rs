//! How a lamp's intensity depends on direction: where a direction falls in a table of what was measured.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod light_profile {
    use crate::constants::*;
    use crate::frame::*;
    use wgsl_rs::std::*;

    /// Four values of a table and how they are mixed. The table has a row for each vertical angle, from 0 to π in equal steps,
    /// and a column for each horizontal angle, from 0 to 2π in equal steps, without the end, which is the beginning.
    #[derive(Clone, Copy, Debug)]
    pub struct ProfileCell {
        /// Number of the value in the row above and the column before, row by row.
        pub first: u32,
        /// In the row above and the column after.
        pub second: u32,
        /// In the row below and the column before.
        pub third: u32,
        /// In the row below and the column after.
        pub fourth: u32,
        /// How far it is from the row above to the row below, in `[0, 1]`.
        pub down: f32,
        /// How far it is from the column before to the column after, in `[0, 1]`.
        pub across: f32,
    }

    /// Horizontal angle of a direction around a lamp's axis, in radians and in any turn.
    ///
    /// - `axis`: unit direction that the lamp is aimed at. `direction`: unit direction away from it.
    /// - `zero`: what this function gives, called with 0 for it, for the direction whose horizontal angle is 0.
    ///
    /// Angles grow anticlockwise for who looks along the axis' opposite, which is up for a lamp that hangs (LM-63, type C: seen from
    /// above).
    pub fn profile_azimuth(axis: Vec3f, zero: f32, direction: Vec3f) -> f32 {
        let frame = frame_from_normal(axis);
        // The frame turns the other way round.
        -atan2(dot(direction, frame.bitangent), dot(direction, frame.tangent)) - zero
    }

    /// Where a direction falls in a table of `rows` × `columns`; both at least 1, and at least two rows.
    ///
    /// - `axis`, `zero`, `direction`: as in [`profile_azimuth`].
    pub fn profile_cell(axis: Vec3f, zero: f32, direction: Vec3f, rows: u32, columns: u32) -> ProfileCell {
        let along = dot(axis, direction);
        // The arccosine alone would lose half of the digits near the axis.
        let aside = length(cross(axis, direction));
        let row = saturate(atan2(aside, along) * INV_PI) * f32(rows - 1u32);
        let above = min(u32(row), rows - 2u32);
        let turns = profile_azimuth(axis, zero, direction) * (1.0 / TAU);
        let column = (turns - floor(turns)) * f32(columns);
        // A turn that rounding makes whole is the beginning.
        let before = u32(column) % columns;
        let after = (before + 1u32) % columns;
        ProfileCell {
            first: above * columns + before,
            second: above * columns + after,
            third: (above + 1u32) * columns + before,
            fourth: (above + 1u32) * columns + after,
            down: row - f32(above),
            across: column - floor(column),
        }
    }

    /// The four values of a cell, mixed.
    pub fn profile_mix(cell: ProfileCell, first: f32, second: f32, third: f32, fourth: f32) -> f32 {
        let above = first + (second - first) * cell.across;
        let below = third + (fourth - third) * cell.across;
        above + (below - above) * cell.down
    }
}
