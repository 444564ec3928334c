//! The page's folder: the compiled renderer, its JavaScript, and the files of `crates/web/page`.

use super::toolchain::{PLATFORM, Toolchain};
use crate::shell::{cargo, root, run, target_dir};
use anyhow::Context;
use flate2::Compression;
use flate2::write::GzEncoder;
use sha2::{Digest, Sha256};
use std::fs;
use std::io::Write;
use std::path::Path;

/// Files of the repository that lessons open.
const SCENES: [&str; 1] = ["docs/scenes/mis.toml"];

/// Builds the page into `folder`, which it replaces.
pub fn build(folder: &Path) -> anyhow::Result<()> {
    let toolchain = Toolchain::find()?;
    run(&mut toolchain.cargo(&["build", "--locked", "--package", "web", "--profile", "web"])?)?;
    let compiled = target_dir()?.join("cross").join(PLATFORM).join("web/web.wasm");
    let _ = fs::remove_dir_all(folder);
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let tool = root().join("xtask/wasm-bindgen");
    let mut bindgen = cargo(&["run", "--quiet", "--release", "--locked", "--manifest-path"]);
    bindgen.arg(tool.join("Cargo.toml")).arg("--target-dir").arg(target_dir()?.join("wasm-bindgen"));
    run(bindgen.arg("--").arg(&compiled).arg(folder))?;
    for file in page_files()? {
        copy(&file, folder)?;
    }
    write_package(folder)?;
    write_service_worker(folder)?;
    let wasm = fs::read(folder.join("alhazen_bg.wasm")).context("the compiled renderer")?;
    let mut packed = GzEncoder::new(Vec::new(), Compression::best());
    packed.write_all(&wasm)?;
    let packed = packed.finish()?.len();
    eprintln!("{}: the renderer has {} bytes, {packed} compressed", folder.display(), wasm.len());
    Ok(())
}

/// The page's own files, and the scenes of its lessons.
fn page_files() -> anyhow::Result<Vec<std::path::PathBuf>> {
    let page = root().join("crates/web/page");
    let entries = fs::read_dir(&page).with_context(|| format!("no {}", page.display()))?;
    let mut files: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.extend(SCENES.map(|scene| root().join(scene)));
    files.sort();
    Ok(files)
}

fn copy(file: &Path, folder: &Path) -> anyhow::Result<()> {
    let name = file.file_name().context("a file has a name")?;
    fs::copy(file, folder.join(name)).with_context(|| format!("cannot copy {}", file.display()))?;
    Ok(())
}

/// The description by which npm knows the page's modules.
fn write_package(folder: &Path) -> anyhow::Result<()> {
    let package = serde_json::json!({
        "name": "alhazen-render",
        "version": env!("CARGO_PKG_VERSION"),
        "description": "A path tracer for web pages",
        "license": "MIT OR Apache-2.0",
        "type": "module",
        "main": "element.js",
        "types": "alhazen.d.ts",
        "exports": { ".": "./element.js", "./view": "./view.js", "./renderer": "./alhazen.js" },
        "sideEffects": ["element.js"],
    });
    let text = serde_json::to_string_pretty(&package)? + "\n";
    fs::write(folder.join("package.json"), text).context("cannot write package.json")
}

/// Tells the service worker which files there are, and a version that changes with any of them.
fn write_service_worker(folder: &Path) -> anyhow::Result<()> {
    let path = folder.join("sw.js");
    let text = fs::read_to_string(&path).context("the service worker")?;
    let mut names: Vec<_> = fs::read_dir(folder)?
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| {
            !["sw.js", "package.json"].contains(&name.as_str())
                && !name.ends_with(".ts")
                && !name.starts_with("test.")
                && name != "shot.html"
        })
        .collect();
    names.sort();
    let mut hash = Sha256::new();
    for name in &names {
        hash.update(name);
        hash.update(fs::read(folder.join(name)).with_context(|| format!("cannot read {name}"))?);
    }
    let version: String = hash.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect();
    // The page itself by both of its addresses.
    names.push("./".into());
    let text = text.replace("VERSION", &version);
    let text = text.replace("FILES_OF_THE_PAGE", &serde_json::to_string(&names)?);
    fs::write(&path, text).context("cannot write sw.js")
}
