//! Any bytes as an STL file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use scene::LoadOptions;

fuzz_target!(|bytes: &[u8]| {
    let _ = scene::load::stl::parse(bytes, &LoadOptions::default());
});
