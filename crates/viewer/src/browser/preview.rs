//! What a file looks like before it is opened: pictures are shown small, scenes are rendered small.
//! A thread of its own makes them, one after the other.

use alhazen::{
    Control, Denoiser, Image, Job, Limits, LoadOptions, LoadReport, NoisyPicture, Renderer, Source,
    add_daylight_if_dark,
};
use egui::{Color32, ColorImage};
use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// Longest side of previews, pixels.
pub const SIDE: u32 = 240;
/// Larger files take too long for a glance.
const MOST_BYTES: u64 = 64 << 20;
/// Samples per pixel of scenes.
const SAMPLES: u32 = 8;
/// So many previews are kept.
const KEPT: usize = 64;

/// What a file looks like.
#[derive(Clone, Debug, Default)]
pub struct Preview {
    /// The picture, if there is one.
    pub picture: Option<ColorImage>,
    /// A line about the file, or why there is no picture.
    pub text: String,
}

/// A preview that is being made. Dropping it gives it up.
struct Making {
    path: PathBuf,
    control: Arc<Control>,
    made: Receiver<Preview>,
}

impl Drop for Making {
    fn drop(&mut self) {
        self.control.cancel();
    }
}

/// The previews of files that have been looked at.
#[derive(Default)]
pub struct Previews {
    made: BTreeMap<PathBuf, Preview>,
    making: Option<Making>,
}

impl Previews {
    /// The preview of a file, once it is made; `wake` is called then.
    ///
    /// - `options`: how scenes are loaded.
    pub fn of(
        &mut self,
        path: &Path,
        options: &LoadOptions,
        wake: &Arc<dyn Fn() + Send + Sync>,
    ) -> Option<&Preview> {
        self.take();
        if !self.made.contains_key(path) {
            match &self.making {
                // A file that is being read cannot be given up; the next one waits for it.
                Some(making) if making.path != path => making.control.cancel(),
                Some(_) => {}
                None => self.making = Some(start(path.to_owned(), options.clone(), wake.clone())),
            }
        }
        self.made.get(path)
    }

    fn take(&mut self) {
        let Some(making) = &self.making else { return };
        let preview = match making.made.try_recv() {
            Err(TryRecvError::Empty) => return,
            Ok(preview) => (!making.control.is_cancelled()).then_some(preview),
            Err(TryRecvError::Disconnected) => Some(Preview { text: "no preview".into(), picture: None }),
        };
        if self.made.len() >= KEPT {
            self.made.clear();
        }
        if let Some(preview) = preview {
            self.made.insert(making.path.clone(), preview);
        }
        self.making = None;
    }
}

fn start(path: PathBuf, options: LoadOptions, wake: Arc<dyn Fn() + Send + Sync>) -> Making {
    let (sender, made) = channel();
    let control = Arc::new(Control::new());
    let (of_thread, by) = (path.clone(), control.clone());
    let work = move || {
        let preview = preview(&of_thread, &options, &by).unwrap_or_else(|error| {
            let text = crate::worker::full_text(&*error);
            Preview { picture: None, text }
        });
        // Who has closed the dialog does not listen.
        let _ = sender.send(preview);
        wake();
    };
    // Without a thread the channel is closed, which says that there is no preview.
    let _ = std::thread::Builder::new().name("preview".into()).spawn(work);
    Making { path, control, made }
}

fn preview(path: &Path, options: &LoadOptions, control: &Control) -> Result<Preview, Box<dyn Error>> {
    let bytes = std::fs::metadata(path)?.len();
    if bytes > MOST_BYTES {
        return Ok(Preview { picture: None, text: "too large for a preview".into() });
    }
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match ending.as_str() {
        "png" | "jpg" | "jpeg" | "exr" | "hdr" => of_picture(path),
        "obj" | "gltf" | "glb" | "pbrt" | "ply" | "stl" | "toml" => of_scene(path, options, control),
        _ => Ok(Preview::default()),
    }
}

fn of_picture(path: &Path) -> Result<Preview, Box<dyn Error>> {
    let image = Image::open(path)?;
    let text = format!("{}×{} pixels", image.width(), image.height());
    Ok(Preview { picture: Some(shown(&reduced(&image.to_rgb()), 1.0)), text })
}

