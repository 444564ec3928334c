//! Other renderers that `cargo xtask bench cpu` measures, each by a script of the shared data's tools.

use crate::shell::{output, python_with, shared_dir};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A renderer to compare with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Renderer {
    /// Mitsuba 3, `pip install mitsuba`.
    Mitsuba,
    /// Blender's Cycles on the CPU, `pip install bpy`.
    Cycles,
}

/// What all renderers are asked for.
#[derive(Clone, Debug)]
pub struct Task {
    /// Width and height of the picture in pixels.
    pub size: u32,
    /// Samples per pixel.
    pub spp: u32,
    /// Vertices of a path after the camera's, as Alhazen counts them.
    pub max_depth: u32,
    /// First vertex at which Russian roulette may end a path, for renderers that can be told.
    pub roulette_start: u32,
    /// Mitsuba's variant.
    pub variant: String,
}

/// A renderer that can be run here.
#[derive(Debug)]
pub struct Peer {
    renderer: Renderer,
    python: PathBuf,
    script: PathBuf,
}

impl Renderer {
    /// Its name for readers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mitsuba => "Mitsuba 3",
            Self::Cycles => "Cycles",
        }
    }

    fn module(self) -> &'static str {
        match self {
            Self::Mitsuba => "mitsuba",
            Self::Cycles => "bpy",
        }
    }

    fn script(self) -> &'static str {
        match self {
            Self::Mitsuba => "gltf_to_mitsuba.py",
            Self::Cycles => "gltf_to_cycles.py",
        }
    }
}

impl Peer {
    /// Finds the script and a Python with the renderer: `wanted`, or else the one on the path.
    pub fn find(renderer: Renderer, wanted: Option<&Path>) -> Option<Self> {
        let script = shared_dir().map(|shared| shared.join("tools").join(renderer.script()));
        let script = script.filter(|s| s.is_file());
        let python = python_with(wanted, renderer.module());
        if script.is_none() || python.is_none() {
            eprintln!(
                "no peer: it needs the shared data's tools and a Python with {} (--python PATH)",
                renderer.module()
            );
        }
        Some(Self { renderer, python: python?, script: script? })
    }

    /// Renders a scene and returns what the script says of it, with `msamples_s`.
    ///
    /// # Errors
    ///
    /// If the script fails or says nothing.
    pub fn run(&self, file: &Path, task: &Task) -> anyhow::Result<Value> {
        super::bench::last_line_as_json(&output(&mut self.command(file, task))?)
    }

    fn command(&self, file: &Path, task: &Task) -> Command {
        let (size, spp) = (format!("{0}x{0}", task.size), task.spp.to_string());
        let mut command = Command::new(&self.python);
        command.arg(&self.script).arg(file).args(["--size", &size, "--spp", &spp]);
        command.args(["--depth", &task.max_depth.to_string()]);
        match self.renderer {
            Renderer::Mitsuba => {
                command.args(["--variant", &task.variant, "--rr", &task.roulette_start.to_string()]);
                // The first render of a process compiles its kernels; the second is the one that is measured.
                command.args(["--repeat", "2"]);
            }
            // Its roulette begins where its own rule says. A render of one sample is subtracted by the script.
            Renderer::Cycles => {
                command.args(["--repeat", "1"]);
            }
        }
        command
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_renderer_is_asked_for_the_same_picture() {
        let task = Task { size: 32, spp: 7, max_depth: 5, roulette_start: 4, variant: "scalar_rgb".into() };
        for renderer in [Renderer::Mitsuba, Renderer::Cycles] {
            let peer = Peer { renderer, python: "python3".into(), script: "script.py".into() };
            let command = peer.command(Path::new("a.glb"), &task);
            let words: Vec<_> = command.get_args().map(|w| w.to_string_lossy().into_owned()).collect();
            for pair in [["--size", "32x32"], ["--spp", "7"], ["--depth", "5"]] {
                assert!(words.windows(2).any(|w| w == pair), "{}: {words:?}", renderer.name());
            }
            assert_eq!(words[..2], ["script.py", "a.glb"], "{}", renderer.name());
        }
    }
}
