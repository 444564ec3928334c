//! What a job consists of, whatever engine runs it.

use crate::commands::render::RenderArgs;
use anyhow::{Context, bail, ensure};
use std::path::{Path, PathBuf};

/// Tasks of a job at most. Engines take some thousands.
const MAX_TASKS: u64 = 100_000;

/// A render that is divided into tasks.
///
/// Each task renders one tile and one range of samples of one frame to a part beside the output. Then a merge for each
/// frame adds the parts up.
#[derive(Clone, Debug, PartialEq)]
pub struct JobPlan {
    /// Scene file or name of a built-in scene.
    pub scene: String,
    /// All other arguments of `alhazen render` that are the same for every task.
    pub arguments: Vec<String>,
    /// Pictures to make; all are in one folder.
    pub outputs: Vec<PathBuf>,
    /// Frames `a..b` of a sequence.
    pub frames: Option<(u32, u32)>,
    /// Tiles of each picture.
    pub tiles: u32,
    /// Ranges of samples of each tile.
    pub ranges: u32,
}

impl JobPlan {
    /// Divides what `arguments` of `alhazen render` ask for.
    pub fn new(arguments: &[String], tiles: u32, ranges: u32) -> anyhow::Result<Self> {
        let all = parse(arguments)?;
        if let Some(option) = all.not_for_jobs() {
            bail!("{option} cannot be used with `alhazen submit`, which divides the render itself");
        }
        let mut rest = without_option(arguments, &["-o", "--output"]);
        rest = without_option(&rest, &["--frames"]);
        rest = without_scene(&rest, &all)?;
        // What is left must mean what it meant before, whatever way of writing options was used.
        let left = parse(&rest)?;
        let understood = left.frames.is_none() && left.output == RenderArgs::default_picture().output;
        ensure!(understood, "write --output and --frames on their own, not joined to other options");
        let plan = Self {
            scene: all.scene.clone(),
            arguments: rest,
            outputs: all.output.clone(),
            frames: all.frames,
            tiles,
            ranges,
        };
        let frames = plan.frames.map_or(1, |(first, end)| end - first);
        let tasks = u64::from(frames).saturating_mul(u64::from(tiles)).saturating_mul(u64::from(ranges));
        ensure!(tasks <= MAX_TASKS, "{tasks} tasks are more than {MAX_TASKS}: ask for fewer tiles or ranges");
        let folder = plan.folder();
        if let Some(other) = plan.outputs.iter().find(|o| o.parent() != Some(folder)) {
            bail!("{} is not in the folder of the first output, {folder:?}", other.display());
        }
        Ok(plan)
    }

    /// The folder of the outputs; empty if it is the current one.
    pub fn folder(&self) -> &Path {
        self.outputs.first().and_then(|o| o.parent()).unwrap_or(Path::new(""))
    }

    /// The first output's name without its ending and without the place of the frame's number.
    pub fn stem(&self) -> String {
        let stem = self.outputs.first().and_then(|o| o.file_stem()).unwrap_or_default().to_string_lossy();
        let stem = stem.replace('#', "");
        let stem = stem.trim_matches(['-', '_', '.']);
        if stem.is_empty() { "alhazen".into() } else { stem.into() }
    }

    /// The file names of the outputs.
    pub fn output_names(&self) -> impl Iterator<Item = String> {
        self.outputs.iter().map(|o| o.file_name().unwrap_or_default().to_string_lossy().into_owned())
    }

    /// Whether there is anything to merge.
    pub fn is_divided(&self) -> bool {
        self.tiles > 1 || self.ranges > 1
    }

    /// The file name of a part, of which `tile` and `range` are the numbers, counted from 1.
    pub fn part_name(&self, tile: &str, range: &str) -> String {
        format!("{}.part-{tile}-{range}.exr", self.stem())
    }

    /// Numbers of tile and range of all parts of a picture, counted from 1.
    pub fn parts(&self) -> impl Iterator<Item = (u32, u32)> {
        let ranges = self.ranges;
        (1..=self.tiles).flat_map(move |tile| (1..=ranges).map(move |range| (tile, range)))
    }
}

fn parse(arguments: &[String]) -> anyhow::Result<RenderArgs> {
    RenderArgs::parse_arguments(arguments).context("these are no arguments of `alhazen render`")
}

/// The arguments without an option that takes a value.
fn without_option(arguments: &[String], names: &[&str]) -> Vec<String> {
    let mut rest = Vec::new();
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        let joined = argument.split_once('=').map_or("", |(name, _)| name);
        if names.contains(&&**argument) {
            arguments.next();
        } else if !names.contains(&joined) {
            rest.push(argument.clone());
        }
    }
    rest
}

/// The arguments without the scene, which an option's value may happen to be equal to.
fn without_scene(arguments: &[String], all: &RenderArgs) -> anyhow::Result<Vec<String>> {
    let default = RenderArgs::default_picture().scene;
    for (i, _) in arguments.iter().enumerate().filter(|(_, a)| **a == all.scene) {
        let mut rest = arguments.to_vec();
        rest.remove(i);
        // Without it, the scene is the default one and nothing else has changed.
        if let (Ok(mut without), Ok(with)) = (parse(&rest), parse(arguments))
            && without.scene == default
        {
            without.scene.clone_from(&all.scene);
            if format!("{without:?}") == format!("{with:?}") {
                return Ok(rest);
            }
        }
    }
    ensure!(all.scene == default, "cannot tell which argument is the scene {}", all.scene);
    Ok(arguments.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(arguments: &str) -> anyhow::Result<JobPlan> {
        let words: Vec<String> = arguments.split_whitespace().map(str::to_owned).collect();
        JobPlan::new(&words, 2, 3)
    }

    #[test]
    fn arguments_are_taken_apart() {
        let taken = plan("--spp 8 --camera atrium atrium -o out/f-####.exr --frames 3..5 --output=out/f.png")
            .unwrap();
        assert_eq!(taken.scene, "atrium");
        assert_eq!(taken.arguments, ["--spp", "8", "--camera", "atrium"]);
        assert_eq!(taken.outputs, [PathBuf::from("out/f-####.exr"), PathBuf::from("out/f.png")]);
        assert_eq!(
            (taken.frames, taken.stem().as_str(), taken.folder()),
            (Some((3, 5)), "f", Path::new("out"))
        );
        assert_eq!(taken.parts().count(), 6);
        assert_eq!(plan("--width 9").unwrap().scene, "three-spheres");
        assert_eq!(plan("--width 9").unwrap().output_names().collect::<Vec<_>>(), ["render.png"]);
    }

    #[test]
    fn what_cannot_be_divided_is_refused() {
        let refused = |arguments: &str| format!("{:#}", plan(arguments).unwrap_err());
        assert!(refused("atrium --tile 1/2").contains("--tile cannot be used"));
        assert!(refused("atrium --noise 0.1").contains("--noise cannot be used"));
        assert!(refused("atrium -qoa.png").contains("on their own"));
        assert!(refused("atrium -o a/a.png -o b/b.png").contains("b/b.png is not in the folder"));
        assert!(refused("atrium --nonsense").contains("--nonsense"));
    }
}
