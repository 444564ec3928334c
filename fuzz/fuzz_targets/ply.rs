//! Any bytes as a PLY file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use scene::LoadOptions;

fuzz_target!(|bytes: &[u8]| {
    let _ = scene::load::ply::parse(bytes, &LoadOptions::default());
});
