use super::*;

fn entries(dir: &Path) -> usize {
    fs::read_dir(dir).unwrap().count()
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    write_atomically(path, |w| {
        w.write_all(bytes).map_err(|source| ImageError::Write { path: path.to_owned(), source })
    })
}

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("picture.bin");
    write(&path, b"old").unwrap();
    let result = write_atomically(&path, |w| {
        w.write_all(b"half of the n").unwrap();
        Err(ImageError::Encode { path: path.clone(), reason: "test".into() })
    });
    assert!(matches!(result, Err(ImageError::Encode { .. })));
    assert_eq!((fs::read(&path).unwrap().as_slice(), entries(dir.path())), (&b"old"[..], 1));
    prove_writable(&path).unwrap();
    assert_eq!((fs::read(&path).unwrap().as_slice(), entries(dir.path())), (&b"old"[..], 1));
    write(&path, b"new").unwrap();
    assert_eq!((fs::read(&path).unwrap().as_slice(), entries(dir.path())), (&b"new"[..], 1));
}

/// The name of a temporary file of `process` of this system.
fn temporary(of: &str, process: u32) -> String {
    let space = PROCESS_SPACE.as_deref().unwrap_or("00000000");
    format!(".{of}.{space}-{process}-0.tmp")
}

#[test]
fn what_a_killed_process_left_behind_can_be_removed() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("part.exr");
    let (mine, other) = (temporary("part.exr", 12), temporary("other.exr", 12));
    for name in ["part.exr", &mine, ".part.exr.note.tmp", ".part.exr.12-0.tmp", &other] {
        fs::write(dir.path().join(name), "").unwrap();
    }
    remove_temporaries(&path);
    assert!(path.exists() && !dir.path().join(mine).exists());
    assert_eq!(entries(dir.path()), 4);
}

#[test]
fn the_next_write_into_a_folder_removes_what_dead_processes_left() {
    const NOBODY: u32 = u32::MAX; // more than any system's processes
    let dir = tempfile::tempdir().unwrap();
    let names = [
        (temporary("a.png", NOBODY), PROCESS_SPACE.is_none()),
        (temporary("b.png", std::process::id()), true),
        // Somebody of another machine may be writing to it.
        (format!(".c.png.0123abcd-{NOBODY}-7.tmp"), true),
        (".d.png.note.tmp".to_owned(), true),
        (format!(".e.png.{NOBODY}-0.tmp"), true),
    ];
    names.iter().for_each(|(name, _)| fs::write(dir.path().join(name), "").unwrap());
    write(&dir.path().join("new.png"), b"new").unwrap();
    for (name, stays) in names {
        assert_eq!(dir.path().join(&name).exists(), stays, "{name}");
    }
    let day = Duration::from_secs(25 * 3600);
    let stranger = Temporary { of: "c.png".into(), space: "0123abcd".into(), process: NOBODY };
    assert!(stranger.is_abandoned(day) && !stranger.is_abandoned(Duration::from_secs(60)));
}

#[test]
fn impossible_places_are_errors_that_name_the_file() {
    let dir = tempfile::tempdir().unwrap();
    for path in [dir.path().join("missing/picture.bin"), dir.path().to_owned(), PathBuf::from("..")] {
        for error in [write(&path, b"").unwrap_err(), prove_writable(&path).unwrap_err()] {
            assert_eq!(error.path(), Some(path.as_path()));
        }
    }
    assert_eq!(entries(dir.path()), 0);
}

#[test]
fn inputs_are_protected_by_any_name() {
    let dir = tempfile::tempdir().unwrap();
    let [input, other] = ["input.png", "other.png"].map(|name| dir.path().join(name));
    [&input, &other].into_iter().for_each(|path| fs::write(path, "precious").unwrap());
    let protected = ProtectedFiles::new([&input, &dir.path().join("missing.png")]);
    let aliases = [input.clone(), dir.path().join("./input.png")];
    for alias in aliases {
        let error = protected.check(&alias).unwrap_err();
        assert!(matches!(&error, ImageError::Protected { path, .. } if *path == alias), "{error}");
    }
    protected.check(&other).unwrap();
    protected.check(&dir.path().join("missing.png")).unwrap();
}

#[cfg(unix)]
mod links_and_special_files {
    use super::*;
    use std::os::unix::fs::symlink;
    use std::os::unix::net::UnixListener;

    #[test]
    fn links_are_followed_and_stay() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::create_dir(at("folder")).unwrap();
        for (link, target) in [("link.png", "target.png"), ("to-new.png", "folder/new.png")] {
            symlink(target, at(link)).unwrap();
            write(&at(link), b"picture").unwrap();
            assert_eq!(fs::read_link(at(link)).unwrap(), Path::new(target));
            assert_eq!(fs::read(at(target)).unwrap(), b"picture");
        }
        symlink("target.png", at("alias.png")).unwrap();
        assert!(ProtectedFiles::new([at("target.png")]).check(&at("alias.png")).is_err());
        symlink("loop.png", at("loop.png")).unwrap();
        // A link that leads nowhere is replaced, as it names nothing that could be lost.
        write(&at("loop.png"), b"picture").unwrap();
    }

    #[test]
    fn devices_pipes_and_sockets_are_never_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let _listener = UnixListener::bind(at("socket.png")).unwrap();
        symlink("/dev/null", at("null.png")).unwrap();
        symlink("socket.png", at("link.png")).unwrap();
        for name in ["socket.png", "null.png", "link.png"] {
            for error in [write(&at(name), b"x").unwrap_err(), prove_writable(&at(name)).unwrap_err()] {
                assert!(matches!(error, ImageError::NotAFile { .. }), "{name}: {error}");
            }
        }
        assert_eq!(entries(dir.path()), 3);
    }
}
