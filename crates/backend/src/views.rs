//! Many pictures of one scene, by as many cameras, in one call.

use crate::{BackendError, Integrator, View};
use film::Rect;
use optics::camera::CameraFrame;
use std::fmt;
use std::str::FromStr;

/// What of each view is wanted. All but [`ViewLayer::Rgb`] are exact values at the centres of
/// pixels, found by one ray each; where that meets nothing, numbers are 0 and ids
/// [`ViewLayer::NOTHING`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ViewLayer {
    /// Linear radiance as the integrator finds it, W·sr⁻¹·m⁻², three channels.
    Rgb,
    /// Distance along the camera's axis, metres; of a camera that sees to all sides, along the ray.
    Depth,
    /// Unit shading normal, world space, towards the camera, three channels.
    Normal,
    /// World position, metres, three channels.
    Position,
    /// Base colour, linear, three channels.
    Albedo,
    /// How far what is seen moves to the next picture: pixels to the right and down, two channels.
    /// NaN where the next camera does not show it. What is infinitely far away moves as the camera turns.
    Flow,
    /// Number of the instance, an id.
    Instance,
    /// Number of the material, an id.
    Material,
    /// Number of the primitive in its mesh part, an id.
    Primitive,
}

impl ViewLayer {
    /// All of them, in the order in which users read them.
    pub const ALL: [Self; 9] = [
        Self::Rgb,
        Self::Depth,
        Self::Normal,
        Self::Position,
        Self::Albedo,
        Self::Flow,
        Self::Instance,
        Self::Material,
        Self::Primitive,
    ];

    /// The id of nothing.
    pub const NOTHING: u32 = u32::MAX;

    /// What users call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rgb => "rgb",
            Self::Depth => "depth",
            Self::Normal => "normal",
            Self::Position => "position",
            Self::Albedo => "albedo",
            Self::Flow => "flow",
            Self::Instance => "instance",
            Self::Material => "material",
            Self::Primitive => "primitive",
        }
    }

    /// Values of a pixel.
    pub fn channels(self) -> usize {
        match self {
            Self::Rgb | Self::Normal | Self::Position | Self::Albedo => 3,
            Self::Flow => 2,
            Self::Depth | Self::Instance | Self::Material | Self::Primitive => 1,
        }
    }

    /// Whether its values are numbers of things.
    pub fn is_id(self) -> bool {
        matches!(self, Self::Instance | Self::Material | Self::Primitive)
    }
}

impl fmt::Display for ViewLayer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for ViewLayer {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let known = Self::ALL.into_iter().find(|layer| layer.name() == name);
        known.ok_or_else(|| format!("unknown `{name}`; there are: {}", Self::ALL.map(Self::name).join(", ")))
    }
}

/// Many pictures of one scene, all of one size.
#[derive(Clone, Debug)]
pub struct ViewBatch {
    /// What they have in common. Its camera, window and auxiliary layers do not count.
    pub view: View,
    /// A camera for each.
    pub cameras: Vec<CameraFrame>,
    /// For [`ViewLayer::Flow`], the camera of the next picture of each; else empty.
    pub next: Vec<CameraFrame>,
    /// What is wanted, each layer once.
    pub layers: Vec<ViewLayer>,
    /// For [`ViewLayer::Rgb`], samples of each pixel.
    pub samples: u32,
}

impl ViewBatch {
    /// Whether colours are among what is wanted.
    pub fn wants_colors(&self) -> bool {
        self.layers.contains(&ViewLayer::Rgb)
    }

    /// What else is wanted.
    pub fn exact_layers(&self) -> impl Iterator<Item = ViewLayer> + Clone + '_ {
        self.layers.iter().copied().filter(|layer| *layer != ViewLayer::Rgb)
    }

    /// One of the views, as [`crate::Backend::render`] takes it.
    pub fn single(&self, number: usize) -> View {
        let View { width, height, .. } = self.view;
        let camera = self.cameras.get(number).copied().unwrap_or(self.view.camera);
        View { camera, window: Rect::full(width, height), aovs: Vec::new(), ..self.view.clone() }
    }

    /// Pixels of a view.
    pub fn pixels(&self) -> usize {
        self.view.width as usize * self.view.height as usize
    }

    /// Samples of all pixels: one for the exact layers, and those of the colours.
    pub fn all_samples(&self) -> u64 {
        let exact = u64::from(self.exact_layers().next().is_some());
        let colors = if self.wants_colors() { u64::from(self.samples) } else { 0 };
        (exact + colors) * (self.pixels() * self.cameras.len()) as u64
    }

    /// For back ends: whether it can be rendered by anybody.
    ///
    /// # Errors
    /// [`BackendError::View`] that says what cannot be.
    pub fn check(&self) -> Result<(), BackendError> {
        /// Most values of a layer: what its arrays may hold on every machine.
        const MOST_VALUES: u64 = 1 << 40;
        let bad = |reason: String| Err(BackendError::View { reason });
        let View { width, height, .. } = self.view;
        let (all, next) = (self.cameras.len(), self.next.len());
        if width == 0 || height == 0 || width > 1 << 14 || height > 1 << 14 {
            return bad(format!("views of {width}×{height} pixels are not possible"));
        }
        if self.pixels().checked_mul(3 * all).is_none_or(|values| values as u64 > MOST_VALUES) {
            return bad(format!("{all} views of {width}×{height} pixels are too many for one call"));
        }
        let flow = self.layers.contains(&ViewLayer::Flow);
        if (flow && next != all) || (!flow && next != 0) {
            return bad(format!("{next} next cameras for {all} views; `flow` needs one for each"));
        }
        if let Some(twice) = (1..self.layers.len()).find(|&i| self.layers[..i].contains(&self.layers[i])) {
            return bad(format!("the layer `{}` is named twice", self.layers[twice]));
        }
        if !self.wants_colors() {
            return Ok(());
        }
        match self.view.integrator {
            Integrator::Hybrid(_) | Integrator::Realtime(_) => {
                bad(format!("`{}` draws frames, no batches of views", self.view.integrator.name()))
            }
            _ if self.samples == 0 => bad("colours need at least one sample".into()),
            _ if self.view.first_sample.checked_add(self.samples).is_none() => {
                bad(format!("sample index beyond {}", u32::MAX))
            }
            _ => Ok(()),
        }
    }
}

