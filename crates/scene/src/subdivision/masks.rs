//! What vertices of the next level and of the limit are: weighted sums of those around.
//!
//! Rules for creases are those of DeRose, Kass and Truong (1998) as OpenSubdiv has them: a vertex is smooth, on a crease,
//! or a corner by the number of its sharp edges, and where sharpness ends within a level, both rules are mixed.

use super::description::Scheme;
use super::level::{Channel, Level, Value};
use elementary::cos;

/// What a vertex follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rule {
    Smooth,
    Crease,
    Corner,
}

/// The edges of a vertex by sharpness.
#[derive(Clone, Copy, Debug)]
struct Sharpness<V> {
    /// Number of sharp edges.
    count: u32,
    /// Sum of what is at their other ends.
    ends: V,
    pinned: bool,
}

impl<V: Value> Sharpness<V> {
    fn rule(&self) -> Rule {
        match self.count {
            _ if self.pinned => Rule::Corner,
            0 | 1 => Rule::Smooth,
            2 => Rule::Crease,
            _ => Rule::Corner,
        }
    }
}

/// A vertex and what is around it.
pub(super) struct Vertex<V> {
    /// Edges, as many as faces if it is not on a border.
    pub edges: u32,
    /// Its own value.
    pub own: V,
    /// Sum of what is at the other ends of its edges.
    pub ends: V,
    /// Sharp edges now and, later, those that are on the next level.
    sharp: [Sharpness<V>; 2],
    /// Share of the rule of this level, where the next one follows another.
    share: f32,
    /// Whether sharpness ends here or on a later level, so that the limit is known only then.
    pub changes: bool,
}

impl<V: Value> Vertex<V> {
    /// Looks at a vertex. `ring`: its corners in the channel; `closed`: whether they go all around.
    pub fn new(level: &Level, channel: &Channel<V>, ring: &[u32], closed: bool) -> Self {
        let own = channel.at(ring[0]);
        let pin = if !closed && ring.len() == 1 && !level.round_corners {
            f32::INFINITY
        } else {
            level.pin(ring[0])
        };
        let none = |pin: f32| Sharpness { count: 0, ends: V::default(), pinned: pin > 0.0 };
        let mut vertex = Self {
            edges: 0,
            own,
            ends: V::default(),
            sharp: [none(pin), none(pin - 1.0)],
            share: 0.0,
            changes: pin > 0.0 && pin < f32::INFINITY,
        };
        let (mut fading, mut faded) = (0.0, 0u32);
        let mut fade = |sharpness: f32| {
            if sharpness > 0.0 && sharpness <= 1.0 {
                fading += sharpness;
                faded += 1;
            }
        };
        fade(pin);
        let mut edge = |end: V, sharpness: f32| {
            vertex.edges += 1;
            vertex.ends = vertex.ends + end;
            for (sharp, ended) in vertex.sharp.iter_mut().zip([0.0, 1.0]) {
                if sharpness > ended {
                    sharp.count += 1;
                    sharp.ends = sharp.ends + end;
                }
            }
            vertex.changes |= sharpness > 0.0 && sharpness < f32::INFINITY;
            fade(sharpness);
        };
        for (i, corner) in ring.iter().enumerate() {
            let border = !closed && i == 0;
            let sharpness = if border { f32::INFINITY } else { level.sharpness(*corner) };
            edge(channel.at(level.next(*corner)), sharpness);
        }
        if let (false, Some(last)) = (closed, ring.last()) {
            edge(channel.at(level.previous(*last)), f32::INFINITY);
        }
        vertex.share = if faded == 0 { 0.0 } else { fading / faded as f32 };
        vertex
    }

    /// Mixes what rules give: `smooth`, and with the weight of each end of a crease.
    fn mixed(&self, smooth: impl Fn() -> V, end: f32) -> V {
        let by = |sharp: &Sharpness<V>| match sharp.rule() {
            Rule::Smooth => smooth(),
            Rule::Crease => self.own * (1.0 - 2.0 * end) + sharp.ends * end,
            Rule::Corner => self.own,
        };
        let [now, later] = &self.sharp;
        if now.rule() == later.rule() {
            return by(now);
        }
        by(now) * self.share + by(later) * (1.0 - self.share)
    }

