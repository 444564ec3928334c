//! Pictures as arrays.

use crate::arrays::{Input, output};
use crate::camera::Camera;
use crate::errors::{bad, choice_error, render_error};
use crate::protect;
use crate::scene::{Scene, lock};
use crate::watch::watch;
use alhazen::output::{Encoding, Format, OutputError};
use alhazen::{
    Aov, AovData, BackendChoice, CRYPTOMATTE_RANKS, Control, ExrFile, Film, Image, ImageError, Integrator,
    Job, Limits, Mis, Precision, Rect, Renderer, RendererOptions, Summary, Switch, ToneMapper, ToneMapping,
    check_default_camera,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// What a caller may say of a picture; [`Scene`]'s method explains it.
pub struct Settings<'py> {
    pub width: Option<u32>,
    pub height: Option<u32>,
    pub spp: Option<u32>,
    pub camera: Option<Bound<'py, PyAny>>,
    pub aovs: Vec<String>,
    pub seed: u32,
    pub integrator: Option<String>,
    pub max_depth: Option<u32>,
    pub mis: String,
    pub clamp_indirect: Option<f32>,
    pub caustics: Option<String>,
    pub guiding: Option<String>,
    pub ambient_distance: Option<f32>,
    pub sampler: String,
    pub crop: Option<[u32; 4]>,
    pub first_sample: u32,
    pub time: f32,
    pub time_limit: Option<f64>,
    pub noise: Option<f64>,
    pub backend: String,
    pub adapter: Option<String>,
    pub threads: Option<usize>,
    pub progress: Option<Bound<'py, PyAny>>,
}

