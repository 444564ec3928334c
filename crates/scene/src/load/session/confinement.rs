//! Which files a scene may read: those below the folder of the file that the user named, and below folders that the
//! user allowed.
//!
//! A name is first resolved to its canonical path, without links and `..`. If that is below an allowed folder, the rest
//! of it is opened from a handle of that folder, so that it stays below whatever is swapped for a link meanwhile. What
//! was opened is then looked at through its own handle, and no more is read than was checked.

use super::{Budget, names};
use crate::LoadError;
use cap_std::ambient_authority;
use cap_std::fs::{Dir, OpenOptions};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, RwLock};

/// Where the system shows its own state as files. They are no data of anybody's scene.
const SYSTEM_FOLDERS: [&str; 3] = ["/proc", "/sys", "/dev"];
/// Below them, but in memory like any other folder.
const ORDINARY: &str = "/dev/shm";

/// What is said of a file that is not there, and of one that is not allowed: whoever wrote the scene must not learn
/// which.
const NOT_THERE: &str =
    "there is no such file below the scene's folder; `--allow-path DIR` lets a scene read other folders";

/// The files that a session may read.
#[derive(Debug)]
pub(super) struct Confinement {
    roots: RwLock<Vec<Arc<Root>>>,
    /// Files that the user named, as they were named.
    named: RwLock<Vec<PathBuf>>,
}

/// A folder with everything below it.
#[derive(Debug)]
struct Root {
    /// As the user wrote it.
    given: PathBuf,
    canonical: PathBuf,
    handle: Dir,
}

impl Root {
    /// `None` if there is no such folder.
    fn open(given: &Path) -> Option<Arc<Self>> {
        let given = if given.as_os_str().is_empty() { Path::new(".") } else { given };
        let canonical = given.canonicalize().ok()?;
        let handle = Dir::open_ambient_dir(&canonical, ambient_authority()).ok()?;
        Some(Arc::new(Self { given: given.to_owned(), canonical, handle }))
    }
}

/// A file that is below a root.
struct Inside {
    root: Arc<Root>,
    /// From the root on; without links when it was resolved.
    rest: PathBuf,
}

impl Confinement {
    /// The folder of the file that the user `named`, and the folders that are `allowed` beside it.
    pub fn new(named: &Path, allowed: &[PathBuf]) -> Self {
        let roots = allowed.iter().filter_map(|folder| Root::open(folder)).collect();
        let confinement = Self { roots: RwLock::new(roots), named: RwLock::default() };
        confinement.name(named);
        confinement
    }

    /// Adds a file that the user named, and its folder.
    pub fn name(&self, file: &Path) {
        let folder = Root::open(file.parent().unwrap_or(Path::new("")));
        write(&self.roots).extend(folder);
        self.call(file);
    }

    /// Adds a name of a file that the user named.
    pub fn call(&self, name: &Path) {
        write(&self.named).push(name.to_owned());
    }

    /// The content of a file.
    ///
    /// # Errors
    /// [`LoadError::Read`], the same for what is missing and what is not allowed; [`LoadError::TooLarge`]; what goes over
    /// the budget.
    pub fn read(&self, path: &Path, limit: u64, budget: &Budget) -> Result<Vec<u8>, LoadError> {
        let failed = |source| LoadError::Read { path: path.to_owned(), source };
        let file = self.open(path).map_err(failed)?;
        let metadata = file.metadata().map_err(failed)?;
        check_kind(&file, &metadata).map_err(failed)?;
        let size = metadata.len();
        if size > limit {
            return Err(LoadError::TooLarge { path: path.to_owned(), what: "the file".into(), size, limit });
        }
        budget.take(size, "files")?;
        let mut bytes = Vec::new();
        let reserved = usize::try_from(size).ok().map(|size| bytes.try_reserve_exact(size));
        if !matches!(reserved, Some(Ok(()))) {
            return Err(budget.no_memory(size, "a file"));
        }
        // A file that grows meanwhile is read as far as it was checked.
        file.take(size).read_to_end(&mut bytes).map_err(failed)?;
        Ok(bytes)
    }

    /// Whether [`Confinement::read`] would find a regular file.
    pub fn is_file(&self, path: &Path) -> bool {
        if self.is_named(path) {
            return path.is_file();
        }
        let inside = self.resolve(path);
        inside.is_some_and(|i| i.root.handle.metadata(&i.rest).is_ok_and(|m| m.is_file()))
    }

    /// The canonical path of a regular file that is there and that the scene may not read. What the system shows of itself is
    /// nobody's file.
    pub fn elsewhere(&self, path: &Path) -> Option<PathBuf> {
        if !names::is_ordinary(path) || self.is_named(path) || self.resolve(path).is_some() {
            return None;
        }
        let canonical = path.canonicalize().ok().filter(|canonical| !is_system(canonical))?;
        canonical.is_file().then_some(canonical)
    }

