//! `alhazen tonemap`: shows a finished picture.

use super::render::check_output;
use super::render::output::OutputArgs;
use super::tone::ToneArgs;
use crate::console::{keep_each, say};
use crate::exit::Exit;
use alhazen::output::Format;
use alhazen::{FinishedPicture, ProtectedFiles, write_image};
use anyhow::anyhow;
use std::path::{Path, PathBuf};

/// Make a .png or .jpg of a finished picture.
///
/// The picture is an .exr or .hdr file of any renderer. Files of Alhazen say how they are to be
/// shown; others are clipped and encoded as sRGB unless options say otherwise.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  alhazen tonemap atrium.exr -o atrium.png
  alhazen tonemap blender.exr --tonemap agx --exposure 2 -o blender.png
  alhazen tonemap pbrt.exr --layer Albedo -o albedo.png")]
pub struct TonemapArgs {
    /// The picture: .exr, .hdr, .png or .jpg.
    #[arg(value_name = "PICTURE")]
    picture: PathBuf,
    /// Picture to write: .png or .jpg. May be given several times.
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// Layer to show [default: the one without a name, or called Combined, beauty, rgba or the
    /// like].
    #[arg(long, value_name = "LAYER")]
    layer: Option<String>,
    #[command(flatten)]
    tone: ToneArgs,
    #[command(flatten)]
    files: OutputArgs,
    /// No report.
    #[arg(short, long)]
    quiet: bool,
}

/// Tone maps.
pub fn run(args: &TonemapArgs) -> anyhow::Result<()> {
    let inputs = ProtectedFiles::new([&args.picture]);
    for path in &args.output {
        check_output(path, false, &inputs)?;
        if !matches!(Format::of(path)?, Format::Png | Format::Jpeg) {
            let text = format!("{} would not be tone mapped: give a .png or .jpg", path.display());
            return Err(Exit::Usage.with(anyhow!(text)));
        }
    }
    let picture = FinishedPicture::open(&args.picture, args.layer.as_deref())?;
    let mut tone = picture.tone().unwrap_or_default();
    args.tone.apply(&mut tone);
    let encoding = args.files.encoding();
    keep_each(&args.output, |path| Ok(write_image(path, picture.colour(), &tone, &encoding)?))?;
    if !args.quiet {
        say_notes(&args.picture, picture.notes());
        let (mapper, exposure) = (tone.mapper, tone.exposure);
        say!("{} is shown by {mapper:?}, exposure {exposure}", describe(&picture));
    }
    Ok(())
}

/// Says what people should know of how a picture was read.
pub fn say_notes(path: &Path, notes: &[String]) {
    notes.iter().for_each(|note| say!("note: {}: {note}", path.display()));
}

/// A picture's size and layer, for people.
pub fn describe(picture: &FinishedPicture) -> String {
    let (width, height) = (picture.colour().width(), picture.colour().height());
    match picture.layer() {
        "" => format!("{width}×{height}"),
        layer => format!("{width}×{height}, layer {layer},"),
    }
}
