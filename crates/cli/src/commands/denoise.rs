//! `alhazen denoise`: removes the noise of a finished picture.

use super::render::DenoiserName;
use super::render::check_output;
use super::render::output::OutputArgs;
use super::tone::ToneArgs;
use crate::console::{keep_each, say};
use alhazen::{FinishedPicture, LayerNames, ProtectedFiles};
use std::path::PathBuf;

/// Remove the noise of a finished picture.
///
/// The picture is an .exr file of Alhazen (also one that `alhazen merge` has made), of Blender,
/// pbrt or Mitsuba, or any .exr, .hdr or .png. Layers of albedo and normals guide the filter; they
/// are found by the names that these renderers give them. Without them edges and textures are kept
/// less well: render with --aov albedo,normal,standard-error. How noisy each pixel is tells the
/// layer standard-error; where it is missing, the network judges by the picture.
///
/// An .exr that is written keeps all other layers, and the picture as it was as the layer `noisy`.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  alhazen render atrium --aov albedo,normal,standard-error -o atrium.exr
  alhazen denoise atrium.exr -o clean.exr -o clean.png
  alhazen denoise blender.exr --layer ViewLayer.Combined -o clean.exr")]
pub struct DenoiseArgs {
    /// The picture: .exr, .hdr, .png or .jpg.
    #[arg(value_name = "PICTURE")]
    picture: PathBuf,
    /// Picture to write: .exr, .hdr, or tone mapped .png or .jpg. May be given several times.
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// What removes it.
    #[arg(long, value_enum, value_name = "WHAT", default_value_t = DenoiserName::Network)]
    denoiser: DenoiserName,
    /// Layer of the picture itself [default: `noisy` if there is one, else the one without a name,
    /// or called Combined, beauty, rgba or the like].
    #[arg(long, help_heading = "Layers", value_name = "LAYER")]
    layer: Option<String>,
    /// Layer of the first surfaces' albedo.
    #[arg(long, help_heading = "Layers", value_name = "LAYER")]
    albedo: Option<String>,
    /// Layer of the first surfaces' normals.
    #[arg(long, help_heading = "Layers", value_name = "LAYER")]
    normal: Option<String>,
    #[command(flatten)]
    tone: ToneArgs,
    #[command(flatten)]
    files: OutputArgs,
    /// No report.
    #[arg(short, long)]
    quiet: bool,
}

/// Denoises.
pub fn run(args: &DenoiseArgs) -> anyhow::Result<()> {
    let inputs = ProtectedFiles::new([&args.picture]);
    args.output.iter().try_for_each(|path| check_output(path, false, &inputs))?;
    let picture = FinishedPicture::open_noisy(&args.picture, args.layer.as_deref())?;
    let names = LayerNames { albedo: args.albedo.clone(), normal: args.normal.clone() };
    let (denoised, guides) = picture.denoise(args.denoiser.into(), &names)?;
    let mut tone = picture.tone().unwrap_or_default();
    args.tone.apply(&mut tone);
    let encoding = args.files.encoding();
    if guides.invalid > 0 {
        say!("warning: {} values were NaN or infinite; they are taken as 0", guides.invalid);
    }
    keep_each(&args.output, |path| Ok(picture.write_denoised(&denoised, path, &tone, &encoding)?))?;
    if !args.quiet {
        super::tonemap::say_notes(&args.picture, picture.notes());
        let named = |layer: &Option<String>| layer.clone().unwrap_or_else(|| "none".into());
        let errors = if guides.has_errors { "the file's" } else { "unknown" };
        say!(
            "denoised {} by {}; albedo: {}, normals: {}, errors: {errors}",
            super::tonemap::describe(&picture),
            denoised.by,
            named(&guides.albedo),
            named(&guides.normal),
        );
    }
    Ok(())
}
