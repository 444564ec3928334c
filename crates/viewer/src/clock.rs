//! The clock of scenes that move: which frame of the sequence is shown, and how it goes on.

use alhazen::{Moment, Scene, frame_time};

/// How much of a frame rounding may take: a place that frames are counted to is where its frame begins.
const ROUNDING: f64 = 1e-4;

/// Time in the scene. It counts in frames, as `alhazen render --frames` does: frame 0 is at 0 s.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    /// Whether the scene is shown as it is at the clock's time, rather than at rest, as its file describes it.
    pub shown: bool,
    /// Whether time passes.
    pub playing: bool,
    /// Starts again after the end, instead of stopping there.
    pub looping: bool,
    /// Seconds of the scene in a second; below 0 it goes back.
    pub speed: f32,
    /// Frames per second of the scene's time, above 0.
    pub fps: f32,
    /// Which clip is played, by name or number; `None` is the first of each file.
    pub clip: Option<String>,
    /// Clips that are shorter than others start again after their end, instead of holding their last pose.
    pub repeat: bool,
    /// Seconds until the end of the longest clip.
    duration: f32,
    /// Seconds of the scene.
    seconds: f64,
}

impl Default for Clock {
    fn default() -> Self {
        Self {
            shown: false,
            playing: false,
            looping: true,
            speed: 1.0,
            fps: 24.0,
            clip: None,
            repeat: false,
            duration: 0.0,
            seconds: 0.0,
        }
    }
}

impl Clock {
    /// A clock for another scene, with the settings of this one that are not of the scene.
    pub fn for_scene(&self, scene: &Scene) -> Self {
        let (looping, speed, fps) = (self.looping, self.speed, self.fps);
        Self { looping, speed, fps, duration: scene.duration(), ..Self::default() }
    }

    /// Seconds until the end of the longest clip.
    pub fn duration(&self) -> f32 {
        self.duration
    }

    /// Another clip is played, or the scene has got another: what is shown is not after its end.
    pub fn set_duration(&mut self, seconds: f32) {
        self.duration = seconds;
        self.seconds = self.seconds.min(f64::from(seconds));
    }

    /// What is shown.
    pub fn moment(&self) -> Moment {
        let time = self.shown.then(|| frame_time(self.frame(), self.fps));
        Moment { time, clip: self.clip.clone(), repeat: self.repeat }
    }

    /// The frame that is shown.
    pub fn frame(&self) -> u32 {
        self.frame_at(self.seconds)
    }

    /// The last frame that begins before the end.
    pub fn last_frame(&self) -> u32 {
        self.frame_at(f64::from(self.duration))
    }

    fn frame_at(&self, seconds: f64) -> u32 {
        (seconds * f64::from(self.fps) + ROUNDING) as u32
    }

    /// Shows a frame; after the last comes none.
    pub fn seek(&mut self, frame: u32) {
        self.seconds = f64::from(frame.min(self.last_frame())) / f64::from(self.fps);
        self.shown = true;
    }

    /// Stands still, so many frames further on.
    pub fn step(&mut self, frames: i32) {
        self.playing = false;
        let count = i64::from(self.last_frame()) + 1;
        let frame = i64::from(self.frame()) + i64::from(frames);
        let frame = if self.looping { frame.rem_euclid(count) } else { frame.clamp(0, count - 1) };
        self.seek(frame as u32);
    }

    /// Starts or stops. What stands at its end starts at its beginning.
    pub fn play(&mut self) {
        self.playing = !self.playing;
        self.shown = true;
        let (end, forward) = (self.last_frame(), self.speed >= 0.0);
        if self.playing && !self.looping && self.frame() == if forward { end } else { 0 } {
            self.seek(if forward { 0 } else { end });
        }
    }

    /// Shows the scene at rest.
    pub fn rest(&mut self) {
        (self.shown, self.playing, self.seconds) = (false, false, 0.0);
    }

