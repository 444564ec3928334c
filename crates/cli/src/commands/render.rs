//! `alhazen render`: a picture, or a sequence of pictures, of a scene.

mod args;
mod backend;
mod checkpoint;
mod checks;
mod ending;
mod made;
mod moving;
mod onlooker;
pub mod output;
pub mod parsing;
mod places;
pub mod realtime;
mod report;
pub mod roulette;
mod setup;
mod shutter;
mod split;
mod video;

#[cfg(feature = "window")]
pub use args::integrators;
pub use args::{DenoiserName, RenderArgs};
pub use places::{check_output, check_place, frame_path};

use crate::console::{ProgressDisplay, say};
use crate::exit::Exit;
use crate::interrupt::cancel_on_signal;
use crate::profile::Profile;
use alhazen::{
    Control, Description, Job, Limits, LoadOptions, Loaded, MemoryLimit, PartJob, ProtectedFiles, Renderer,
    SequenceDenoiser, Summary, frame_seed, metadata,
};
use anyhow::anyhow;
use backend::{choose_renderer, print_notices};
use checkpoint::Saved;
use checks::{check, protect_inputs};
use ending::check_end;
use made::{InSequence, Made};
use moving::{Moving, stillness};
use onlooker::Onlooker;
use report::{print_loaded, report};
#[cfg(feature = "window")]
pub use setup::environment_preset;
use setup::{job, limits, set_environment};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Instant;

/// Renders what the arguments ask for.
pub fn run(args: &RenderArgs) -> anyhow::Result<()> {
    let (videos, pictures) = check(args).map_err(|error| Exit::Usage.or(error))?;
    let options = LoadOptions {
        lenient: args.lenient,
        variant: args.variant.clone(),
        picture_height: args.height,
        ..args.loading.options()
    };
    let mut onlooker = Onlooker::start(args)?;
    let mut memory_limit = super::loading::memory_limit(&options);
    let mut loaded = super::load_scene(&args.scene, &args.parameters, &options)?;
    set_environment(args, &mut loaded, &options)?;
    protect_inputs(args, &ProtectedFiles::new(options.files_read.list()), &pictures)?;
    if !args.quiet {
        print_loaded(&loaded);
    }
    let usage = |error| Exit::Usage.or(error);
    let mut saved = Saved::open(&args.split)?;
    let frames = saved.frames_left(args.sequence()).map_err(usage)?;
    let first_frame = frames.start;
    let mut moving = Moving::start(args, &mut loaded.scene, first_frame).map_err(usage)?;
    let mut job = job(args, &mut loaded, args.seconds(first_frame)).map_err(usage)?;
    if let Some(text) = stillness(args, &loaded.scene, &job.camera, &frames) {
        say!("{text}");
    }
    if !args.quiet {
        shutter::say_what_is_held(&loaded.scene, &job.integrator);
    }
    let limits = limits(args, &loaded);
    let tables = alhazen::SceneTables::build(&loaded.scene);
    let description = Description::new(&args.scene, &args.parameters, &loaded.scene);
    let load_time = loaded.report.elapsed;
    // The tables have all that back ends need: unless the scene will move, free it before structures are built.
    let mut loaded = moving.is_some().then_some(loaded);
    let mut profile = Profile::new();
    let begin = Instant::now();
    memory_limit.iter_mut().for_each(MemoryLimit::pause);
    let mut renderer = choose_renderer(args)?;
    if renderer.backend_name() == "cpu" {
        // The picture is as large as the user wants it.
        memory_limit.iter_mut().for_each(|limit| limit.resume(picture_bytes(&job)));
    }
    profile.span("open the back end", begin);
    let begin = Instant::now();
    let mut built = renderer.load_tables(tables)?;
    profile.span("load the scene", begin);
    print_notices(&mut renderer);
    let chosen = renderer.settle_caustics(&mut job);
    if let Some(text) = chosen.filter(|_| !args.quiet) {
        say!("{text}");
    }
    let control = cancel_on_signal();
    let mut history = args.denoises_sequence().then(SequenceDenoiser::default);
    for frame in frames {
        if let Some((moving, loaded)) = moving.as_mut().zip(loaded.as_mut()) {
            let begin = Instant::now();
            built = moving.show(args, frame, loaded, &mut job, &mut renderer)?.unwrap_or(built);
            profile.span("move the scene", begin);
        }
        if history.is_some() {
            // What frames have found adds up only if their noise differs.
            job.seed = frame_seed(args.seed, frame);
        }
        let part_job = PartJob {
            tile: args.split.tile,
            samples: args.split.samples(limits.spp).map_err(usage)?,
            time: args.seconds(frame).unwrap_or(0.0),
            frame: args.sequence().is_some().then_some(frame),
            ..PartJob::whole(&job, limits.spp, &description)
        };
        if let Some(onlooker) = &mut onlooker {
            onlooker.begin(part_job.frame);
        }
        let begin = Instant::now();
        let (made, summary) = if args.split.is_used() {
            saved.render(&mut renderer, &part_job, &control, args.quiet)?
        } else {
            render_whole(&mut renderer, &part_job, &limits, &control, args.quiet, onlooker.as_mut())?
        };
        profile.span("render", begin);
        profile.passes(&renderer.take_passes(), begin);
        print_notices(&mut renderer);
        let begin = Instant::now();
        let written = pictures.iter().map(|path| frame_path(path, part_job.frame));
        let written: Vec<_> = written.chain(videos.iter().map(|video| video.frame(frame))).collect();
        let place = history.as_mut().map(|history| InSequence {
            history,
            view: job.view(part_job.time),
            scene: loaded.as_ref().map(|loaded| &loaded.scene),
        });
        let files = made.write(&mut renderer, &written, &job, args, place, onlooker.as_mut());
        profile.span("write", begin);
        let reported = report(args, &renderer, &job, &summary, load_time, &built, &written);
        files.and(reported)?;
        check_end(args, &summary)?;
    }
    for video in videos {
        video.finish(first_frame, args.fps).map_err(|error| Exit::Output.or(error))?;
    }
    args.profile.as_deref().map_or(Ok(()), |path| profile.write(path))
}

