//! Polygons that do not cross themselves, by a sweep in O(n log n).
//!
//! The sweep goes over the corners from left to right and keeps the edges that it crosses in order from bottom to top.
//! Where the outline turns back, the polygon is cut: what is left are pieces that every vertical line meets in one
//! interval (Lee and Preparata, "Location of a Point in a Planar Subdivision and Its Applications", 1977), which
//! [`Piece`] fills. Of points on a vertical line the lower one is farther to the left.
//!
//! All decisions are exact: coordinates are those of the corners, and the side of a line that a point is on is computed
//! without rounding (Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates",
//! 1997). Corners in one place are one event, edges that lie on each other are added up, and what is inside is decided
//! by winding numbers (Hormann and Agathos, 2001), so that slits which join holes to the outline and outlines that touch
//! themselves need no care of their own. Neighbours in the order are tested for a crossing (Shamos and Hoey,
//! "Geometric Intersection Problems", 1976): the sweep ends before the first one can confuse the order.

use super::piece::{Piece, Side, Triangle};
use glam::DVec2;
use std::cmp::{Ordering, Reverse};
use std::collections::{BTreeMap, BinaryHeap};

/// The polygon's edges cross.
#[derive(Debug)]
pub(super) struct Crossing;

/// Twice the signed area of a triangle, with the right sign; positive when it turns left.
pub(super) fn orientation(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| robust::Coord { x: p.x, y: p.y };
    robust::orient2d(coord(a), coord(b), coord(c))
}

/// Appends the triangles of the polygon, as indices into `points`; they turn left. Returns whether the outline goes
/// round once, or else several times or backwards somewhere.
pub(super) fn polygon(points: &[DVec2], triangles: &mut Vec<Triangle>) -> Result<bool, Crossing> {
    let outline = Outline::new(points);
    let first = triangles.len();
    let mut sweep = Sweep {
        places: &outline.places,
        status: BTreeMap::new(),
        late: BinaryHeap::new(),
        triangles,
        winds_once: true,
    };
    let mut edges = &outline.edges[..];
    for place in 0..outline.places.len() as u32 {
        let count = edges.partition_point(|edge| edge.left == place);
        let (starting, rest) = edges.split_at(count);
        edges = rest;
        sweep.event(place, starting)?;
    }
    let winds_once = sweep.winds_once;
    for triangle in &mut triangles[first..] {
        *triangle = triangle.map(|place| outline.corners[place as usize]);
    }
    Ok(winds_once)
}

/// An edge from one place to one farther to the right, or several that lie on each other.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    left: u32,
    right: u32,
    /// How often the outline runs to the right here, less how often it runs to the left.
    winding: i32,
}

/// The distinct places of a polygon, from left to right, and its edges.
struct Outline {
    places: Vec<DVec2>,
    /// A corner in each place.
    corners: Vec<u32>,
    /// In order of their left ends.
    edges: Vec<Edge>,
}

impl Outline {
    fn new(points: &[DVec2]) -> Self {
        let count = points.len();
        let key = |i: u32| points[i as usize] + DVec2::ZERO; // −0 and 0 are one place
        let mut order: Vec<u32> = (0..count as u32).collect();
        order.sort_unstable_by(|a, b| {
            let (p, q) = (key(*a), key(*b));
            p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(a.cmp(b))
        });
        let (mut places, mut corners) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut place_of = vec![0u32; count];
        for corner in order {
            if places.last() != Some(&key(corner)) {
                places.push(key(corner));
                corners.push(corner);
            }
            place_of[corner as usize] = places.len() as u32 - 1;
        }
        let between = |i: usize| (place_of[i], place_of[(i + 1) % count]);
        let mut edges: Vec<Edge> = (0..count)
            .map(between)
            .filter(|(a, b)| a != b)
            .map(|(a, b)| Edge { left: a.min(b), right: a.max(b), winding: if a < b { 1 } else { -1 } })
            .collect();
        edges.sort_unstable();
        edges.dedup_by(|next, kept| {
            let same = (next.left, next.right) == (kept.left, kept.right);
            kept.winding += if same { next.winding } else { 0 };
            same
        });
        edges.retain(|edge| edge.winding != 0);
        Self { places, corners, edges }
    }
}

/// The place of an edge in the order from bottom to top; or just below or above a point, to search with.
#[derive(Clone, Copy)]
struct Key {
    left: DVec2,
    right: DVec2,
    kind: Kind,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Below,
    Edge,
    Above,
}

impl Key {
    fn near(point: DVec2, kind: Kind) -> Self {
        Self { left: point, right: point, kind }
    }

