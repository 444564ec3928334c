//! What was rendered, and how it is written.

use super::args::RenderArgs;
use crate::console::{keep_each, say};
use alhazen::{
    DenoiseError, DenoiseFilmError, Denoised, Film, Job, NoisyPicture, Part, Renderer, finish, output,
};
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
        let write_picture = |film: &Film,
                             mut metadata: BTreeMap<String, String>,
                             denoised: Option<Result<Denoised, DenoiseFilmError>>|
         -> anyhow::Result<()> {
            let (denoised, failed) = match denoised.transpose() {
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
                let noisy = match args.denoise {
                    Some(_) => Some(NoisyPicture::of_film(film_of(renderer)?)),
                    None => None,
                };
                let denoised = denoised(renderer, args, noisy);
                write_picture(film_of(renderer)?, metadata, denoised)
            }
            Self::Part(part) if args.split.makes_parts() => keep_each(paths, |path| Ok(part.write(path)?)),
            Self::Part(part) => {
                let (film, metadata) = finish(*part)?;
                let noisy = args.denoise.map(|_| NoisyPicture::of_film(&film));
                let denoised = denoised(renderer, args, noisy);
                write_picture(&film, metadata, denoised)
            }
        }
    }
}

fn film_of(renderer: &mut Renderer) -> anyhow::Result<&Film> {
    renderer.film()?.context("nothing was rendered")
}

/// A film's picture without its noise, if that is wanted.
fn denoised(
    renderer: &mut Renderer,
    args: &RenderArgs,
    noisy: Option<Result<NoisyPicture, DenoiseError>>,
) -> Option<Result<Denoised, DenoiseFilmError>> {
    let (denoiser, noisy) = args.denoise.zip(noisy)?;
    let denoised = noisy.map_err(DenoiseFilmError::from).and_then(|n| renderer.denoise(denoiser.into(), &n));
    if !args.quiet {
        renderer.take_notices().into_iter().for_each(|notice| say!("{notice}"));
    }
    Some(denoised)
}
