//! What there is to know of a picture but its looks: histogram, waveform, clipping, and how far it is
//! from another one. Found by a thread of its own, so that neither the window nor rendering waits.

mod clipping;
mod difference;
mod histogram;
mod waveform;

pub use clipping::Clipping;
pub use difference::{Compared, Difference, compare};
pub use histogram::{BINS, Histogram, STOPS, stop_of};
pub use waveform::waveform;

use alhazen::Image;
use egui::ColorImage;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

/// Which findings are wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wanted {
    /// Histogram and waveform.
    pub distribution: bool,
    /// Zebra stripes.
    pub clipping: bool,
    /// The difference to the reference, and error metrics.
    pub difference: Option<Difference>,
}

/// A picture to look into.
#[derive(Clone)]
pub struct Request {
    /// Comes back with the findings: which picture, and how it is shown.
    pub number: u64,
    /// Linear values, three channels.
    pub linear: Arc<Image>,
    /// Display values.
    pub shown: Arc<ColorImage>,
    /// What it is compared with, linear.
    pub reference: Option<Arc<Image>>,
    /// Whether that had its exposure and curve before it became linear, as files of eight bits have.
    pub is_encoded: bool,
    /// Factor on linear values.
    pub exposure: f32,
    /// What is wanted.
    pub wanted: Wanted,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Findings {
    /// Of the request.
    pub number: u64,
    /// Of linear values after exposure.
    pub histogram: Option<Histogram>,
    /// Of display values.
    pub waveform: Option<ColorImage>,
    /// Of display values.
    pub clipping: Option<Clipping>,
    /// Or why both pictures cannot be compared.
    pub compared: Option<Result<Compared, String>>,
    /// How long it took.
    pub took: Duration,
}

impl Findings {
    /// Looks into a picture.
    pub fn of(request: &Request) -> Self {
        let begin = Instant::now();
        let Request { linear, shown, reference, exposure, wanted, .. } = request;
        let compared = wanted.difference.zip(reference.as_ref()).map(|(difference, reference)| {
            // Like is compared with like.
            let compared = match request.is_encoded {
                true => compare(reference, &decoded(shown), difference, 1.0),
                false => compare(reference, linear, difference, *exposure),
            };
            compared.map_err(|error| error.to_string())
        });
        Self {
            number: request.number,
            histogram: wanted.distribution.then(|| Histogram::of(linear, *exposure)),
            waveform: wanted.distribution.then(|| waveform(shown)),
            clipping: wanted.clipping.then(|| Clipping::of(shown)),
            compared,
            took: begin.elapsed(),
        }
    }
}

/// Linear values of display values, by the curve of sRGB.
fn decoded(shown: &ColorImage) -> Image {
    let linear = |byte: u8| match f32::from(byte) / 255.0 {
        v if v <= 0.04045 => v / 12.92,
        v => ((v + 0.055) / 1.055).powf(2.4),
    };
    let [width, height] = shown.size;
    Image::from_fn(width as u32, height as u32, |x, y| {
        let pixel = shown.pixels[y as usize * width + x as usize];
        [pixel.r(), pixel.g(), pixel.b()].map(linear)
    })
}

/// The thread that looks into pictures, seen from the window's.
pub struct Analyst {
    requests: Sender<Request>,
    findings: Receiver<Findings>,
}

impl Analyst {
    /// Starts the thread; `wake` is called when there are findings. It ends with this.
    pub fn start(wake: impl Fn() + Send + 'static) -> Self {
        let (requests, inbox) = channel::<Request>();
        let (outbox, findings) = channel();
        let work = move || {
            while let Ok(first) = inbox.recv() {
                // Only the newest picture is wanted.
                let request = inbox.try_iter().last().unwrap_or(first);
                if outbox.send(Findings::of(&request)).is_err() {
                    return;
                }
                wake();
            }
        };
        if let Err(error) = std::thread::Builder::new().name("analysis".into()).spawn(work) {
            eprintln!("cannot start a thread for histograms and differences: {error}");
        }
        Self { requests, findings }
    }

    /// Has a picture looked into.
    pub fn ask(&self, request: Request) {
        // Without the thread there are no findings, which was said when it could not be started.
        let _ = self.requests.send(request);
    }

    /// The newest findings that were not taken yet.
    pub fn take(&self) -> Option<Findings> {
        self.findings.try_iter().last()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::Color32;

    #[test]
    fn pictures_of_eight_bits_are_compared_with_what_is_shown() {
        let shown = Arc::new(ColorImage::new([16, 16], vec![Color32::from_rgb(188, 0, 255); 256]));
        let grey = 0.502_886;
        let mut request = Request {
            number: 1,
            // Radiance is another thing.
            linear: Arc::new(Image::from_fn(16, 16, |_, _| [9.0; 3])),
            reference: Some(Arc::new(Image::from_fn(16, 16, |_, _| [grey, 0.0, 1.0]))),
            shown,
            is_encoded: true,
            exposure: 4.0,
            wanted: Wanted { difference: Some(Difference::Absolute), ..Wanted::default() },
        };
        let greatest = |request: &Request| {
            let compared = Findings::of(request).compared.expect("asked for").expect("alike in size");
            compared.greatest.0
        };
        assert!(greatest(&request) < 1e-4, "{}", greatest(&request));
        request.is_encoded = false;
        assert!(greatest(&request) > 1.0);
        assert!(Findings::of(&request).histogram.is_none(), "nobody wanted it");
    }
}
