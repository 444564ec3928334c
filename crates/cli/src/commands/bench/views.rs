//! What is measured: scenes with a view each, and converged references of them.

use crate::commands::load_scene;
use crate::commands::render::parsing::{parse_positive, parse_threads, parse_vector};
use crate::console::{ProgressDisplay, say};
use alhazen::{
    BackendChoice, Camera, Control, ExrCompression, ExrFile, Image, Job, Limits, LoadOptions, PathKernel,
    Precision, Renderer, RendererOptions, Scene, Summary, add_daylight_if_dark, metrics,
};
use anyhow::Context;
use clap::Args;
use glam::Vec3;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Seed of references: no measurement has it, so that none shares a reference's noise.
const REFERENCE_SEED: u32 = 0x5eed_0000;

/// Scenes, pictures and what renders them.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// Scene files or names of built-in scenes, each with the place to look from if that is not the scene's first camera:
    /// `room.glb@EYE:TARGET`, both X,Y,Z.
    #[arg(value_name = "FILE|SCENE[@EYE:TARGET]", default_values_t = ["cornell", "glass", "atrium"].map(String::from))]
    scenes: Vec<String>,
    /// Width of the pictures in pixels.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(16..=8192))]
    width: u32,
    /// Height of the pictures in pixels.
    #[arg(long, default_value_t = 144, value_parser = clap::value_parser!(u32).range(16..=8192))]
    height: u32,
    /// Samples per pixel of the references. Their own error adds to every error measured: take many times what is compared.
    #[arg(long, value_name = "SPP", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(1..))]
    reference_spp: u32,
    /// Folder that keeps references for later runs, by the contents of their scene.
    #[arg(long, value_name = "FOLDER")]
    references: Option<PathBuf>,
    /// Factor on radiance before FLIP and in pictures [default: what each scene says].
    #[arg(long, value_parser = parse_positive)]
    exposure: Option<f32>,
    /// What renders, as in `alhazen render`.
    #[arg(long, value_name = "NAME", default_value_t = BackendChoice::Cpu)]
    backend: BackendChoice,
    /// Which GPU: a part of its name.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Number of threads [default: all cores].
    #[arg(long, value_parser = parse_threads)]
    threads: Option<usize>,
}

/// A scene that is ready to be rendered, and the truth about its picture.
pub struct View {
    /// Short name: the scene's, or the file's without its ending.
    pub name: String,
    /// The picture.
    pub job: Job,
    /// The converged picture.
    pub reference: Image,
}

/// How far a picture is from the reference.
#[derive(Clone, Copy, Debug)]
pub struct Distance {
    /// See [`metrics::rel_mse`].
    pub rel_mse: f64,
    /// Mean FLIP error.
    pub flip: f64,
}

/// A scene of the command line, and from where to look at it: `FILE` or `FILE@EYE:TARGET`, each of both `X,Y,Z` in metres.
#[derive(Debug, PartialEq)]
struct Place<'a> {
    scene: &'a str,
    /// The camera's position and what it looks at; `None`: the scene's first camera.
    look: Option<([f32; 3], [f32; 3])>,
}

impl<'a> Place<'a> {
    /// What is no place is a name.
    fn parse(text: &'a str) -> Self {
        let look = |place: &str| {
            let (eye, target) = place.split_once(':')?;
            let (eye, target) = (parse_vector(eye).ok()?, parse_vector(target).ok()?);
            (eye != target).then_some((eye, target))
        };
        let split = text.rsplit_once('@').and_then(|(scene, place)| Some((scene, look(place)?)));
        split.map_or(Self { scene: text, look: None }, |(scene, look)| Self { scene, look: Some(look) })
    }
}

/// Loads a scene of the command line, with daylight if it has no light and the camera of its place as the only one.
///
/// # Errors
/// When it cannot be loaded.
pub fn open_scene(text: &str) -> anyhow::Result<Scene> {
    let place = Place::parse(text);
    let mut loaded = load_scene(place.scene, &[], &LoadOptions::default())?;
    add_daylight_if_dark(&mut loaded.scene, &mut loaded.report, None);
    if let Some((eye, target)) = place.look {
        let camera = loaded.scene.default_camera();
        let (eye, target) = (Vec3::from(eye), Vec3::from(target));
        let focus_distance = (target - eye).length();
        loaded.scene.cameras = vec![Camera { eye, target, focus_distance, path: None, ..camera }];
    }
    Ok(loaded.scene)
}

/// The short name of a scene of the command line: the scene's, or the file's without its ending, and the place.
pub fn short_name(text: &str) -> String {
    let place = Place::parse(text);
    let stem = Path::new(place.scene).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    place.look.map_or(stem.clone(), |([x, y, z], _)| format!("{stem} from {x},{y},{z}"))
}

/// Loads all scenes once, so that a name that is wrong is heard of before the others have taken their hours.
///
/// # Errors
/// For the first that cannot be loaded.
pub fn check_scenes(names: &[String]) -> anyhow::Result<()> {
    // Of a single scene nothing is lost.
    let names = if names.len() > 1 { names } else { &[] };
    names.iter().try_for_each(|name| open_scene(name).map(drop))
}

impl ViewArgs {
    /// The names of the scenes, all of which can be loaded.
    ///
    /// # Errors
    /// When one cannot.
    pub fn scenes(&self) -> anyhow::Result<&[String]> {
        check_scenes(&self.scenes)?;
        Ok(&self.scenes)
    }

    /// Width and height of the pictures in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Which GPU: a part of its name.
    pub fn adapter(&self) -> Option<String> {
        self.adapter.clone()
    }

