//! Decisions about a glTF file whose structure is right: counts, indices, numbers and what is combined.
#![no_main]

use libfuzzer_sys::fuzz_target;
use scene::LoadOptions;
use scene::tables::SceneTables;
use std::path::Path;
use testkit::{Choices, random_glb};

fuzz_target!(|bytes: &[u8]| {
    let mut choices = Choices::from_bytes(bytes);
    let lenient = choices.once_in(2);
    let file = random_glb(&mut choices);
    let options = LoadOptions { lenient, max_memory: 256 << 20, ..LoadOptions::default() };
    if let Ok(mut loaded) = scene::load::gltf::load_bytes(Path::new("/nonexistent/fuzz.glb"), &file, &options) {
        loaded.scene.set_time(0.7);
        let _ = SceneTables::build(&loaded.scene);
    }
});
