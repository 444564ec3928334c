//! Outlines that cross themselves, by cutting off ears: something for what has no right answer, in linear time.

use glam::DVec2;

/// Tests of corners that an outline may cost for each of its corners. Then anything is cut off.
const TESTS_PER_CORNER: u64 = 2048;

/// Cuts corners off one after the other, keeping its buffers between outlines.
#[derive(Default)]
pub(super) struct Ears {
    next: Vec<u32>,
    previous: Vec<u32>,
}

impl Ears {
    /// Appends `n − 2` triangles for an outline of `n ≥ 3` points. First those go that turn left and hold no other
    /// corner.
    pub(super) fn clip(&mut self, points: &[DVec2], triangles: &mut Vec<[u32; 3]>) {
        let count = points.len() as u32;
        self.next.clear();
        self.next.extend((1..count).chain([0]));
        self.previous.clear();
        self.previous.extend([count - 1].into_iter().chain(0..count - 1));
        let mut budget = TESTS_PER_CORNER * u64::from(count);
        let (mut remaining, mut corner, mut tried) = (count, 0, 0);
        while remaining > 3 {
            // After a whole round without an ear, go on with anything.
            let stuck = tried > remaining || budget == 0;
            let (before, after) = (self.previous[corner as usize], self.next[corner as usize]);
            if stuck || self.is_ear(points, [before, corner, after], &mut budget) {
                triangles.push([before, corner, after]);
                self.next[before as usize] = after;
                self.previous[after as usize] = before;
                remaining -= 1;
                tried = 0;
                corner = self.next[after as usize]; // skipping one avoids long thin fans
            } else {
                tried += 1;
                corner = after;
            }
        }
        triangles.push([self.previous[corner as usize], corner, self.next[corner as usize]]);
    }

    /// Whether the middle corner turns left and no other corner that is left lies in the triangle.
    fn is_ear(&self, points: &[DVec2], corners: [u32; 3], budget: &mut u64) -> bool {
        let [a, b, c] = corners.map(|i| points[i as usize]);
        *budget = budget.saturating_sub(1);
        if (b - a).perp_dot(c - b) <= 0.0 {
            return false;
        }
        let mut other = self.next[corners[2] as usize];
        while other != corners[0] {
            *budget = budget.saturating_sub(1);
            let p = points[other as usize];
            let inside = (b - a).perp_dot(p - a) >= 0.0
                && (c - b).perp_dot(p - b) >= 0.0
                && (a - c).perp_dot(p - c) >= 0.0;
            if inside && p != a && p != b && p != c {
                return false;
            }
            other = self.next[other as usize];
        }
        true
    }
}