impl<'py> Settings<'py> {
    /// From the keyword arguments of a Python call; what is not given has the value that `Scene.render` documents.
    pub fn from_keywords(
        [width, height, spp]: [Option<u32>; 3],
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Self> {
        #[rustfmt::skip]
        let mut settings = Self {
            width, height, spp, camera: None, aovs: Vec::new(), seed: 0, integrator: None, max_depth: None,
            mis: "power".into(), clamp_indirect: None, caustics: None, guiding: None, ambient_distance: None, sampler: "sobol".into(), crop: None, first_sample: 0, time: 0.0,
            time_limit: None, noise: None, backend: "auto".into(), adapter: None, threads: None, progress: None,
        };
        for (key, value) in keywords.into_iter().flatten() {
            match key.extract::<String>()?.as_str() {
                "camera" => settings.camera = value.extract()?,
                "aovs" => settings.aovs = value.extract()?,
                "seed" => settings.seed = value.extract()?,
                "integrator" => settings.integrator = value.extract()?,
                "max_depth" => settings.max_depth = value.extract()?,
                "mis" => settings.mis = value.extract()?,
                "caustics" => settings.caustics = value.extract()?,
                "clamp_indirect" => settings.clamp_indirect = value.extract()?,
                "guiding" => settings.guiding = value.extract()?,
                "ambient_distance" => settings.ambient_distance = value.extract()?,
                "sampler" => settings.sampler = value.extract()?,
                "crop" => settings.crop = value.extract()?,
                "time" => settings.time = value.extract()?,
                "backend" => settings.backend = value.extract()?,
                "adapter" => settings.adapter = value.extract()?,
                "threads" => settings.threads = value.extract()?,
                "progress" => settings.progress = value.extract()?,
                other => return Err(PyTypeError::new_err(format!("unexpected keyword argument `{other}`"))),
            }
        }
        Ok(settings)
    }
}

/// A renderer that holds a version of a scene.
pub struct Prepared {
    options: RendererOptions,
    renderer: Renderer,
    version: u64,
}

/// An `alhazen.Picture`: layers by name, and what rendering took.
pub fn render<'py>(py: Python<'py>, scene: &Scene, settings: &Settings<'py>) -> PyResult<Bound<'py, PyAny>> {
    let options = renderer_options(settings)?;
    let (job, limits) = {
        let contents = scene.contents(py);
        (job(&contents.scene, settings)?, limits(&contents.scene, settings)?)
    };
    // Held to the end: pictures of one scene are made one after the other.
    let mut prepared = lock(py, &scene.prepared);
    let control = Control::new();
    let renderer = prepare(py, scene, &mut prepared, options, &control)?;
    let mut view = job.view(settings.time);
    view.first_sample = settings.first_sample;
    let total = (u64::from(limits.spp) * view.window.area() as u64).max(1) as f64;
    let before = AtomicU64::new(0);
    let fraction = || (before.load(Ordering::Relaxed) + control.progress().samples_done) as f64 / total;
    // Each pass counts from zero again.
    let mut after_pass = |_: &mut Renderer, summary: &Summary| {
        control.begin(0);
        before.store(summary.samples, Ordering::Relaxed);
    };
    let summary = watch(py, &control, settings.progress.as_ref(), fraction, || {
        renderer.render_view(&view, &limits, &control, &mut after_pass)
    })?;
    let summary = summary.map_err(render_error)?;
    let layers = match renderer.film().map_err(render_error)? {
        Some(film) => layers(py, film)?,
        None => PyDict::new(py),
    };
    let about = PyDict::new(py);
    about.set_item("spp", summary.spp)?;
    about.set_item("seconds", summary.elapsed.as_secs_f64())?;
    about.set_item("noise", summary.noise)?;
    about.set_item("invalid_samples", summary.invalid_samples)?;
    about.set_item("backend", renderer.backend_name())?;
    about.set_item("notices", renderer.take_notices())?;
    picture(py, layers, &about)
}

/// An `alhazen.Picture`: layers by name, and what rendering took.
pub fn picture<'py>(
    py: Python<'py>,
    layers: Bound<'py, PyDict>,
    about: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyAny>> {
    py.import("alhazen._picture")?.getattr("Picture")?.call((layers,), Some(about))
}

/// The renderer of these options with the scene as it is now.
pub fn prepare<'a>(
    py: Python,
    scene: &Scene,
    prepared: &'a mut Option<Prepared>,
    options: RendererOptions,
    control: &Control,
) -> PyResult<&'a mut Renderer> {
    let contents = scene.contents(py);
    let (description, version) = (&contents.scene, contents.version);
    let old = prepared.take().filter(|p| p.options == options);
    let made = watch(
        py,
        control,
        None,
        || 0.0,
        || -> Result<_, PrepareError> {
            match old {
                Some(mut current) if current.version == version => {
                    current.renderer.restart();
                    Ok(current)
                }
                Some(mut outdated) => {
                    outdated.renderer.update(description).map_err(PrepareError::Load)?;
                    Ok(Prepared { version, ..outdated })
                }
                None => {
                    let mut renderer = Renderer::choose(&options).map_err(PrepareError::Choice)?.renderer;
                    renderer.load(description).map_err(PrepareError::Load)?;
                    Ok(Prepared { options, renderer, version })
                }
            }
        },
    )?;
    let made = made.map_err(|e| match e {
        PrepareError::Choice(e) => choice_error(e),
        PrepareError::Load(e) => render_error(e),
    })?;
    Ok(&mut prepared.insert(made).renderer)
}

enum PrepareError {
    Choice(alhazen::ChoiceError),
    Load(alhazen::BackendError),
}

pub fn renderer_options(settings: &Settings) -> PyResult<RendererOptions> {
    let backend: BackendChoice = settings.backend.parse().map_err(|e| bad(format!("backend: {e}")))?;
    let (adapter, threads) = (settings.adapter.clone(), settings.threads);
    Ok(RendererOptions { backend, adapter, threads, ..RendererOptions::default() })
}

pub fn limits(scene: &alhazen::Scene, settings: &Settings) -> PyResult<Limits> {
    let spp = settings.spp.or(scene.defaults.spp).unwrap_or(Limits::default().spp);
    if spp == 0 {
        return Err(bad("spp: a picture needs at least one sample per pixel"));
    }
    let time = settings.time_limit.map(Duration::try_from_secs_f64).transpose();
    let time = time.map_err(|e| bad(format!("time_limit: {e}")))?;
    if let Some(noise) = settings.noise.filter(|n| !(*n > 0.0 && n.is_finite())) {
        return Err(bad(format!("noise: {noise} is not a positive number")));
    }
    Ok(Limits { spp, time, noise: settings.noise, ..Limits::default() })
}

