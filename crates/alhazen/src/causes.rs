//! Errors as people read them.

use backend::BackendError;

/// An error with all its causes.
pub(crate) fn full_text(error: &BackendError) -> String {
    let mut text = error.to_string();
    let mut source = std::error::Error::source(error);
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    text
}
