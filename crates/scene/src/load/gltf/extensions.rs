//! Which extensions are understood, and what happens with the others.

use super::document::Document;
use crate::{LoadError, LoadReport};

/// What the loader makes of an extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ExtensionStatus {
    /// Its meaning is kept.
    Supported,
    /// Most of its meaning is kept; the report says what is not.
    Approximated,
    /// It says nothing about the picture, so nothing is lost.
    Harmless,
    /// It is known by name; a note says what is drawn without it.
    Unrendered,
    /// It encodes the data itself and cannot be decoded: what needs it is an error, or is left out and reported.
    Undecoded,
}

impl ExtensionStatus {
    /// In a word, for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Supported => "supported",
            Self::Approximated => "approximated",
            Self::Harmless => "harmless",
            Self::Unrendered => "not rendered",
            Self::Undecoded => "not decoded",
        }
    }

    /// Whether a file may require it.
    fn is_met(self) -> bool {
        matches!(self, Self::Supported | Self::Approximated)
    }
}

/// An extension that the loader knows. What is not in [`EXTENSIONS`] is ignored, and the report says so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extension {
    /// As files spell it.
    pub name: &'static str,
    /// What the loader makes of it.
    pub status: ExtensionStatus,
    /// What a reader should know of it, as a phrase; empty where there is nothing to add.
    pub remark: &'static str,
}

const fn known(name: &'static str, status: ExtensionStatus, remark: &'static str) -> Extension {
    Extension { name, status, remark }
}

/// All extensions that the loader knows, by name.
pub const EXTENSIONS: &[Extension] = {
    use ExtensionStatus::*;
    &[
        known("EXT_lights_ies", Supported, ""),
        known(
            "EXT_lights_image_based",
            Supported,
            "irradiance is that of the map; RGBD is taken as sRGB divided by alpha",
        ),
        known("EXT_mesh_gpu_instancing", Supported, ""),
        known("EXT_meshopt_compression", Supported, ""),
        known("EXT_texture_avif", Undecoded, "the plain image is used where there is one"),
        known("EXT_texture_webp", Supported, ""),
        known(
            "KHR_animation_pointer",
            Approximated,
            "targets that docs/formats.md does not list stay as they are",
        ),
        known("KHR_draco_mesh_compression", Supported, ""),
        known("KHR_gaussian_splatting", Unrendered, "splats are left out, as points are"),
        known("KHR_lights_punctual", Supported, ""),
        known("KHR_materials_anisotropy", Supported, ""),
        known("KHR_materials_clearcoat", Supported, "light that the base emits is not dimmed by the coat"),
        known(
            "KHR_materials_diffuse_transmission",
            Supported,
            "as of a thin sheet: light does not scatter inside",
        ),
        known("KHR_materials_dispersion", Supported, "three wavelengths"),
        known("KHR_materials_emissive_strength", Supported, ""),
        known("KHR_materials_ior", Supported, ""),
        known("KHR_materials_iridescence", Supported, "the film's colour is that of the viewing direction"),
        known(
            "KHR_materials_pbrSpecularGlossiness",
            Supported,
            "a metallic-roughness copy in the same material is preferred",
        ),
        known("KHR_materials_sheen", Supported, "roughness below 0.1 is taken as 0.1"),
        known("KHR_materials_specular", Supported, ""),
        known("KHR_materials_transmission", Supported, ""),
        known("KHR_materials_unlit", Supported, ""),
        known("KHR_materials_variants", Supported, "chosen by name; the default materials otherwise"),
        known("KHR_materials_volume", Supported, "bodies need closed surfaces"),
        known(
            "KHR_materials_volume_scatter",
            Unrendered,
            "the body is clear or absorbs, as `KHR_materials_volume` says",
        ),
        known("KHR_mesh_quantization", Supported, ""),
        known("KHR_meshopt_compression", Supported, ""),
        known("KHR_node_visibility", Supported, ""),
        known("KHR_texture_basisu", Supported, "the plain image is used where there is one"),
        known("KHR_texture_transform", Supported, ""),
        known("KHR_xmp", Harmless, "metadata"),
        known("KHR_xmp_json_ld", Harmless, "metadata"),
        known("MSFT_texture_dds", Supported, "the plain image is used where there is one"),
    ]
};

/// What is known of an extension.
fn find(name: &str) -> Option<&'static Extension> {
    EXTENSIONS.iter().find(|e| e.name == name)
}

impl Document<'_> {
    /// Checks what the file requires, and notes what else it uses without effect.
    ///
    /// Extensions of materials and textures are noted where they are met, not here: a file may list what none of its
    /// visible objects use.
    ///
    /// # Errors
    /// [`LoadError::UnknownExtension`], [`LoadError::UnsupportedExtension`]; both become notes if
    /// [`crate::LoadOptions::lenient`] is set.
    pub fn check_extensions(&self, report: &mut LoadReport) -> Result<(), LoadError> {
        let is_met = |name: &str| find(name).is_some_and(|e| e.status.is_met());
        for name in self.json.extensions_required.iter().filter(|n| !is_met(n)) {
            if !self.options.lenient {
                return Err(self.missing_extension(name));
            }
            report.ignored(format!("the required extension {name} is not supported"));
        }
        let required = &self.json.extensions_required;
        for name in self.json.extensions_used.iter().filter(|n| !required.contains(n)) {
            let has_effect = find(name).is_some_and(|e| e.status != ExtensionStatus::Unrendered);
            if !has_effect && !name.starts_with("KHR_materials_") {
                report.ignored(unsupported(name));
            }
        }
        Ok(())
    }

    fn missing_extension(&self, name: &str) -> LoadError {
        let known = [ExtensionStatus::Undecoded, ExtensionStatus::Unrendered];
        if find(name).is_some_and(|e| known.contains(&e.status)) {
            return self.unsupported("the file", name);
        }
        LoadError::UnknownExtension { path: self.path.to_owned(), extension: name.into() }
    }
}

/// The note about an extension without effect.
pub(super) fn unsupported(name: &str) -> String {
    match find(name) {
        Some(extension) if extension.status == ExtensionStatus::Unrendered => unrendered(extension),
        _ => format!("the extension {name} is not supported and has no effect"),
    }
}

fn unrendered(extension: &Extension) -> String {
    format!("the extension {} is not rendered: {}", extension.name, extension.remark)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extensions_are_sorted_and_each_is_listed_once() {
        assert!(EXTENSIONS.is_sorted_by(|a, b| a.name < b.name), "sorted, without repetitions");
        assert!(find("KHR_materials_unlit").is_some_and(|e| e.status.is_met()));
        assert!(find("KHR_materials_of_tomorrow").is_none());
    }

    #[test]
    fn what_is_not_quite_kept_has_a_remark() {
        for e in EXTENSIONS.iter().filter(|e| e.status != ExtensionStatus::Supported) {
            assert!(!e.remark.is_empty(), "{}", e.name);
        }
    }
}
