//! A display without a screen (Xvfb) for tests that open windows.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

/// A display of its own.
pub struct Display {
    server: Child,
    pub name: String,
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

impl Display {
    /// Starts a server on a free number; `None` and a visible skip where there is none to start, or nothing draws.
    pub fn open(test: &str) -> Option<Self> {
        if alhazen::gpu::adapters().is_empty() {
            testkit::skip_without_gpu(test, "no driver draws on windows");
            return None;
        }
        let program = std::env::var_os("ALHAZEN_XVFB").unwrap_or_else(|| "Xvfb".into());
        let mut command = Command::new(program);
        // The pointer rests in the middle, which is to be outside the window: no tool-tip covers the picture.
        command.args(["-displayfd", "1", "-screen", "0", "1900x1400x24", "-nolisten", "tcp"]);
        let server = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let Ok(mut server) = server else {
            testkit::skip_without_tool(test, "there is no Xvfb; `cargo xtask test` sets it up");
            return None;
        };
        let mut number = String::new();
        let out = server.stdout.take().expect("piped");
        BufReader::new(out).read_line(&mut number).expect("a number");
        let display = Self { server, name: format!(":{}", number.trim()) };
        assert!(!number.trim().is_empty(), "{test}: Xvfb did not start");
        Some(display)
    }
}