/// Renders a scene as its first picture would be, but small.
fn of_scene(path: &Path, options: &LoadOptions, control: &Control) -> Result<Preview, Box<dyn Error>> {
    let mut scene = Source::parse_file(path).load(options)?.scene;
    add_daylight_if_dark(&mut scene, &mut LoadReport::default(), None);
    let text = format!("{} objects, {} triangles", scene.instances.len(), scene.instanced_triangles());
    let job = Job::for_scene(&scene);
    let scale = f64::from(SIDE) / f64::from(job.width.max(job.height).max(1));
    let side = |n: u32| ((f64::from(n) * scale).round() as u32).max(1);
    let (width, height) = (side(job.width), side(job.height));
    let job = Job { width, height, crop: None, aovs: NoisyPicture::LAYERS.to_vec(), ..job };
    let mut renderer = Renderer::cpu(Some(1))?;
    renderer.load(&scene)?;
    renderer.render(&job, &Limits { spp: SAMPLES, ..Limits::default() }, control)?;
    let film = renderer.film()?.ok_or("nothing was rendered")?;
    let denoised = Denoiser::Network.run_on(&NoisyPicture::of_film(film)?)?;
    let picture = job.tone.apply(&denoised.picture);
    Ok(Preview { picture: Some(bytes_of(&picture)), text })
}

/// Linear values as the screen shows them.
fn shown(image: &Image, exposure: f32) -> ColorImage {
    bytes_of(&alhazen::ToneMapping { exposure, ..Default::default() }.apply(image))
}

fn bytes_of(display: &Image) -> ColorImage {
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
    let color = |rgb: &[f32]| Color32::from_rgb(byte(rgb[0]), byte(rgb[1]), byte(rgb[2]));
    let size = [display.width() as usize, display.height() as usize];
    ColorImage::new(size, display.data().chunks_exact(3).map(color).collect())
}

/// A picture whose sides are at most [`SIDE`]: means of the pixels that fall together.
fn reduced(image: &Image) -> Image {
    let step = image.width().max(image.height()).div_ceil(SIDE).max(1);
    let [width, height] = [image.width(), image.height()].map(|n| n.div_ceil(step));
    Image::from_fn(width, height, |x, y| {
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for row in y * step..((y + 1) * step).min(image.height()) {
            for column in x * step..((x + 1) * step).min(image.width()) {
                let rgb = image.rgb(column, row);
                sum = [0, 1, 2].map(|c| sum[c] + rgb[c]);
                count += 1.0;
            }
        }
        sum.map(|v| v / count)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(path: &Path) -> Preview {
        let (mut previews, options) = (Previews::default(), LoadOptions::default());
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(|| {});
        for _ in 0..6000 {
            if let Some(preview) = previews.of(path, &options, &wake) {
                return preview.clone();
            }
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        panic!("{}: no preview after 30 s", path.display());
    }

    #[test]
    fn pictures_scenes_and_what_cannot_be_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let left_red = Image::from_fn(1000, 500, |x, _| [if x < 500 { 1.0 } else { 0.0 }, 0.0, 0.0]);
        left_red.write_hdr(&at("red.hdr")).expect("written");
        let preview = of(&at("red.hdr"));
        let picture = preview.picture.expect("a picture");
        assert_eq!((picture.size, preview.text.as_str()), ([200, 100], "1000×500 pixels"));
        assert_eq!([picture.pixels[10].r(), picture.pixels[190].r()], [255, 0]);

        std::fs::write(at("wall.obj"), "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n").expect("written");
        let preview = of(&at("wall.obj"));
        let picture = preview.picture.expect("a picture");
        assert!(picture.size[0] == 240 && preview.text.contains("1 triangles"), "{}", preview.text);
        let [least, most] = [u8::MAX, 0].map(|begin| {
            let pick = if begin == 0 { u8::max } else { u8::min };
            picture.pixels.iter().map(|p| p.g()).fold(begin, pick)
        });
        assert!(most > least, "the triangle stands out from the sky: {least} {most}");

        std::fs::write(at("torn.glb"), "no model").expect("written");
        let preview = of(&at("torn.glb"));
        assert!(preview.picture.is_none() && preview.text.contains("torn.glb"), "{}", preview.text);
        std::fs::write(at("notes.txt"), "words").expect("written");
        assert!(of(&at("notes.txt")).picture.is_none());
    }
}
