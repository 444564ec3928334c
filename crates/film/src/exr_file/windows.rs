//! Data windows: where the parts of a file lie.

use crate::{ImageError, limits};
use exr::prelude as ex;
use std::path::Path;

type Layer = ex::Layer<ex::AnyChannels<ex::FlatSamples>>;

/// The stored pixels of a part within the whole picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Window {
    pub x: i32,
    pub y: i32,
    pub width: usize,
    pub height: usize,
}

impl Window {
    pub fn of(layer: &Layer) -> Self {
        let ex::Vec2(x, y) = layer.attributes.layer_position;
        Self { x, y, width: layer.size.0, height: layer.size.1 }
    }

    /// The smallest window around both.
    fn with(self, other: Self) -> Self {
        let span = |a: i32, a_length: usize, b: i32, b_length: usize| {
            let end = |at: i32, length: usize| i64::from(at) + length as i64;
            let low = a.min(b);
            (low, (end(a, a_length).max(end(b, b_length)) - i64::from(low)) as usize)
        };
        let (x, width) = span(self.x, self.width, other.x, other.width);
        let (y, height) = span(self.y, self.height, other.y, other.height);
        Self { x, y, width, height }
    }
}

/// The window around all parts of a file of `length` bytes.
///
/// # Errors
/// [`ImageError::TooLarge`] if all channels on it take more memory than such a file may.
pub(super) fn around(path: &Path, layers: &[Layer], length: u64) -> Result<Window, ImageError> {
    let windows: Vec<Window> = layers.iter().map(Window::of).collect();
    let Some(whole) = windows.iter().copied().reduce(Window::with) else {
        return Ok(Window { x: 0, y: 0, width: 0, height: 0 });
    };
    let (width, height) = (whole.width as u64, whole.height as u64);
    let channels = layers.iter().map(|layer| layer.channel_data.list.len() as u64).sum();
    let fits = |bytes: u64| bytes <= limits::decoded_bytes(length);
    if windows.iter().any(|w| *w != whole) && !limits::bytes(width, height, channels).is_some_and(fits) {
        return Err(ImageError::TooLarge { path: path.to_owned(), width, height, channels });
    }
    Ok(whole)
}

/// The values of a channel on a larger window, zero outside of their own.
pub(super) fn placed<T: Copy + Default>(values: Vec<T>, own: Window, whole: Window) -> Vec<T> {
    if own == whole || own.width == 0 {
        return values;
    }
    let (left, top) = ((own.x - whole.x) as usize, (own.y - whole.y) as usize); // the whole begins before
    let mut all = vec![T::default(); whole.width * whole.height];
    for (row, line) in values.chunks_exact(own.width).enumerate() {
        let start = (top + row) * whole.width + left;
        all[start..start + own.width].copy_from_slice(line);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_placed_on_the_window_around_all() {
        let (a, b) =
            (Window { x: -1, y: 2, width: 2, height: 1 }, Window { x: 0, y: 1, width: 3, height: 2 });
        let whole = a.with(b);
        assert_eq!(whole, Window { x: -1, y: 1, width: 4, height: 2 });
        assert_eq!(placed(vec![1, 2], a, whole), [0, 0, 0, 0, 1, 2, 0, 0]);
        assert_eq!(placed(vec![1, 2, 3, 4, 5, 6], b, whole), [0, 1, 2, 3, 0, 4, 5, 6]);
    }
}
