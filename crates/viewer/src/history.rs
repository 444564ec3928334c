//! Undo and redo of values.

/// How long (seconds) changes of the same thing without a drag count as one: keys repeat.
const SAME_GESTURE: f64 = 0.7;
/// So many steps can be taken back.
const DEPTH: usize = 200;

/// A value with its past and its future.
#[derive(Clone, Debug, Default)]
pub struct History<T> {
    now: T,
    past: Vec<T>,
    future: Vec<T>,
    last: Option<Change>,
    gesture: Option<u64>,
}

/// The last change.
#[derive(Clone, Debug)]
struct Change {
    what: String,
    time: f64,
    gesture: Option<u64>,
}

impl Change {
    /// Whether another change is part of the same step: of the same drag, however long the pointer
    /// rests; without one, soon after.
    fn goes_on(&self, later: &Self) -> bool {
        self.what == later.what
            && match (self.gesture, later.gesture) {
                (Some(before), Some(now)) => before == now,
                _ => later.time - self.time < SAME_GESTURE,
            }
    }
}

impl<T: Clone + PartialEq> History<T> {
    /// A value without a past.
    pub fn new(now: T) -> Self {
        Self { now, past: Vec::new(), future: Vec::new(), last: None, gesture: None }
    }

    /// The value as it is.
    pub fn now(&self) -> &T {
        &self.now
    }

    /// The drag that changes belong to from now on; `None` while no button is held.
    pub fn set_gesture(&mut self, gesture: Option<u64>) {
        self.gesture = gesture;
    }

    /// Changes the value.
    ///
    /// - `what`: changes of the same thing in one drag, or in short succession, are one step.
    /// - `time`: seconds, from whatever beginning.
    pub fn change(&mut self, what: &str, time: f64, change: impl FnOnce(&mut T)) {
        let before = self.now.clone();
        change(&mut self.now);
        if self.now == before {
            return;
        }
        let change = Change { what: what.to_owned(), time, gesture: self.gesture };
        if !self.last.as_ref().is_some_and(|last| last.goes_on(&change)) {
            self.past.push(before);
            if self.past.len() > DEPTH {
                self.past.remove(0);
            }
        }
        self.future.clear();
        self.last = Some(change);
    }

    /// Takes the last step back; false if there is none.
    pub fn undo(&mut self) -> bool {
        self.last = None;
        let Some(before) = self.past.pop() else { return false };
        self.future.push(std::mem::replace(&mut self.now, before));
        true
    }

    /// As [`History::undo`], of a step that nobody will want again, such as a drag that was given up.
    pub fn abandon(&mut self) -> bool {
        let undone = self.undo();
        if undone {
            self.future.pop();
        }
        undone
    }

    /// Makes the step again that was taken back; false if there is none.
    pub fn redo(&mut self) -> bool {
        self.last = None;
        let Some(after) = self.future.pop() else { return false };
        self.past.push(std::mem::replace(&mut self.now, after));
        true
    }

    /// Whether there is a step to take back.
    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    /// Whether there is a step to make again.
    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_go_back_and_forth() {
        let mut h = History::new(1);
        h.change("a", 0.0, |v| *v = 2);
        h.change("b", 0.1, |v| *v = 3);
        assert!(h.undo() && *h.now() == 2 && h.undo() && *h.now() == 1 && !h.undo());
        assert!(h.redo() && *h.now() == 2 && h.redo() && *h.now() == 3 && !h.redo());
        h.undo();
        h.change("c", 5.0, |v| *v = 9);
        assert!(!h.can_redo() && h.can_undo(), "a change makes another future");
    }

    #[test]
    fn a_drag_is_one_step_and_nothing_is_none() {
        let mut h = History::new(0);
        (1..100).for_each(|i| h.change("slider", f64::from(i) * 0.1, |v| *v = i));
        h.change("slider", 10.0, |_| {});
        assert!(h.undo() && *h.now() == 0 && !h.can_undo());
        h.change("slider", 20.0, |v| *v = 1);
        h.change("slider", 22.0, |v| *v = 2);
        assert!(h.undo() && *h.now() == 1, "a pause ends the drag");
    }

    #[test]
    fn a_drag_is_one_step_however_long_the_pointer_rests() {
        let mut h = History::new(0);
        h.set_gesture(Some(1));
        h.change("slider", 0.0, |v| *v = 1);
        h.change("slider", 60.0, |v| *v = 2);
        h.set_gesture(Some(2));
        h.change("slider", 60.1, |v| *v = 3);
        assert!(h.undo() && *h.now() == 2, "another drag is another step");
        assert!(h.undo() && *h.now() == 0 && !h.can_undo());
        h.change("slider", 90.0, |v| *v = 4);
        h.change("colour", 90.1, |v| *v = 5);
        assert!(h.undo() && *h.now() == 4, "another thing is another step");
    }

    #[test]
    fn what_was_given_up_is_not_made_again() {
        let mut h = History::new(0);
        h.change("a", 0.0, |v| *v = 1);
        h.change("drag", 9.0, |v| *v = 2);
        assert!(h.abandon() && *h.now() == 1 && !h.can_redo());
        assert!(h.undo() && h.redo() && *h.now() == 1);
    }

    #[test]
    fn the_past_has_an_end() {
        let mut h = History::new(0);
        (1..1000).for_each(|i| h.change(&i.to_string(), f64::from(i), |v| *v = i));
        let steps = std::iter::from_fn(|| h.undo().then_some(())).count();
        assert_eq!(steps, DEPTH);
    }
}
