//! Any bytes as an EXR file, and what it says as a picture and as a part of one.
#![no_main]

use film::{ExrFile, Part};
use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(file) = ExrFile::from_bytes(Path::new("memory.exr"), bytes) {
        let _ = file.picture(Path::new("memory.exr"));
    }
    let _ = Part::from_bytes("memory.exr", bytes);
});