/// The values of a layer: view by view, rows from the top, the channels of a pixel together.
#[derive(Clone, Debug, PartialEq)]
pub enum ViewValues {
    /// Numbers.
    Float(Vec<f32>),
    /// Ids.
    Id(Vec<u32>),
}

/// What was made of a [`ViewBatch`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewPictures {
    /// The layers that were asked for, in that order. Where it was cancelled, zeros.
    pub layers: Vec<(ViewLayer, ViewValues)>,
    /// Samples of colours that were NaN or infinite and were dropped.
    pub invalid_samples: u64,
}

impl ViewPictures {
    /// Zeros for all that a batch asks for.
    pub fn empty(batch: &ViewBatch) -> Self {
        let of = |layer: ViewLayer| {
            let count = batch.pixels() * batch.cameras.len() * layer.channels();
            let zeros = if layer.is_id() {
                ViewValues::Id(vec![0; count])
            } else {
                ViewValues::Float(vec![0.0; count])
            };
            (layer, zeros)
        };
        Self { layers: batch.layers.iter().map(|&layer| of(layer)).collect(), invalid_samples: 0 }
    }

    /// A layer's numbers; `None` for ids, and for what was not asked for.
    pub fn numbers(&self, layer: ViewLayer) -> Option<&[f32]> {
        self.layers.iter().find_map(|(l, values)| match values {
            ViewValues::Float(numbers) if *l == layer => Some(&numbers[..]),
            _ => None,
        })
    }

    /// A layer's ids.
    pub fn ids(&self, layer: ViewLayer) -> Option<&[u32]> {
        self.layers.iter().find_map(|(l, values)| match values {
            ViewValues::Id(ids) if *l == layer => Some(&ids[..]),
            _ => None,
        })
    }

    /// For back ends: where the colours go.
    pub fn colors_mut(&mut self) -> Option<&mut [f32]> {
        self.layers.iter_mut().find_map(|(layer, values)| match values {
            ViewValues::Float(numbers) if *layer == ViewLayer::Rgb => Some(&mut numbers[..]),
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SamplerKind;
    use optics::{vec2f, vec3f};

    fn batch(layers: &[ViewLayer]) -> ViewBatch {
        let camera = CameraFrame {
            kind: 0,
            origin: vec3f(0.0, 0.0, 0.0),
            right: vec3f(1.0, 0.0, 0.0),
            up: vec3f(0.0, 1.0, 0.0),
            forward: vec3f(0.0, 0.0, -1.0),
            half_size: vec2f(1.0, 1.0),
            lens_radius: 0.0,
            focus_distance: 1.0,
            distortion: optics::distortion::no_distortion(),
        };
        let view = View {
            camera,
            width: 4,
            height: 3,
            window: Rect::full(4, 3),
            integrator: Integrator::Aov,
            single_scatter: false,
            sampler: SamplerKind::Sobol,
            seed: 0,
            first_sample: 0,
            shutter: None,
            aovs: Vec::new(),
        };
        ViewBatch { view, cameras: vec![camera; 2], next: vec![], layers: layers.to_vec(), samples: 2 }
    }

    #[test]
    fn names_parse_back_and_others_are_refused() {
        for layer in ViewLayer::ALL {
            assert_eq!(layer.name().parse(), Ok(layer));
        }
        assert!("colour".parse::<ViewLayer>().is_err_and(|e| e.contains("`colour`") && e.contains("rgb")));
    }

    #[test]
    fn what_cannot_be_rendered_is_refused_by_name() {
        use ViewLayer::{Depth, Flow, Instance, Rgb};
        let good = batch(&[Rgb, Depth, Instance]);
        assert!(good.check().is_ok());
        assert_eq!(good.all_samples(), 3 * 24);
        let empty = ViewPictures::empty(&good);
        assert_eq!(empty.numbers(Rgb).map(<[f32]>::len), Some(72));
        assert_eq!(empty.ids(Instance).map(<[u32]>::len), Some(24));
        let refused = |change: &dyn Fn(&mut ViewBatch), reason: &str| {
            let mut batch = batch(&[Rgb, Depth]);
            change(&mut batch);
            let error = batch.check().expect_err(reason).to_string();
            assert!(error.contains(reason), "{error}");
        };
        refused(&|b| b.view.width = 0, "0×3");
        refused(&|b| b.samples = 0, "at least one sample");
        refused(&|b| b.layers.push(Depth), "`depth` is named twice");
        refused(&|b| b.layers.push(Flow), "0 next cameras for 2");
        refused(&|b| b.view.integrator = Integrator::Realtime(Default::default()), "`realtime`");
        refused(&|b| b.view.first_sample = u32::MAX, "sample index");
    }
}
