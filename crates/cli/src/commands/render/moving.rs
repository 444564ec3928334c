//! Scenes that change over time, on the clock of `--frames` and `--at`.

use super::args::RenderArgs;
use super::setup::job;
use super::shutter::bring;
use alhazen::{Camera, Job, LoadStats, Loaded, Renderer, Scene};
use anyhow::{Context, ensure};
use std::ops::Range;

/// A scene that is brought to each frame's moment.
pub struct Moving {
    /// When the renderer's scene is, seconds.
    shown: f32,
}

impl Moving {
    /// Chooses what is played and brings the scene to its first moment. `None` if it then stays as it is.
    pub fn start(args: &RenderArgs, scene: &mut Scene, first_frame: u32) -> anyhow::Result<Option<Self>> {
        if let Some(name) = &args.animation {
            let known = || {
                let clips = scene.animations.iter().flat_map(|a| a.clips.iter());
                clips.map(|c| c.name.clone()).collect::<Vec<_>>()
            };
            let known = known();
            let found = scene.play(name);
            ensure!(found, "there is no animation {name:?}; the scene has {known:?}");
        }
        scene.animations.iter_mut().for_each(|animation| animation.repeat = args.repeat);
        let (time, shutter) = (args.seconds(first_frame), args.shutter(scene)?);
        if !scene.is_animated() || (time.is_none() && shutter.is_none()) {
            return Ok(None);
        }
        let shown = time.unwrap_or(0.0);
        bring(scene, shown, shutter.as_ref());
        Ok(time.map(|_| Self { shown }))
    }

    /// Brings scene, camera and renderer to a frame; says what was built, if anything.
    pub fn show(
        &mut self,
        args: &RenderArgs,
        frame: u32,
        loaded: &mut Loaded,
        shown: &mut Job,
        renderer: &mut Renderer,
    ) -> anyhow::Result<Option<LoadStats>> {
        let time = args.seconds(frame).unwrap_or(self.shown);
        if time == self.shown {
            return Ok(None);
        }
        let shutter = args.shutter(&loaded.scene)?;
        bring(&mut loaded.scene, time, shutter.as_ref());
        self.shown = time;
        // A scene without cameras keeps the one that frames all of its movement.
        if !loaded.scene.cameras.is_empty() {
            *shown = job(args, loaded, Some(time))?;
        }
        renderer.update(&loaded.scene).map(Some).context("cannot bring the scene to the next frame")
    }
}

/// What to say of a sequence whose pictures will all be the same: why, and what makes it move.
pub fn stillness(args: &RenderArgs, scene: &Scene, camera: &Camera, frames: &Range<u32>) -> Option<String> {
    if args.sequence().is_none() || frames.len() < 2 || camera.path.is_some() {
        return None;
    }
    let (count, last) = (frames.len(), scene.duration());
    let is_over = !args.repeat && args.seconds(frames.start).is_some_and(|first| first >= last);
    let (why, remedy) = if last == 0.0 {
        let why = "nothing in the scene moves, and its camera stands still".to_owned();
        (why, "--turntable SECONDS takes the camera around")
    } else if is_over {
        let why = format!("the animation is over after {last} s, before frame {}", frames.start);
        (why, "--repeat starts it again")
    } else {
        return None;
    };
    Some(format!("{why}: all {count} pictures will be equal; {remedy}"))
}