pub fn job(scene: &alhazen::Scene, settings: &Settings) -> PyResult<Job> {
    if !settings.time.is_finite() {
        return Err(bad(format!("time: {} is not a moment", settings.time)));
    }
    let mut job = Job::for_scene(scene);
    match &settings.camera {
        Some(camera) => job.camera = camera_of(scene, camera)?,
        None => check_default_camera(scene).map_err(|e| bad(e.to_string()))?,
    }
    let aspect = job.camera.aspect.unwrap_or(job.width as f32 / job.height as f32);
    let scaled = |side: u32, factor: f32| ((side as f32 * factor).round() as u32).max(1);
    (job.width, job.height) = match (settings.width, settings.height) {
        (Some(w), Some(h)) => (w, h),
        (Some(w), None) => (w, scaled(w, 1.0 / aspect)),
        (None, Some(h)) => (scaled(h, aspect), h),
        (None, None) => (job.width, scaled(job.width, 1.0 / aspect)),
    };
    if job.width == 0 || job.height == 0 {
        return Err(bad(format!("a picture of {}×{} pixels is not possible", job.width, job.height)));
    }
    if settings.camera.is_none() && scene.cameras.is_empty() {
        job.camera = scene.framing_camera(job.width as f32 / job.height as f32);
    }
    job.crop = settings.crop.map(|[x, y, width, height]| Rect { x, y, width, height });
    job.integrator = integrator(settings, job.integrator)?;
    job.seed = settings.seed;
    job.sampler = settings.sampler.parse().map_err(|e| bad(format!("sampler: {e}")))?;
    let layer = |name: &String| name.parse::<Aov>().map_err(|e| bad(format!("aovs: {e}")));
    job.aovs = settings.aovs.iter().map(layer).collect::<PyResult<_>>()?;
    Ok(job)
}

/// A camera itself, or one of the scene's by number or name.
fn camera_of(scene: &alhazen::Scene, named: &Bound<PyAny>) -> PyResult<alhazen::Camera> {
    if let Ok(camera) = named.cast::<Camera>() {
        return Ok(camera.get().0.clone());
    }
    let found = match named.extract::<usize>() {
        Ok(index) => scene.cameras.get(index),
        Err(_) => {
            let name: String =
                named.extract().map_err(|_| bad("camera: expected a Camera, a number or a name"))?;
            scene.cameras.iter().find(|c| c.name == name)
        }
    };
    let known: Vec<_> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
    found.cloned().ok_or_else(|| bad(format!("camera: there is no {named}; the scene has {known:?}")))
}

/// The integrator that the settings name, or the scene's.
pub fn integrator(settings: &Settings, of_scene: Integrator) -> PyResult<Integrator> {
    let unknown = |name: &str| {
        let known = Integrator::all().map(|integrator| integrator.name()).join(", ");
        bad(format!("integrator: unknown `{name}`; there are: {known}"))
    };
    let named = settings.integrator.as_deref();
    let named = named.map(|name| Integrator::from_name(name).ok_or_else(|| unknown(name))).transpose()?;
    let mut integrator = match (named, of_scene) {
        (None, of_scene) | (Some(Integrator::Path(_)), of_scene @ Integrator::Path(_)) => of_scene,
        (Some(Integrator::Path(_)), Integrator::Realtime(realtime)) => Integrator::Path(realtime.path),
        (Some(named), _) => named,
    };
    if let Some(depth) = settings.max_depth {
        if !(1..=1000).contains(&depth) {
            return Err(bad(format!("max_depth: {depth} is not between 1 and 1000")));
        }
        if let Some(longest) = integrator.max_depth_mut() {
            *longest = depth;
        }
    }
    let mis: Mis = settings.mis.parse().map_err(|e| bad(format!("mis: {e}")))?;
    match &mut integrator {
        Integrator::Path(path) => path.mis = mis,
        other if mis != Mis::default() => {
            return Err(bad(format!("mis is for the integrator path, not for {}", other.name())));
        }
        _ => {}
    }
    if let Some(most) = settings.clamp_indirect {
        if !(most > 0.0 && most.is_finite()) {
            return Err(bad(format!("clamp_indirect: {most} is not a positive number")));
        }
        match &mut integrator {
            Integrator::Path(path) => path.clamp_indirect = Some(most),
            other => {
                return Err(bad(format!(
                    "clamp_indirect is for the integrator path, not for {}",
                    other.name()
                )));
            }
        }
    }
    let switches = [("caustics", &settings.caustics), ("guiding", &settings.guiding)];
    for (what, name) in switches.into_iter().filter_map(|(what, name)| Some((what, name.as_ref()?))) {
        let switch: Switch = name.parse().map_err(|e| bad(format!("{what}: {e}")))?;
        match &mut integrator {
            Integrator::Path(path) if what == "caustics" => path.caustics = switch,
            Integrator::Path(path) => path.guiding = switch,
            other => {
                return Err(bad(format!("{what} is for the integrator path, not for {}", other.name())));
            }
        }
    }
    if let Some(metres) = settings.ambient_distance {
        if !(metres >= 0.0 && metres.is_finite()) {
            return Err(bad(format!("ambient_distance: {metres} is not a number of at least 0")));
        }
        let name = integrator.name();
        let other = || bad(format!("ambient_distance: the integrator {name} has no ambient occlusion"));
        integrator.ambient_mut().ok_or_else(other)?.set_distance(metres);
    }
    Ok(integrator)
}

