//! The corners around a vertex.

use super::level::{Channel, Level, Value};

/// How far the corners around a vertex go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Extent {
    /// All around.
    Closed,
    /// From an edge to itself: there is one sharp edge.
    Slit,
    /// From one edge to another.
    Open,
}

impl Level {
    /// The corners of a vertex in a channel, counter-clockwise. Returns whether they go all around; otherwise the first one
    /// lies at the border, or at a seam.
    pub fn ring<V: Value>(&self, channel: &Channel<V>, corner: u32, ring: &mut Vec<u32>) -> bool {
        self.walk(corner, ring, |half| channel.is_cut(half)) == Extent::Closed
    }

    /// The corners of a vertex between edges that stay sharp for ever, counter-clockwise.
    pub fn sector(&self, corner: u32, ring: &mut Vec<u32>) -> Extent {
        self.walk(corner, ring, |half| self.sharpness(half) == f32::INFINITY)
    }

    fn walk(&self, corner: u32, ring: &mut Vec<u32>, stops: impl Fn(u32) -> bool) -> Extent {
        let twin = |half: u32| self.twin(half).filter(|_| !stops(half));
        let mut first = corner;
        let mut extent = Extent::Open;
        // Clockwise, back to where it begins.
        while let Some(twin) = twin(first) {
            first = self.next(twin);
            if first == corner {
                extent = Extent::Closed;
                break;
            }
        }
        ring.clear();
        ring.push(first);
        let mut last = first;
        while let Some(next) = twin(self.previous(last)) {
            if next == first {
                break;
            }
            ring.push(next);
            last = next;
        }
        if extent == Extent::Open && self.twin(self.previous(last)) == Some(first) {
            extent = Extent::Slit;
        }
        extent
    }

    /// Whether the vertex of a corner is on creases that become smooth on a later level.
    pub fn changes_at(&self, corner: u32, ring: &mut Vec<u32>) -> bool {
        if self.sharp.is_empty() && self.pins.is_empty() {
            return false;
        }
        let fades = |sharpness: f32| sharpness > 0.0 && sharpness < f32::INFINITY;
        self.ring(&self.position, corner, ring);
        fades(self.pin(corner)) || ring.iter().any(|c| fades(self.sharpness(*c)))
    }
}
