//! Which slot the next frame is prepared in, and when the host has to wait for the device.

use std::collections::VecDeque;

/// Most frames in flight.
pub const MOST_FRAMES: usize = 5;

/// What the next frame does first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// It is prepared in this slot, in `0..MOST_FRAMES`, which the device does not use.
    Prepare(usize),
    /// As many frames are in flight as may be: wait until this one is done, say so with [`FrameRing::finished`], and ask again.
    Wait(u64),
}

/// Frames between the host, which prepares one while the device works on those before it, and the device, which finishes them in
/// order. Everything that both sides touch exists once for each slot; a slot is the device's from [`FrameRing::submitted`] until
/// [`FrameRing::finished`].
///
/// The ring knows no device: what it decides is tested over all its states.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct FrameRing {
    depth: usize,
    /// Slot and number of each frame that the device has, the oldest first.
    in_flight: VecDeque<(usize, u64)>,
    preparing: Option<usize>,
    next_frame: u64,
}

impl FrameRing {
    /// An empty ring of `depth` frames, from 1 to [`MOST_FRAMES`]; what is outside of that is moved to its end.
    pub fn new(depth: usize) -> Self {
        let depth = depth.clamp(1, MOST_FRAMES);
        Self { depth, in_flight: VecDeque::new(), preparing: None, next_frame: 0 }
    }

    /// How many frames may be in flight.
    pub fn depth(&self) -> usize {
        self.depth
    }

    /// Lets more or fewer frames be in flight from now on. Of those that are too many, the next [`FrameRing::begin`] waits.
    pub fn set_depth(&mut self, depth: usize) {
        self.depth = depth.clamp(1, MOST_FRAMES);
    }

    /// How many frames the device has.
    pub fn in_flight(&self) -> usize {
        self.in_flight.len()
    }

    /// Where the next frame is prepared, or which frame has to be done before. Asked twice, it says the same.
    pub fn begin(&mut self) -> Turn {
        if let Some(slot) = self.preparing {
            return Turn::Prepare(slot);
        }
        if self.in_flight.len() >= self.depth {
            // As late as possible: with this one done there is room for the next.
            let (_, frame) = self.in_flight[self.in_flight.len() - self.depth];
            return Turn::Wait(frame);
        }
        // Fewer than `depth` slots are taken, so one of the first `MOST_FRAMES` is free.
        let free = |slot: &usize| self.in_flight.iter().all(|(taken, _)| taken != slot);
        let slot = (0..MOST_FRAMES).find(free).unwrap_or_default();
        self.preparing = Some(slot);
        Turn::Prepare(slot)
    }

    /// The frame that was being prepared is the device's now. Returns its number, counted from 0; `None` if none was begun.
    pub fn submitted(&mut self) -> Option<u64> {
        let slot = self.preparing.take()?;
        let frame = self.next_frame;
        self.next_frame += 1;
        self.in_flight.push_back((slot, frame));
        Some(frame)
    }

    /// The frame that was being prepared will not be submitted.
    pub fn abandoned(&mut self) {
        self.preparing = None;
    }

