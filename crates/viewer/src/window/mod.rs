//! The window: events in, pictures out. What is shown and done is [`Viewer`]'s.

mod plain;
mod surface;

pub use plain::PlainWindow;
pub use surface::SurfaceError;

use crate::settings::Settings;
use crate::smoke::{Request, Run, Smoke, SmokeError};
use crate::viewer::{Start, Viewer};
use crate::worker::full_text;
use alhazen::{BackendError, Source};
use egui::ViewportId;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use surface::{Drawing, Surface};
use winit::application::ApplicationHandler;
use winit::dpi::{LogicalSize, PhysicalSize};
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Fullscreen, UserAttentionType, Window, WindowId};

/// What to open, and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// The first scene.
    pub source: Source,
    /// What the viewer begins with; its settings are replaced by those that were remembered.
    pub start: Start,
    /// Width and height of the window, physical pixels; `None` is as it was the last time.
    pub window: Option<[u32; 2]>,
    /// Run unattended; nothing is remembered then.
    pub smoke: Option<Smoke>,
    /// When the program began.
    pub began: Instant,
}

/// Why the window could not be opened or was closed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewerError {
    /// There is no display to open a window on.
    #[error("cannot open a window")]
    Display(#[from] winit::error::EventLoopError),
    /// The system cannot create a window.
    #[error("the system cannot create a window")]
    Window(#[from] winit::error::OsError),
    /// The system never allowed a window to be created.
    #[error("the system never allowed a window to be created")]
    NoWindow,
    /// Nothing can draw on the window.
    #[error("cannot draw on the window")]
    Surface(#[from] SurfaceError),
    /// Nothing can render.
    #[error("cannot render")]
    Backend(#[from] BackendError),
    /// A picture of the window could not be written.
    #[error("cannot write a picture of the window")]
    Capture(#[from] alhazen::ImageError),
    /// An unattended run has failed.
    #[error("the unattended run has failed")]
    Smoke(#[from] SmokeError),
}

/// What wakes the window.
#[derive(Debug)]
enum Wake {
    /// Another thread has something to see.
    Repaint,
    /// A screen reader.
    AccessKit(egui_winit::accesskit_winit::Event),
}

impl From<egui_winit::accesskit_winit::Event> for Wake {
    fn from(event: egui_winit::accesskit_winit::Event) -> Self {
        Self::AccessKit(event)
    }
}

/// Opens the window and returns when it is closed: what an unattended run has to say.
///
/// # Errors
/// See [`ViewerError`].
pub fn run(options: Options) -> Result<Vec<String>, ViewerError> {
    let event_loop = EventLoop::<Wake>::with_user_event().build()?;
    let proxy = event_loop.create_proxy();
    let mut start = options.start.clone();
    let keeps = if options.smoke.is_some() { None } else { Settings::path() };
    if let Some(path) = &keeps {
        start.settings = Settings::load(path);
    }
    let waker = proxy.clone();
    // Loading and rendering begin before there is a window: opening one takes its time.
    let viewer = Viewer::new(options.source.clone(), start, move || {
        // Without a window there is nothing to wake.
        let _ = waker.send_event(Wake::Repaint);
    })?;
    let run = options.smoke.clone().map(|smoke| Run::new(smoke, options.began.elapsed().as_secs_f64()));
    let mut app = App { options, proxy, viewer, keeps, run, open: None, result: Ok(()), finished: 0 };
    event_loop.run_app(&mut app)?;
    if let Some(path) = app.keeps.take() {
        app.viewer.save_settings(&path);
    }
    app.result.map(|()| app.run.map(|run| run.report).unwrap_or_default())
}

struct App {
    options: Options,
    proxy: EventLoopProxy<Wake>,
    viewer: Viewer,
    /// Where settings are kept.
    keeps: Option<PathBuf>,
    run: Option<Run>,
    open: Option<Open>,
    result: Result<(), ViewerError>,
    /// Pictures rendered into files that the user was told of.
    finished: u64,
}

/// The window and what belongs to it.
struct Open {
    window: Arc<Window>,
    surface: Surface,
    egui: egui_winit::State,
    /// When to draw again without being asked.
    next: Option<Instant>,
    hidden: bool,
}

impl App {
    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<Open, ViewerError> {
        let attributes = Window::default_attributes().with_title("Alhazen").with_visible(false);
        let [width, height] = self.viewer.settings.window;
        let attributes = match self.options.window {
            Some([width, height]) => attributes.with_inner_size(PhysicalSize::new(width, height)),
            None => attributes.with_inner_size(LogicalSize::new(width, height)),
        };
        let window = Arc::new(event_loop.create_window(attributes)?);
        let surface = Surface::new(event_loop, window.clone())?;
        let ctx = egui::Context::default();
        let mut egui = egui_winit::State::new(
            ctx,
            ViewportId::ROOT,
            &window,
            Some(window.scale_factor() as f32),
            window.theme(),
            Some(surface.max_texture_side()),
        );
        egui.init_accesskit(event_loop, &window, self.proxy.clone());
        // Screen readers want to know the window before it is seen.
        window.set_visible(true);
        window.request_redraw();
        Ok(Open { window, surface, egui, next: None, hidden: false })
    }

    /// Draws a frame.
    fn draw(&mut self, event_loop: &ActiveEventLoop) -> Result<(), ViewerError> {
        let Some(open) = &mut self.open else { return Ok(()) };
        if open.hidden {
            return Ok(());
        }
        let begin = Instant::now();
        let time = self.options.began.elapsed().as_secs_f64();
        let size = open.window.inner_size();
        open.surface.resize(size.width, size.height);
        let ctx = open.egui.egui_ctx().clone();
        let viewer = &mut self.viewer;
        ctx.set_zoom_factor(viewer.settings.zoom);
        ctx.set_theme(if viewer.settings.dark { egui::Theme::Dark } else { egui::Theme::Light });
        let input = open.egui.take_egui_input(&open.window);
        let (run, mut request, mut is_new) = (&mut self.run, Ok(None), true);
        let output = ctx.run_ui(input, |ui| {
            // What asks for another frame does so while this one is made; and a frame may be laid out twice.
            if std::mem::take(&mut is_new) {
                viewer.tick(ui.ctx(), time);
                if let Some(run) = run {
                    request = run.frame(viewer, ui.ctx());
                }
            }
            viewer.take_keys(ui.ctx());
            crate::panels::show(viewer, ui);
        });
        viewer.send_wishes(&ctx);
        // Ctrl+C and Ctrl+V are about text where text is typed or selected, and else about materials.
        let selected = ctx.plugin_opt::<egui::text_selection::LabelSelectionState>();
        let is_text = viewer.is_typing(&ctx) || selected.is_some_and(|text| text.lock().has_selection());
        open.egui.set_clipboard_shortcuts(is_text);
        open.egui.handle_platform_output_with_event_loop(&open.window, event_loop, output.platform_output);
        let primitives = ctx.tessellate(output.shapes, output.pixels_per_point);
        let drawing = Drawing {
            primitives,
            textures: output.textures_delta,
            pixels_per_point: output.pixels_per_point,
        };
        let capture = open.surface.draw(drawing, viewer.capture_to.is_some());
        if let (Some(capture), Some(path)) = (capture, viewer.capture_to.take()) {
            match capture.write(&path) {
                Ok(()) => viewer.notice(format!("wrote {}", path.display()), false),
                Err(error) if self.run.is_some() => return Err(error.into()),
                Err(error) => viewer.notice(full_text(&error), true),
            }
        }
        let delay = output.viewport_output.get(&ViewportId::ROOT).map(|v| v.repaint_delay);
        open.next = delay.filter(|d| *d < Duration::from_secs(3600)).map(|d| Instant::now() + d);
        viewer.statistics.frame(time, begin.elapsed().as_secs_f32() * 1e3);
        self.after_frame(event_loop, request?);
        Ok(())
    }

    /// What the frame has asked of the window.
    fn after_frame(&mut self, event_loop: &ActiveEventLoop, request: Option<Request>) {
        let Some(open) = &self.open else { return };
        let wants_all = self.viewer.full_screen;
        if wants_all != open.window.fullscreen().is_some() {
            open.window.set_fullscreen(wants_all.then_some(Fullscreen::Borderless(None)));
        }
        let title = self.viewer.title();
        if open.window.title() != title {
            open.window.set_title(&title);
        }
        if std::mem::replace(&mut self.finished, self.viewer.finished) < self.viewer.finished {
            // Who waits for the picture may be at another window.
            open.window.request_user_attention(Some(UserAttentionType::Informational));
        }
        match request {
            Some(Request::Resize(width, height)) => {
                let _ = open.window.request_inner_size(PhysicalSize::new(width, height));
            }
            Some(Request::Drop(path)) => self.viewer.drop_file(&path),
            Some(Request::Close) => event_loop.exit(),
            None => {}
        }
        if self.viewer.quit {
            event_loop.exit();
        }
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, error: ViewerError) {
        self.result = Err(error);
        event_loop.exit();
    }

    fn redraw(&self) {
        if let Some(open) = &self.open {
            open.window.request_redraw();
        }
    }

    /// Whether the window is seen; hidden ones cost nothing.
    fn set_hidden(&mut self, hidden: bool) {
        let Some(open) = &mut self.open else { return };
        if open.hidden != hidden {
            open.hidden = hidden;
            self.viewer.tell(crate::worker::Message::Pause(hidden || self.viewer.paused));
            if !hidden {
                self.redraw();
            }
        }
    }
}

impl ApplicationHandler<Wake> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.open.is_none() {
            match self.open(event_loop) {
                Ok(open) => self.open = Some(open),
                Err(error) => self.fail(event_loop, error),
            }
        }
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: StartCause) {
        if matches!(cause, StartCause::ResumeTimeReached { .. }) {
            self.redraw();
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, wake: Wake) {
        match wake {
            Wake::Repaint => self.redraw(),
            Wake::AccessKit(event) => {
                let Some(open) = &mut self.open else { return };
                match event.window_event {
                    egui_winit::accesskit_winit::WindowEvent::InitialTreeRequested => {
                        open.egui.egui_ctx().enable_accesskit();
                    }
                    egui_winit::accesskit_winit::WindowEvent::ActionRequested(request) => {
                        open.egui.on_accesskit_action_request(request);
                    }
                    egui_winit::accesskit_winit::WindowEvent::AccessibilityDeactivated => {
                        open.egui.egui_ctx().disable_accesskit();
                    }
                }
                self.redraw();
            }
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else { return };
        let response = open.egui.on_window_event(&open.window, &event);
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::RedrawRequested => {
                if let Err(error) = self.draw(event_loop) {
                    self.fail(event_loop, error);
                }
                return;
            }
            WindowEvent::Resized(size) => {
                let scale = open.window.scale_factor() as f32 * self.viewer.settings.zoom;
                self.viewer.settings.window = [size.width as f32 / scale, size.height as f32 / scale];
                self.set_hidden(size.width == 0 || size.height == 0);
            }
            WindowEvent::Occluded(hidden) => self.set_hidden(hidden),
            WindowEvent::DroppedFile(path) => self.viewer.drop_file(&path),
            _ => {}
        }
        if response.repaint {
            self.redraw();
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let next = self.open.as_ref().filter(|open| !open.hidden).and_then(|open| open.next);
        match next {
            Some(next) if next <= Instant::now() => {
                self.redraw();
                event_loop.set_control_flow(ControlFlow::Wait);
            }
            Some(next) => event_loop.set_control_flow(ControlFlow::WaitUntil(next)),
            None => event_loop.set_control_flow(ControlFlow::Wait),
        }
    }
}
