//! What was rendered, and how it is written.

use super::args::RenderArgs;
use crate::console::{keep_each, say};
use alhazen::{Denoiser, Film, Job, Part, Renderer, finish, output};
use anyhow::Context;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A rendered picture, or a part of one.
pub enum Made {
    /// The renderer has the film; this is what its file says.
    Picture(BTreeMap<String, String>),
    /// Exact sums.
    Part(Box<Part>),
}

impl Made {
    /// Writes it to all `paths`, each even if others fail.
    ///
    /// A picture whose noise cannot be removed is written with it.
    pub fn write(
        self,
        renderer: &mut Renderer,
        paths: &[PathBuf],
        job: &Job,
        args: &RenderArgs,
    ) -> anyhow::Result<()> {
        let encoding = args.files.encoding();
        let write_picture = |film: &Film, metadata: &BTreeMap<String, String>| -> anyhow::Result<()> {
            let mut metadata = metadata.clone();
            let denoised = args.denoise.map(|name| Denoiser::from(name).run(film)).transpose();
            let (denoised, failed) = match denoised {
                Ok(denoised) => (denoised, Ok(())),
                Err(error) => (None, Err(error).context("the picture was written with its noise")),
            };
            if let Some(denoised) = &denoised {
                if !args.quiet {
                    say!("denoised by {}", denoised.by);
                }
                metadata.insert("denoiser".into(), denoised.by.clone());
            }
            let colour = denoised.as_ref().map(|d| &d.picture);
            keep_each(paths, |path| {
                Ok(output::write_as(path, film, colour, &job.tone, &metadata, &encoding)?)
            })?;
            failed
        };
        match self {
            Self::Picture(metadata) => {
                write_picture(renderer.film()?.context("nothing was rendered")?, &metadata)
            }
            Self::Part(part) if args.split.makes_parts() => keep_each(paths, |path| Ok(part.write(path)?)),
            Self::Part(part) => {
                let (film, metadata) = finish(*part)?;
                write_picture(&film, &metadata)
            }
        }
    }
}
