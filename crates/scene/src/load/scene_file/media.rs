//! `medium` of materials and `[fog]`: what is between surfaces.

use super::Builder;
use super::document::{Context, Entry, NameOr};
use super::materials::MaterialKeys;
use super::values::{Color, Vec3Value, within};
use crate::load::{LoadError, vol};
use crate::{DensityGrid, Fog, Material, Medium, Model, Subsurface};
use glam::{DVec3, Vec3};
use serde::Deserialize;
use std::sync::Arc;

/// What a medium consists of.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub(super) struct MediumKeys {
    /// m⁻¹.
    absorption: Option<Color>,
    /// m⁻¹.
    scattering: Option<Color>,
    /// W·sr⁻¹·m⁻³.
    emission: Option<Color>,
    anisotropy: Option<f32>,
    density: Option<NameOr<DensityKeys>>,
}

/// Densities of a file or a texture graph, and where they are.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct DensityKeys {
    file: Option<String>,
    /// A texture that the file declares, or a graph.
    texture: Option<toml::Value>,
    /// Lower and upper corner, world space, metres; a file's own without them.
    bounds: Option<[Vec3Value; 2]>,
    /// Cells along x, y and z at which a texture is evaluated.
    size: Option<[u32; 3]>,
}

/// Light that comes out elsewhere.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SubsurfaceKeys {
    /// Mean free path, metres.
    radius: Color,
    #[serde(default)]
    anisotropy: f32,
}

