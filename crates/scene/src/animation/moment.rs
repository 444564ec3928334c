//! A moment of a scene that moves, as a value.

use super::{Animation, NodePose};
use crate::Scene;

/// When a scene is shown, and what is played of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moment {
    /// Seconds since the beginning; `None` is the scene at rest, as its file describes it.
    pub time: Option<f32>,
    /// Which clip is played, by its name or number ([`Scene::play`]); `None` is the first of each file.
    pub clip: Option<String>,
    /// Clips start again after their end, instead of holding their last pose.
    pub repeat: bool,
}

/// When a frame of a sequence is, in seconds.
///
/// - `fps`: frames per second, above 0.
pub fn frame_time(frame: u32, fps: f32) -> f32 {
    frame as f32 / fps
}

impl Scene {
    /// Plays what a moment says, and brings the scene to it. A moment without a time changes no more than what
    /// [`Scene::set_time`] would play.
    pub fn set_moment(&mut self, moment: &Moment) {
        if let Some(clip) = &moment.clip {
            // Files without such a clip play what they played.
            self.play(clip);
        }
        self.animations.iter_mut().for_each(|animation| animation.repeat = moment.repeat);
        if let Some(time) = moment.time {
            self.set_time(time);
        }
    }

    /// Gives meshes that deform the shape that they have at rest.
    pub(crate) fn rest_meshes(&mut self) {
        let animations = std::mem::take(&mut self.animations);
        animations.iter().for_each(|animation| animation.rest_meshes(self));
        self.animations = animations;
    }
}

impl Animation {
    fn rest_meshes(&self, scene: &mut Scene) {
        let placed: Vec<NodePose> = self.rig.place(&self.rig.nodes);
        self.deform(&placed, &self.rig.weights, scene);
    }
}
