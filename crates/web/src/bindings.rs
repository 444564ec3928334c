//! What JavaScript calls. Errors arrive there as exceptions with the whole chain as text.

use crate::session::{Gesture, Session, SessionError, scenes};
use glam::{Vec2, Vec3};
use std::error::Error;
use wasm_bindgen::prelude::*;
use web_time::Duration;

/// A scene that is looked at. Lengths are metres, angles radians, colours linear.
#[wasm_bindgen]
pub struct Page {
    session: Session,
    shown_size: [u32; 2],
}

#[wasm_bindgen]
impl Page {
    /// Nothing is open yet.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Result<Page, JsError> {
        Ok(Self { session: Session::new().map_err(chain)?, shown_size: [0, 0] })
    }

    /// The built-in scenes: `[[name, what it shows], …]` as JSON.
    pub fn scenes() -> Result<String, JsError> {
        Ok(serde_json::to_string(&scenes())?)
    }

    /// Takes a file that is to be opened, or that a scene refers to.
    pub fn give(&mut self, name: &str, bytes: Vec<u8>) {
        self.session.give(name, bytes);
    }

    /// Forgets all files that were given.
    pub fn forget_files(&mut self) {
        self.session.forget_files();
    }

    /// Opens a built-in scene or a file that was given. Returns what it is, as JSON.
    pub fn open(&mut self, name: &str) -> Result<String, JsError> {
        Ok(serde_json::to_string(&self.session.open(name).map_err(chain)?)?)
    }

    /// Lights the scene by a picture that was given. Returns what was mended in it, as a JSON list.
    pub fn light_by(&mut self, name: &str) -> Result<String, JsError> {
        Ok(serde_json::to_string(&self.session.light_by(name).map_err(chain)?)?)
    }

    /// The picture's size in pixels.
    pub fn resize(&mut self, width: u32, height: u32) -> Result<(), JsError> {
        self.session.resize(width, height).map_err(chain)
    }

    /// Turns the camera about its target; `x`, `y` in heights of the picture.
    pub fn orbit(&mut self, x: f32, y: f32) -> Result<(), JsError> {
        self.session.navigate(Gesture::Orbit(Vec2::new(x, y))).map_err(chain)
    }

    /// Moves the camera along the picture; `x`, `y` in heights of the picture.
    pub fn pan(&mut self, x: f32, y: f32) -> Result<(), JsError> {
        self.session.navigate(Gesture::Pan(Vec2::new(x, y))).map_err(chain)
    }

    /// Goes towards the target, `steps` notches of a wheel.
    pub fn dolly(&mut self, steps: f32) -> Result<(), JsError> {
        self.session.navigate(Gesture::Dolly(steps)).map_err(chain)
    }

    /// Looks from one point at another.
    pub fn look_at(&mut self, eye: &[f32], target: &[f32]) -> Result<(), JsError> {
        let point = |v: &[f32]| match *v {
            [x, y, z] if v.iter().all(|c| c.is_finite()) => Ok(Vec3::new(x, y, z)),
            _ => Err(JsError::new("a point has three numbers")),
        };
        self.session.look_at(point(eye)?, point(target)?).map_err(chain)
    }

    /// Takes one of the scene's cameras.
    pub fn take_camera(&mut self, index: usize) -> Result<(), JsError> {
        self.session.take_camera(index).map_err(chain)
    }

    /// Eye and target, six numbers; none if nothing is open.
    pub fn camera(&self) -> Vec<f32> {
        self.session.camera().map_or_else(Vec::new, |(eye, target)| {
            eye.to_array().into_iter().chain(target.to_array()).collect()
        })
    }

    /// Makes a setting, by the name and in the words of the command line's options.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), JsError> {
        self.session.set(name, value).map_err(chain)
    }

    /// Renders for about so many milliseconds, up to `spp` samples a pixel. Returns how far the picture is, as JSON.
    pub fn render(&mut self, spp: u32, milliseconds: f64) -> Result<String, JsError> {
        let time = Duration::from_secs_f64(milliseconds.clamp(0.0, 1e4) / 1e3);
        Ok(serde_json::to_string(self.session.render(spp, time).map_err(chain)?)?)
    }

    /// The picture: four bytes a pixel. `shown_width` and `shown_height` are its size.
    pub fn shown(&mut self, denoise: bool) -> Result<Vec<u8>, JsError> {
        let shown = self.session.shown(denoise).map_err(chain)?;
        self.shown_size = [shown.width, shown.height];
        Ok(shown.rgba)
    }

    /// Columns of what [`Page::shown`] returned last.
    #[wasm_bindgen(getter)]
    pub fn shown_width(&self) -> u32 {
        self.shown_size[0]
    }

    /// Rows of what [`Page::shown`] returned last.
    #[wasm_bindgen(getter)]
    pub fn shown_height(&self) -> u32 {
        self.shown_size[1]
    }

    /// A PNG file of the picture.
    pub fn png(&mut self, denoise: bool) -> Result<Vec<u8>, JsError> {
        self.session.png(denoise).map_err(chain)
    }

    /// An OpenEXR file of the picture.
    pub fn exr(&mut self) -> Result<Vec<u8>, JsError> {
        self.session.exr().map_err(chain)
    }

    /// What a sample of a pixel did, as JSON.
    pub fn explain(&mut self, x: u32, y: u32, sample: u32) -> Result<String, JsError> {
        Ok(serde_json::to_string(&self.session.explain([x, y], sample).map_err(chain)?)?)
    }
}

/// An error with its causes, on one line.
fn chain(error: SessionError) -> JsError {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text.push_str(": ");
        text.push_str(&error.to_string());
        cause = error.source();
    }
    JsError::new(&text)
}