impl SubsurfaceKeys {
    fn subsurface(&self, c: &Context) -> Result<Subsurface, LoadError> {
        let (Color(radius), most) = (self.radius, Medium::MOST_ANISOTROPIC);
        within(radius.min_element(), [Subsurface::SHORTEST, 1e6], "subsurface.radius", c)?;
        let anisotropy = within(self.anisotropy, [-most, most], "subsurface.anisotropy", c)?;
        Ok(Subsurface { radius, anisotropy })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct FogKeys {
    absorption: Option<Color>,
    scattering: Option<Color>,
    emission: Option<Color>,
    anisotropy: Option<f32>,
    /// Metres.
    top: Option<f32>,
}

impl MediumKeys {
    fn medium(&self, what: &str, c: &Context) -> Result<Medium, LoadError> {
        let color = |color: Option<Color>, key: &str| {
            let color = color.map_or(Vec3::ZERO, |c| c.0);
            within(color.max_element(), [0.0, 1e9], &format!("{what}{key}"), c)?;
            Ok::<_, LoadError>(color)
        };
        let most = Medium::MOST_ANISOTROPIC;
        let anisotropy = self.anisotropy.unwrap_or(0.0);
        Ok(Medium {
            absorption: color(self.absorption, "absorption")?,
            scattering: color(self.scattering, "scattering")?,
            emission: color(self.emission, "emission")?,
            anisotropy: within(anisotropy, [-most, most], &format!("{what}anisotropy"), c)?,
            density: None,
        })
    }
}

/// Most cells along an axis of a texture's grid.
const MOST_CELLS: u32 = 1024;

/// The medium of a material, and its priority.
pub(super) fn apply_medium(
    builder: &mut Builder,
    k: &MaterialKeys,
    m: &mut Material,
    c: &Context,
) -> Result<(), LoadError> {
    if let Some(keys) = &k.medium {
        let mut medium = keys.medium("medium.", c)?;
        medium.density = builder.density(keys.density.as_ref(), c)?;
        m.medium = Some(medium);
    }
    if let Some(keys) = &k.subsurface {
        if m.model != Model::Dielectric || m.thin_walled {
            return Err(c.error("`subsurface` needs `model = \"dielectric\"` that is not `thin-walled`"));
        }
        if m.medium.is_some() {
            return Err(c.error("`subsurface` is a medium already; it cannot have `medium` as well"));
        }
        if m.base_color_texture.is_some() || m.checkerboard.is_some() {
            return Err(c.error("the inside of `subsurface` has one colour, `base-color`, and no texture"));
        }
        m.subsurface = Some(keys.subsurface(c)?);
    }
    if m.medium.is_some() && !m.refracts_into_body() {
        return Err(c.error(
            "`medium` needs a surface that light gets through: `model = \"boundary\"`, a dielectric or `transmission`, \
             not `thin-walled`",
        ));
    }
    m.priority = k.priority.map(|p| within(p, [-1000, 1000], "priority", c)).transpose()?;
    if m.priority.is_some() && !m.refracts_into_body() {
        return Err(c.error(
            "`priority` is one of bodies that light gets into: dielectrics, `transmission`, boundaries",
        ));
    }
    if m.model == Model::Boundary && k.alpha_mode.is_some() {
        return Err(c.error("`alpha-mode` has no meaning for a boundary, which is no surface"));
    }
    Ok(())
}

impl Builder<'_> {
    /// The grid of a medium's `density`.
    fn density(
        &mut self,
        keys: Option<&NameOr<DensityKeys>>,
        c: &Context,
    ) -> Result<Option<Arc<DensityGrid>>, LoadError> {
        let grid = match keys {
            None => return Ok(None),
            Some(NameOr::Name(file)) => self.density_of_file(file, None, c)?,
            Some(NameOr::Table(keys)) => match (&keys.file, &keys.texture) {
                (Some(file), None) if keys.size.is_none() => self.density_of_file(file, keys.bounds, c)?,
                (None, Some(texture)) => self.density_of_texture(texture, keys, c)?,
                _ => {
                    return Err(c.error(
                        "`density` needs either `file`, or `texture` with `bounds` and perhaps `size`",
                    ));
                }
            },
        };
        Ok(Some(Arc::new(grid)))
    }

    fn density_of_file(
        &self,
        file: &str,
        bounds: Option<[Vec3Value; 2]>,
        c: &Context,
    ) -> Result<DensityGrid, LoadError> {
        let grid = vol::load(&self.place.folder.join(file), self.options)?;
        let Some(corners) = bounds else { return Ok(grid) };
        let placed = grid.placed(corners.map(|corner| DVec3::from_array(corner).as_vec3()));
        placed.ok_or_else(|| {
            c.error("`density.bounds` must be two corners, the second one above the first along each axis")
        })
    }

    /// A texture graph, evaluated on a grid.
    fn density_of_texture(
        &mut self,
        texture: &toml::Value,
        keys: &DensityKeys,
        c: &Context,
    ) -> Result<DensityGrid, LoadError> {
        let corners = keys.bounds.ok_or_else(|| c.error("`density.texture` needs `bounds`"))?;
        let size = keys.size.unwrap_or([64; 3]);
        for cells in size {
            within(cells, [1, MOST_CELLS], "density.size", c)?;
        }
        let cells: u64 = size.iter().map(|&n| u64::from(n)).product();
        c.take(cells * size_of::<f32>() as u64, "densities")?;
        let graph = self.parse_graph(texture).map_err(|why| c.error(format!("`density.texture`: {why}")))?;
        let bounds = corners.map(|corner| DVec3::from_array(corner).as_vec3());
        graph.density(size, bounds).map_err(|why| c.error(format!("`density`: {why}")))
    }

    /// `[fog]`.
    pub(super) fn set_fog(&mut self, entry: Entry) -> Result<(), LoadError> {
        let context = entry.context();
        let FogKeys { absorption, scattering, emission, anisotropy, top } = entry.read()?;
        let keys = MediumKeys { absorption, scattering, emission, anisotropy, density: None };
        let medium = keys.medium("", &context)?;
        let fog = Fog { medium, top: top.unwrap_or(f32::INFINITY) };
        if fog.is_endlessly_bright() {
            return Err(context.error(
                "fog that shines must absorb or scatter at least a billionth of its emission per metre, or it is \
                 infinitely bright",
            ));
        }
        self.scene.fog = Some(fog);
        Ok(())
    }
}
