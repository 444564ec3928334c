//! Many pictures in one call, as arrays with the views in front.

use crate::arrays::{Input, matrices, output, shown};
use crate::errors::{bad, render_error};
use crate::render::{Settings, integrator, prepare, renderer_options};
use crate::scene::{Scene, lock};
use crate::watch::watch;
use alhazen::{
    Camera, Control, Job, Limits, Projection, Renderer, ViewBatch, ViewLayer, ViewPictures, ViewValues,
};
use glam::Vec3;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::collections::BTreeMap;

/// What a caller may say of views besides what pictures have; [`Scene`]'s method explains it.
pub struct Wanted<'py> {
    pub poses: Bound<'py, PyAny>,
    pub intrinsics: Bound<'py, PyAny>,
    pub width: Bound<'py, PyAny>,
    pub height: Bound<'py, PyAny>,
    pub layers: Vec<String>,
    pub next_poses: Option<Bound<'py, PyAny>>,
    pub axes: String,
}

/// How a camera shows the world, of each view or of all.
enum Intrinsics {
    /// As OpenCV has them, in pixels.
    Matrices(Vec<[[f64; 3]; 3]>),
    /// Vertical fields of view, radians.
    FieldsOfView(Vec<f64>),
}

impl Intrinsics {
    /// One for all, or one for each of `count` views.
    fn new(value: &Bound<PyAny>, count: usize) -> PyResult<Self> {
        let input = Input::<f64>::new("intrinsics", value)?;
        let numbers = input.numbers()?;
        let rows = || numbers.as_chunks::<3>().0.as_chunks::<3>().0.to_vec();
        match *input.shape() {
            // A number alone is an array of one.
            [n] if n == 1 || n == count => Ok(Self::FieldsOfView(numbers.to_vec())),
            [3, 3] => Ok(Self::Matrices(rows())),
            [n, 3, 3] if n == count => Ok(Self::Matrices(rows())),
            ref other => Err(bad(format!(
                "intrinsics: expected the shape (3, 3) or ({count}, 3, 3), or an angle or {count} of them, got {}",
                shown(other)
            ))),
        }
    }

    /// The camera of a view.
    fn camera(&self, number: usize, pose: [[f64; 4]; 3], (width, height): (u32, u32)) -> PyResult<Camera> {
        let failed = |e: &dyn std::fmt::Display| bad(format!("view {number}: {e}"));
        match self {
            Self::Matrices(all) => {
                let matrix = all[if all.len() == 1 { 0 } else { number }];
                Camera::from_opencv(matrix, pose, width, height).map_err(|e| failed(&e))
            }
            Self::FieldsOfView(all) => {
                let fov_y = all[if all.len() == 1 { 0 } else { number }];
                if !(fov_y > 0.0 && fov_y < std::f64::consts::PI) {
                    return Err(failed(&format!("intrinsics: {fov_y} is not between 0 and π radians")));
                }
                let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                let camera = Camera::from_opencv(unit, pose, width, height).map_err(|e| failed(&e))?;
                Ok(Camera { projection: Projection::Perspective { fov_y: fov_y as f32 }, ..camera })
            }
        }
    }
}

/// Camera to world with OpenCV's axes, rows, of each view.
fn poses(name: &'static str, value: &Bound<PyAny>, axes: &str) -> PyResult<Vec<[[f64; 4]; 3]>> {
    let turned = match axes {
        "opencv" => false,
        "opengl" => true,
        other => return Err(bad(format!("axes: unknown `{other}`; there are: opencv, opengl"))),
    };
    let all = matrices(name, value)?;
    let rows = |[x, y, z, _]: [[f64; 4]; 4]| [x, y, z];
    // OpenGL's cameras have y up and look along -z.
    let turn = |[x, y, z, at]: [f64; 4]| if turned { [x, -y, -z, at] } else { [x, y, z, at] };
    Ok(all.into_iter().map(|pose| rows(pose).map(turn)).collect())
}

