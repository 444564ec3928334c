//! What was rendered, and how it is written.

use super::args::RenderArgs;
use super::onlooker::Onlooker;
use crate::console::{keep_each, say};
use alhazen::{
    DenoiseError, DenoiseFilmError, Denoised, Film, FrameFilm, Job, NoisyPicture, Part, Renderer, Scene,
    SequenceDenoiser, View, finish, output,
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

/// A picture's place in a sequence that is denoised.
pub struct InSequence<'a> {
    /// What the frames before have found.
    pub history: &'a mut SequenceDenoiser,
    /// What the picture shows.
    pub view: View,
    /// The scene as it is in the picture; `None` if nothing but the camera moves.
    pub scene: Option<&'a Scene>,
}

/// What is denoised.
enum Noisy {
    Picture(NoisyPicture),
    Frame(Box<FrameFilm>),
}

impl Noisy {
    fn new(film: &Film, place: Option<&InSequence>) -> Result<Self, DenoiseError> {
        match place {
            None => NoisyPicture::of_film(film).map(Self::Picture),
            Some(place) => FrameFilm::new(film, &place.view, place.scene).map(|f| Self::Frame(Box::new(f))),
        }
    }
}

impl Made {
    /// Writes it to all `paths`, each even if others fail.
    ///
    /// A picture whose noise cannot be removed is written with it. An onlooker sees what is written.
    pub fn write(
        self,
        renderer: &mut Renderer,
        paths: &[PathBuf],
        job: &Job,
        args: &RenderArgs,
        place: Option<InSequence>,
        mut onlooker: Option<&mut Onlooker>,
    ) -> anyhow::Result<()> {
        let encoding = args.files.encoding();
        let mut write_picture = |film: &Film,
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
            if let Some(onlooker) = &mut onlooker {
                onlooker.show(film, colour);
            }
            keep_each(paths, |path| {
                Ok(output::write_as(path, film, colour, &job.tone, &metadata, &encoding)?)
            })?;
            failed
        };
        match self {
            Self::Picture(metadata) => {
                let noisy = match args.denoise {
                    Some(_) => Some(Noisy::new(film_of(renderer)?, place.as_ref())),
                    None => None,
                };
                let denoised = denoised(renderer, args, noisy, place);
                write_picture(film_of(renderer)?, metadata, denoised)
            }
            Self::Part(part) if args.split.makes_parts() => keep_each(paths, |path| Ok(part.write(path)?)),
            Self::Part(part) => {
                let (film, metadata) = finish(*part)?;
                let noisy = args.denoise.map(|_| Noisy::new(&film, place.as_ref()));
                let denoised = denoised(renderer, args, noisy, place);
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
    noisy: Option<Result<Noisy, DenoiseError>>,
    place: Option<InSequence>,
) -> Option<Result<Denoised, DenoiseFilmError>> {
    let (denoiser, noisy) = args.denoise.zip(noisy)?;
    let denoised = match (noisy, place) {
        (Err(error), _) => Err(error.into()),
        (Ok(Noisy::Picture(noisy)), _) => renderer.denoise(denoiser.into(), &noisy),
        (Ok(Noisy::Frame(frame)), Some(place)) => place.history.denoise(renderer, denoiser.into(), &frame),
        (Ok(Noisy::Frame(frame)), None) => renderer.denoise(denoiser.into(), frame.noisy()),
    };
    if !args.quiet {
        renderer.take_notices().into_iter().for_each(|notice| say!("{notice}"));
    }
    Some(denoised)
}