    /// What renders.
    ///
    /// # Errors
    /// When there is no such back end.
    pub fn renderer(&self) -> anyhow::Result<Renderer> {
        let options = RendererOptions {
            backend: self.backend,
            adapter: self.adapter.clone(),
            threads: self.threads,
            kernel: PathKernel::Auto,
        };
        Ok(Renderer::choose(&options)?.renderer)
    }

    /// What reports say of the arguments.
    pub fn settings(&self, renderer: &Renderer) -> Vec<(&'static str, String)> {
        vec![
            ("back end", renderer.backend_name().to_owned()),
            ("device", renderer.describe()),
            ("size", format!("{}×{}", self.width, self.height)),
            ("reference", format!("{} samples per pixel", self.reference_spp)),
        ]
    }

    /// Loads a scene into the renderer, and renders its reference or finds it.
    ///
    /// # Errors
    /// When the scene cannot be loaded or rendered, or the reference not be kept.
    pub fn open(&self, scene: &str, renderer: &mut Renderer) -> anyhow::Result<View> {
        let loaded = open_scene(scene)?;
        let mut job = Job { width: self.width, height: self.height, ..Job::for_scene(&loaded) };
        job.tone.exposure = self.exposure.unwrap_or(job.tone.exposure);
        renderer.load(&loaded)?;
        let name = short_name(scene);
        let reference = self.reference(&name, &job, renderer)?;
        Ok(View { name, job, reference })
    }

    /// The converged picture of a job, whose camera `name` tells from others of the same scene, or the kept one.
    ///
    /// # Errors
    /// When it cannot be rendered or kept.
    pub fn reference(&self, name: &str, job: &Job, renderer: &mut Renderer) -> anyhow::Result<Image> {
        let fingerprint = renderer.scene_fingerprint()?;
        let short: String = fingerprint.chars().filter(char::is_ascii_alphanumeric).take(12).collect();
        let (width, height, spp) = (self.width, self.height, self.reference_spp);
        // A place is a part of the name.
        let stem = name.replace(' ', "-");
        let file = format!("{stem}-{short}-{width}x{height}-{spp}.exr");
        let kept = self.references.as_ref().map(|folder| folder.join(file));
        if let Some(path) = kept.as_ref().filter(|path| path.is_file()) {
            return Ok(Image::open(path)?);
        }
        say!("{name}: rendering the reference, {spp} samples per pixel");
        let job = Job { seed: REFERENCE_SEED, ..job.clone() };
        let limits = Limits { spp, ..Limits::default() };
        let control = Arc::new(Control::new());
        let total = u64::from(width) * u64::from(height) * u64::from(spp);
        let display = ProgressDisplay::new(control.clone(), total, false);
        let (image, _) = render_watched(renderer, &job, &limits, &control)?;
        display.finish();
        if let Some(path) = kept {
            let folder = path.parent().unwrap_or(Path::new("."));
            std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
            ExrFile::from_image(&image, Precision::Float).write(&path, ExrCompression::Zip)?;
        }
        Ok(image)
    }
}

impl View {
    /// How far a picture of this view is from the reference.
    ///
    /// # Errors
    /// When it has another size or values that are no numbers.
    pub fn distance(&self, picture: &Image) -> anyhow::Result<Distance> {
        let flip = metrics::flip(&self.reference, picture, self.job.tone.exposure.log2())?.mean;
        Ok(Distance { rel_mse: metrics::rel_mse(&self.reference, picture)?, flip })
    }

    /// The middles of pictures of this view side by side, ready for display: half as wide and high as the pictures.
    pub fn crops(&self, pictures: &[Image]) -> Image {
        let (width, height) = (self.job.width / 2, self.job.height / 2);
        let middle = |picture: &Image| picture.crop(width / 2, height / 2, width, height);
        let crops: Vec<Image> = pictures.iter().map(|p| self.job.tone.apply(&middle(p))).collect();
        Image::from_fn(width * crops.len() as u32, height, |x, y| {
            crops[(x / width) as usize].rgb(x % width, y)
        })
    }
}

/// Renders a picture anew.
///
/// # Errors
/// When the back end fails.
pub fn render(renderer: &mut Renderer, job: &Job, limits: &Limits) -> anyhow::Result<(Image, Summary)> {
    render_watched(renderer, job, limits, &Control::new())
}

fn render_watched(
    renderer: &mut Renderer,
    job: &Job,
    limits: &Limits,
    control: &Control,
) -> anyhow::Result<(Image, Summary)> {
    renderer.restart();
    let summary = renderer.render(job, limits, control)?;
    let film = renderer.film()?.context("nothing was rendered")?;
    Ok((film.to_image(), summary))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_have_places() {
        let plain = |scene| Place { scene, look: None };
        assert_eq!(Place::parse("cornell"), plain("cornell"));
        let look = Some(([1.0, 2.0, -3.5], [4.0, 0.0, 0.0]));
        assert_eq!(Place::parse("a@b/room.glb@1,2,-3.5:4,0,0"), Place { scene: "a@b/room.glb", look });
        // Names may have such a letter, too. Who looks at where he stands sees nothing.
        for text in ["me@home", "a@1,2:3,4,5", "a@1,2,3:1,2,3", "a@1,2,3"] {
            assert_eq!(Place::parse(text), plain(text));
        }
        assert_eq!(short_name("rooms/room.glb@1,2,-3.5:4,0,0"), "room from 1,2,-3.5");
        assert_eq!(short_name("rooms/room.glb"), "room");
    }

    #[test]
    fn places_become_the_camera() {
        let scene = open_scene("cornell@1,2,3:4,5,6").unwrap_or_else(|e| panic!("{e}"));
        let camera = scene.default_camera();
        assert_eq!((camera.eye.to_array(), camera.target.to_array()), ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]));
    }
}
