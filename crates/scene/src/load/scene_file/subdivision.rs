//! `subdivision` and `displacement` of shapes and models.

use super::Builder;
use super::document::{Context, Entry};
use super::textures::TextureValue;
use super::values::{positive, within};
use crate::load::LoadError;
use crate::load::textures::Neutral;
use crate::subdivision::{Cage, Displacement, DisplacementSpace, Rate, Refinement, Scheme};
use crate::{ColorSpace, MeshId, Scene};
use serde::Deserialize;
use std::collections::HashMap;

/// How finely displaced surfaces are cut if nothing is said, pixels.
const USUAL_PIXELS: f32 = 2.0;

/// The keys of an object that make a surface of its mesh.
#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct SurfaceKeys {
    subdivision: Option<Subdivision>,
    displacement: Option<DisplacementKeys>,
}

/// A number of levels, or all about it.
#[derive(Clone, Debug, Deserialize)]
#[serde(try_from = "toml::Value")]
struct Subdivision(SubdivisionKeys);

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
struct SubdivisionKeys {
    scheme: Option<String>,
    levels: Option<u32>,
    edge_pixels: Option<f32>,
    edge_length: Option<f32>,
    max_levels: Option<u32>,
    /// Degrees.
    crease_angle: Option<f32>,
    /// Two vertices and a sharpness each.
    creases: Vec<[f64; 3]>,
    /// A vertex and a sharpness each.
    corners: Vec<[f64; 2]>,
    round_corners: bool,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct DisplacementKeys {
    texture: TextureValue,
    #[serde(default = "one")]
    scale: f32,
    #[serde(default)]
    midlevel: f32,
    space: Option<String>,
}

fn one() -> f32 {
    1.0
}

impl TryFrom<toml::Value> for Subdivision {
    type Error = String;

    fn try_from(value: toml::Value) -> Result<Self, String> {
        let keys = match value {
            toml::Value::Integer(levels) => {
                let levels = u32::try_from(levels).map_err(|_| format!("{levels} is no number of levels"))?;
                SubdivisionKeys { levels: Some(levels), ..SubdivisionKeys::default() }
            }
            toml::Value::Table(table) => {
                SubdivisionKeys::deserialize(table).map_err(|error| error.message().to_owned())?
            }
            _ => return Err("`subdivision` is a number of levels, or a table".into()),
        };
        Ok(Self(keys))
    }
}

impl SurfaceKeys {
    /// Takes them out of an object.
    pub fn take(entry: &mut Entry) -> Result<Self, LoadError> {
        entry.split(&["subdivision", "displacement"]).read()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.subdivision.is_none() && self.displacement.is_none()
    }

    fn scheme(&self, context: &Context) -> Result<Scheme, LoadError> {
        let Some(Subdivision(keys)) = &self.subdivision else { return Ok(Scheme::Linear) };
        let Some(name) = &keys.scheme else { return Ok(Scheme::default()) };
        let names = Scheme::ALL.map(|(_, name)| name).join("`, `");
        Scheme::named(name)
            .ok_or_else(|| context.error(format!("`scheme` is one of `{names}`, not `{name}`")))
    }

    fn rate(&self, context: &Context) -> Result<Rate, LoadError> {
        let none = SubdivisionKeys::default();
        let keys = self.subdivision.as_ref().map_or(&none, |subdivision| &subdivision.0);
        let limits = [0, Rate::MOST_LEVELS];
        let levels = within(keys.max_levels.unwrap_or(Rate::USUAL_LEVELS), limits, "max-levels", context)?;
        let said = [keys.levels.is_some(), keys.edge_pixels.is_some(), keys.edge_length.is_some()];
        if said.iter().filter(|said| **said).count() > 1 {
            return Err(context.error("`levels`, `edge-pixels` and `edge-length` exclude each other"));
        }
        Ok(match (keys.levels, keys.edge_pixels, keys.edge_length) {
            (Some(levels), ..) => Rate::Levels(within(levels, limits, "levels", context)?),
            (_, Some(most), _) => Rate::Pixels { most: positive(most, "edge-pixels", context)?, levels },
            (_, _, Some(most)) => Rate::Length { most: positive(most, "edge-length", context)?, levels },
            _ if self.displacement.is_some() => Rate::Pixels { most: USUAL_PIXELS, levels },
            _ => Rate::Levels(2),
        })
    }