    /// Lets so many seconds of the user's time pass.
    pub fn advance(&mut self, seconds: f32) {
        if !self.playing {
            return;
        }
        let (now, end) = (self.seconds + f64::from(seconds * self.speed), f64::from(self.duration));
        self.seconds = if (0.0..end).contains(&now) {
            now
        } else if self.looping && end > 0.0 {
            now.rem_euclid(end)
        } else {
            self.playing = false;
            let last = f64::from(self.last_frame()) / f64::from(self.fps);
            now.clamp(0.0, last)
        };
    }

    /// Options of `alhazen render` for what is shown; empty at rest.
    pub fn arguments(&self) -> String {
        let Moment { time: Some(time), clip, repeat } = self.moment() else { return String::new() };
        let clip = clip.map_or(String::new(), |clip| format!(" --animation {}", quoted(&clip)));
        format!("--at {time}{clip}{}", if repeat { " --repeat" } else { "" })
    }
}

/// A word of a command line.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clock(duration: f32) -> Clock {
        Clock { duration, ..Clock::default() }
    }

    #[test]
    fn frames_are_those_of_the_command_line() {
        for fps in [24.0, 25.0, 29.97, 30.0, 60.0, 1.0 / 3.0] {
            let mut clock = Clock { fps, ..clock(1000.0) };
            for frame in 0..clock.last_frame() {
                clock.seek(frame);
                assert_eq!(clock.frame(), frame, "{fps} fps");
                assert_eq!(clock.moment().time, Some(frame as f32 / fps));
            }
        }
    }

    #[test]
    fn steps_reach_every_frame_and_go_around_only_in_a_loop() {
        let mut clock = clock(0.5);
        let frames: Vec<u32> = (0..14)
            .map(|_| {
                clock.step(1);
                clock.frame()
            })
            .collect();
        assert_eq!(frames, [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0, 1]);
        clock.looping = false;
        clock.step(-5);
        assert_eq!(clock.frame(), 0);
        clock.step(100);
        assert_eq!(clock.frame(), 12);
    }

    #[test]
    fn time_passes_as_fast_as_it_is_told_to() {
        let mut clock = Clock { speed: 0.5, ..clock(2.0) };
        clock.advance(1.0);
        assert_eq!((clock.frame(), clock.moment().time), (0, None), "nothing plays");
        clock.play();
        (0..20).for_each(|_| clock.advance(0.1));
        assert_eq!(clock.frame(), 24);
        (0..21).for_each(|_| clock.advance(0.1));
        assert_eq!(clock.frame(), 1, "2.05 s of 2 s in a loop");
        clock.speed = -1.0;
        clock.advance(0.1);
        assert_eq!(clock.frame(), 46, "backwards through the beginning");
    }

    #[test]
    fn what_is_no_loop_ends_at_its_last_frame_and_starts_again() {
        let mut clock = Clock { looping: false, ..clock(1.01) };
        clock.play();
        (0..30).for_each(|_| clock.advance(0.1));
        assert_eq!((clock.frame(), clock.playing), (24, false));
        clock.play();
        assert_eq!((clock.frame(), clock.playing), (0, true));
        clock.rest();
        assert_eq!(clock.moment(), Moment::default());
    }

    #[test]
    fn scenes_of_no_length_stand_still() {
        let mut clock = clock(0.0);
        clock.play();
        clock.advance(1.0);
        clock.step(1);
        assert_eq!((clock.frame(), clock.last_frame()), (0, 0));
    }

    #[test]
    fn the_command_line_says_the_moment() {
        let mut clock = clock(2.0);
        assert_eq!(clock.arguments(), "");
        clock.seek(6);
        (clock.clip, clock.repeat) = (Some("Run Fox's".into()), true);
        assert_eq!(clock.arguments(), r"--at 0.25 --animation 'Run Fox'\''s' --repeat");
    }
}
