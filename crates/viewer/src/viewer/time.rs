//! Time in the scene: it is brought to the clock's moments, one after the other.

use super::state::Viewer;

/// So long (seconds) a moment is waited for before the next one follows anyway: rendering may stand still.
const PATIENCE: f64 = 0.5;

impl Viewer {
    /// Lets so many seconds pass, and brings the scene to where it is then.
    pub(super) fn pass_time(&mut self, ctx: &egui::Context, seconds: f32) {
        // What is being recorded must not change.
        if self.recording.is_some() {
            return;
        }
        if self.clock.playing {
            self.clock.advance(seconds);
            ctx.request_repaint();
        }
        let moment = self.clock.moment();
        let Some(document) = &mut self.document else { return };
        if *document.moment() == moment {
            return;
        }
        // A render thread that is told moments faster than it brings the scene to them would render none of them.
        let (when, change) = self.last_moment;
        let is_behind = self.shots[0].as_ref().is_some_and(|shot| shot.changes < change);
        if is_behind && self.time - when < PATIENCE {
            ctx.request_repaint_after(std::time::Duration::from_secs_f64(PATIENCE));
            return;
        }
        if let Err(error) = document.set_moment(moment) {
            self.notice(crate::worker::full_text(&error), true);
        }
        self.last_motion = self.time;
        self.follow_camera();
        self.send_edits();
        self.last_moment = (self.time, self.changes());
    }

    /// Looks through a camera of the scene, wherever time moves it.
    pub fn look_through_own(&mut self, index: usize) {
        let Some(camera) = self.document.as_ref().and_then(|d| d.scene().cameras.get(index)) else { return };
        self.look_through(camera.clone());
        self.follows = Some(index);
        self.follow_camera();
    }

    fn follow_camera(&mut self) {
        let Some(document) = &self.document else { return };
        let Some(camera) = self.follows.and_then(|i| document.scene().cameras.get(i)) else { return };
        self.camera = camera.clone();
        if let (Some(time), true) = (document.moment().time, camera.path.is_some()) {
            self.camera_time = time;
        }
    }

    /// Plays another clip from now on; `None` is the first of each file.
    pub fn play_clip(&mut self, clip: Option<String>) {
        (self.clock.clip, self.clock.shown) = (clip, true);
    }
}
