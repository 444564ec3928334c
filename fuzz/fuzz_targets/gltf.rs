//! Any bytes as a glTF file, text or binary. Files that it names are looked for in an empty folder.
#![no_main]

use libfuzzer_sys::fuzz_target;
use scene::LoadOptions;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let options = LoadOptions { max_file_size: 1 << 20, ..LoadOptions::default() };
    let _ = scene::load::gltf::load_bytes(Path::new("/nonexistent/fuzz.glb"), bytes, &options);
});
