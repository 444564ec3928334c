//! Constants that Rust and shaders share, as text.

use std::fmt::Write;

/// WGSL constants.
pub(crate) fn numbers(constants: impl IntoIterator<Item = (&'static str, u32)>) -> String {
    let mut text = String::new();
    for (name, value) in constants {
        let _ = writeln!(text, "const {name}: u32 = {value}u;"); // writing to a string cannot fail
    }
    text
}