    /// On which side of the edge a point is: `Less` if the edge is below it.
    fn side(&self, point: DVec2) -> Ordering {
        0f64.partial_cmp(&orientation(self.left, self.right, point)).unwrap_or(Ordering::Equal)
    }
}

impl Ord for Key {
    fn cmp(&self, other: &Self) -> Ordering {
        match (self.kind, other.kind) {
            (Kind::Edge, Kind::Edge) => {
                let is_first = (self.left.x, self.left.y) <= (other.left.x, other.left.y);
                if is_first {
                    self.side(other.left).then_with(|| self.side(other.right))
                } else {
                    other.side(self.left).then_with(|| other.side(self.right)).reverse()
                }
            }
            // A point on an edge is above what is just below it.
            (Kind::Edge, kind) => self.side(other.left).then(Kind::Edge.cmp(&kind)),
            (kind, Kind::Edge) => other.side(self.left).reverse().then(kind.cmp(&Kind::Edge)),
            (a, b) => a.cmp(&b),
        }
    }
}

impl PartialOrd for Key {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Key {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Key {}

/// An edge that the sweep crosses, with what is above it.
struct Crossed {
    right: u32,
    winding: i32,
    /// The winding number above it.
    above: i32,
    /// What is above it, where that is inside.
    region: Option<Region>,
}

struct Sweep<'a> {
    places: &'a [DVec2],
    status: BTreeMap<Key, Crossed>,
    /// The far ends of edges that lie on others.
    late: BinaryHeap<Reverse<Edge>>,
    triangles: &'a mut Vec<Triangle>,
    winds_once: bool,
}

impl Sweep<'_> {
    /// Goes over a place, from which the edges `starting` lead to the right.
    fn event(&mut self, place: u32, starting: &[Edge]) -> Result<(), Crossing> {
        let (mut ended, mut started) = (Vec::new(), starting.to_vec());
        self.take_ended(place, &mut ended, &mut started);
        self.order(place, &mut started);
        if ended.is_empty() && started.is_empty() {
            return Ok(()); // only slits end here
        }
        self.check_neighbours(place, &started)?;
        let point = self.places[place as usize];
        let below = self.status.range_mut(..Key::near(point, Kind::Below)).next_back().map(|(_, edge)| edge);
        let mut winding = below.as_ref().map_or(0, |edge| edge.above);
        let mut none = None;
        let below = below.map_or(&mut none, |edge| &mut edge.region);

        let mut filled = Pieces { places: self.places, triangles: self.triangles };
        let last = ended.pop();
        ended.into_iter().filter_map(|edge| edge.region).for_each(|region| region.finish(place, &mut filled));
        // The region above the place, for the topmost of the edges that start here.
        let mut above = None;
        match last {
            None if !started.is_empty() => {
                if let Some(region) = below.take() {
                    let (lower, upper) = region.split(place, &mut filled);
                    *below = Some(lower);
                    above = Some(upper);
                }
            }
            None => {}
            Some(last) => {
                let mut lower = below.take();
                let mut upper = last.region;
                lower.iter_mut().for_each(|region| region.add(place, Side::Upper, &mut filled));
                upper.iter_mut().for_each(|region| region.add(place, Side::Lower, &mut filled));
                if started.is_empty() {
                    *below = match (lower, upper) {
                        (Some(lower), Some(upper)) => Some(lower.merge(upper)),
                        (one, other) => one.or(other),
                    };
                } else {
                    (*below, above) = (lower, upper);
                }
            }
        }
        let count = started.len();
        for (i, edge) in started.into_iter().enumerate() {
            winding += edge.winding;
            self.winds_once &= matches!(winding, 0 | 1);
            let region =
                if i + 1 == count { above.take() } else { (winding != 0).then(|| Region::begin(place)) };
            let key = Key { left: point, right: self.places[edge.right as usize], kind: Kind::Edge };
            let crossed = Crossed { right: edge.right, winding: edge.winding, above: winding, region };
            self.status.insert(key, crossed);
        }
        Ok(())
    }

    /// Takes the edges that come to a place out of the order, from bottom to top. Those that go on behind it start anew.
    fn take_ended(&mut self, place: u32, ended: &mut Vec<Crossed>, started: &mut Vec<Edge>) {
        let point = self.places[place as usize];
        let range = Key::near(point, Kind::Below)..Key::near(point, Kind::Above);
        let keys: Vec<Key> = self.status.range(range).map(|(key, _)| *key).collect();
        for key in keys {
            let Some(edge) = self.status.remove(&key) else { continue };
            if edge.right != place {
                started.push(Edge { left: place, right: edge.right, winding: edge.winding });
            }
            ended.push(edge);
        }
    }

