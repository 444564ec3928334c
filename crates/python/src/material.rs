//! Materials and textures that a caller describes.

use crate::arrays::Input;
use crate::errors::bad;
use crate::light::{color, hex};
use crate::medium::BodyDescribed;
use crate::texture_graph::add_graph;
use alhazen::{
    AlphaMode, ColorSpace, Interior, LAYER_NUMBERS, Layers, Material, Model, Pixels, Scene, SceneImage,
    Texture, TextureRef,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// What a caller may say of a material; `Scene.add_material` explains it.
pub struct Described<'py> {
    pub name: String,
    pub model: String,
    pub base_color: Option<Bound<'py, PyAny>>,
    pub metallic: f32,
    pub roughness: f32,
    pub ior: f32,
    pub specular: f32,
    pub transmission: f32,
    pub thin_walled: bool,
    pub emission: Option<Bound<'py, PyAny>>,
    pub emission_two_sided: bool,
    pub alpha_mode: String,
    pub alpha_cutoff: f32,
    pub base_color_texture: Option<Bound<'py, PyAny>>,
    pub metallic_roughness_texture: Option<Bound<'py, PyAny>>,
    pub emission_texture: Option<Bound<'py, PyAny>>,
    pub normal_texture: Option<Bound<'py, PyAny>>,
    pub layers: LayersDescribed<'py>,
    pub body: BodyDescribed<'py>,
}

/// What may lie on the base of a material, and what is inside.
pub struct LayersDescribed<'py> {
    /// By the names of [`LAYER_NUMBERS`].
    pub numbers: Option<Bound<'py, PyDict>>,
    pub sheen_color: Option<Bound<'py, PyAny>>,
    pub specular_color: Option<Bound<'py, PyAny>>,
    pub iridescence_thickness: f32,
    pub anisotropy_rotation: f32,
    pub diffuse_transmission_color: Option<Bound<'py, PyAny>>,
    pub attenuation_color: Option<Bound<'py, PyAny>>,
    pub attenuation_distance: f32,
}

const MODELS: [(&str, Model); 6] = [
    ("metallic-roughness", Model::MetallicRoughness),
    ("lambert", Model::Lambert),
    ("dielectric", Model::Dielectric),
    ("mirror", Model::Mirror),
    ("unlit", Model::Unlit),
    ("boundary", Model::Boundary),
];

/// The material, with its textures added to the scene.
pub fn material(scene: &mut Scene, described: &Described) -> PyResult<Material> {
    let d = described;
    let model = MODELS.iter().find(|(name, _)| *name == d.model).map(|(_, model)| *model);
    let known = MODELS.map(|(name, _)| name).join(", ");
    let model = model.ok_or_else(|| bad(format!("model: unknown `{}`; there are: {known}", d.model)))?;
    let alpha_mode = match d.alpha_mode.as_str() {
        "opaque" => AlphaMode::Opaque,
        "mask" => AlphaMode::Mask(share("alpha_cutoff", d.alpha_cutoff)?),
        "blend" => AlphaMode::Blend,
        other => return Err(bad(format!("alpha_mode: unknown `{other}`; there are: opaque, mask, blend"))),
    };
    if !(d.ior >= 1.0 && d.ior.is_finite()) {
        return Err(bad(format!("ior: {} is below 1", d.ior)));
    }
    let mut texture = |name, picture: &Option<Bound<PyAny>>, space| {
        picture.as_ref().map(|p| add_texture(scene, name, p, space)).transpose()
    };
    let defaults = Material::default();
    let mut material = Material {
        name: d.name.clone(),
        model,
        base_color: d.base_color.as_ref().map_or(Ok(defaults.base_color), base_color)?,
        base_color_texture: texture("base_color_texture", &d.base_color_texture, ColorSpace::Srgb)?,
        metallic: share("metallic", d.metallic)?,
        roughness: share("roughness", d.roughness)?,
        metallic_roughness_texture: texture(
            "metallic_roughness_texture",
            &d.metallic_roughness_texture,
            ColorSpace::Linear,
        )?,
        specular: share("specular", d.specular)?,
        ior: d.ior,
        transmission: share("transmission", d.transmission)?,
        thin_walled: d.thin_walled,
        emission: d.emission.as_ref().map_or(Ok(defaults.emission), |e| color("emission", e))?,
        emission_texture: texture("emission_texture", &d.emission_texture, ColorSpace::Srgb)?,
        emission_two_sided: d.emission_two_sided,
        double_sided: d.emission_two_sided,
        normal_texture: texture("normal_texture", &d.normal_texture, ColorSpace::Linear)?,
        alpha_mode,
        layers: layers(&d.layers)?,
        interior: interior(&d.layers)?,
        ..defaults
    };
    d.body.apply(&mut material)?;
    Ok(material)
}

