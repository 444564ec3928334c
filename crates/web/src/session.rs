//! A scene, a camera, a picture in progress.

use crate::explanation::Explanation;
use crate::picture::{Shown, linear};
use crate::progressive::Progressive;
use crate::settings::{Setting, SettingError, settings_of};
use alhazen::{
    BackendError, Camera, DenoiseFilmError, Environment, ExrCompression, ExrFile, GivenFiles, ImageError,
    Job, LoadError, LoadOptions, LoadReport, NoisyPicture, Precision, RayQueries, Renderer, Scene, Source,
    add_daylight_if_dark, builtin, check_default_camera, load_environment,
};
use glam::{Vec2, Vec3};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use web_time::Duration;

/// Larger pictures are not asked for by any screen, and a page has one thread.
const LARGEST_SIDE: u32 = 4096;

/// Why something could not be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The scene cannot be loaded.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The scene is too small or too large to look at.
    #[error(transparent)]
    Camera(#[from] alhazen::NoCamera),
    /// The picture cannot be rendered.
    #[error(transparent)]
    Render(#[from] BackendError),
    /// The picture cannot be denoised.
    #[error(transparent)]
    Denoise(#[from] DenoiseFilmError),
    /// The picture cannot be written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A setting cannot be made.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// Nothing was opened before.
    #[error("no scene is open")]
    NoScene,
    /// A picture of this size.
    #[error("a picture of {0}×{1} pixels is not possible: sides are 1 to {LARGEST_SIDE}")]
    Size(u32, u32),
}

/// What was opened, for people.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Opened {
    /// The scene's name.
    pub name: String,
    /// Triangles of all instances, as they are drawn.
    pub triangles: u64,
    /// Names of the cameras; without any, one was found.
    pub cameras: Vec<String>,
    /// What was ignored, repaired or approximated.
    pub notes: Vec<String>,
    /// What the scene asks for itself, or what is usual, by the names of [`Setting`].
    pub settings: BTreeMap<&'static str, String>,
}

/// A scene that is looked at.
pub struct Session {
    files: GivenFiles,
    renderer: Renderer,
    open: Option<Open>,
    size: [u32; 2],
}

/// What is open.
struct Open {
    scene: Scene,
    job: Job,
    progressive: Progressive,
    /// For paths that are followed again; made when somebody asks.
    queries: Option<RayQueries>,
}

impl Session {
    /// Nothing is open yet.
    ///
    /// # Errors
    /// When the back end cannot be made.
    pub fn new() -> Result<Self, SessionError> {
        let renderer = Renderer::cpu(None)?;
        Ok(Self { files: GivenFiles::default(), renderer, open: None, size: [480, 270] })
    }

    /// Takes a file that is to be opened, or that a scene refers to. It replaces one of the same name.
    pub fn give(&mut self, name: &str, bytes: Vec<u8>) {
        self.files.add(name, bytes);
    }

    /// Forgets all files that were given.
    pub fn forget_files(&mut self) {
        self.files = GivenFiles::default();
    }

    /// Opens a built-in scene, or a file that was given. What was open before stays if that fails.
    ///
    /// # Errors
    /// Of loading, and for scenes that cannot be looked at.
    pub fn open(&mut self, name: &str) -> Result<Opened, SessionError> {
        let is_given = self.files.names().any(|given| given == Path::new(name));
        let source = if is_given { Source::parse_file(Path::new(name)) } else { Source::parse(name) };
        let options = LoadOptions { given_files: self.files.clone(), ..LoadOptions::default() };
        let mut loaded = source.load(&options)?;
        check_default_camera(&loaded.scene)?;
        add_daylight_if_dark(&mut loaded.scene, &mut loaded.report, None);
        self.renderer.load(&loaded.scene)?;
        let scene = loaded.scene;
        let [width, height] = self.size;
        let camera = scene.cameras.first().cloned();
        let camera = camera.unwrap_or_else(|| scene.framing_camera(width as f32 / height as f32));
        let mut job = Job::by_camera(&scene, camera, width, height);
        job.aovs = NoisyPicture::LAYERS.to_vec();
        let opened = Opened {
            name: scene.name.clone(),
            triangles: scene.instanced_triangles(),
            cameras: scene.cameras.iter().map(|camera| camera.name.clone()).collect(),
            notes: loaded.report.notes.iter().map(ToString::to_string).collect(),
            settings: settings_of(&job),
        };
        let progressive = Progressive::new(&job);
        self.open = Some(Open { scene, job, progressive, queries: None });
        Ok(opened)
    }

    /// Lights the scene by an equirectangular picture that was given (`.hdr`, `.exr`). Returns what was mended in it.
    ///
    /// # Errors
    /// Without a scene, and for pictures that cannot be read: the light stays as it was.
    pub fn light_by(&mut self, name: &str) -> Result<Vec<String>, SessionError> {
        let options = LoadOptions { given_files: self.files.clone(), ..LoadOptions::default() };
        let mut report = LoadReport::default();
        let picture = load_environment(Path::new(name), &options, &mut report)?;
        let open = self.open.as_mut().ok_or(SessionError::NoScene)?;
        open.scene.environment =
            Environment::Image { image: open.scene.images.len() as u32, rotation: 0.0, intensity: 1.0 };
        open.scene.images.push(picture);
        self.renderer.update(&open.scene)?;
        open.queries = None;
        open.progressive.restart(&open.job);
        Ok(report.notes.iter().map(ToString::to_string).collect())
    }

    /// The picture's size in pixels. It begins anew.
    ///
    /// # Errors
    /// [`SessionError::Size`].
    pub fn resize(&mut self, width: u32, height: u32) -> Result<(), SessionError> {
        let is_possible = |side| (1..=LARGEST_SIDE).contains(&side);
        if !is_possible(width) || !is_possible(height) {
            return Err(SessionError::Size(width, height));
        }
        self.size = [width, height];
        if let Some(open) = &mut self.open {
            (open.job.width, open.job.height) = (width, height);
            open.progressive.restart(&open.job);
        }
        Ok(())
    }

    /// Moves the camera, such as by [`alhazen::navigation`]. While it moves, pictures are coarse.
    ///
    /// # Errors
    /// [`SessionError::NoScene`].
    pub fn steer(&mut self, change: impl FnOnce(&mut Camera)) -> Result<(), SessionError> {
        let open = self.open.as_mut().ok_or(SessionError::NoScene)?;
        change(&mut open.job.camera);
        open.progressive.move_to(&open.job);
        Ok(())
    }

    /// Looks from `eye` at `target`, metres.
    ///
    /// # Errors
    /// [`SessionError::NoScene`].
    pub fn look_at(&mut self, eye: Vec3, target: Vec3) -> Result<(), SessionError> {
        self.steer(|camera| (camera.eye, camera.target, camera.path) = (eye, target, None))
    }

    /// Takes one of the scene's cameras; numbers beyond the last change nothing.
    ///
    /// # Errors
    /// [`SessionError::NoScene`].
    pub fn take_camera(&mut self, index: usize) -> Result<(), SessionError> {
        let camera = self.open.as_ref().and_then(|open| open.scene.cameras.get(index).cloned());
        self.steer(|now| *now = camera.unwrap_or_else(|| now.clone()))
    }

    /// Where the camera is, and what it looks at, metres.
    pub fn camera(&self) -> Option<(Vec3, Vec3)> {
        self.open.as_ref().map(|open| (open.job.camera.eye, open.job.camera.target))
    }

    /// Makes a setting; the picture begins anew where it would be another one.
    ///
    /// # Errors
    /// [`SettingError`], and without a scene.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), SessionError> {
        let setting = Setting::parse(name, value)?;
        let open = self.open.as_mut().ok_or(SessionError::NoScene)?;
        let before = open.job.clone();
        setting.apply(&mut open.job);
        let same = Job { tone: before.tone, ..open.job.clone() } == before;
        if !same {
            open.progressive.restart(&open.job);
        }
        Ok(())
    }

    /// Renders for about `time`, up to `spp` samples a pixel, and says how far the picture is.
    ///
    /// # Errors
    /// Without a scene, and of rendering.
    pub fn render(&mut self, spp: u32, time: Duration) -> Result<&Progressive, SessionError> {
        let open = self.open.as_mut().ok_or(SessionError::NoScene)?;
        open.progressive.render(&mut self.renderer, spp, time)?;
        Ok(&open.progressive)
    }

    /// The picture as it is now.
    ///
    /// # Errors
    /// Without a scene, before the first [`Session::render`], and of the denoiser.
    pub fn shown(&mut self, denoise: bool) -> Result<Shown, SessionError> {
        let open = self.open.as_mut().ok_or(SessionError::NoScene)?;
        let film = self.renderer.film()?.ok_or(SessionError::NoScene)?;
        Shown::of(film, open.progressive.below(), open.job.tone, denoise)
    }

    /// The picture as a PNG file for displays.
    ///
    /// # Errors
    /// As [`Session::shown`].
    pub fn png(&mut self, denoise: bool) -> Result<Vec<u8>, SessionError> {
        let open = self.open.as_ref().ok_or(SessionError::NoScene)?;
        let film = self.renderer.film()?.ok_or(SessionError::NoScene)?;
        let picture = linear(film, open.progressive.below(), denoise)?;
        Ok(open.job.tone.apply(&picture).encode_png()?)
    }

    /// The picture as an OpenEXR file of linear radiance, with the layers that denoisers need.
    ///
    /// # Errors
    /// Without a picture.
    pub fn exr(&mut self) -> Result<Vec<u8>, SessionError> {
        let film = self.renderer.film()?.ok_or(SessionError::NoScene)?;
        let file = ExrFile::from_film(film, Precision::Half);
        Ok(file.into_bytes(Path::new("picture.exr"), ExrCompression::default())?)
    }

    /// What a sample of a pixel did.
    ///
    /// # Errors
    /// Without a scene, and for pixels that are not in the picture.
    pub fn explain(&mut self, pixel: [u32; 2], sample: u32) -> Result<Explanation, SessionError> {
        let tables = self.renderer.tables();
        let open = self.open.as_mut().ok_or(SessionError::NoScene)?;
        let queries = match &mut open.queries {
            Some(queries) => queries,
            none => none.insert(RayQueries::new(tables.ok_or(SessionError::NoScene)?, None)?),
        };
        let view = open.job.view(0.0);
        let record = queries.replay(&view, pixel, sample)?;
        Ok(Explanation::new(&open.scene, &view, record))
    }

    /// Turns the camera about what it looks at, moves it, or goes nearer: `drag` in heights of the picture, `steps` of a wheel.
    ///
    /// # Errors
    /// [`SessionError::NoScene`].
    pub fn navigate(&mut self, gesture: Gesture) -> Result<(), SessionError> {
        use alhazen::navigation::{dolly, orbit, pan};
        self.steer(|camera| match gesture {
            Gesture::Orbit(drag) => orbit(camera, drag),
            Gesture::Pan(drag) => pan(camera, drag),
            Gesture::Dolly(steps) => dolly(camera, steps),
        })
    }
}

/// What a pointer or fingers do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gesture {
    /// Turns the camera about its target.
    Orbit(Vec2),
    /// Moves camera and target along the picture.
    Pan(Vec2),
    /// Goes towards the target.
    Dolly(f32),
}

/// Names of the built-in scenes, with what each shows.
pub fn scenes() -> Vec<(&'static str, String)> {
    builtin::list().into_iter().map(|scene| (scene.name, scene.about)).collect()
}

#[cfg(test)]
mod tests;
