//! Every image of the shared data folder opens.

use std::path::{Path, PathBuf};

use film::{Image, ImageError};
use testkit::require_shared;

fn images_below(dir: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(dir).into_iter().flatten().flatten().map(|e| e.path()).collect();
    entries.sort();
    for path in entries {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        if path.is_dir() {
            images_below(&path, found);
        } else if ["exr", "hdr", "png", "jpg", "jpeg", "tga", "bmp", "webp"].contains(&extension.as_str()) {
            found.push(path);
        }
    }
}

#[test]
fn shared_images_open() {
    let Some(shared) = require_shared("shared_images_open") else { return };
    let mut paths = Vec::new();
    images_below(&shared, &mut paths);
    assert!(paths.len() > 50, "only {} images below {}", paths.len(), shared.display());
    let mut failures = Vec::new();
    for path in &paths {
        match Image::open(path) {
            Ok(image) => {
                let mean = image.mean();
                assert!(image.width() > 0 && mean.iter().all(|m| m.is_finite()), "{}", path.display());
            }
            // Some scenes come with files that are broken on purpose; converged references never are.
            Err(error @ (ImageError::Decode { .. } | ImageError::UnknownFormat { .. })) => {
                failures.push(error)
            }
            Err(error) => panic!("{error}"),
        }
    }
    let exr = |p: &Path| p.extension().is_some_and(|e| e == "exr" || e == "hdr");
    let broken: Vec<_> = failures.iter().filter(|e| e.path().is_some_and(exr)).collect();
    assert!(broken.is_empty(), "{broken:?}");
    assert!(failures.len() * 20 < paths.len(), "{failures:?}");
}
