//! Grids of densities: Mitsuba's `.vol` files, version 3.
//!
//! Little-endian. Bytes 0–2 are `VOL`, byte 3 the version; then 32-bit integers: encoding (1 is 32-bit floats, the only one
//! that is read), cells along x, y and z, and channels (1); then the bounds as six floats, the lower corner first; then the
//! values, x fastest.
//! Source: Mitsuba 3 documentation, "Grid-based volume data source"; a file that Mitsuba wrote is read in the tests.

use super::{LoadError, LoadOptions};
use crate::DensityGrid;
use glam::Vec3;
use std::path::Path;

const HEADER: usize = 48;

/// Reads a file.
///
/// # Errors
/// [`LoadError::Read`], [`LoadError::TooLarge`], and [`LoadError::Malformed`] for what is no such file, for other encodings, and
/// for densities that are negative or not finite.
pub fn load(path: &Path, options: &LoadOptions) -> Result<DensityGrid, LoadError> {
    options.session(path, |options| {
        let bytes = options.read(path)?;
        parse(&bytes).map_err(|(object, message)| LoadError::malformed(path, object, message))
    })
}

/// The grid of a file's bytes.
///
/// # Errors
/// What in the file is wrong, and what is wrong with it.
pub fn parse(bytes: &[u8]) -> Result<DensityGrid, (String, String)> {
    let header = |message: String| ("the header".to_owned(), message);
    let (head, data) = bytes.split_at_checked(HEADER).ok_or_else(|| {
        header(format!("the file has {} bytes, but the header alone has {HEADER}", bytes.len()))
    })?;
    if &head[..3] != b"VOL" || head[3] != 3 {
        return Err(header("the file does not begin with `VOL` and version 3".into()));
    }
    let word = |at: usize| [head[at], head[at + 1], head[at + 2], head[at + 3]];
    let [encoding, x, y, z, channels] = [4, 8, 12, 16, 20].map(|at| u32::from_le_bytes(word(at)));
    if encoding != 1 {
        return Err(header(format!("encoding {encoding} is unknown; 1, 32-bit floats, is read")));
    }
    if channels != 1 {
        return Err(header(format!("there are {channels} channels; a density has 1")));
    }
    let cells = [x, y, z].iter().try_fold(1usize, |n, &c| n.checked_mul(c as usize));
    let expected = cells.and_then(|n| n.checked_mul(4));
    if cells == Some(0) || expected != Some(data.len()) {
        return Err(header(format!("{x} × {y} × {z} cells do not fit {} bytes of values", data.len())));
    }
    let [x0, y0, z0, x1, y1, z1] = [24, 28, 32, 36, 40, 44].map(|at| f32::from_le_bytes(word(at)));
    let values: Vec<f32> =
        data.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    if let Some(i) = values.iter().position(|v| !v.is_finite() || *v < 0.0) {
        return Err((format!("value {i}"), format!("a density must not be {}", values[i])));
    }
    DensityGrid::new([x, y, z], [Vec3::new(x0, y0, z0), Vec3::new(x1, y1, z1)], values)
        .ok_or_else(|| header("the upper bounds must be above the lower ones".into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(size: [u32; 3], values: &[f32]) -> Vec<u8> {
        let mut bytes = b"VOL\x03".to_vec();
        let words = [1, size[0], size[1], size[2], 1];
        bytes.extend(words.iter().flat_map(|w: &u32| w.to_le_bytes()));
        bytes.extend([0.0f32, 0.0, 0.0, 1.0, 1.0, 1.0].iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        bytes
    }

    /// The first 48 bytes of what `mi.VolumeGrid(numpy.zeros((4, 3, 2))).write` of Mitsuba 3.9.1 writes.
    #[test]
    fn files_of_mitsuba_are_read() {
        let head = "564f4c0301000000020000000300000004000000010000000000000000000000000000000000803f0000803f0000803f";
        let byte = |i: usize| u8::from_str_radix(&head[2 * i..2 * i + 2], 16).expect("hexadecimal");
        let mut bytes: Vec<u8> = (0..HEADER).map(byte).collect();
        bytes.extend((0..24).flat_map(|i| (i as f32).to_le_bytes()));
        let grid = parse(&bytes).expect("a grid");
        assert_eq!((grid.size(), grid.bounds()), ([2, 3, 4], [Vec3::ZERO, Vec3::ONE]));
        assert_eq!((grid.values()[7], grid.largest()), (7.0, 23.0));
    }

    #[test]
    fn what_is_no_grid_is_an_error() {
        let good = file([2, 1, 1], &[0.5, 1.0]);
        assert!(parse(&good).is_ok());
        for cut in 0..good.len() {
            assert!(parse(&good[..cut]).is_err(), "{cut} bytes");
        }
        for (at, byte, says) in [
            (0, b'X', "VOL"),
            (3, 2, "version 3"),
            (4, 2, "encoding 2"),
            (8, 0, "cells"),
            (11, 255, "cells"),
            (20, 3, "channels"),
            (39, 0xbf, "bounds"),
            (51, 0xbf, "density"),
        ] {
            let mut bad = good.clone();
            bad[at] = byte;
            let (object, message) = parse(&bad).expect_err(says);
            assert!(message.contains(says) || object.contains(says), "{object}: {message}");
        }
        let (object, _) = parse(&file([2, 1, 1], &[0.5, f32::NAN])).expect_err("NaN");
        assert_eq!(object, "value 1");
    }
}
