//! Exit codes: what kind of end a command came to.

use alhazen::output::OutputError;
use alhazen::{
    BackendError, ChoiceError, DenoiseFilmError, FinishedError, ImageError, LoadError, PartError,
    RenderPartError,
};
use sensors::SensorError;
use std::error::Error as StdError;
use std::fmt;

/// How a command ended that did not do what it was asked for. The help of `alhazen` lists the codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Anything else.
    Other = 1,
    /// Arguments that cannot be, or do not go together; the parser of arguments uses this code as well.
    Usage = 2,
    /// A scene, part or other input that is missing, damaged or impossible.
    Input = 3,
    /// An input that is refused by policy.
    Refused = 4,
    /// No back end, one that failed, or a picture that is mostly no picture.
    Render = 5,
    /// An output that is not where it was asked for.
    Output = 6,
    /// Stopped before there was anything to keep.
    Stopped = 7,
    /// The system gave no more memory. A process that aborts ends with this code as well.
    Memory = 8,
    /// Stopped by Ctrl-C, SIGTERM, SIGHUP or their kin; what there was is kept.
    Interrupted = 130,
}

/// The end of the help of `alhazen`.
pub const HELP: &str = "\
Exit codes:
  0    done
  1    failed for another reason; `compare`: the pictures differ
  2    wrong arguments; `compare`: the pictures cannot be compared
  3    an input is missing, damaged or impossible
  4    an input is refused by policy
  5    rendering failed, or more samples than --max-invalid allows were NaN or infinite
  6    an output could not be written where it was asked for; the last line says where it is kept
  7    stopped before there was anything to keep
  8    there was no more memory
  130  stopped by Ctrl-C, SIGTERM, SIGHUP, CTRL_BREAK or CTRL_CLOSE; what was rendered is kept";

/// An error of which the kind is known.
#[derive(Debug)]
struct Failure {
    exit: Exit,
    error: anyhow::Error,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.error.fmt(f)
    }
}

impl StdError for Failure {
    fn source(&self) -> Option<&(dyn StdError + 'static)> {
        self.error.source()
    }
}

impl Exit {
    /// Marks an error as one of this kind, unless its causes say better what it is.
    pub fn or(self, error: anyhow::Error) -> anyhow::Error {
        if Self::of(&error) == Self::Other { self.with(error) } else { error }
    }

    /// Marks an error as one of this kind.
    pub fn with(self, error: anyhow::Error) -> anyhow::Error {
        Failure { exit: self, error }.into()
    }

    /// What kind an error is.
    pub fn of(error: &anyhow::Error) -> Self {
        error.chain().find_map(Self::of_cause).unwrap_or(Self::Other)
    }

    fn of_cause(cause: &(dyn StdError + 'static)) -> Option<Self> {
        if let Some(failure) = cause.downcast_ref::<Failure>() {
            return Some(failure.exit);
        }
        if let Some(error) = cause.downcast_ref::<OutputError>() {
            return match error {
                OutputError::UnknownFormat { .. } => Some(Self::Usage),
                _ => None, // its cause says more
            };
        }
        if let Some(error) = cause.downcast_ref::<FinishedError>() {
            return match error {
                FinishedError::Image(error) => Some(Self::of_image(error)),
                FinishedError::NoLayer { .. } => Some(Self::Usage),
                FinishedError::IsPart { .. } => Some(Self::Input),
                _ => Some(Self::Render),
            };
        }
        if let Some(error) = cause.downcast_ref::<RenderPartError>() {
            return Some(match error {
                RenderPartError::Tile { .. } | RenderPartError::Samples { .. } => Self::Usage,
                RenderPartError::Backend(e) => Self::of_backend(e),
                RenderPartError::Part(e) => Self::of_part(e),
                _ => Self::Render,
            });
        }
        if let Some(error) = cause.downcast_ref::<SensorError>() {
            return match error {
                SensorError::Setting { .. } | SensorError::UnknownFormat { .. } => Some(Self::Usage),
                SensorError::Folder { .. } => Some(Self::Output),
                SensorError::Read { .. } | SensorError::Malformed { .. } | SensorError::Camera { .. } => {
                    Some(Self::Input)
                }
                SensorError::Cancelled => Some(Self::Stopped),
                _ => None,
            };
        }
        cause
            .downcast_ref::<ImageError>()
            .map(Self::of_image)
            .or_else(|| cause.downcast_ref::<PartError>().map(Self::of_part))
            .or_else(|| cause.downcast_ref::<BackendError>().map(Self::of_backend))
            .or_else(|| cause.downcast_ref::<LoadError>().map(Self::of_load))
            .or_else(|| (cause.is::<ChoiceError>() || cause.is::<DenoiseFilmError>()).then_some(Self::Render))
    }

    fn of_image(error: &ImageError) -> Self {
        match error {
            ImageError::Write { .. }
            | ImageError::NotAFile { .. }
            | ImageError::Protected { .. }
            | ImageError::Encode { .. } => Self::Output,
            _ => Self::Input,
        }
    }

    fn of_part(error: &PartError) -> Self {
        if let PartError::File(error) = error { Self::of_image(error) } else { Self::Input }
    }

    fn of_backend(error: &BackendError) -> Self {
        match error {
            // The view and its size are what was asked for.
            BackendError::View { .. } | BackendError::Film(_) => Self::Usage,
            _ => Self::Render,
        }
    }

    fn of_load(error: &LoadError) -> Self {
        match error {
            LoadError::TooLarge { .. } | LoadError::OverBudget { .. } | LoadError::TookTooLong { .. } => {
                Self::Refused
            }
            LoadError::OutOfMemory { .. } => Self::Memory,
            _ => Self::Input,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::{Context, anyhow};

    #[test]
    fn causes_tell_the_kind() {
        let write = || ImageError::NotAFile { path: "a".into(), what: "a folder" };
        let read = || ImageError::UnknownFormat { path: "a".into() };
        assert_eq!(Exit::of(&anyhow!("anything")), Exit::Other);
        assert_eq!(Exit::of(&write().into()), Exit::Output);
        assert_eq!(Exit::of(&OutputError::from(write()).into()), Exit::Output);
        assert_eq!(Exit::of(&anyhow::Error::from(read()).context("more")), Exit::Input);
        let format = alhazen::output::Format::of("a.tif".as_ref()).map(drop).context("more");
        assert_eq!(Exit::of(&format.expect_err("unknown")), Exit::Usage);
        assert_eq!(Exit::of(&Exit::Usage.or(anyhow!("x"))), Exit::Usage);
        assert_eq!(Exit::of(&Exit::Usage.or(write().into())), Exit::Output);
        let limit = LoadError::OverBudget { path: "a".into(), what: "images".into(), size: 2, limit: 1 };
        assert_eq!(Exit::of(&anyhow::Error::from(limit).context("more")), Exit::Refused);
        let memory = LoadError::OutOfMemory { path: "a".into(), what: "images".into(), size: 2 };
        assert_eq!(Exit::of(&memory.into()), Exit::Memory);
        let kept = Exit::Interrupted.with(anyhow::Error::from(read()).context("why"));
        assert_eq!((Exit::of(&kept), format!("{kept:#}")), (Exit::Interrupted, format!("why: {}", read())));
        // Every code is documented.
        let all = [
            Exit::Other,
            Exit::Usage,
            Exit::Input,
            Exit::Refused,
            Exit::Render,
            Exit::Output,
            Exit::Stopped,
            Exit::Memory,
        ];
        for exit in all {
            assert!(HELP.contains(&format!("\n  {}    ", exit as u8)), "{exit:?}");
        }
    }
}