    /// The device is done with a frame, and with all before it. Returns the slots that are free by that, the oldest frame's first.
    pub fn finished(&mut self, frame: u64) -> Vec<usize> {
        let done = self.in_flight.iter().take_while(|(_, f)| *f <= frame).count();
        self.in_flight.drain(..done).map(|(slot, _)| slot).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// What a ring must not do, kept by hand: which slots are whose.
    #[derive(Clone, Debug, PartialEq, Eq, Hash)]
    struct Model {
        ring: FrameRing,
        device: Vec<(usize, u64)>,
        host: Option<usize>,
    }

    impl Model {
        /// Numbers of frames count from the oldest one in flight, so that there are only so many states.
        fn canonical(&self) -> Self {
            let mut model = self.clone();
            let oldest = self.device.first().map_or(self.ring.next_frame, |d| d.1);
            model.device.iter_mut().for_each(|d| d.1 -= oldest);
            model.ring.in_flight.iter_mut().for_each(|d| d.1 -= oldest);
            model.ring.next_frame -= oldest;
            model
        }

        fn begin(mut self) -> Self {
            match self.ring.begin() {
                Turn::Prepare(slot) => {
                    assert!(slot < MOST_FRAMES);
                    assert!(self.device.iter().all(|(taken, _)| *taken != slot), "overwrites what is in use");
                    assert!(self.host.is_none_or(|own| own == slot), "two slots at a time");
                    let depth = self.ring.depth();
                    assert!(self.host.is_some() || self.device.len() < depth, "more in flight than may be");
                    self.host = Some(slot);
                }
                Turn::Wait(frame) => {
                    assert!(self.host.is_none(), "has a slot already");
                    assert!(self.device.len() >= self.ring.depth(), "waits before the ring is full");
                    let left = self.device.iter().filter(|(_, f)| *f > frame).count();
                    assert_eq!(
                        left,
                        self.ring.depth() - 1,
                        "waits for a frame other than the one that makes room"
                    );
                }
            }
            self
        }

        fn submit(mut self) -> Self {
            match (self.ring.submitted(), self.host.take()) {
                (Some(frame), Some(slot)) => self.device.push((slot, frame)),
                (None, None) => {}
                (ring, host) => panic!("submitted {ring:?} of {host:?}"),
            }
            self
        }

        fn finish(mut self, count: usize) -> Self {
            let done: Vec<_> = self.device.drain(..count).collect();
            let freed = self.ring.finished(done[count - 1].1);
            assert_eq!(freed, done.iter().map(|d| d.0).collect::<Vec<_>>());
            self
        }

        /// All states that one step leads to.
        fn next(&self) -> Vec<Self> {
            let mut next = vec![self.clone().begin(), self.clone().submit()];
            next.extend((1..=self.device.len()).map(|count| self.clone().finish(count)));
            for depth in 1..=MOST_FRAMES {
                let mut changed = self.clone();
                changed.ring.set_depth(depth);
                next.push(changed);
            }
            let mut abandoned = self.clone();
            abandoned.ring.abandoned();
            abandoned.host = None;
            next.push(abandoned);
            next
        }
    }

    /// All states that can be reached from an empty ring by any steps.
    fn reachable() -> HashSet<Model> {
        let start = Model { ring: FrameRing::new(1), device: Vec::new(), host: None };
        let (mut seen, mut left) = (HashSet::from([start.clone()]), vec![start]);
        while let Some(model) = left.pop() {
            for next in model.next() {
                let next = next.canonical();
                if seen.insert(next.clone()) {
                    left.push(next);
                }
            }
        }
        seen
    }

    /// Over every state and every step from there: no slot in use is handed out, nobody waits early, for too long, or for ever.
    #[test]
    fn no_state_overwrites_or_waits_early() {
        let states = reachable();
        println!("{} states", states.len());
        assert!(states.len() > 1000, "{} states", states.len());
        for depth in 1..=MOST_FRAMES {
            let full = states.iter().filter(|m| m.ring.depth() == depth && m.device.len() == depth);
            assert!(full.count() > 0, "a ring of {depth} is never full");
        }
        // Wherever it is, a host that waits as it is told gets its slot after one wait.
        for mut model in states {
            if let Turn::Wait(frame) = model.ring.begin() {
                let count = model.device.iter().filter(|(_, f)| *f <= frame).count();
                model = model.finish(count);
            }
            assert!(matches!(model.ring.begin(), Turn::Prepare(_)), "waits twice");
        }
    }

    #[test]
    #[should_panic(expected = "overwrites what is in use")]
    fn a_slot_given_twice_is_noticed() {
        let model = Model { ring: FrameRing::new(2), device: Vec::new(), host: None }.begin().submit();
        let mut broken = model;
        broken.ring.in_flight.clear();
        broken.begin();
    }

    #[test]
    #[should_panic(expected = "waits before the ring is full")]
    fn an_early_wait_is_noticed() {
        let mut model = Model { ring: FrameRing::new(3), device: Vec::new(), host: None }.begin().submit();
        model.ring.in_flight.extend([(3, 1), (4, 2)]);
        model.begin();
    }

    #[test]
    fn depths_are_kept_in_range() {
        assert_eq!((FrameRing::new(0).depth(), FrameRing::new(9).depth()), (1, MOST_FRAMES));
    }
}