    /// Its value on the next level.
    ///
    /// - `faces`: sum of the points of its faces, of Catmull and Clark's scheme.
    pub fn refined(&self, scheme: Scheme, faces: impl Fn() -> V) -> V {
        let n = self.edges as f32;
        match scheme {
            Scheme::Linear => self.own,
            Scheme::CatmullClark => {
                let smooth = || self.own * ((n - 2.0) / n) + (self.ends + faces()) * (1.0 / (n * n));
                self.mixed(smooth, 0.125)
            }
            Scheme::Loop => {
                let beta = loop_weight(self.edges);
                self.mixed(|| self.own * (1.0 - n * beta) + self.ends * beta, 0.125)
            }
        }
    }

    /// Its place on the limit.
    ///
    /// - `diagonals`: sum of the opposite corners of its faces, which are quadrilaterals, of Catmull and Clark's scheme.
    pub fn limit(&self, scheme: Scheme, diagonals: impl Fn() -> V) -> V {
        let n = self.edges as f32;
        match scheme {
            Scheme::Linear => self.own,
            Scheme::CatmullClark => {
                let smooth =
                    || (self.own * (n * n) + self.ends * 4.0 + diagonals()) * (1.0 / (n * (n + 5.0)));
                self.mixed(smooth, 1.0 / 6.0)
            }
            Scheme::Loop => {
                let weight = 1.0 / (n + 0.375 / loop_weight(self.edges));
                self.mixed(|| self.own * (1.0 - n * weight) + self.ends * weight, 1.0 / 6.0)
            }
        }
    }
}

/// Loop's weight of each neighbour of a vertex with `n` edges.
fn loop_weight(n: u32) -> f32 {
    let part = 0.375 + 0.25 * cos(std::f32::consts::TAU / n as f32);
    (0.625 - part * part) / n as f32
}

/// The point of an edge on the next level.
///
/// - `sharpness`: of the edge, infinite at borders.
/// - `others`: of Catmull and Clark's scheme the sum of the points of both faces, of Loop's the sum of their opposite
///   corners.
pub(super) fn edge_point<V: Value>(scheme: Scheme, ends: V, sharpness: f32, others: impl Fn() -> V) -> V {
    let sharp = ends * 0.5;
    if scheme == Scheme::Linear || sharpness >= 1.0 {
        return sharp;
    }
    let smooth = match scheme {
        Scheme::Loop => ends * 0.375 + others() * 0.125,
        _ => (ends + others()) * 0.25,
    };
    if sharpness > 0.0 { smooth * (1.0 - sharpness) + sharp * sharpness } else { smooth }
}

/// The mean of a face's corners.
pub(super) fn face_point<V: Value>(level: &Level, channel: &Channel<V>, face: u32) -> V {
    let corners = level.corners(face);
    let count = corners.len() as f32;
    corners.fold(V::default(), |sum, corner| sum + channel.at(corner)) * (1.0 / count)
}

/// The limit at a corner's vertex, and whether it is known only on a later level.
pub(super) fn limit<V: Value>(
    level: &Level,
    channel: &Channel<V>,
    scheme: Scheme,
    corner: u32,
    ring: &mut Vec<u32>,
) -> (V, bool) {
    let closed = level.ring(channel, corner, ring);
    let vertex = Vertex::new(level, channel, ring, closed);
    let diagonals = || {
        let opposite = |c: &u32| channel.at(level.next(level.next(*c)));
        ring.iter().map(opposite).fold(V::default(), |sum, value| sum + value)
    };
    (vertex.limit(scheme, diagonals), vertex.changes && scheme != Scheme::Linear)
}

/// Sharpness on the next level.
pub(super) fn fade(sharpness: f32) -> f32 {
    (sharpness - 1.0).max(0.0)
}
