//! `cargo xtask gallery`: the README's pictures, and a contact sheet of all scenes that are at hand.

use crate::shell::{output_within, release_binary, root, run as run_command, shared_dir};
use anyhow::{Context, ensure};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// Built-in scenes, the width of their picture in the documentation, and samples per pixel before it is denoised.
const PICTURES: [(&str, u32, u32); 9] = [
    ("three-spheres", 960, 64),
    ("cornell", 640, 128),
    ("material-grid", 960, 128),
    ("textures", 960, 128),
    ("glass", 960, 128),
    ("model", 960, 128),
    ("lights", 960, 128),
    ("layers", 960, 128),
    ("atrium", 960, 64),
];

/// Endings of scene files.
const SCENE_ENDINGS: [&str; 4] = ["obj", "gltf", "glb", "ply"];

/// Thumbnails of the contact sheet are this wide.
const THUMBNAIL: u32 = 240;
/// A file that takes longer than this is reported as too slow.
const LIMIT: Duration = Duration::from_secs(180);

/// Render the built-in scenes to docs/images, and all scenes of the shared folder to target/gallery.
#[derive(Debug, clap::Args)]
pub struct GalleryArgs {
    /// Folder with scene files for a contact sheet [default: `scenes` in the shared test data, if there is any].
    #[arg(long, value_name = "DIR")]
    shared: Option<PathBuf>,
    /// Samples per pixel [default: what each picture needs; 32 for the contact sheet].
    #[arg(long)]
    spp: Option<u32>,
    /// Only scenes whose name or path contains this.
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Leave the contact sheet out.
    #[arg(long)]
    no_contact_sheet: bool,
}

/// Renders the pictures.
pub fn run(args: &GalleryArgs) -> anyhow::Result<()> {
    let binary = release_binary()?;
    let wanted = |name: &str| args.only.as_ref().is_none_or(|only| name.contains(only.as_str()));
    let images = root().join("docs/images");
    std::fs::create_dir_all(&images).with_context(|| format!("cannot make {}", images.display()))?;
    for (name, width, spp) in PICTURES.into_iter().filter(|(name, ..)| wanted(name)) {
        let mut command = Command::new(&binary);
        command.arg("render").arg(name).arg("--output").arg(images.join(format!("{name}.png")));
        command.args(["--width", &width.to_string(), "--spp", &args.spp.unwrap_or(spp).to_string()]);
        command.arg("--denoise");
        run_command(&mut command)?;
    }
    let folder = args.shared.clone().or_else(|| Some(shared_dir()?.join("scenes")));
    match folder {
        Some(folder) if !args.no_contact_sheet => {
            contact_sheet(&binary, &folder, args.spp.unwrap_or(32), &wanted)
        }
        Some(_) => Ok(()),
        None => {
            eprintln!("no shared scenes, so no contact sheet; name a folder with --shared");
            Ok(())
        }
    }
}

/// Renders every scene file below `folder` and writes `target/gallery/index.html`.
fn contact_sheet(
    binary: &Path,
    folder: &Path,
    spp: u32,
    wanted: &dyn Fn(&str) -> bool,
) -> anyhow::Result<()> {
    ensure!(folder.is_dir(), "{} is not a folder", folder.display());
    let sheet = root().join("target/gallery");
    std::fs::create_dir_all(&sheet).with_context(|| format!("cannot make {}", sheet.display()))?;
    let mut files = Vec::new();
    find_scenes(folder, &mut files)?;
    let name_of =
        |file: &PathBuf| file.strip_prefix(folder).unwrap_or(file).to_string_lossy().replace('\\', "/");
    files.retain(|file| wanted(&name_of(file)));
    files.sort();
    let (mut figures, mut pictures, mut panics) = (String::new(), 0, 0);
    for (i, file) in files.iter().enumerate() {
        let name = name_of(file);
        let picture = format!("{i:04}.png");
        let start = Instant::now();
        let mut command = Command::new(binary);
        command
            .arg("render")
            .arg(file)
            .arg("--output")
            .arg(sheet.join(&picture))
            .args(["--quiet", "--lenient"]);
        command.args(["--width", &THUMBNAIL.to_string(), "--height", "180", "--spp", &spp.to_string()]);
        let result = output_within(&mut command, LIMIT);
        let seconds = start.elapsed().as_secs_f64();
        let shown = match &result {
            Ok(_) => {
                pictures += 1;
                format!("<img src=\"{picture}\" width=\"{THUMBNAIL}\" height=\"180\" alt=\"\">")
            }
            Err(error) => {
                let message = error.to_string();
                panics += usize::from(message.contains("panicked"));
                format!("<pre>{}</pre>", escape(&message))
            }
        };
        let status = if result.is_ok() { "ok" } else { "error" };
        eprintln!("{status:>5} {seconds:6.1} s  {name}");
        let caption = format!("<figcaption>{}<br>{seconds:.1} s</figcaption>", escape(&name));
        writeln!(figures, "<figure>{shown}{caption}</figure>")?;
    }
    let page = sheet.join("index.html");
    let style = "body{font:12px sans-serif;background:#222;color:#ddd;display:flex;flex-wrap:wrap;gap:8px}\
                 figure{margin:0;width:240px;overflow-wrap:anywhere}pre{white-space:pre-wrap;height:168px;overflow:auto}";
    let html = format!(
        "<!doctype html><meta charset=\"utf-8\"><title>Alhazen</title><style>{style}</style>\n{figures}"
    );
    std::fs::write(&page, html).with_context(|| format!("cannot write {}", page.display()))?;
    eprintln!("{pictures} of {} files have a picture: {}", files.len(), page.display());
    ensure!(panics == 0, "{panics} files made the program panic");
    Ok(())
}

fn find_scenes(folder: &Path, found: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    for entry in entries {
        let entry = entry?;
        let path = entry.path();
        // Links are not followed: they could lead round in circles.
        let kind = entry.file_type()?;
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        if kind.is_dir() {
            find_scenes(&path, found)?;
        } else if kind.is_file() && SCENE_ENDINGS.contains(&ending.as_str()) {
            found.push(path);
        }
    }
    Ok(())
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_cannot_break_the_page() {
        assert_eq!(escape("<a&b>"), "&lt;a&amp;b&gt;");
    }
}
