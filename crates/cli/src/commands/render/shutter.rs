//! `--shutter` and its like: what moves is blurred.

use super::args::RenderArgs;
use super::parsing::{ShutterTimes, parse_rolling, parse_shutter, parse_shutter_shape};
use crate::console::say;
use alhazen::{Integrator, Rolling, Scene, Shutter, ShutterShape};
use anyhow::{Context, ensure};
use clap::Args;

/// When light reaches the film.
#[derive(Debug, Clone, Args)]
pub struct ShutterArgs {
    /// Blur what moves while the shutter is open: OPEN..CLOSE in seconds around the picture's
    /// moment, or a share of a frame around it (0.5 is a shutter of 180 degrees), or off [default:
    /// what the scene says, else off].
    #[arg(long, help_heading = "Sequence", value_name = "OPEN..CLOSE|SHARE|off", value_parser = parse_shutter, allow_hyphen_values = true)]
    pub shutter: Option<ShutterTimes>,
    /// How the shutter opens and closes: box, triangle, or trapezoid:RISE,FALL with shares of the
    /// time.
    #[arg(long, help_heading = "Sequence", value_name = "SHAPE", value_parser = parse_shutter_shape)]
    pub shutter_shape: Option<ShutterShape>,
    /// Expose one line of pixels after the other, the last one later than the first by so many
    /// seconds: rows:SECONDS or columns:SECONDS.
    #[arg(long, help_heading = "Sequence", value_name = "LINES:SECONDS", value_parser = parse_rolling)]
    pub rolling: Option<Rolling>,
}

impl RenderArgs {
    /// The shutter that the arguments ask for, or the scene.
    ///
    /// # Errors
    /// Where a shape is given to a shutter that does not open.
    pub(super) fn shutter(&self, scene: &Scene) -> anyhow::Result<Option<Shutter>> {
        let ShutterArgs { shutter, shutter_shape, rolling } = &self.shutter;
        let base = match shutter {
            Some(ShutterTimes::Off) => None,
            Some(ShutterTimes::Seconds(open, close)) => Some(Shutter::new(*open, *close)?),
            Some(ShutterTimes::Share(share)) => Some(Shutter::of_frame(*share, self.fps)?),
            // Lines that are exposed for an instant each.
            None if rolling.is_some() => {
                Some(scene.defaults.shutter.map_or_else(|| Shutter::new(0.0, 0.0), Ok)?)
            }
            None => scene.defaults.shutter,
        };
        ensure!(
            base.is_some() || (shutter_shape.is_none() && rolling.is_none()),
            "--shutter-shape and --rolling need a shutter that opens: --shutter"
        );
        let Some(mut base) = base else { return Ok(None) };
        base.shape = shutter_shape.unwrap_or(base.shape);
        base.rolling = rolling.or(base.rolling);
        base.checked().map(Some).context("the shutter")
    }
}

/// Brings a scene that is animated to a moment, with the shutter open around it if it opens.
pub fn bring(scene: &mut Scene, time: f32, shutter: Option<&Shutter>) {
    match shutter {
        Some(shutter) => scene.open_shutter(time, shutter),
        None => scene.set_time(time),
    }
}

/// Says what of the motion is not shown.
pub fn say_what_is_held(scene: &Scene, integrator: &Integrator) {
    let Some(motion) = &scene.motion else { return };
    if integrator.makes_frames() {
        return say!("on GPUs `{}` shows the middle of the shutter", integrator.name());
    }
    for held in &motion.held {
        say!("{held} changes while the shutter is open; it is shown as it is in the middle");
    }
}
