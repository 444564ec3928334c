//! `alhazen dataset`: pictures, exact layers and annotations from a list of poses.

use crate::console::{print_report, print_result, say};
use crate::exit::Exit;
use crate::interrupt::cancel_on_signal;
use alhazen::{BackendChoice, Job, Limits, ProtectedFiles, Renderer, RendererOptions, add_daylight_if_dark};
use anyhow::Context;
use sensors::SensorError;
use sensors::dataset::{Dataset, Poses};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Make a data set: for each pose a picture, exact layers, and annotations as COCO has them.
///
/// The folder gets images/*.png, layers/*.exr (colour, depth, position, normal, flow to the next pose, ids of instance,
/// category and material) and annotations.json (boxes, masks as run lengths, three-dimensional boxes, camera and pose). See
/// docs/python.md for the list of poses.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  alhazen dataset room.glb --poses poses.json -o room-data --spp 256")]
pub struct DatasetArgs {
    /// Scene file or name of a built-in scene.
    #[arg(value_name = "FILE|SCENE")]
    scene: String,
    /// Size, intrinsics and poses of the camera, as JSON.
    #[arg(long, value_name = "FILE")]
    poses: PathBuf,
    /// Folder to write, made if need be.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Categories by name of instance, as JSON: {"chair.001": "chair"}. All others are called as their mesh is.
    #[arg(long, value_name = "FILE")]
    categories: Option<PathBuf>,
    /// Parameter of the scene, as NAME=VALUE. May be given several times.
    #[arg(short, long = "param", value_name = "NAME=VALUE", value_parser = super::parse_parameter)]
    parameters: Vec<(String, String)>,
    #[command(flatten)]
    loading: super::loading::LoadingArgs,
    /// Samples per pixel [default: what the scene says, or 64].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Seed of the noise.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// What renders: auto, cpu, gpu, gpu-bvh, gpu-query, gpu-pipeline, all.
    #[arg(long, value_name = "NAME", default_value_t = BackendChoice::Auto)]
    backend: BackendChoice,
    /// Number of threads [default: all cores].
    #[arg(long, value_parser = super::render::parsing::parse_threads)]
    threads: Option<usize>,
    /// No progress, no report.
    #[arg(short, long)]
    quiet: bool,
}

/// Makes the data set.
pub fn run(args: &DatasetArgs) -> anyhow::Result<()> {
    let mut poses = Poses::read(&args.poses)?;
    let categories: BTreeMap<String, String> = match &args.categories {
        Some(path) => {
            let text =
                std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()));
            let text = text.map_err(|error| Exit::Input.with(error))?;
            serde_json::from_str(&text)
                .with_context(|| format!("{} is no list of categories", path.display()))
                .map_err(|error| Exit::Input.with(error))?
        }
        None => BTreeMap::new(),
    };
    let options = args.loading.options();
    let memory_limit = super::loading::memory_limit(&options);
    let mut loaded = super::load_scene(&args.scene, &args.parameters, &options)?;
    drop(memory_limit);
    poses.subtract(loaded.scene.origin);
    let mut inputs = ProtectedFiles::new(options.files_read.list());
    inputs.extend(std::iter::once(&args.poses).chain(&args.categories));
    Dataset::files(&args.output, poses.poses.len()).try_for_each(|path| inputs.check(&path))?;
    add_daylight_if_dark(&mut loaded.scene, &mut loaded.report, None);
    if !args.quiet {
        print_report(&loaded.report, false);
    }
    let options =
        RendererOptions { backend: args.backend, threads: args.threads, ..RendererOptions::default() };
    let mut renderer = Renderer::choose(&options)?.renderer;
    let job = Job { seed: args.seed, ..Job::for_scene(&loaded.scene) };
    let spp = args.spp.or(loaded.scene.defaults.spp).unwrap_or(Limits::default().spp);
    let count = poses.poses.len();
    let limits = Limits { spp, ..Limits::default() };
    let dataset = Dataset { scene: loaded.scene, poses, categories, job, limits };
    let mut finished = 0;
    let tell = |number: usize| {
        finished = number + 1;
        if !args.quiet {
            say!("{} of {count}", number + 1);
        }
    };
    let exported = dataset.export(&args.output, &mut renderer, &cancel_on_signal(), tell);
    let exported = exported.map_err(|error| match error {
        SensorError::Cancelled if finished > 0 => Exit::Interrupted.with(error.into()),
        error => error.into(),
    })?;
    let (images, annotations, place) = (exported.images, exported.annotations, args.output.display());
    print_result(&format!("{images} pictures with {annotations} annotations in {place}\n"))
}
