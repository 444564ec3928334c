//! `alhazen compare`: how far a picture is from a reference.

use crate::console::{json_line, print_error, print_result, say};
use crate::exit::Exit;
use alhazen::{Image, ProtectedFiles, metrics};
use anyhow::{Context, ensure};
use elementary::log2;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Exit code of pictures that are further apart than allowed, as `diff` has it.
const DIFFERENT: u8 = 1;
/// Exit code of pictures that cannot be compared.
const TROUBLE: u8 = 2;

/// Measure how far a picture is from a reference.
///
/// Pictures may be .exr, .hdr, .png or .jpg; the last two are decoded to linear light. relMSE is the mean of
/// (a - r)² / (r² + 0.01) over linear values. PSNR is over sRGB-encoded values. FLIP is what a viewer notices who flips
/// between the two (Andersson et al. 2020, 67 pixels per degree): 0 is nothing, 1 is everything.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Exit code: 0 if the pictures are as close as asked for, 1 if not, 2 if they cannot be compared.

Examples:
  alhazen compare reference.exr render.exr
  alhazen compare reference.png render.png --max-flip 0.02 --difference difference.png
  alhazen compare reference.exr render.exr --max-rel-mse 1e-3 --json")]
pub struct CompareArgs {
    /// The picture that is right.
    reference: PathBuf,
    /// The picture to judge.
    actual: PathBuf,
    /// Exit with 1 when the mean FLIP error is above this.
    #[arg(long, value_name = "ERROR", value_parser = parse_limit)]
    max_flip: Option<f64>,
    /// Exit with 1 when relMSE is above this.
    #[arg(long, value_name = "ERROR", value_parser = parse_limit)]
    max_rel_mse: Option<f64>,
    /// Write a picture of the differences (.png): grey where both agree, red where ACTUAL is brighter, blue where it is
    /// darker, fully so at 10 %; yellow where a value is not a number.
    #[arg(long, value_name = "FILE")]
    difference: Option<PathBuf>,
    /// Factor on both pictures before PSNR and FLIP.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = parse_exposure)]
    exposure: f32,
    /// Print the result as JSON. PSNR is null for pictures that look the same.
    #[arg(long)]
    json: bool,
}

/// What was measured.
#[derive(Debug)]
struct Measured {
    width: u32,
    height: u32,
    rel_mse: f64,
    psnr: f64,
    flip: f64,
    flip_max: f64,
    mean_reference: Vec<f64>,
    mean_actual: Vec<f64>,
}

/// Compares and prints.
pub fn run(args: &CompareArgs) -> ExitCode {
    match compare(args) {
        Ok(reasons) if reasons.is_empty() => ExitCode::SUCCESS,
        Ok(reasons) => {
            reasons.iter().for_each(|reason| say!("{reason}"));
            ExitCode::from(DIFFERENT)
        }
        Err(error) => {
            print_error(&error);
            let output = Exit::of(&error) == Exit::Output;
            ExitCode::from(if output { Exit::Output as u8 } else { TROUBLE })
        }
    }
}

/// Returns the limits that were exceeded, as sentences.
fn compare(args: &CompareArgs) -> anyhow::Result<Vec<String>> {
    if let Some(path) = &args.difference {
        let is_png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
        ensure!(is_png, "--difference {}: the picture of the differences is a .png", path.display());
    }
    let reference = open(&args.reference, "the reference")?;
    let actual = open(&args.actual, "the picture")?;
    if let Some(path) = &args.difference {
        // Before anything can fail for values that are no numbers: this picture shows where they are.
        ProtectedFiles::new([&args.reference, &args.actual]).check(path)?;
        metrics::difference_picture(&reference, &actual, 0.1)?.write_png_encoded(path)?;
    }
    let measured = measure(&reference, &actual, args.exposure)?;
    let mut reasons = Vec::new();
    let mut check = |what: &str, value: f64, limit: Option<f64>| {
        if let Some(limit) = limit.filter(|limit| value > *limit) {
            reasons.push(format!("{what} is {value:.6}, above the limit of {limit}"));
        }
    };
    check("the mean FLIP error", measured.flip, args.max_flip);
    check("relMSE", measured.rel_mse, args.max_rel_mse);
    print_result(&if args.json { as_json(&measured, &reasons) } else { as_text(&measured)? })?;
    Ok(reasons)
}

