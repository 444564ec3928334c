//! `alhazen explain`: what the paths of a pixel did.

mod draw;
mod json;
mod text;

use super::render::{self, Asked, RenderArgs};
use crate::console::{json_line, print_result, say};
use crate::exit::Exit;
use alhazen::{RayQueries, SampleRecord, Scene, SceneTables};
use anyhow::ensure;
use std::path::PathBuf;

/// Show what the paths of a pixel did, vertex by vertex: surfaces, light samples, densities, weights, roulette.
///
/// The paths are those that `render` follows on the CPU, number by number: their sum is the pixel's, bit for bit. All options
/// of `render` that say what picture it is mean the same here; those about files and back ends do not matter, so a command that
/// renders a picture can be turned into one that explains it.
#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "\
Examples:
  alhazen explain cornell --pixel 256,300
  alhazen explain glass --pixel 400,260 --sample 3 --draw path.png
  alhazen explain three-spheres --pixel 640,400 --samples 64 --json")]
pub struct ExplainArgs {
    /// The pixel: column and row, from the upper left.
    #[arg(long, help_heading = "Path", value_name = "X,Y", value_parser = parse_pixel)]
    pixel: [u32; 2],
    /// Index of the first sample.
    #[arg(long, help_heading = "Path", value_name = "N", default_value_t = 0)]
    sample: u32,
    /// How many samples.
    #[arg(long, help_heading = "Path", value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    samples: u32,
    /// Draw the paths over the picture, to a .png.
    #[arg(long, help_heading = "Path", value_name = "FILE")]
    draw: Option<PathBuf>,
    #[command(flatten)]
    render: Box<RenderArgs>,
}

/// What is explained: samples of a pixel, and where their names come from.
struct Explained<'s> {
    scene: &'s Scene,
    samples: Vec<SampleRecord>,
}

/// Follows the paths again, and prints what they did.
pub fn run(args: &ExplainArgs) -> anyhow::Result<()> {
    let end = args.sample.checked_add(args.samples);
    ensure!(
        end.is_some(),
        Exit::Usage.with(anyhow::anyhow!("--sample {}: there are no such samples", args.sample))
    );
    let Asked { loaded, job, time, inputs } = render::load_asked(&args.render)?;
    if let Some(path) = &args.draw {
        draw::check(path, &inputs)?;
    }
    let tables = SceneTables::build(&loaded.scene);
    let queries = RayQueries::new(tables, args.render.threads)?;
    let view = job.view(time);
    let samples = (args.sample..).take(args.samples as usize);
    let samples: Result<_, _> = samples.map(|sample| queries.replay(&view, args.pixel, sample)).collect();
    let explained =
        Explained { scene: &loaded.scene, samples: samples.map_err(|error| Exit::Usage.with(error.into()))? };
    if let Some(path) = &args.draw {
        draw::write(path, &explained, &job, time, args.render.threads)?;
        if !args.render.quiet {
            say!("{}", path.display());
        }
    }
    if args.render.json {
        return print_result(&json_line(&json::of(&explained)?));
    }
    let text = text::of(&explained);
    print_result(&text.lines().map(|line| format!("{}\n", alhazen::plain(line))).collect::<String>())
}

impl Explained<'_> {
    /// Mean radiance of the samples.
    fn mean(&self) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for sample in &self.samples {
            sum.iter_mut().zip(sample.radiance).for_each(|(sum, c)| *sum += f64::from(c));
        }
        sum.map(|c| (c / self.samples.len() as f64) as f32)
    }

    fn instance(&self, index: u32) -> &str {
        self.scene.instances.get(index as usize).map_or("", |instance| &instance.name)
    }

    fn material(&self, index: u32) -> &str {
        self.scene.materials.get(index as usize).map_or("", |material| &material.name)
    }
}

fn parse_pixel(text: &str) -> Result<[u32; 2], String> {
    let number = |text: &str| text.trim().parse().map_err(|_| format!("{text:?} is no number of a pixel"));
    let (x, y) = text.split_once(',').ok_or("expected X,Y")?;
    Ok([number(x)?, number(y)?])
}