/// A side of all views, or of each.
fn sides(name: &str, value: &Bound<PyAny>, count: usize) -> PyResult<Vec<u32>> {
    if let Ok(side) = value.extract::<u32>() {
        return Ok(vec![side; count]);
    }
    let sides: Vec<u32> = value.extract().map_err(|_| {
        bad(format!("{name}: expected a number of pixels, or one for each of {count} views, got {value}"))
    })?;
    if sides.len() != count {
        return Err(bad(format!("{name}: expected {count} numbers, one for each view, got {}", sides.len())));
    }
    Ok(sides)
}

/// The views of each size, by their numbers.
fn by_size(widths: &[u32], heights: &[u32]) -> BTreeMap<(u32, u32), Vec<usize>> {
    let mut groups: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (number, (&width, &height)) in widths.iter().zip(heights).enumerate() {
        groups.entry((width, height)).or_default().push(number);
    }
    groups
}

/// What is asked for, of views of any sizes.
struct Request {
    job: Job,
    samples: u32,
    layers: Vec<ViewLayer>,
    poses: Vec<[[f64; 4]; 3]>,
    next: Vec<[[f64; 4]; 3]>,
    intrinsics: Intrinsics,
}

impl Request {
    fn new(scene: &alhazen::Scene, wanted: &Wanted, settings: &Settings) -> PyResult<Self> {
        let poses_of = |name, value: &Bound<PyAny>| poses(name, value, &wanted.axes);
        let poses = poses_of("poses", &wanted.poses)?;
        let next = wanted.next_poses.as_ref().map(|next| poses_of("next_poses", next)).transpose()?;
        if let Some(next) = next.as_ref().filter(|next| next.len() != poses.len()) {
            return Err(bad(format!("next_poses: {} matrices for {} poses", next.len(), poses.len())));
        }
        let layer = |name: &String| name.parse::<ViewLayer>().map_err(|e| bad(format!("layers: {e}")));
        let layers: Vec<ViewLayer> = wanted.layers.iter().map(layer).collect::<PyResult<_>>()?;
        if layers.is_empty() {
            return Err(bad("layers: expected at least one"));
        }
        let flow = layers.contains(&ViewLayer::Flow);
        if flow && next.is_none() {
            return Err(bad("layers: `flow` needs next_poses"));
        }
        let samples = settings.spp.or(scene.defaults.spp).unwrap_or(Limits::default().spp);
        // Its camera and size are nobody's: each group of views has its own.
        let mut job = Job::by_camera(scene, Camera::perspective("views", Vec3::ZERO, Vec3::NEG_Z, 1.0), 1, 1);
        job.integrator = integrator(settings, job.integrator)?;
        job.seed = settings.seed;
        job.sampler = settings.sampler.parse().map_err(|e| bad(format!("sampler: {e}")))?;
        let intrinsics = Intrinsics::new(&wanted.intrinsics, poses.len())?;
        let next = next.filter(|_| flow).unwrap_or_default();
        Ok(Self { job, samples, layers, poses, next, intrinsics })
    }

    /// The views of these numbers, which are all of one size.
    fn batch(&self, numbers: &[usize], (width, height): (u32, u32)) -> PyResult<ViewBatch> {
        let cameras = |poses: &[[[f64; 4]; 3]]| -> PyResult<Vec<Camera>> {
            let camera = |&number: &usize| self.intrinsics.camera(number, poses[number], (width, height));
            if poses.is_empty() { Ok(Vec::new()) } else { numbers.iter().map(camera).collect() }
        };
        let job = Job { width, height, ..self.job.clone() };
        Ok(job.views(&cameras(&self.poses)?, &cameras(&self.next)?, self.layers.clone(), self.samples))
    }
}