fn open(path: &Path, what: &str) -> anyhow::Result<Image> {
    let opened = Image::open_noting(path);
    let (image, notes) = opened.with_context(|| format!("cannot open {what} {}", path.display()))?;
    super::tonemap::say_notes(path, &notes);
    Ok(image)
}

fn measure(reference: &Image, actual: &Image, exposure: f32) -> anyhow::Result<Measured> {
    let rel_mse = metrics::rel_mse(reference, actual)?;
    let exposed = |image: &Image| image.map(|v| v * exposure);
    let flip = metrics::flip(reference, actual, log2(exposure))?;
    let mean = |image: &Image| image.to_rgb().mean();
    Ok(Measured {
        width: reference.width(),
        height: reference.height(),
        rel_mse,
        psnr: metrics::psnr(&exposed(reference), &exposed(actual))?,
        flip: flip.mean,
        flip_max: flip.max,
        mean_reference: mean(reference),
        mean_actual: mean(actual),
    })
}

fn as_text(m: &Measured) -> anyhow::Result<String> {
    let mut text = String::new();
    let mean = |mean: &[f64]| mean.iter().map(|v| format!("{v:.5}")).collect::<Vec<_>>().join(" ");
    writeln!(text, "size        {}×{}", m.width, m.height)?;
    writeln!(text, "relMSE      {:.6e}", m.rel_mse)?;
    writeln!(text, "PSNR        {:.2} dB", m.psnr)?;
    writeln!(text, "FLIP        {:.6} (largest {:.4})", m.flip, m.flip_max)?;
    writeln!(text, "means       {} (reference)", mean(&m.mean_reference))?;
    writeln!(text, "            {}", mean(&m.mean_actual))?;
    Ok(text)
}

fn as_json(m: &Measured, reasons: &[String]) -> String {
    let json = serde_json::json!({
        "width": m.width, "height": m.height, "rel_mse": m.rel_mse, "psnr": m.psnr, "flip": m.flip,
        "flip_max": m.flip_max, "mean_reference": m.mean_reference, "mean_actual": m.mean_actual,
        "within_limits": reasons.is_empty(),
    });
    json_line(&json)
}

fn parse_limit(text: &str) -> anyhow::Result<f64> {
    let value: f64 = text.parse()?;
    ensure!(value >= 0.0 && value.is_finite(), "expected a number that is not negative");
    Ok(value)
}

fn parse_exposure(text: &str) -> anyhow::Result<f32> {
    let value: f32 = text.parse()?;
    ensure!(value > 0.0 && value.is_finite(), "expected a number above zero");
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposure_is_applied_to_what_looks_but_not_to_rel_mse() {
        let reference = Image::from_fn(16, 16, |_, _| [0.2; 3]);
        let actual = Image::from_fn(16, 16, |_, _| [0.25; 3]);
        let plain = measure(&reference, &actual, 1.0).unwrap();
        let dark = measure(&reference, &actual, 1e-4).unwrap();
        assert_eq!(plain.rel_mse, dark.rel_mse);
        assert!(dark.psnr > plain.psnr && dark.flip < plain.flip, "{plain:?} {dark:?}");
        assert!((plain.mean_actual[0] - 0.25).abs() < 1e-6);
    }

    #[test]
    fn limits_are_checked() {
        assert!(
            parse_limit("-1").is_err()
                && parse_limit("inf").is_err()
                && parse_limit("nan").is_err()
                && parse_limit("0").is_ok()
        );
        assert!(
            parse_exposure("0").is_err() && parse_exposure("inf").is_err() && parse_exposure("2").is_ok()
        );
    }
}
