//! Whether what was rendered is what was asked for.

use super::args::RenderArgs;
use crate::exit::Exit;
use alhazen::Summary;
use anyhow::anyhow;

/// Whether the picture that was written is what was asked for.
pub fn check_end(args: &RenderArgs, summary: &Summary) -> anyhow::Result<()> {
    if summary.cancelled {
        let text = format!("stopped before the end; the picture has {} samples per pixel", summary.spp);
        return Err(Exit::Interrupted.with(anyhow!(text)));
    }
    let share = summary.invalid_samples as f64 / summary.samples.max(1) as f64;
    if share > args.max_invalid {
        let (invalid, all) = (summary.invalid_samples, summary.samples);
        let text = format!("{invalid} of {all} samples were NaN or infinite: more than --max-invalid allows");
        return Err(Exit::Render.with(anyhow!(text)));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_many_invalid_samples_are_a_failure() {
        let args = |words: &str| {
            let words: Vec<String> = words.split_whitespace().map(str::to_owned).collect();
            RenderArgs::parse_arguments(&words).unwrap()
        };
        let summary = |invalid_samples| Summary { samples: 1000, invalid_samples, ..Summary::default() };
        let end = |args: &RenderArgs, invalid| check_end(args, &summary(invalid)).map_err(|e| Exit::of(&e));
        let usual = args("");
        assert_eq!((end(&usual, 0), end(&usual, 10)), (Ok(()), Ok(())));
        assert_eq!(end(&usual, 11), Err(Exit::Render));
        assert_eq!(end(&args("--max-invalid 0"), 1), Err(Exit::Render));
        assert_eq!(end(&args("--max-invalid 1"), 1000), Ok(()));
    }
}
