//! Any bytes as a saved scene.
#![no_main]

use libfuzzer_sys::fuzz_target;
use scene::tables::SceneTables;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(scene) = scene::load::packed::unpack(Path::new("memory.alhazen"), bytes) {
        let _ = SceneTables::build(&scene);
    }
});