/// The scene and the picture that arguments ask for.
pub struct Asked {
    pub loaded: Loaded,
    pub job: Job,
    /// When the scene is, in seconds.
    pub time: f32,
    /// Files that the scene was read from: nothing may be written over them.
    pub inputs: ProtectedFiles,
}

/// Loads what the arguments ask for, without rendering it.
pub fn load_asked(args: &RenderArgs) -> anyhow::Result<Asked> {
    let options =
        LoadOptions { lenient: args.lenient, variant: args.variant.clone(), ..args.loading.options() };
    let _limit = super::loading::memory_limit(&options);
    let mut loaded = super::load_scene(&args.scene, &args.parameters, &options)?;
    set_environment(args, &mut loaded, &options)?;
    let usage = |error| Exit::Usage.or(error);
    let first_frame = args.sequence().map_or(0, |(first, _)| first);
    Moving::start(args, &mut loaded.scene, first_frame).map_err(usage)?;
    let time = args.seconds(first_frame);
    let job = job(args, &mut loaded, time).map_err(usage)?;
    let inputs = ProtectedFiles::new(options.files_read.list());
    Ok(Asked { loaded, job, time: time.unwrap_or(0.0), inputs })
}

/// What a picture takes at most, until it is written: sums, the layers, and copies of both in other formats.
fn picture_bytes(job: &Job) -> u64 {
    const PIXEL: u64 = 160;
    const LAYER: u64 = 64;
    let pixels = u64::from(job.width) * u64::from(job.height);
    pixels.saturating_mul(PIXEL + LAYER * job.aovs.len() as u64)
}

/// Renders a picture in one go, until a limit is reached.
fn render_whole(
    renderer: &mut Renderer,
    part_job: &PartJob,
    limits: &Limits,
    control: &Arc<Control>,
    quiet: bool,
    mut onlooker: Option<&mut Onlooker>,
) -> anyhow::Result<(Made, Summary)> {
    let display = ProgressDisplay::new(control.clone(), part_job.picture().sample_count(), quiet);
    // The last picture of a sequence may have had the same view.
    renderer.restart();
    let mut after_pass = |renderer: &mut Renderer, _: &Summary| {
        if let Some(onlooker) = &mut onlooker {
            onlooker.look(renderer);
        }
    };
    let view = part_job.job.view(part_job.time);
    let summary = renderer.render_view(&view, limits, control, &mut after_pass)?;
    display.finish();
    let backends = BTreeSet::from([renderer.backend_name().to_owned()]);
    let settings = part_job.description.settings_at(part_job.job, part_job.time);
    let Some(film) = renderer.film()? else {
        return Err(Exit::Stopped.with(anyhow!("stopped before anything was rendered")));
    };
    let mut metadata = metadata(&settings, film, summary.spp, &backends, summary.elapsed);
    metadata.insert("sampling".into(), limits.sampling.name().into());
    Ok((Made::Picture(metadata), summary))
}
