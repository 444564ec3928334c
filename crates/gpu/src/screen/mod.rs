//! Frames on a window: its surface, when pictures are taken from it and given back, and what went wrong with it.
//!
//! A [`Screen`] belongs to the device that [`Gpu::open_with_screen`] opened with it. A frame takes a picture from it before it is
//! prepared, draws the film on it at its end (`pass`), and gives it back once it is submitted; frames in flight stay the ring's
//! ([`crate::frames`]).

mod pass;

use crate::film::FilmBuffers;
use crate::frames::FrameClock;
use crate::{Gpu, GpuError, GpuOptions};
use pass::ScreenPass;
use std::fmt;
use std::time::{Duration, Instant};
use wgpu::CurrentSurfaceTexture::{Lost, Occluded, Outdated, Suboptimal, Success, Timeout, Validation};

/// A window that frames are to be shown on.
pub struct WindowTarget {
    /// The display that it is on.
    pub display: Box<dyn wgpu::wgt::WgpuHasDisplayHandle>,
    /// The window.
    pub window: wgpu::SurfaceTarget<'static>,
    /// Its width and height, physical pixels.
    pub size: [u32; 2],
}

/// When pictures reach the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PresentMode {
    /// The first that the window has of `immediate`, `mailbox` and `fifo`: without waiting for the screen, if that can be.
    #[default]
    Auto,
    /// Each in its turn, with the screen's refresh; every window has it.
    Fifo,
    /// The latest, with the screen's refresh.
    Mailbox,
    /// At once, in the middle of a refresh.
    Immediate,
}

impl PresentMode {
    /// The modes that are tried, in this order.
    fn candidates(self) -> &'static [wgpu::PresentMode] {
        match self {
            Self::Auto => {
                &[wgpu::PresentMode::Immediate, wgpu::PresentMode::Mailbox, wgpu::PresentMode::Fifo]
            }
            Self::Fifo => &[wgpu::PresentMode::Fifo],
            Self::Mailbox => &[wgpu::PresentMode::Mailbox],
            Self::Immediate => &[wgpu::PresentMode::Immediate],
        }
    }

    /// What a window that offers `offered` takes.
    ///
    /// # Errors
    /// When it has none of those.
    fn choose(self, offered: &[wgpu::PresentMode]) -> Result<wgpu::PresentMode, GpuError> {
        let found = self.candidates().iter().find(|mode| offered.contains(mode));
        found.copied().ok_or_else(|| GpuError::PresentMode {
            wanted: self.to_string(),
            offered: offered.iter().copied().map(mode_name).collect::<Vec<_>>().join(", "),
        })
    }
}

impl fmt::Display for PresentMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Auto => "auto",
            Self::Fifo => "fifo",
            Self::Mailbox => "mailbox",
            Self::Immediate => "immediate",
        })
    }
}

/// What a mode is called in arguments and reports.
fn mode_name(mode: wgpu::PresentMode) -> String {
    format!("{mode:?}").to_lowercase()
}

/// What the host spent on showing a frame; on trying to, where the window was hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShowTimes {
    /// Until it had a picture to draw on, waiting for the screen included.
    pub acquired: Duration,
    /// Until it had given the picture back.
    pub presented: Duration,
}

/// A picture of the window that a frame draws on.
pub(crate) struct Acquired {
    texture: wgpu::SurfaceTexture,
    time: Duration,
}

/// A window's surface, and what draws films on it.
pub struct Screen {
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    pass: ScreenPass,
    /// Whether the window has another size than the surface.
    is_stale: bool,
    /// Whether the window has no area.
    is_hidden: bool,
    shown: Vec<ShowTimes>,
    missed: u32,
}

impl Gpu {
    /// Opens a device that can draw on a window: of those that can, the one that the options ask for, or the best.
    ///
    /// # Errors
    /// When none can, the window does not have the mode, or as [`Gpu::open`].
    pub fn open_with_screen(
        options: &GpuOptions,
        target: WindowTarget,
        mode: PresentMode,
    ) -> Result<(Self, Screen), GpuError> {
        let instance = crate::device::instance(Some(target.display));
        let surface =
            instance.create_surface(target.window).map_err(|e| GpuError::Screen { reason: e.to_string() })?;
        let adapters = crate::device::ranked_adapters(&instance);
        let able: Vec<_> = adapters.into_iter().filter(|a| a.is_surface_supported(&surface)).collect();
        if able.is_empty() {
            return Err(GpuError::Screen { reason: "no driver draws on this display".into() });
        }
        let (gpu, adapter) = Self::open_one(&able, options)?;
        let offered = surface.get_capabilities(adapter);
        let screen = Screen::new(&gpu, surface, &offered, target.size, mode)?;
        Ok((gpu, screen))
    }
}

