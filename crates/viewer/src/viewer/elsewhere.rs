//! Files that a scene asks for and that are not below its folder: whoever opened the scene is asked once.

use super::state::Viewer;
use crate::loading;
use std::collections::BTreeSet;
use std::path::PathBuf;

/// What a scene would like to read.
#[derive(Clone, Debug, PartialEq)]
pub struct Elsewhere {
    /// What was loaded without it.
    pub job: loading::Job,
    /// The folders that the files are in, in order.
    pub folders: Vec<PathBuf>,
    /// How many files.
    pub files: usize,
}

impl Viewer {
    /// Asks about the files that were refused to what has been loaded, but for folders that were asked about before.
    pub(super) fn note_refused(&mut self, job: &loading::Job, refused: &[PathBuf]) {
        let folder = |file: &PathBuf| file.parent().map(PathBuf::from);
        let is_new = |file: &&PathBuf| folder(file).is_some_and(|folder| !self.asked_about.contains(&folder));
        let files: Vec<&PathBuf> = refused.iter().filter(is_new).collect();
        let folders: BTreeSet<PathBuf> = files.iter().filter_map(|file| folder(file)).collect();
        if !folders.is_empty() {
            self.asked_about.extend(folders.iter().cloned());
            let (folders, files) = (folders.into_iter().collect(), files.len());
            self.elsewhere = Some(Elsewhere { job: job.clone(), folders, files });
        }
    }

    /// The answer: from now on scenes may read those folders, and what was loaded is loaded again; or nothing changes.
    pub fn answer_elsewhere(&mut self, allow: bool) {
        let Some(elsewhere) = self.elsewhere.take().filter(|_| allow) else { return };
        self.load_options.allowed_paths.extend(elsewhere.folders);
        self.keeps_camera = false;
        self.load(elsewhere.job);
    }
}
