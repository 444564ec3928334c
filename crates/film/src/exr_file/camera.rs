//! What a file says about the camera, in OpenEXR's standard attributes.

use exr::meta::attribute::EnvironmentMap;
use exr::prelude as ex;

/// A matrix as OpenEXR stores it: for row vectors, so a translation stands in the last row.
pub type ExrMatrix = [[f32; 4]; 4];

/// The camera that made a picture. Standard attributes of OpenEXR that compositing programs read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExrCamera {
    /// `worldToCamera`: camera space is left-handed, +X to the right of the picture, +Y to its top, +Z where the camera
    /// looks. Metres.
    pub world_to_camera: ExrMatrix,
    /// `worldToNDC`: after division by w, `(0, 0)` is the upper left and `(1, 1)` the lower right corner of the whole
    /// picture. `None` for panoramas, which no matrix describes.
    pub world_to_ndc: Option<ExrMatrix>,
    /// `screenWindowCenter` and `screenWindowWidth`: the picture on the plane at distance 1 in camera space. `None` for what is
    /// no perspective.
    pub screen_window: Option<([f32; 2], f32)>,
    /// `focus`: distance of the plane in focus, in metres; `None` where everything is sharp.
    pub focus: Option<f32>,
    /// Whether the picture is an equirectangular panorama (`envmap`).
    pub panorama: bool,
}

impl ExrCamera {
    pub(super) fn put(&self, attributes: &mut ex::LayerAttributes) {
        attributes.world_to_camera = Some(flat(&self.world_to_camera));
        attributes.world_to_normalized_device = self.world_to_ndc.as_ref().map(flat);
        if let Some((center, width)) = self.screen_window {
            attributes.screen_window_center = ex::Vec2(center[0], center[1]);
            attributes.screen_window_width = width;
        }
        attributes.focus = self.focus;
        attributes.environment_map = self.panorama.then_some(EnvironmentMap::LatitudeLongitude);
    }

    /// The camera that a file names; `None` if it has no `worldToCamera`.
    pub(super) fn of(attributes: &ex::LayerAttributes) -> Option<Self> {
        let world_to_camera = rows(attributes.world_to_camera.as_ref()?);
        let (center, width) = (attributes.screen_window_center, attributes.screen_window_width);
        // The window is required of every file; this one says that there is none.
        let no_window = (center, width) == (ex::Vec2(0.0, 0.0), 1.0);
        Some(Self {
            world_to_camera,
            world_to_ndc: attributes.world_to_normalized_device.as_ref().map(rows),
            screen_window: (!no_window).then_some(([center.0, center.1], width)),
            focus: attributes.focus,
            panorama: attributes.environment_map == Some(EnvironmentMap::LatitudeLongitude),
        })
    }
}

fn flat(matrix: &ExrMatrix) -> [f32; 16] {
    std::array::from_fn(|i| matrix[i / 4][i % 4])
}

fn rows(matrix: &[f32; 16]) -> ExrMatrix {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[row * 4 + column]))
}