impl Screen {
    fn new(
        gpu: &Gpu,
        surface: wgpu::Surface<'static>,
        offered: &wgpu::SurfaceCapabilities,
        [width, height]: [u32; 2],
        mode: PresentMode,
    ) -> Result<Self, GpuError> {
        // The optics encode values: a format that encodes is second best.
        let format = offered.formats.iter().find(|f| !f.is_srgb()).or(offered.formats.first());
        let format = *format.ok_or_else(|| GpuError::Screen { reason: "it offers no format".into() })?;
        let config = wgpu::SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format,
            color_space: wgpu::SurfaceColorSpace::Auto,
            width: width.max(1),
            height: height.max(1),
            desired_maximum_frame_latency: 2,
            present_mode: mode.choose(&offered.present_modes)?,
            alpha_mode: wgpu::CompositeAlphaMode::Auto,
            view_formats: Vec::new(),
        };
        let pass = ScreenPass::new(gpu, format)?;
        let is_hidden = width == 0 || height == 0;
        Ok(Self { surface, config, pass, is_stale: true, is_hidden, shown: Vec::new(), missed: 0 })
    }

    /// The mode that was taken.
    pub fn present_mode(&self) -> String {
        mode_name(self.config.present_mode)
    }

    /// The surface's format.
    pub fn format(&self) -> String {
        format!("{:?}", self.config.format)
    }

    /// Width and height of the window, physical pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.config.width, self.config.height]
    }

    /// Follows the window's size, physical pixels. A window without area shows nothing.
    pub fn resize(&mut self, [width, height]: [u32; 2]) {
        self.is_hidden = width == 0 || height == 0;
        if !self.is_hidden && self.size() != [width, height] {
            (self.config.width, self.config.height) = (width, height);
            self.is_stale = true;
        }
    }

    /// What showing took for each frame since the last call, and how many of them were not shown because the window was hidden.
    pub fn take_shown(&mut self) -> (Vec<ShowTimes>, u32) {
        (std::mem::take(&mut self.shown), std::mem::take(&mut self.missed))
    }

    /// A picture to draw on; `None` while the window cannot be drawn on. The surface has as many as frames may be in flight, and
    /// one, so that the ring decides who waits.
    ///
    /// # Errors
    /// When the device fails.
    pub(crate) fn acquire(&mut self, gpu: &Gpu, in_flight: usize) -> Result<Option<Acquired>, GpuError> {
        let start = Instant::now();
        let wanted = in_flight as u32;
        self.is_stale |= self.config.desired_maximum_frame_latency != wanted;
        self.config.desired_maximum_frame_latency = wanted;
        // A surface that is outdated or lost is made anew, once a frame.
        for _ in 0..2 {
            if self.is_hidden {
                break;
            }
            if std::mem::take(&mut self.is_stale) {
                failed(gpu, "fitting the window's surface", || {
                    self.surface.configure(&gpu.device, &self.config)
                })?;
            }
            match failed(gpu, "taking a picture of the window", || self.surface.get_current_texture())? {
                Success(texture) | Suboptimal(texture) => {
                    return Ok(Some(Acquired { texture, time: start.elapsed() }));
                }
                Outdated | Lost => self.is_stale = true,
                Timeout | Occluded | Validation => break,
            }
        }
        self.missed += 1;
        self.shown.push(ShowTimes { acquired: start.elapsed(), presented: Duration::ZERO });
        Ok(None)
    }

    /// Records that the film is drawn on a picture.
    ///
    /// # Errors
    /// When the device fails.
    pub(crate) fn record(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        clock: &mut FrameClock,
        film: &FilmBuffers,
        picture: &Acquired,
    ) -> Result<(), GpuError> {
        let texture = &picture.texture.texture;
        self.pass.record(gpu, encoder, clock, film, texture)
    }

    /// Shows a picture, after what draws on it was submitted.
    ///
    /// # Errors
    /// When the device fails.
    pub(crate) fn present(&mut self, gpu: &Gpu, picture: Acquired) -> Result<(), GpuError> {
        let start = Instant::now();
        failed(gpu, "showing a frame", || gpu.queue.present(picture.texture))?;
        self.shown.push(ShowTimes { acquired: picture.time, presented: start.elapsed() });
        Ok(())
    }
}

fn failed<T>(gpu: &Gpu, doing: &'static str, act: impl FnOnce() -> T) -> Result<T, GpuError> {
    gpu.guarded(act).map_err(|reason| GpuError::Device { doing, reason })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_without_waiting_come_first_and_missing_ones_are_named() {
        use wgpu::PresentMode::{Fifo, FifoRelaxed, Immediate, Mailbox};
        let auto = |offered: &[wgpu::PresentMode]| PresentMode::Auto.choose(offered).expect("has fifo");
        assert_eq!(auto(&[Fifo, Mailbox, Immediate]), Immediate);
        assert_eq!(auto(&[FifoRelaxed, Fifo, Mailbox]), Mailbox);
        assert_eq!(auto(&[FifoRelaxed, Fifo]), Fifo);
        let error = PresentMode::Mailbox.choose(&[Fifo, Immediate]).expect_err("has no mailbox");
        assert_eq!(error.to_string(), "the window has no present mode `mailbox`; it has fifo, immediate");
    }
}
