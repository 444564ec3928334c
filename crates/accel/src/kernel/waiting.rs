//! The beginning of a stream: rays meet what is at the top, sixteen at a time, and those that are not answered by that wait to walk.

use super::Best;
use super::answers::Answers;
use super::setup::{LaneSlabs, Setup, Shears, half_of, sixteen_rays, write_setups};
use super::top::{ANYTHING, RAYS, Top, store};
use crate::behind::Children;
use crate::layout::WIDTH;
use crate::ray::MISS;
use crate::simd::{Arithmetic, Part, Simd};
use crate::streams::{HitRow, RayLanes, RayStream};

/// The rays of a stream that have not begun to walk yet, sixteen of which have been tested with what is at the top.
pub(super) struct Waiting<'r, R: ?Sized> {
    pub rays: &'r R,
    pub top: Top<'r>,
    /// Magnitude of the coordinates of the tree that they begin in.
    extent: &'r [f32; 3],
    lanes: [RayLanes; 2],
    /// What each has met at the top, if nearest hits are asked for.
    row: HitRow,
    /// What each of the sixteen needs to walk.
    pub setups: [Setup; RAYS],
    /// What each has met already.
    pub bests: [Best; RAYS],
    /// Where each enters the root's boxes, infinite where it does not.
    pub near: [[f32; WIDTH]; RAYS],
    /// What each need not be tested with.
    pub behind: [Children; RAYS],
    /// Number of the first.
    pub first: usize,
    /// Which of them still wait, as bits.
    which: u32,
    /// The first one after them.
    next: usize,
}

impl<'r, R: RayStream + ?Sized> Waiting<'r, R> {
    pub fn new(rays: &'r R, top: Top<'r>, extent: &'r [f32; 3]) -> Self {
        Waiting {
            rays,
            top,
            extent,
            lanes: [RayLanes::NOTHING; 2],
            row: HitRow::MISSES,
            setups: [Setup::nothing(); RAYS],
            bests: [Best { hit: MISS, t_max: -1.0 }; RAYS],
            near: [[f32::INFINITY; WIDTH]; RAYS],
            behind: [Children::NONE; RAYS],
            first: 0,
            which: 0,
            next: 0,
        }
    }

    /// The next ray that has to walk, as its lane. Answers those that have not.
    #[inline(always)]
    pub fn take<S: Simd, const ANY: bool>(&mut self, s: S, answers: &mut impl Answers) -> Option<usize> {
        while self.which == 0 {
            if self.next >= self.rays.len() {
                return None;
            }
            s.call(MeetTop::<_, _, ANY>(self, answers));
        }
        let lane = self.which.trailing_zeros() as usize % RAYS;
        self.which &= self.which - 1;
        Some(lane)
    }

    /// Tests the next sixteen rays with what is at the top.
    #[inline(always)]
    fn meet_top<S: Simd, const ANY: bool>(&mut self, s: S, answers: &mut impl Answers) {
        let w = s.sixteen();
        let rays = sixteen_rays(s, self.rays, self.next, &mut self.lanes);
        (self.first, self.next) = (self.next, self.next + RAYS);
        self.rays.prefetch(self.next);
        self.rays.prefetch(self.next + WIDTH);
        let met = self.top.meet_faces::<_, ANY>(w, &rays);
        let mut answered = w.bits(met.any);
        if !ANY && self.top.has_faces() {
            // Also of those that walk on, which are answered again.
            self.top.write_hits(s, &met, &mut self.row);
            answers.row(self.first, &self.row);
        }
        if !self.top.is_all() {
            let slabs = LaneSlabs::new(w, &rays, self.extent);
            let t_max = if ANY { w.select(met.any, rays.t_max, w.splat(-1.0)) } else { met.t };
            let (near, mut walking) = self.top.meet_boxes(w, &rays, &slabs, t_max);
            write_setups(s, &rays, &slabs, &Shears::new(w, &rays), walking, &mut self.setups);
            self.write_nearest(s, &near, walking);
            if !self.top.behind.is_empty() {
                walking = self.look_behind(s, walking);
            }
            let mut ends = [0.0; RAYS];
            store(s, t_max, &mut ends);
            for lane in bits(walking) {
                self.bests[lane] = Best { hit: self.row.get(lane), t_max: ends[lane] };
            }
            self.which = walking;
            answered &= !walking;
        }
        if ANY {
            for lane in bits(answered) {
                answers.one(self.first + lane, &ANYTHING);
            }
        }
    }

    /// Finds out what lies behind the rays in `walking`, and returns which of them are left that enter another of the root's boxes.
    #[inline(always)]
    fn look_behind<S: Simd>(&mut self, s: S, walking: u32) -> u32 {
        let mut left = walking;
        let sides = [self.rays.leaving(self.first), self.rays.leaving(self.first + WIDTH)];
        for lane in bits(walking) {
            self.behind[lane] = self.top.behind.of(sides[lane / WIDTH][lane % WIDTH]);
            let of_root = self.behind[lane].of(self.top.entry);
            if of_root != 0 {
                let near = s.load(&self.near[lane]);
                let near = s.select(s.mask(of_root), near, s.splat(f32::INFINITY));
                s.store(near, &mut self.near[lane]);
                let enters = s.bits(s.lt(near, s.splat(f32::INFINITY))) != 0;
                left &= !(u32::from(!enters) << lane);
            }
        }
        left
    }

    /// Turns around where the rays enter the boxes, where any of eight in `which` does.
    #[inline(always)]
    fn write_nearest<S: Simd>(&mut self, s: S, near: &[<S::Sixteen as Arithmetic>::F; WIDTH], which: u32) {
        for half in 0..2 {
            if which >> (half * WIDTH) & 255 != 0 {
                let rows = s.transposed(half_of(s, near, half));
                for ray in 0..WIDTH {
                    s.store(rows[ray], &mut self.near[half * WIDTH + ray]);
                }
            }
        }
    }
}

/// A call of [`Waiting::meet_top`].
struct MeetTop<'c, 'r, R: ?Sized, A, const ANY: bool>(&'c mut Waiting<'r, R>, &'c mut A);

impl<R: RayStream + ?Sized, S: Simd, A: Answers, const ANY: bool> Part<S> for MeetTop<'_, '_, R, A, ANY> {
    #[inline(always)]
    fn run(self, s: S) {
        self.0.meet_top::<S, ANY>(s, self.1);
    }
}

/// The numbers of the bits that are set.
#[inline(always)]
fn bits(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (bit < 32).then_some(bit % RAYS)
    })
}
