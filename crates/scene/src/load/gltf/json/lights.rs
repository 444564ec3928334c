//! Lights: punctual, photometric and image-based ones.

use super::list::List;
use serde::Deserialize;

#[derive(Deserialize)]
pub struct Lights {
    #[serde(default)]
    pub lights: List<Light>,
}

#[derive(Deserialize)]
pub struct Light {
    pub name: Option<String>,
    #[serde(rename = "type", default)]
    pub kind: String,
    pub color: Option<[f32; 3]>,
    pub intensity: Option<f32>,
    pub range: Option<f32>,
    #[serde(default)]
    pub spot: Spot,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Spot {
    pub inner_cone_angle: Option<f32>,
    pub outer_cone_angle: Option<f32>,
}

#[derive(Deserialize)]
pub struct PhotometricLights {
    #[serde(default)]
    pub lights: List<PhotometricLight>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct PhotometricLight {
    pub uri: Option<String>,
    pub buffer_view: Option<u32>,
}

#[derive(Deserialize)]
pub struct NodePhotometric {
    pub light: u32,
    pub multiplier: Option<f32>,
    pub color: Option<[f32; 3]>,
}

#[derive(Deserialize)]
pub struct ImageBasedLights {
    #[serde(default)]
    pub lights: List<ImageBasedLight>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct ImageBasedLight {
    pub name: Option<String>,
    pub rotation: Option<[f32; 4]>,
    pub intensity: Option<f32>,
    #[serde(default)]
    pub specular_images: Vec<Vec<u32>>,
}
