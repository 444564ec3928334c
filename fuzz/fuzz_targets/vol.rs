//! Any bytes as a grid of densities.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = scene::load::vol::parse(bytes);
});
