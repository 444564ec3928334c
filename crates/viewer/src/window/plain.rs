//! A window without panels, for who draws frames on it by themselves: measurements.

use super::ViewerError;
use alhazen::gpu::screen::WindowTarget;
use std::sync::Arc;
use std::time::Duration;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, WindowEvent};
use winit::event_loop::{ActiveEventLoop, EventLoop, OwnedDisplayHandle};
use winit::keyboard::{Key, NamedKey};
use winit::platform::pump_events::{EventLoopExtPumpEvents, PumpStatus};
use winit::window::{Window, WindowId};

/// A window, and what has happened to it. Its events are taken when somebody asks ([`PlainWindow::poll`]): the loop over frames is that
/// of who opened it. A process opens one at most.
pub struct PlainWindow {
    window: Arc<Window>,
    display: OwnedDisplayHandle,
    state: State,
    /// Dropped last: it is the connection to the display.
    event_loop: EventLoop<()>,
}

/// What events have said.
#[derive(Default)]
struct State {
    title: String,
    wanted: [u32; 2],
    window: Option<Result<Arc<Window>, winit::error::OsError>>,
    is_closed: bool,
}

impl PlainWindow {
    /// Opens a window whose inside has so many physical pixels, if the system lets it.
    ///
    /// # Errors
    /// When there is no display, or the system makes no window.
    pub fn open(title: &str, size: [u32; 2]) -> Result<Self, ViewerError> {
        // Windows may be opened when the system says so, which it does in one of the first rounds of events.
        const ROUNDS: u32 = 100;
        let mut event_loop = EventLoop::new()?;
        let display = event_loop.owned_display_handle();
        let mut state = State { title: title.to_owned(), wanted: size, ..State::default() };
        for _ in 0..ROUNDS {
            event_loop.pump_app_events(Some(Duration::from_millis(50)), &mut state);
            if let Some(window) = state.window.take() {
                return Ok(Self { window: window?, display, state, event_loop });
            }
        }
        Err(ViewerError::NoWindow)
    }

    /// What a device draws on.
    pub fn target(&self) -> WindowTarget {
        WindowTarget {
            display: Box::new(self.display.clone()),
            window: self.window.clone().into(),
            size: self.size(),
        }
    }

    /// Width and height of its inside, physical pixels; 0 while it is minimised.
    pub fn size(&self) -> [u32; 2] {
        self.window.inner_size().into()
    }

    /// Takes the events since the last call. Returns whether the window is still wanted: not closed, and Escape was not pressed.
    pub fn poll(&mut self) -> bool {
        let status = self.event_loop.pump_app_events(Some(Duration::ZERO), &mut self.state);
        !self.state.is_closed && !matches!(status, PumpStatus::Exit(_))
    }
}

impl ApplicationHandler for State {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_none() {
            let attributes = Window::default_attributes()
                .with_title(&self.title)
                .with_inner_size(PhysicalSize::<u32>::from(self.wanted));
            self.window = Some(event_loop.create_window(attributes).map(Arc::new));
        }
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => self.is_closed = true,
            WindowEvent::KeyboardInput { event, .. } => {
                let is_escape = event.logical_key == Key::Named(NamedKey::Escape);
                self.is_closed |= is_escape && event.state == ElementState::Pressed;
            }
            _ => {}
        }
    }
}
