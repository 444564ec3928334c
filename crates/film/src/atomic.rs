//! The one way in which files are written: complete, or not at all, and never over what is no output.

use std::collections::{BTreeSet, HashSet};
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use crate::ImageError;
use crate::file_name::refused_by_windows;

/// Temporary files of processes that may still live elsewhere are left alone until nobody has written to them for so long.
const ABANDONED: Duration = Duration::from_secs(24 * 3600);

/// Writes a file through `fill` under a temporary name in the same folder, then renames it to `path`.
///
/// An existing file keeps its old contents until the new ones are complete and flushed; if anything fails, the
/// temporary file is removed. `fill` gets a buffered writer that can also seek. A symbolic link keeps pointing at the file
/// that it names, which is what is replaced. The first write into a folder removes the temporary files that killed
/// processes have left there.
///
/// # Errors
/// What `fill` returns, [`ImageError::NotAFile`] if a folder, device, pipe or socket is there, or [`ImageError::Write`].
pub fn write_atomically(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> Result<(), ImageError>,
) -> Result<(), ImageError> {
    let failed = |source| ImageError::Write { path: path.to_owned(), source };
    let target = replaceable(path)?;
    remove_abandoned(&target);
    let (file, temporary) = create_beside(&target).map_err(failed)?;
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    let result = fill(&mut writer)
        .and_then(|()| writer.flush().map_err(failed))
        .and_then(|()| writer.get_ref().sync_all().map_err(failed));
    if result.is_err() {
        // What is still buffered would be written when the writer goes.
        let _ = writer.into_parts();
    }
    // Something else may have taken the place meanwhile.
    let result = result.and_then(|()| replaceable(path).map(drop));
    result.and_then(|()| fs::rename(&temporary, &target).map_err(failed)).inspect_err(|_| {
        let _ = fs::remove_file(&temporary); // the first error is the one to report
    })
}

/// Finds out whether a file could be written to `path` now, by making its temporary file with a few bytes and removing it
/// again. What is at `path` stays as it is.
///
/// # Errors
/// As [`write_atomically`].
pub fn prove_writable(path: &Path) -> Result<(), ImageError> {
    let failed = |source| ImageError::Write { path: path.to_owned(), source };
    let target = replaceable(path)?;
    remove_abandoned(&target);
    let (mut file, temporary) = create_beside(&target).map_err(failed)?;
    let written = file.write_all(&[0; 4096]).map_err(failed);
    drop(file);
    let removed = fs::remove_file(&temporary).map_err(failed);
    written.and(removed)
}

/// Files that must not be replaced: what a command has read.
#[derive(Clone, Debug, Default)]
pub struct ProtectedFiles(BTreeSet<PathBuf>);

impl ProtectedFiles {
    /// Protects those of `paths` that are there.
    pub fn new<P: AsRef<Path>>(paths: impl IntoIterator<Item = P>) -> Self {
        Self(paths.into_iter().filter_map(|path| fs::canonicalize(path).ok()).collect())
    }

    /// Protects further files.
    pub fn extend<P: AsRef<Path>>(&mut self, paths: impl IntoIterator<Item = P>) {
        self.0.extend(Self::new(paths).0);
    }

    /// Whether `path` may be written. Links are followed: they are as protected as what they name.
    ///
    /// # Errors
    /// [`ImageError::Protected`].
    pub fn check(&self, path: &Path) -> Result<(), ImageError> {
        match fs::canonicalize(path) {
            Ok(file) if self.0.contains(&file) => Err(ImageError::Protected {
                path: path.to_owned(),
                reason: "it is an input of this command".into(),
            }),
            _ => Ok(()),
        }
    }
}

/// Removes the temporary files that processes have left beside `path` that were killed in [`write_atomically`]. No
/// process may be writing to `path` now.
pub fn remove_temporaries(path: &Path) {
    let target = followed(path);
    let (Some(folder), Some(name)) = (folder_of(&target), target.file_name()) else { return };
    for (file, temporary) in temporaries(&folder) {
        if *temporary.of == *name.to_string_lossy() {
            // What cannot be removed does no harm.
            let _ = fs::remove_file(file);
        }
    }
}

