//! What stands for windows in a build without the feature `window`: nothing can open one.

use alhazen::gpu::screen::WindowTarget;

/// Why no window opens.
pub const LEFT_OUT: &str = "this build has no windows: they are the feature `window`, which is on by default";

/// A window that cannot be: [`PlainWindow::open`] always fails.
#[derive(Debug)]
pub enum PlainWindow {}

impl PlainWindow {
    /// Fails.
    ///
    /// # Errors
    /// Always.
    pub fn open(_title: &str, _size: [u32; 2]) -> anyhow::Result<Self> {
        Err(anyhow::anyhow!(LEFT_OUT))
    }

    /// What a device draws on.
    pub fn target(&self) -> WindowTarget {
        match *self {}
    }

    /// Its size in pixels.
    pub fn size(&self) -> [u32; 2] {
        match *self {}
    }

    /// Whether it is still open.
    pub fn poll(&mut self) -> bool {
        match *self {}
    }
}
