//! Any bytes as a texture or environment map.
#![no_main]

use libfuzzer_sys::fuzz_target;
use scene::{LoadOptions, LoadReport};

fuzz_target!(|bytes: &[u8]| {
    let options = LoadOptions { max_texture_size: 64, ..LoadOptions::default() };
    let _ = scene::load::textures::decode("fuzz.tga", bytes, &options, &mut LoadReport::default());
});