/// The file that is replaced when `path` is written.
fn replaceable(path: &Path) -> Result<PathBuf, ImageError> {
    let target = followed(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if let Some(reason) = refused_by_windows(&name).filter(|_| cfg!(windows)) {
        let source = std::io::Error::new(std::io::ErrorKind::InvalidInput, reason);
        return Err(ImageError::Write { path: path.to_owned(), source });
    }
    match fs::metadata(&target) {
        Ok(found) if !found.is_file() => {
            let what = if found.is_dir() { "a folder" } else { "a device, pipe or socket" };
            Err(ImageError::NotAFile { path: path.to_owned(), what })
        }
        _ => Ok(target),
    }
}

/// Where symbolic links lead, even if there is no file at their end yet.
fn followed(path: &Path) -> PathBuf {
    const MOST_LINKS: usize = 40;
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        if let Ok(file) = fs::canonicalize(&path) {
            return file;
        }
        let Ok(next) = fs::read_link(&path) else { break };
        path = path.parent().unwrap_or(Path::new("")).join(next);
    }
    path
}

fn folder_of(target: &Path) -> Option<PathBuf> {
    let folder = target.parent()?;
    Some(if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder.to_owned() })
}

/// Which processes can be asked whether they live: those of this start of the system and of this container. Eight
/// hexadecimal digits; `None` where the system does not say.
static PROCESS_SPACE: LazyLock<Option<String>> = LazyLock::new(|| {
    let boot = fs::read("/proc/sys/kernel/random/boot_id").ok()?;
    let processes = fs::read_link("/proc/self/ns/pid").ok()?;
    let mut hasher = blake3::Hasher::new();
    hasher.update(&boot).update(processes.to_string_lossy().as_bytes());
    Some(hasher.finalize().to_hex()[..8].to_owned())
});

/// What the name of a temporary file says: `.NAME.SPACE-PROCESS-NUMBER.tmp`.
struct Temporary {
    /// The file that it was to become.
    of: String,
    /// See [`PROCESS_SPACE`].
    space: String,
    process: u32,
}

impl Temporary {
    fn parse(name: &str) -> Option<Self> {
        let (of, id) = name.strip_prefix('.')?.strip_suffix(".tmp")?.rsplit_once('.')?;
        let (space, rest) = id.split_once('-')?;
        let (process, number) = rest.split_once('-')?;
        let is_space = space.len() == 8 && space.bytes().all(|b| b.is_ascii_hexdigit());
        let is_number = !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit());
        let (of, space, process) = (of.to_owned(), space.to_owned(), process.parse().ok()?);
        (is_space && is_number).then_some(Self { of, space, process })
    }

    /// Whether nobody will ever finish it. `age`: time since somebody wrote to it.
    fn is_abandoned(&self, age: Duration) -> bool {
        let is_ours = PROCESS_SPACE.as_ref() == Some(&self.space);
        let is_dead = || !Path::new("/proc").join(self.process.to_string()).exists();
        (is_ours && is_dead()) || (age > ABANDONED && self.process != std::process::id())
    }
}

/// The temporary files of a folder.
fn temporaries(folder: &Path) -> impl Iterator<Item = (PathBuf, Temporary)> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter_map(|entry| Some((entry.path(), Temporary::parse(entry.file_name().to_str()?)?)))
}

/// Removes what killed processes have left in the folder of `target`; once for each folder, as folders may be full.
fn remove_abandoned(target: &Path) {
    static SEEN: LazyLock<Mutex<HashSet<PathBuf>>> = LazyLock::new(Mutex::default);
    let Some(folder) = folder_of(target) else { return };
    if !SEEN.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.clone()) {
        return;
    }
    for (file, temporary) in temporaries(&folder) {
        let modified = fs::symlink_metadata(&file).ok().filter(fs::Metadata::is_file);
        let modified = modified.and_then(|found| found.modified().ok());
        let age = modified.and_then(|time| SystemTime::now().duration_since(time).ok());
        if age.is_some_and(|age| temporary.is_abandoned(age)) {
            // What cannot be removed does no harm.
            let _ = fs::remove_file(file);
        }
    }
}

fn create_beside(target: &Path) -> std::io::Result<(File, PathBuf)> {
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    let name = target.file_name().ok_or_else(|| {
        std::io::Error::new(std::io::ErrorKind::InvalidInput, "the path does not name a file")
    })?;
    let space = PROCESS_SPACE.as_deref().unwrap_or("00000000");
    loop {
        let mut temporary = OsString::from(".");
        temporary.push(name);
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        temporary.push(format!(".{space}-{}-{number}.tmp", std::process::id()));
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
mod tests;