    /// Sorts the edges that start in a place from bottom to top. Of edges that lie on each other the shortest is kept,
    /// with all their windings; what the others have beyond its end starts there.
    fn order(&mut self, place: u32, started: &mut Vec<Edge>) {
        while let Some(Reverse(edge)) = self.late.peek().copied()
            && edge.left == place
        {
            self.late.pop();
            started.push(edge);
        }
        let point = |place: u32| self.places[place as usize];
        let by_angle = |a: &Edge, b: &Edge| {
            0f64.partial_cmp(&orientation(point(place), point(a.right), point(b.right)))
                .unwrap_or(Ordering::Equal)
        };
        started.sort_unstable_by(|a, b| by_angle(a, b).then(a.right.cmp(&b.right)));
        let mut kept: Vec<Edge> = Vec::with_capacity(started.len());
        for edge in started.drain(..) {
            match kept.last_mut() {
                Some(last) if by_angle(last, &edge).is_eq() => {
                    last.winding += edge.winding;
                    if edge.right != last.right {
                        self.late.push(Reverse(Edge { left: last.right, ..edge }));
                    }
                }
                _ => kept.push(edge),
            }
        }
        kept.retain(|edge| edge.winding != 0);
        *started = kept;
    }

    /// Fails if edges cross that become neighbours when those of a place have been taken out and `started` come in.
    fn check_neighbours(&self, place: u32, started: &[Edge]) -> Result<(), Crossing> {
        let point = self.places[place as usize];
        let ends = |key: &Key| [key.left, key.right];
        let below = self.status.range(..Key::near(point, Kind::Below)).next_back().map(|(key, _)| ends(key));
        let above = self.status.range(Key::near(point, Kind::Above)..).next().map(|(key, _)| ends(key));
        let of = |edge: Option<&Edge>| edge.map(|edge| [point, self.places[edge.right as usize]]);
        let pairs = match (of(started.first()), of(started.last())) {
            (Some(lowest), Some(topmost)) => [(below, Some(lowest)), (Some(topmost), above)],
            _ => [(below, above), (None, None)],
        };
        let crosses = pairs.into_iter().any(|(a, b)| a.zip(b).is_some_and(|(a, b)| cross(a, b)));
        if crosses { Err(Crossing) } else { Ok(()) }
    }
}

/// Whether two edges cross in a point inside both.
fn cross(a: [DVec2; 2], b: [DVec2; 2]) -> bool {
    let apart = |line: [DVec2; 2], points: [DVec2; 2]| {
        let sides = points.map(|p| orientation(line[0], line[1], p));
        sides[0].min(sides[1]) < 0.0 && sides[0].max(sides[1]) > 0.0
    };
    apart(a, b) && apart(b, a)
}

/// Where the triangles of pieces go.
pub(super) struct Pieces<'a> {
    pub(super) places: &'a [DVec2],
    pub(super) triangles: &'a mut Vec<Triangle>,
}

/// What is inside between two edges that follow each other.
struct Region {
    piece: Piece,
    /// A second piece above the first. Both end in the place where the outline turned back between them, which the next
    /// place of the region is joined with.
    upper: Option<Piece>,
}

impl Region {
    fn begin(place: u32) -> Self {
        Self { piece: Piece::begin(place), upper: None }
    }

    /// Adds a place on the region's lower or upper edge.
    fn add(&mut self, place: u32, side: Side, filled: &mut Pieces) {
        if let Some(upper) = self.upper.take() {
            match side {
                Side::Lower => std::mem::replace(&mut self.piece, upper).finish(place, filled),
                Side::Upper => upper.finish(place, filled),
            }
        }
        self.piece.add(place, side, filled);
    }

    /// Cuts the region in two, below and above a place inside.
    fn split(mut self, place: u32, filled: &mut Pieces) -> (Self, Self) {
        if let Some(mut upper) = self.upper.take() {
            self.piece.add(place, Side::Upper, filled);
            upper.add(place, Side::Lower, filled);
            return (self, Self { piece: upper, upper: None });
        }
        // The place is joined with the last one before it, which is on one of the region's edges.
        let (last, side) = self.piece.last();
        let mut other = Self::begin(last);
        self.piece.add(place, side, filled);
        other.piece.add(place, side.opposite(), filled);
        match side {
            Side::Lower => (other, self),
            Side::Upper => (self, other),
        }
    }

    /// Joins two regions that have just got the place where the outline between them turns back.
    fn merge(self, above: Self) -> Self {
        Self { piece: self.piece, upper: Some(above.piece) }
    }

    /// Ends the region in a place where its edges meet.
    fn finish(self, place: u32, filled: &mut Pieces) {
        self.piece.finish(place, filled);
        if let Some(upper) = self.upper {
            upper.finish(place, filled);
        }
    }
}