/// Colour and all auxiliary layers of a film, by name.
pub fn layers<'py>(py: Python<'py>, film: &Film) -> PyResult<Bound<'py, PyDict>> {
    let layers = PyDict::new(py);
    let window = film.window();
    let (height, width) = (window.height as usize, window.width as usize);
    let array = |image: Image| {
        let channels = image.channels();
        let shape: &[usize] = if channels == 1 { &[height, width] } else { &[height, width, channels] };
        output(py, image.into_data(), shape)
    };
    layers.set_item("color", array(py.detach(|| film.to_image()))?)?;
    for &aov in film.aovs() {
        let layer = match py.detach(|| film.aov(aov)) {
            Some(AovData::Float(image)) => array(image)?,
            // "No object" is the largest number there, and -1 in arrays.
            Some(AovData::Integer(ids)) => {
                output(py, ids.into_iter().map(|i| i as i32).collect(), &[height, width])?
            }
            Some(AovData::Shares(pixels)) => {
                output(py, ranks(pixels), &[height, width, CRYPTOMATTE_RANKS, 2])?
            }
            None => continue,
        };
        layers.set_item(aov.name(), layer)?;
    }
    Ok(layers)
}

/// The ids of each pixel that have most of its samples, and their shares; -1 and 0 where there are fewer.
fn ranks(pixels: Vec<Vec<(u32, f32)>>) -> Vec<f32> {
    let ranked = |mut shares: Vec<(u32, f32)>| {
        shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        let shares = shares.into_iter().map(|(id, share)| [id as f32, share]);
        shares.chain(std::iter::repeat([-1.0, 0.0])).take(CRYPTOMATTE_RANKS).flatten()
    };
    pixels.into_iter().flat_map(ranked).collect()
}

/// Writes a file: complete, or not at all, and never over a device, a pipe or a folder.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
/// data : bytes
#[pyfunction]
pub fn write_file(py: Python, path: PathBuf, data: &[u8]) -> PyResult<()> {
    protect::check(&path)?;
    let failed = |source| ImageError::Write { path: path.clone(), source };
    let written = py
        .detach(|| alhazen::write_atomically(&path, |writer| Write::write_all(writer, data).map_err(failed)));
    written.map_err(protect::write_error)
}

/// Writes layers as an EXR file, or the colour in another format, by the path's ending: complete, or not at all.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///     Ends in .exr, .hdr, .png, .jpg.
/// layers : dict of str to array_like, shape (height, width) or (height, width, channels)
///     "color" is the picture; all others go into EXR files only.
/// tonemap, exposure
///     For .png and .jpg, see `encode_png`.
#[pyfunction]
#[pyo3(signature = (path, layers, *, tonemap="srgb", exposure=1.0))]
pub fn write_picture(
    py: Python,
    path: PathBuf,
    layers: &Bound<PyDict>,
    tonemap: &str,
    exposure: f32,
) -> PyResult<()> {
    protect::check(&path)?;
    let tone = tone(tonemap, exposure)?;
    let mut color = None;
    let mut others = Vec::new();
    for (name, array) in layers {
        let name: String = name.extract()?;
        if name == "color" {
            color = Some(rgb_image("color", &array)?);
        } else if let Some(layer) = layer_image(&name, &array)? {
            others.push((name, layer));
        }
    }
    let color = color.ok_or_else(|| bad("layers: there is no `color`"))?;
    let encoding = Encoding::default();
    let written = py.detach(|| {
        if Format::of(&path)? != Format::Exr {
            return alhazen::write_image(&path, &color, &tone, &encoding);
        }
        let mut file = ExrFile::from_image(&color, encoding.exr_precision);
        for (name, image) in &others {
            let known = name.parse::<Aov>().map(Aov::channels).unwrap_or_default();
            let channels: &[&str] = match image.channels() {
                n if n == known.len() => known,
                1 => &["V"],
                2 => &["X", "Y"],
                3 => &["R", "G", "B"],
                _ => &["R", "G", "B", "A"],
            };
            file.push_layer(name, channels, image, Precision::Float);
        }
        Ok(file.write(&path, encoding.exr_compression)?)
    });
    written.map_err(|error| match error {
        OutputError::Image(error) => protect::write_error(error),
        other => bad(other.to_string()),
    })
}

