//! Any bytes as a pbrt scene that includes nothing.
#![no_main]

use libfuzzer_sys::fuzz_target;
use scene::LoadOptions;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let _ = scene::load::pbrt::load_bytes(Path::new("/nowhere/fuzz.pbrt"), bytes.to_vec(), &LoadOptions::default());
});