    /// Sets creases and corners of a cage.
    fn sharpen(&self, cage: &mut Cage, context: &Context) -> Result<(), LoadError> {
        let Some(Subdivision(keys)) = &self.subdivision else { return Ok(()) };
        cage.round_corners = keys.round_corners;
        if let Some(angle) = keys.crease_angle {
            let angle = within(angle, [0.0, 180.0], "crease-angle", context)?;
            cage.crease_by_angle(angle.to_radians(), Cage::ENDLESS);
        }
        if keys.creases.is_empty() && keys.corners.is_empty() {
            return Ok(());
        }
        // Without numbers of a file positions are counted as they are.
        let own: Vec<u32> = (0..cage.positions.len() as u32).collect();
        let numbers = if cage.numbers.is_empty() { &own } else { &cage.numbers };
        let places: HashMap<u64, u32> = numbers.iter().map(|n| u64::from(*n)).zip(0..).collect();
        // Of a file of several objects each has some of the vertices.
        let place = |number: f64| places.get(&(number as u64)).copied().filter(|_| number.fract() == 0.0);
        let sharpness = |s: f64| within(s as f32, [0.0, 1e6], "sharpness", context);
        for [a, b, s] in &keys.creases {
            let s = sharpness(*s)?;
            cage.creases.extend(place(*a).zip(place(*b)).map(|(a, b)| ([a, b], s)));
        }
        for [vertex, s] in &keys.corners {
            let s = sharpness(*s)?;
            cage.corners.extend(place(*vertex).map(|vertex| (vertex, s)));
        }
        Ok(())
    }

    /// Makes a mesh of a scene a surface; its displacement comes later. Returns whether it has faces.
    ///
    /// - `pair`: whether two triangles that follow each other may be a quadrilateral.
    pub fn refine(
        &self,
        scene: &mut Scene,
        mesh: MeshId,
        pair: bool,
        context: &Context,
    ) -> Result<bool, LoadError> {
        let known = scene.refinements.iter().position(|refinement| refinement.mesh == mesh);
        let known = known.map(|number| scene.refinements.swap_remove(number));
        let of_mesh = || Refinement::of_mesh(mesh, scene.meshes.get(mesh as usize)?, pair);
        let Some(mut refinement) = known.or_else(of_mesh) else { return Ok(false) };
        (refinement.scheme, refinement.rate) = (self.scheme(context)?, self.rate(context)?);
        refinement.displacement = None;
        self.sharpen(&mut refinement.cage, context)?;
        scene.refinements.push(refinement);
        Ok(true)
    }
}

impl Builder<'_> {
    /// Makes the mesh that was added last a surface.
    pub(super) fn refine_shape(&mut self, keys: &SurfaceKeys, context: &Context) -> Result<(), LoadError> {
        if keys.is_empty() {
            return Ok(());
        }
        let mesh = self.scene.meshes.len() as MeshId - 1;
        let first = self.scene.refinements.len();
        if !keys.refine(&mut self.scene, mesh, true, context)? {
            return Err(context.error("a `sphere` has no faces to subdivide: take an `icosphere`"));
        }
        self.displace(keys, first, context)
    }

    /// Displaces the refinements from `first` on.
    pub(super) fn displace(
        &mut self,
        keys: &SurfaceKeys,
        first: usize,
        context: &Context,
    ) -> Result<(), LoadError> {
        let Some(displacement) = &keys.displacement else { return Ok(()) };
        let DisplacementKeys { texture, scale, midlevel, space } = displacement;
        let names = DisplacementSpace::ALL.map(|(_, name)| name).join("`, `");
        let named = space.as_deref().map_or(Some(DisplacementSpace::Normal), DisplacementSpace::named);
        let space = named.ok_or_else(|| context.error(format!("`space` is one of `{names}`")))?;
        let texture = self.texture(&Some(texture.clone()), ColorSpace::Linear, Neutral::White, context)?;
        let made = texture.map(|texture| Displacement { texture, scale: *scale, midlevel: *midlevel, space });
        self.scene.refinements[first..].iter_mut().for_each(|refinement| refinement.displacement = made);
        Ok(())
    }
}