    /// The canonical path of a folder whose entries the scene may learn.
    pub fn folder(&self, path: &Path) -> Option<PathBuf> {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        let Inside { root, rest } = self.resolve(path)?;
        let canonical = root.canonical.join(rest);
        canonical.is_dir().then_some(canonical)
    }

    /// Whether this is a file that the user named.
    pub fn is_named(&self, path: &Path) -> bool {
        read(&self.named).iter().any(|named| named == path)
    }

    fn open(&self, path: &Path) -> io::Result<File> {
        if self.is_named(path) {
            // A look first: opening a device may do something.
            if !std::fs::metadata(path)?.is_file() {
                return Err(not_regular());
            }
            return File::options().read(true).open(path);
        }
        let not_there = || io::Error::new(io::ErrorKind::NotFound, NOT_THERE);
        let Inside { root, rest } = self.resolve(path).ok_or_else(not_there)?;
        if !root.handle.metadata(&rest).map_err(|_| not_there())?.is_file() {
            return Err(not_regular());
        }
        let mut options = OpenOptions::new();
        options.read(true);
        #[cfg(unix)]
        {
            use cap_std::fs::OpenOptionsExt;
            // Should a pipe be swapped in now, nothing waits for its other end.
            options.custom_flags((rustix::fs::OFlags::NONBLOCK | rustix::fs::OFlags::NOCTTY).bits() as i32);
        }
        let file = root.handle.open_with(&rest, &options);
        file.map(cap_std::fs::File::into_std).map_err(|error| {
            let escaped = root.handle.symlink_metadata(&rest).is_err();
            // What is below the folder and cannot be read is worth a reason; of what is elsewhere nothing is said.
            let worth_a_reason =
                error.kind() == io::ErrorKind::PermissionDenied && !escaped && is_plain(&root.handle, &rest);
            if worth_a_reason { error } else { not_there() }
        })
    }

    /// Where a name leads, if it is below a root.
    fn resolve(&self, path: &Path) -> Option<Inside> {
        if !names::is_ordinary(path) {
            return None;
        }
        let roots = read(&self.roots);
        let is_given = || roots.iter().any(|root| path.starts_with(&root.given));
        if cfg!(windows) && names::leaves_drives(&path.to_string_lossy()) && !is_given() {
            return None;
        }
        let canonical = path.canonicalize().ok()?;
        if is_system(&canonical) {
            return None;
        }
        roots.iter().find_map(|root| {
            let rest = canonical.strip_prefix(&root.canonical).ok()?;
            let rest = if rest.as_os_str().is_empty() { Path::new(".") } else { rest };
            Some(Inside { root: root.clone(), rest: rest.to_owned() })
        })
    }
}

/// Whether a name below `root` is a regular file itself, not a link to one.
fn is_plain(root: &Dir, rest: &Path) -> bool {
    root.symlink_metadata(rest).is_ok_and(|metadata| metadata.is_file())
}

/// Whether a canonical path is among the system's own files.
fn is_system(canonical: &Path) -> bool {
    cfg!(unix)
        && SYSTEM_FOLDERS.iter().any(|folder| canonical.starts_with(folder))
        && !canonical.starts_with(ORDINARY)
}

/// Refuses what is open but no regular file of an ordinary file system.
fn check_kind(file: &File, metadata: &std::fs::Metadata) -> io::Result<()> {
    #[cfg(target_os = "linux")]
    {
        // Wherever it is mounted, a file of `proc` or `sysfs` shows the system's state.
        const PROC: i64 = 0x9fa0;
        const SYSFS: i64 = 0x6265_6572;
        let system = rustix::fs::fstatfs(file)?;
        #[allow(clippy::useless_conversion, reason = "the type differs between architectures")]
        let kind = i64::from(system.f_type);
        if [PROC, SYSFS].contains(&kind) {
            return Err(io::Error::new(io::ErrorKind::NotFound, NOT_THERE));
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = file;
    if metadata.is_file() { Ok(()) } else { Err(not_regular()) }
}

fn not_regular() -> io::Error {
    // A device or a pipe could be read for ever.
    io::Error::other("not a regular file")
}

fn read<T>(lock: &RwLock<T>) -> std::sync::RwLockReadGuard<'_, T> {
    lock.read().unwrap_or_else(std::sync::PoisonError::into_inner)
}

fn write<T>(lock: &RwLock<T>) -> std::sync::RwLockWriteGuard<'_, T> {
    lock.write().unwrap_or_else(std::sync::PoisonError::into_inner)
}
