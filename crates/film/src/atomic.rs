//! Files that are either complete or not there.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::ImageError;

/// Writes a file through `fill` under a temporary name in the same folder, then renames it to `path`.
///
/// An existing file keeps its old contents until the new ones are complete and flushed; if anything fails, the
/// temporary file is removed. `fill` gets a buffered writer that can also seek.
///
/// # Errors
/// What `fill` returns, or [`ImageError::Write`].
pub fn write_atomically(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> Result<(), ImageError>,
) -> Result<(), ImageError> {
    let failed = |source| ImageError::Write { path: path.to_owned(), source };
    // A link keeps pointing at the file that it names.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let (file, temporary) = create_beside(&target).map_err(failed)?;
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    let result = fill(&mut writer)
        .and_then(|()| writer.flush().map_err(failed))
        .and_then(|()| writer.get_ref().sync_all().map_err(failed));
    drop(writer);
    result.and_then(|()| fs::rename(&temporary, &target).map_err(failed)).inspect_err(|_| {
        let _ = fs::remove_file(&temporary); // the first error is the one to report
    })
}

/// Removes the temporary files that processes have left beside `path` that were killed in [`write_atomically`]. No
/// process may be writing to `path` now.
pub fn remove_temporaries(path: &Path) {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let (Some(folder), Some(name)) = (target.parent(), target.file_name()) else { return };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let prefix = format!(".{}.", name.to_string_lossy());
    let is_temporary = |name: &str| {
        let id = name.strip_prefix(&prefix).and_then(|rest| rest.strip_suffix(".tmp"));
        id.is_some_and(|id| !id.is_empty() && id.bytes().all(|b| b.is_ascii_digit() || b == b'-'))
    };
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_str().is_some_and(is_temporary) {
            // What cannot be removed does no harm.
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn create_beside(target: &Path) -> std::io::Result<(File, PathBuf)> {
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    let name = target.file_name().ok_or_else(|| {
        std::io::Error::new(std::io::ErrorKind::InvalidInput, "the path does not name a file")
    })?;
    loop {
        let mut temporary = OsString::from(".");
        temporary.push(name);
        temporary.push(format!(".{}-{}.tmp", std::process::id(), COUNTER.fetch_add(1, Ordering::Relaxed)));
        let temporary = target.with_file_name(temporary);
        match OpenOptions::new().write(true).create_new(true).open(&temporary) {
            Ok(file) => return Ok((file, temporary)),
            // Left behind by a process that was killed and had the same id.
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(dir: &Path) -> usize {
        fs::read_dir(dir).unwrap().count()
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("picture.bin");
        write_atomically(&path, |w| w.write_all(b"old").map_err(|_| unreachable!())).unwrap();
        let result = write_atomically(&path, |w| {
            w.write_all(b"half of the n").unwrap();
            Err(ImageError::Encode { path: path.clone(), reason: "test".into() })
        });
        assert!(matches!(result, Err(ImageError::Encode { .. })));
        assert_eq!((fs::read(&path).unwrap().as_slice(), entries(dir.path())), (&b"old"[..], 1));
        write_atomically(&path, |w| w.write_all(b"new").map_err(|_| unreachable!())).unwrap();
        assert_eq!((fs::read(&path).unwrap().as_slice(), entries(dir.path())), (&b"new"[..], 1));
    }

    #[test]
    fn what_a_killed_process_left_behind_can_be_removed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("part.exr");
        for name in ["part.exr", ".part.exr.12-0.tmp", ".part.exr.note.tmp", ".other.exr.12-0.tmp"] {
            fs::write(dir.path().join(name), "").unwrap();
        }
        remove_temporaries(&path);
        assert!(path.exists() && !dir.path().join(".part.exr.12-0.tmp").exists());
        assert_eq!(entries(dir.path()), 3);
    }

    #[test]
    fn impossible_places_are_errors_that_name_the_file() {
        let dir = tempfile::tempdir().unwrap();
        for path in [dir.path().join("missing/picture.bin"), dir.path().to_owned(), PathBuf::from("..")] {
            let error = write_atomically(&path, |_| Ok(())).unwrap_err();
            assert_eq!(error.path(), Some(path.as_path()));
        }
        assert_eq!(entries(dir.path()), 0);
    }
}