/// A layer of numbers; `None` for arrays that no file has a place for, such as mattes.
fn layer_image(name: &str, array: &Bound<PyAny>) -> PyResult<Option<Image>> {
    let input = Input::<f32>::new("layers", array)?;
    let (height, width, channels) = match *input.shape() {
        [height, width] => (height, width, 1),
        [height, width, channels @ 1..=4] => (height, width, channels),
        _ => return Ok(None),
    };
    let side = |n: usize| u32::try_from(n).map_err(|_| bad(format!("{name}: the layer is too large")));
    let image = Image::from_data(side(width)?, side(height)?, channels, input.numbers()?.to_vec());
    image.map(Some).map_err(|e| bad(e.to_string()))
}

const TONE_MAPPERS: [(&str, ToneMapper); 6] = [
    ("srgb", ToneMapper::Srgb),
    ("none", ToneMapper::None),
    ("reinhard", ToneMapper::Reinhard),
    ("aces", ToneMapper::Aces),
    ("agx", ToneMapper::Agx),
    ("neutral", ToneMapper::Neutral),
];

fn tone(tonemap: &str, exposure: f32) -> PyResult<ToneMapping> {
    let known = TONE_MAPPERS.map(|(name, _)| name).join(", ");
    let mapper = TONE_MAPPERS.iter().find(|(name, _)| *name == tonemap).map(|(_, mapper)| *mapper);
    let mapper = mapper.ok_or_else(|| bad(format!("tonemap: unknown `{tonemap}`; there are: {known}")))?;
    if !(exposure > 0.0 && exposure.is_finite()) {
        return Err(bad(format!("exposure: {exposure} is not a positive number")));
    }
    Ok(ToneMapping { mapper, exposure, saturation: 1.0 })
}

/// An image of shape (height, width, 3); `name` is that of the argument.
pub fn rgb_image(name: &'static str, values: &Bound<PyAny>) -> PyResult<Image> {
    let input = Input::<f32>::new(name, values)?;
    let [height, width, 3] = *input.shape() else {
        return Err(bad(format!("{name}: expected the shape (height, width, 3)")));
    };
    let side = |n: usize| u32::try_from(n).map_err(|_| bad(format!("{name}: the picture is too large")));
    let image = Image::from_data(side(width)?, side(height)?, 3, input.numbers()?.to_vec());
    image.map_err(|e| bad(e.to_string()))
}

/// Tone maps a picture and encodes it as PNG.
///
/// Parameters
/// ----------
/// color : array_like, float32, shape (height, width, 3)
///     Linear radiance, Rec. 709 primaries, row 0 at the top.
/// tonemap : {"srgb", "none", "reinhard", "aces", "agx", "neutral"}, default "srgb"
/// exposure : float, default 1
///     Factor on radiance before the curve.
///
/// Returns
/// -------
/// bytes
///     A PNG file, 8 bits a channel.
#[pyfunction]
#[pyo3(signature = (color, *, tonemap="srgb", exposure=1.0))]
pub fn encode_png<'py>(
    py: Python<'py>,
    color: &Bound<'py, PyAny>,
    tonemap: &str,
    exposure: f32,
) -> PyResult<Bound<'py, PyBytes>> {
    let (tone, image) = (tone(tonemap, exposure)?, rgb_image("color", color)?);
    let png = py.detach(|| tone.apply(&image).encode_png());
    Ok(PyBytes::new(py, &png.map_err(|e| bad(e.to_string()))?))
}
