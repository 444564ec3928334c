//! Any text as a scene file. Files that it names are looked for in an empty folder.
#![no_main]

use libfuzzer_sys::fuzz_target;
use scene::LoadOptions;
use scene::load::scene_file::{self, Parameters};
use std::path::Path;

fuzz_target!(|text: &str| {
    let path = Path::new("fuzz.toml");
    let folder = Path::new("/nonexistent");
    let options = LoadOptions { max_file_size: 1 << 20, ..LoadOptions::default() };
    let _ = scene_file::describe(text, path);
    let _ = scene_file::parse(text, path, folder, &Parameters::default(), &options);
});
