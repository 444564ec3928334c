//! How much memory an image file may ask for.

/// No decoded image may be larger than this, in bytes.
const ABSOLUTE: u64 = 8 << 30;

/// Every file may decode to this many bytes, however short it is.
const FREE: u64 = 64 << 20;

/// The best that any of the formats compresses, with room to spare: deflate reaches 1032, PIZ some 4000.
const RATIO: u64 = 8192;

/// Channels of an EXR file at most. Pictures of production have some hundreds; looking for layers takes the square of it.
pub(crate) const MAX_CHANNELS: usize = 2048;

/// The largest number of bytes that a file of `length` bytes may decode to.
pub(crate) fn decoded_bytes(length: u64) -> u64 {
    length.saturating_mul(RATIO).clamp(FREE, ABSOLUTE)
}

/// The bytes of `width × height × channels` numbers of four bytes. `None` if a side is beyond
/// [`crate::MAX_SIDE`] or the number overflows.
pub(crate) fn bytes(width: u64, height: u64, channels: u64) -> Option<u64> {
    let side = 0..=u64::from(crate::MAX_SIDE);
    if !side.contains(&width) || !side.contains(&height) {
        return None;
    }
    (width * height).checked_mul(channels)?.checked_mul(4)
}
