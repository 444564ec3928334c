//! Materials with any of the extensions that are known.

use super::File;
use serde_json::{Map, Value, json};

/// What a field of an extension holds.
enum Field {
    Share,
    Color,
    Number,
    Texture,
}

use Field::{Color, Number, Share, Texture};

const EXTENSIONS: [(&str, &[(&str, Field)]); 13] = [
    ("KHR_materials_emissive_strength", &[("emissiveStrength", Number)]),
    ("KHR_materials_ior", &[("ior", Number)]),
    ("KHR_materials_transmission", &[("transmissionFactor", Share), ("transmissionTexture", Texture)]),
    (
        "KHR_materials_volume",
        &[("thicknessFactor", Share), ("attenuationDistance", Number), ("attenuationColor", Color)],
    ),
    ("KHR_materials_unlit", &[]),
    (
        "KHR_materials_specular",
        &[
            ("specularFactor", Share),
            ("specularTexture", Texture),
            ("specularColorFactor", Color),
            ("specularColorTexture", Texture),
        ],
    ),
    (
        "KHR_materials_pbrSpecularGlossiness",
        &[("diffuseTexture", Texture), ("specularFactor", Color), ("glossinessFactor", Share)],
    ),
    (
        "KHR_materials_clearcoat",
        &[
            ("clearcoatFactor", Share),
            ("clearcoatTexture", Texture),
            ("clearcoatRoughnessFactor", Share),
            ("clearcoatNormalTexture", Texture),
        ],
    ),
    (
        "KHR_materials_sheen",
        &[("sheenColorFactor", Color), ("sheenRoughnessFactor", Share), ("sheenColorTexture", Texture)],
    ),
    (
        "KHR_materials_iridescence",
        &[
            ("iridescenceFactor", Share),
            ("iridescenceIor", Number),
            ("iridescenceThicknessMinimum", Number),
            ("iridescenceThicknessMaximum", Number),
            ("iridescenceThicknessTexture", Texture),
        ],
    ),
    (
        "KHR_materials_anisotropy",
        &[("anisotropyStrength", Share), ("anisotropyRotation", Number), ("anisotropyTexture", Texture)],
    ),
    ("KHR_materials_dispersion", &[("dispersion", Number)]),
    (
        "KHR_materials_diffuse_transmission",
        &[
            ("diffuseTransmissionFactor", Share),
            ("diffuseTransmissionColorFactor", Color),
            ("diffuseTransmissionTexture", Texture),
        ],
    ),
];

impl File<'_, '_> {
    pub(super) fn add_materials(&mut self) {
        for _ in 0..self.choices.below(4) {
            let material = self.material();
            self.materials.push(material);
        }
    }

    fn material(&mut self) -> Value {
        let mut material = Map::new();
        let mut surface = Map::new();
        if !self.choices.once_in(4) {
            surface.insert("baseColorFactor".into(), json!(self.shares::<4>()));
            surface.insert("metallicFactor".into(), json!(self.share()));
            surface.insert("roughnessFactor".into(), json!(self.share()));
        }
        for name in ["baseColorTexture", "metallicRoughnessTexture"] {
            self.add_texture(&mut surface, name);
        }
        material.insert("pbrMetallicRoughness".into(), Value::Object(surface));
        for name in ["normalTexture", "emissiveTexture"] {
            self.add_texture(&mut material, name);
        }
        if self.choices.once_in(4) {
            material.insert("emissiveFactor".into(), json!(self.shares::<3>()));
        }
        let mode = self.choices.one_of(&["OPAQUE", "OPAQUE", "OPAQUE", "MASK", "BLEND", "NONE"]);
        material.insert("alphaMode".into(), json!(mode));
        if self.choices.once_in(4) {
            material.insert("alphaCutoff".into(), json!(self.share()));
        }
        material.insert("doubleSided".into(), json!(self.choices.once_in(2)));
        let mut extensions = Map::new();
        for (name, fields) in EXTENSIONS {
            if self.choices.once_in(6) {
                extensions.insert(name.into(), self.extension(fields));
            }
        }
        material.insert("extensions".into(), Value::Object(extensions));
        Value::Object(material)
    }

    fn extension(&mut self, fields: &[(&str, Field)]) -> Value {
        let mut extension = Map::new();
        for (name, field) in fields {
            match field {
                _ if self.choices.once_in(4) => {}
                Share => drop(extension.insert((*name).into(), json!(self.share()))),
                Color => drop(extension.insert((*name).into(), json!(self.shares::<3>()))),
                Number => {
                    let number = self.choices.number().abs();
                    extension.insert((*name).into(), json!(number));
                }
                Texture => self.add_texture(&mut extension, name),
            }
        }
        Value::Object(extension)
    }

    fn add_texture(&mut self, to: &mut Map<String, Value>, name: &str) {
        if let Some(texture) = self.texture_use() {
            to.insert(name.into(), texture);
        }
    }
}