fn layers(d: &LayersDescribed) -> PyResult<Layers> {
    let mut l = Layers::default();
    layer_numbers(&d.numbers, &mut l)?;
    l.sheen.color = unit_color("sheen_color", &d.sheen_color, glam::Vec3::ZERO)?;
    l.specular_color =
        d.specular_color.as_ref().map_or(Ok(l.specular_color), |c| color("specular_color", c))?;
    l.iridescence.thickness = [at_least("iridescence_thickness", d.iridescence_thickness, 0.0)?; 2];
    l.anisotropy.rotation = d.anisotropy_rotation;
    let through = &d.diffuse_transmission_color;
    l.diffuse_transmission.color = unit_color("diffuse_transmission_color", through, glam::Vec3::ONE)?;
    if !d.anisotropy_rotation.is_finite() {
        return Err(bad(format!("anisotropy_rotation: {} is no angle", d.anisotropy_rotation)));
    }
    Ok(l)
}

/// Sets the numbers of layers that the caller gives.
fn layer_numbers(given: &Option<Bound<PyDict>>, layers: &mut Layers) -> PyResult<()> {
    for (key, value) in given.iter().flat_map(|given| given.iter()) {
        let key: String = key.extract()?;
        let number = LAYER_NUMBERS.iter().find(|number| number.name.replace('-', "_") == key);
        let number = number.ok_or_else(|| {
            PyTypeError::new_err(format!("add_material: unexpected keyword argument `{key}`"))
        })?;
        let value: f32 = value.extract()?;
        let [least, greatest] = number.range;
        if !(least..=greatest).contains(&value) {
            return Err(bad(format!("{key}: {value} is not between {least} and {greatest}")));
        }
        *(number.of)(layers) = value;
    }
    Ok(())
}

fn interior(d: &LayersDescribed) -> PyResult<Interior> {
    if d.attenuation_distance.is_nan() || d.attenuation_distance <= 0.0 {
        return Err(bad(format!("attenuation_distance: {} is not positive", d.attenuation_distance)));
    }
    Ok(Interior {
        attenuation_color: unit_color("attenuation_color", &d.attenuation_color, glam::Vec3::ONE)?,
        attenuation_distance: d.attenuation_distance,
    })
}

/// A colour whose channels are in `[0, 1]`.
fn unit_color(name: &'static str, value: &Option<Bound<PyAny>>, default: glam::Vec3) -> PyResult<glam::Vec3> {
    let Some(value) = value else { return Ok(default) };
    let color = color(name, value)?;
    color.to_array().into_iter().try_for_each(|c| share(name, c).map(drop))?;
    Ok(color)
}

fn at_least(name: &str, value: f32, least: f32) -> PyResult<f32> {
    if value >= least && value.is_finite() {
        Ok(value)
    } else {
        Err(bad(format!("{name}: {value} is not a number of at least {least}")))
    }
}

/// A number in `[0, 1]`.
fn share(name: &str, value: f32) -> PyResult<f32> {
    if (0.0..=1.0).contains(&value) {
        Ok(value)
    } else {
        Err(bad(format!("{name}: {value} is not between 0 and 1")))
    }
}

/// Linear RGB, or RGB and alpha, each in `[0, 1]`; or a text such as "#ff8000" (sRGB).
fn base_color(value: &Bound<PyAny>) -> PyResult<glam::Vec4> {
    if let Some([r, g, b]) = hex("base_color", value)? {
        return Ok(glam::vec4(r, g, b, 1.0));
    }
    let input = Input::<f32>::new("base_color", value)?;
    let rgba = match *input.numbers()? {
        [grey] => [grey, grey, grey, 1.0],
        [r, g, b] => [r, g, b, 1.0],
        [r, g, b, a] => [r, g, b, a],
        ref other => return Err(bad(format!("base_color: expected 3 or 4 numbers, got {}", other.len()))),
    };
    rgba.into_iter().try_for_each(|v| share("base_color", v).map(drop))?;
    Ok(rgba.into())
}

