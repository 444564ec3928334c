//! Puts every file of `src/shaders` into the crate, by its name, so that no list of them has to be kept.

use std::fmt::Write;
use std::path::Path;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let folder = Path::new("src/shaders");
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut files = fs::read_dir(folder)?.map(|f| Ok(f?.path())).collect::<io::Result<Vec<_>>>()?;
    files.retain(|f| f.extension().is_some_and(|e| e == "wgsl"));
    files.sort();
    let mut text = String::from("&[\n");
    for file in files {
        let (name, path) = (file.file_stem().unwrap_or_default(), file.canonicalize()?);
        let _ = writeln!(text, "({name:?}, include_str!({path:?})),"); // writing to a string cannot fail
    }
    text.push(']');
    let out = env::var_os("OUT_DIR").ok_or_else(|| io::Error::other("cargo sets OUT_DIR"))?;
    fs::write(Path::new(&out).join("shaders.rs"), text)
}
