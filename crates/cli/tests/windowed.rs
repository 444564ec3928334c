//! Benchmarks whose frames are shown in a window, on a display without a screen (Xvfb).
#![cfg(target_os = "linux")]

mod common;

use common::display::Display;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    AtomEnum, ClientMessageEvent, ConfigureWindowAux, ConnectionExt, EventMask, ImageFormat, Window,
};
use x11rb::rust_connection::RustConnection;

/// Frames of few passes.
const SHADOWS: &str = "bench shadows --windowed --indices 4000 --lights 1 --small-lamps 0 --width 160 \
                       --height 90 --warm-up 1 --report out";

/// `alhazen` with `arguments` (separated by blanks) in `folder`.
fn alhazen(folder: &Path, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_alhazen"));
    command.args(arguments.split_whitespace()).current_dir(folder);
    command.env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").env_remove("DISPLAY");
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// How a user sees the window.
struct Onlooker {
    connection: RustConnection,
    root: Window,
}

impl Onlooker {
    fn new(display: &Display) -> Self {
        let (connection, screen) = x11rb::connect(Some(&display.name)).expect("a display");
        let root = connection.setup().roots[screen].root;
        Self { connection, root }
    }

    /// The window that is called as the benchmark, once it is there.
    fn window(&self) -> Option<Window> {
        let tree = self.connection.query_tree(self.root).ok()?.reply().ok()?;
        tree.children.into_iter().find(|&window| {
            let named = self.connection.get_property(false, window, AtomEnum::WM_NAME, AtomEnum::ANY, 0, 64);
            let name = named.ok().and_then(|n| n.reply().ok()).map(|n| n.value).unwrap_or_default();
            name == b"Alhazen: shadows"
        })
    }

    /// Share of pixels in the window's right half that are not black, if it can be seen and has this size.
    fn lit(&self, window: Window, [width, height]: [u16; 2]) -> Option<f64> {
        let geometry = self.connection.get_geometry(window).ok()?.reply().ok()?;
        if [geometry.width, geometry.height] != [width, height] {
            return None;
        }
        let (format, half) = (ImageFormat::Z_PIXMAP, width / 2);
        let image = self.connection.get_image(format, window, half as i16, 0, width - half, height, u32::MAX);
        let data = image.ok()?.reply().ok()?.data;
        let lit = data.chunks(4).filter(|p| p[..3].iter().any(|&c| c > 8)).count();
        Some(lit as f64 / (data.len() / 4) as f64)
    }

    /// Waits until the window shows something of this size.
    fn wait_for_light(&self, bench: &mut Child, size: [u16; 2]) -> Window {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(300) {
            if let Some(window) = self.window()
                && self.lit(window, size).is_some_and(|share| share > 0.3)
            {
                return window;
            }
            assert!(bench.try_wait().expect("known").is_none(), "the benchmark has ended by itself");
            std::thread::sleep(Duration::from_millis(20));
        }
        let _ = bench.kill();
        panic!("the window stays dark");
    }

    fn resize(&self, window: Window, [width, height]: [u16; 2]) {
        let wanted = ConfigureWindowAux::new().width(u32::from(width)).height(u32::from(height));
        self.connection.configure_window(window, &wanted).expect("sent");
        self.connection.flush().expect("sent");
    }

    /// Asks the window to close, as its title bar would.
    fn close(&self, window: Window) {
        let atom = |name: &[u8]| {
            self.connection.intern_atom(false, name).expect("sent").reply().expect("an atom").atom
        };
        let data = [atom(b"WM_DELETE_WINDOW"), 0, 0, 0, 0];
        let event = ClientMessageEvent::new(32, window, atom(b"WM_PROTOCOLS"), data);
        self.connection.send_event(false, window, EventMask::NO_EVENT, event).expect("sent");
        self.connection.flush().expect("sent");
    }
}

#[test]
fn frames_are_shown_follow_the_window_and_end_with_it() {
    let Some(display) = Display::open("frames_are_shown_follow_the_window_and_end_with_it") else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut endless = alhazen(folder.path(), &format!("{SHADOWS} --frames 100000000"));
    let mut endless = endless.env("DISPLAY", &display.name).spawn().unwrap();
    let onlooker = Onlooker::new(&display);
    let window = onlooker.wait_for_light(&mut endless, [160, 90]);
    onlooker.resize(window, [260, 150]);
    onlooker.wait_for_light(&mut endless, [260, 150]);
    onlooker.close(window);
    let ended = endless.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(1), "{said}");
    assert!(said.contains("error: the window was closed after") && !said.contains("panicked"), "{said}");
    assert!(ended.stdout.is_empty() && !folder.path().join("out").exists(), "something was written");
    for (mode, taken) in [("auto", "(asked for: auto)"), ("fifo", "fifo (asked for: fifo)")] {
        let arguments = format!("{SHADOWS} --frames 4 --present-mode {mode}");
        let ran = alhazen(folder.path(), &arguments).env("DISPLAY", &display.name).output().unwrap();
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        let text = std::fs::read_to_string(folder.path().join("out/shadows.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        let about = |name: &str| json["about"][name].as_str().unwrap_or_default();
        assert!(about("present mode").ends_with(taken) && !about("surface format").is_empty(), "{text}");
        assert_eq!(about("window"), "160×90");
        let row = &json["tables"][0]["rows"][0];
        for column in ["acquire ms", "present ms", "frame ms", "frames/s"] {
            assert!(row[column].as_f64().is_some_and(|v| v > 0.0), "{column}: {row}");
        }
    }
}

#[test]
fn windows_need_a_display_and_modes_a_window() {
    let folder = tempfile::tempdir().unwrap();
    common::fail(folder.path(), "bench tlas --present-mode fifo", "--windowed");
    common::fail(folder.path(), "bench tlas --windowed --present-mode sometimes", "mailbox");
    let ran = alhazen(folder.path(), "bench tlas --windowed --report out").output().unwrap();
    let said = String::from_utf8_lossy(&ran.stderr);
    assert_eq!(ran.status.code(), Some(1), "{said}");
    assert!(said.contains("error: cannot open a window") && said.contains("DISPLAY"), "{said}");
    assert!(!folder.path().join("out").exists(), "something was written");
}