/// A dictionary of layers.
pub fn render_views<'py>(
    py: Python<'py>,
    scene: &Scene,
    wanted: &Wanted<'py>,
    settings: &Settings<'py>,
) -> PyResult<Bound<'py, PyDict>> {
    let options = renderer_options(settings)?;
    let request = Request::new(&scene.contents(py).scene, wanted, settings)?;
    let count = request.poses.len();
    let (widths, heights) = (sides("width", &wanted.width, count)?, sides("height", &wanted.height, count)?);
    if let Some(i) = (0..count).find(|&i| widths[i] == 0 || heights[i] == 0) {
        return Err(bad(format!("views of {}×{} pixels are not possible", widths[i], heights[i])));
    }
    let groups = by_size(&widths, &heights);
    let batches = groups.iter().map(|(&size, numbers)| request.batch(numbers, size));
    let batches = batches.collect::<PyResult<Vec<ViewBatch>>>()?;
    // Held to the end: pictures of one scene are made one after the other.
    let mut prepared = lock(py, &scene.prepared);
    let control = Control::new();
    let renderer = prepare(py, scene, &mut prepared, options, &control)?;
    let mut made = Vec::with_capacity(batches.len());
    for batch in &batches {
        made.push(render_batch(py, renderer, batch, settings, &control)?);
    }
    let same = wanted.width.extract::<u32>().is_ok() && wanted.height.extract::<u32>().is_ok();
    let layers = PyDict::new(py);
    match (same, made.pop()) {
        (true, pictures) => {
            // Without any view there is no group of them.
            let none = || ViewPictures::empty(&request.job.views(&[], &[], request.layers.clone(), 1));
            let sides = [&wanted.height, &wanted.width].map(|side| side.extract::<usize>());
            let [height, width] = sides;
            for (layer, values) in pictures.unwrap_or_else(none).layers {
                let shape = shape_of(
                    layer,
                    &[count, height.as_ref().map_or(0, |h| *h), width.as_ref().map_or(0, |w| *w)],
                );
                layers.set_item(layer.name(), array(py, values, &shape)?)?;
            }
        }
        (false, last) => {
            made.extend(last);
            let groups: Vec<_> = groups.into_iter().zip(made).collect();
            apart(py, &layers, &request.layers, count, groups)?;
        }
    }
    Ok(layers)
}

fn render_batch(
    py: Python,
    renderer: &mut Renderer,
    batch: &ViewBatch,
    settings: &Settings,
    control: &Control,
) -> PyResult<ViewPictures> {
    let total = batch.all_samples().max(1) as f64;
    let fraction = || control.progress().samples_done as f64 / total;
    let made =
        watch(py, control, settings.progress.as_ref(), fraction, || renderer.render_views(batch, control))?;
    made.map(|(pictures, _)| pictures).map_err(render_error)
}

/// The shape of a layer's array: of a picture, and its channels.
fn shape_of(layer: ViewLayer, picture: &[usize]) -> Vec<usize> {
    let channels = Some(layer.channels()).filter(|c| *c > 1);
    picture.iter().copied().chain(channels).collect()
}

/// An array that takes the values over. "Nothing" is the largest id in Rust, and -1 there.
fn array<'py>(py: Python<'py>, values: ViewValues, shape: &[usize]) -> PyResult<Bound<'py, PyAny>> {
    match values {
        ViewValues::Float(numbers) => output(py, numbers, shape),
        ViewValues::Id(ids) => output(py, ids.into_iter().map(|id| id as i32).collect(), shape),
    }
}

/// A view's part of a layer of a group of `count`.
fn part(values: &ViewValues, place: usize, count: usize) -> ViewValues {
    fn cut<T: Copy>(all: &[T], place: usize, count: usize) -> Vec<T> {
        let length = all.len() / count;
        all[place * length..(place + 1) * length].to_vec()
    }
    match values {
        ViewValues::Float(numbers) => ViewValues::Float(cut(numbers, place, count)),
        ViewValues::Id(ids) => ViewValues::Id(cut(ids, place, count)),
    }
}

/// Views of a size, by their numbers, and what was made of them.
type Group = (((u32, u32), Vec<usize>), ViewPictures);

/// For each layer a list of arrays, one for each view.
fn apart<'py>(
    py: Python<'py>,
    layers: &Bound<'py, PyDict>,
    wanted: &[ViewLayer],
    count: usize,
    groups: Vec<Group>,
) -> PyResult<()> {
    for (i, layer) in wanted.iter().enumerate() {
        let mut arrays = vec![py.None().into_bound(py); count];
        for (((width, height), numbers), pictures) in &groups {
            let shape = shape_of(*layer, &[*height as usize, *width as usize]);
            for (place, &number) in numbers.iter().enumerate() {
                let values = part(&pictures.layers[i].1, place, numbers.len());
                arrays[number] = array(py, values, &shape)?;
            }
        }
        layers.set_item(layer.name(), PyList::new(py, arrays)?)?;
    }
    Ok(())
}
