//! Options about scenes that somebody else made: which files they may read, and how much they may take.

use alhazen::{LoadOptions, MemoryLimit};
use std::path::PathBuf;
use std::time::Duration;

/// What a scene may read and take. The same for all commands that load scenes.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct LoadingArgs {
    /// Let the scene read files below DIR, too, not only below its own folder. May be given several times.
    #[arg(long, help_heading = "Files of strangers", value_name = "DIR")]
    allow_path: Vec<PathBuf>,
    /// Memory that the scene may take until it is rendered, as 2GB, 500MB or a number of bytes [default: three
    /// quarters of what is free]. On Linux the process ends with exit code 8 where it would take more all the same.
    #[arg(long, help_heading = "Files of strangers", value_name = "SIZE", value_parser = parse_size)]
    max_memory: Option<u64>,
    /// Seconds that loading may take.
    #[arg(long, help_heading = "Files of strangers", value_name = "SECONDS", value_parser = parse_seconds)]
    max_load_time: Option<Duration>,
    /// Do not trust the scene: load it in a sandbox where the system has one, with 2 GB of memory and a minute unless other
    /// options say more.
    #[arg(long, help_heading = "Files of strangers")]
    untrusted: bool,
    /// Leave out the backs of single-sided surfaces: no ray meets them. Without it they are drawn and block light. Bodies of
    /// glass keep theirs.
    #[arg(long, help_heading = "Surfaces")]
    cull_backs: bool,
    /// Gather light on the triangles of smooth meshes, not where the smooth surface would be: what is below a triangle is
    /// black, however its normals are.
    #[arg(long, help_heading = "Surfaces")]
    exact_terminator: bool,
    /// Keep normals of files that oppose the winding of most faces of their mesh. Without it they are turned round, since such
    /// surfaces are lit from behind; both are reported.
    #[arg(long, help_heading = "Surfaces")]
    keep_normals: bool,
}

impl LoadingArgs {
    /// The options for loading.
    pub fn options(&self) -> LoadOptions {
        let mut options = LoadOptions {
            allowed_paths: self.allow_path.clone(),
            cull_backs: self.cull_backs,
            exact_terminator: self.exact_terminator,
            keep_normals: self.keep_normals,
            ..LoadOptions::default()
        };
        if self.untrusted {
            (options.max_memory, options.max_load_time) = (UNTRUSTED_MEMORY, Some(UNTRUSTED_TIME));
            options.untrusted = true;
        }
        options.max_memory = self.max_memory.unwrap_or(options.max_memory);
        options.max_load_time = self.max_load_time.or(options.max_load_time);
        options
    }

    /// The options, with at most `bytes` of memory unless the user asks for more.
    pub fn options_within(&self, bytes: u64) -> LoadOptions {
        let options = self.options();
        let limit = self.max_memory.unwrap_or(options.max_memory.min(bytes));
        LoadOptions { max_memory: limit, ..options }
    }
}

/// Has the system enforce the limit of `options`, if somebody set one.
pub fn memory_limit(options: &LoadOptions) -> Option<MemoryLimit> {
    (options.max_memory != LoadOptions::default().max_memory).then(|| MemoryLimit::new(options.max_memory))
}

const UNTRUSTED_MEMORY: u64 = 2_000_000_000;
const UNTRUSTED_TIME: Duration = Duration::from_secs(60);

fn parse_seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "expected a number of seconds")?;
    Duration::try_from_secs_f64(seconds).map_err(|_| format!("{seconds} seconds are no time"))
}

/// A number of bytes, or of kB, MB, GB, TB, KiB, MiB, GiB, TiB.
fn parse_size(text: &str) -> Result<u64, String> {
    const UNITS: [(&str, f64); 9] = [
        ("kib", 1024.0),
        ("mib", 1_048_576.0),
        ("gib", 1_073_741_824.0),
        ("tib", 1_099_511_627_776.0),
        ("kb", 1e3),
        ("mb", 1e6),
        ("gb", 1e9),
        ("tb", 1e12),
        ("b", 1.0),
    ];
    let lower = text.trim().to_ascii_lowercase();
    let found = UNITS.iter().find_map(|(name, size)| Some((lower.strip_suffix(name)?, *size)));
    let (number, unit) = found.unwrap_or((&lower, 1.0));
    let number: f64 = number.trim().parse().map_err(|_| "expected a size such as 2GB, 512MiB or 1000000")?;
    let bytes = number * unit;
    if !(1.0..1e18).contains(&bytes) {
        return Err(format!("a memory of {text} cannot be"));
    }
    Ok(bytes as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units() {
        for (text, size) in [("2GB", 2_000_000_000), ("1.5 MiB", 1_572_864), ("700", 700), ("3b", 3)] {
            assert_eq!(parse_size(text), Ok(size), "{text}");
        }
        for text in ["", "GB", "-1GB", "nan", "inf", "0", "2 apples"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
        assert!(parse_seconds("-1").is_err() && parse_seconds("nan").is_err());
        assert_eq!(parse_seconds("0.5"), Ok(Duration::from_millis(500)));
    }
}