/// Adds a picture of shape (height, width, 3 or 4), row 0 at the top: bytes, or linear floats. Or a graph, which is a
/// dictionary.
pub fn add_texture(
    scene: &mut Scene,
    name: &'static str,
    picture: &Bound<PyAny>,
    color_space: ColorSpace,
) -> PyResult<TextureRef> {
    if let Ok(graph) = picture.cast::<PyDict>() {
        return add_graph(scene, name, graph);
    }
    let kind: String =
        picture.getattr("dtype").and_then(|d| d.getattr("name")?.extract()).unwrap_or_default();
    let (height, width, pixels) = match kind.as_str() {
        "uint8" => byte_picture(name, picture)?,
        "float16" | "float32" | "float64" => float_picture(name, picture)?,
        _ => return Err(bad(expected_picture(name))),
    };
    let side = |n: usize| u32::try_from(n).ok().filter(|n| (1..=65_536).contains(n));
    let (Some(width), Some(height)) = (side(width), side(height)) else {
        return Err(bad(format!("{name}: {width}×{height} pixels are not possible")));
    };
    scene.images.push(SceneImage { name: name.into(), width, height, pixels });
    let image = scene.images.len() as u32 - 1;
    scene.textures.push(Texture::image(image, Default::default(), color_space));
    Ok(TextureRef::new(scene.textures.len() as u32 - 1))
}

fn expected_picture(name: &str) -> String {
    format!("{name}: expected uint8 or floats of shape (height, width, 3 or 4), or a dict of a texture node")
}

/// Height, width and pixels of a picture of bytes.
fn byte_picture(name: &'static str, picture: &Bound<PyAny>) -> PyResult<(usize, usize, Pixels)> {
    let input = Input::<u8>::new(name, picture)?;
    let (height, width, pixels) = match *input.shape() {
        [h, w, 3] => (h, w, input.numbers()?.as_chunks().0.iter().map(|&[r, g, b]| [r, g, b, 255]).collect()),
        [h, w, 4] => (h, w, input.numbers()?.as_chunks::<4>().0.to_vec()),
        _ => return Err(bad(expected_picture(name))),
    };
    Ok((height, width, Pixels::Rgba8(pixels)))
}

/// Height, width and pixels of a picture of floats, which are finite and not negative.
fn float_picture(name: &'static str, picture: &Bound<PyAny>) -> PyResult<(usize, usize, Pixels)> {
    let input = Input::<f32>::new(name, picture)?;
    let (height, width, pixels) = match *input.shape() {
        [h, w, 3] => (h, w, Pixels::Rgb32F(input.numbers()?.as_chunks().0.to_vec())),
        [h, w, 4] => (h, w, Pixels::Rgba32F(input.numbers()?.as_chunks().0.to_vec())),
        _ => return Err(bad(expected_picture(name))),
    };
    if !input.numbers()?.iter().all(|v| v.is_finite() && *v >= 0.0) {
        return Err(bad(format!("{name}: numbers must be finite and not negative")));
    }
    Ok((height, width, pixels))
}

/// A picture as an environment: float32 of shape (height, width, 3), linear radiance.
pub fn environment_image(picture: &Bound<PyAny>) -> PyResult<SceneImage> {
    let input = Input::<f32>::new("image", picture)?;
    let [height, width, 3] = *input.shape() else {
        return Err(bad("image: expected the shape (height, width, 3)"));
    };
    let side = |n: usize| u32::try_from(n).ok().filter(|n| (1..=65_536).contains(n));
    let (Some(width), Some(height)) = (side(width), side(height)) else {
        return Err(bad(format!("image: {width}×{height} pixels are not possible")));
    };
    let pixels: &[[f32; 3]] = input.numbers()?.as_chunks().0;
    if !pixels.as_flattened().iter().all(|v| v.is_finite() && *v >= 0.0) {
        return Err(bad("image: radiance must be finite and not negative"));
    }
    Ok(SceneImage { name: "environment".into(), width, height, pixels: Pixels::Rgb32F(pixels.to_vec()) })
}
