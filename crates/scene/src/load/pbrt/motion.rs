//! What moves: transforms at two times, and the shutter.

use super::Builder;
use super::state::Active;
use super::tokens::{Place, TokenKind};
use crate::animation::{Keyed, KeyedObject};
use crate::load::LoadError;
use crate::origin::stored;
use crate::{Animation, Shutter};
use glam::DVec3;

impl Builder<'_> {
    /// `ActiveTransform` and `TransformTimes`.
    pub(super) fn moving(&mut self, directive: &str, place: &Place) -> Result<(), LoadError> {
        if directive == "TransformTimes" {
            let times = self.parser.numbers::<2>(place)?;
            if !(times[0] < times[1] && times.iter().all(|t| t.is_finite())) {
                return Err(self.parser.error(place, "a motion must end after it begins"));
            }
            self.times = times;
            return Ok(());
        }
        let token = self.parser.next()?;
        self.state.active = match token.as_ref().map(|token| &token.kind) {
            Some(TokenKind::Word(word)) if word == "StartTime" => Active::Start,
            Some(TokenKind::Word(word)) if word == "EndTime" => Active::End,
            Some(TokenKind::Word(word)) if word == "All" => Active::All,
            _ => return Err(self.parser.unexpected(place, "StartTime, EndTime or All", token)),
        };
        Ok(())
    }

    /// Lets instances move.
    pub(super) fn move_instances(&mut self, origin: DVec3) {
        let mut keyed = Vec::new();
        for (index, (world, end)) in (0..).zip(self.worlds.iter().zip(&self.ends)) {
            let Some(end) = end else { continue };
            let transforms = vec![stored(world, origin), stored(end, origin)];
            match Keyed::new(KeyedObject::Instance(index), self.times.to_vec(), transforms) {
                Ok(motion) => keyed.push(motion),
                Err(error) => self.report.ignored(format!("the motion of shape {index}: {error}")),
            }
        }
        if !keyed.is_empty() {
            self.scene.animations.push(Animation { keyed, ..Animation::default() });
        }
    }

    /// What moves does so while the shutter is open.
    pub(super) fn open_shutter(&mut self) {
        if self.scene.animations.is_empty() {
            return;
        }
        match Shutter::new(self.shutter[0], self.shutter[1]) {
            Ok(shutter) => self.scene.defaults.shutter = Some(shutter),
            Err(error) => self.report.ignored(error.to_string()),
        }
    }
}
