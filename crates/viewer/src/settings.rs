//! What the viewer remembers from one time to the next.

use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// So many files are remembered.
const MOST_RECENT: usize = 12;

/// Remembered settings; a file lists them as JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Files and scenes that were opened, the last one first.
    pub recent: Vec<String>,
    /// Width and height of the window in points.
    pub window: [f32; 2],
    /// The back end, as `--backend` takes it.
    pub backend: String,
    /// Whether the panel on the right is open.
    pub side_panel: bool,
    /// Dark or light.
    pub dark: bool,
    /// Black and white panels with borders.
    pub high_contrast: bool,
    /// Panels open and scroll at once.
    pub reduced_motion: bool,
    /// Size of everything but the picture.
    pub zoom: f32,
    /// Load a file again when it changes.
    pub watch: bool,
    /// Ask for files by our own dialog, even where the desktop has one.
    pub own_dialogs: bool,
    /// Signs over the picture for lights and cameras.
    pub icons: bool,
    /// A grid on the ground.
    pub ground_grid: bool,
    /// The compass of axes in a corner of the picture.
    pub compass: bool,
    /// Borders and values of pixels that are large enough for them.
    pub pixel_grid: bool,
    /// Height of the list of objects, points.
    pub outliner_height: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            recent: Vec::new(),
            window: [1360.0, 800.0],
            backend: "auto".into(),
            side_panel: true,
            dark: true,
            high_contrast: false,
            reduced_motion: false,
            zoom: 1.0,
            watch: true,
            own_dialogs: false,
            icons: true,
            ground_grid: false,
            compass: true,
            pixel_grid: true,
            outliner_height: 260.0,
        }
    }
}

impl Settings {
    /// Where they are kept: `alhazen/viewer.json` in the user's folder for settings, which is `XDG_CONFIG_HOME`, or
    /// what the system has instead. `None` where there is no such folder.
    pub fn path() -> Option<PathBuf> {
        let variable = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
        let home = || variable("HOME");
        let folder = variable("XDG_CONFIG_HOME").or_else(|| {
            if cfg!(windows) {
                variable("APPDATA")
            } else if cfg!(target_os = "macos") {
                Some(home()?.join("Library/Application Support"))
            } else {
                Some(home()?.join(".config"))
            }
        })?;
        Some(folder.join("alhazen/viewer.json"))
    }

    /// What `path` has; defaults where there is no such file or it is damaged.
    pub fn load(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let mut settings: Self = serde_json::from_str(&text).unwrap_or_default();
        let sane = |v: f32, low: f32, high: f32, otherwise: f32| {
            if v.is_finite() { v.clamp(low, high) } else { otherwise }
        };
        settings.window = settings.window.map(|v| sane(v, 200.0, 16_000.0, 800.0));
        settings.zoom = sane(settings.zoom, 0.5, 4.0, 1.0);
        settings.outliner_height = sane(settings.outliner_height, 60.0, 2000.0, 260.0);
        settings.recent.truncate(MOST_RECENT);
        settings
    }

    /// Writes them to `path`, making its folder.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn save(&self, path: &Path) -> std::io::Result<()> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        let text = serde_json::to_string_pretty(self)?;
        crate::text_file::write(path, &text).map_err(std::io::Error::other)
    }

    /// Puts a file to the top of the list.
    pub fn remember(&mut self, name: &str) {
        self.recent.retain(|known| known != name);
        self.recent.insert(0, name.to_owned());
        self.recent.truncate(MOST_RECENT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_come_back_and_damage_is_forgiven() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a/b/viewer.json");
        let mut settings = Settings { zoom: 1.5, ..Settings::default() };
        settings.remember("x.glb");
        settings.save(&path).expect("written");
        assert_eq!(Settings::load(&path), settings);
        std::fs::write(&path, "{\"zoom\": 1e30, \"unknown\": 1, \"dark\": false}").expect("written");
        let mended = Settings::load(&path);
        assert_eq!((mended.zoom, mended.dark, mended.window), (4.0, false, Settings::default().window));
        std::fs::write(&path, "not json").expect("written");
        assert_eq!(Settings::load(&path), Settings::default());
    }

    #[test]
    fn recent_files_are_few_and_the_last_is_first() {
        let mut settings = Settings::default();
        (0..30).for_each(|i| settings.remember(&i.to_string()));
        settings.remember("25");
        assert_eq!(
            (settings.recent.len(), &settings.recent[..2]),
            (12, &["25".to_owned(), "29".to_owned()][..])
        );
    }
}
