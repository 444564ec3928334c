//! Which extensions are understood, and what happens with the others.

use super::document::Document;
use crate::{LoadError, LoadReport};

/// Extensions whose meaning is kept, fully or with a note in the report about what is approximated.
const SUPPORTED: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
];

/// Extensions that encode the data itself: without them there is nothing to show.
const ENCODINGS: &[&str] =
    &["EXT_texture_avif", "KHR_meshopt_compression", "KHR_texture_basisu", "MSFT_texture_dds"];

/// Extensions that say nothing about the picture.
const HARMLESS: &[&str] = &["KHR_xmp", "KHR_xmp_json_ld"];

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
        for name in self.json.extensions_required.iter().filter(|n| !SUPPORTED.contains(&n.as_str())) {
            if !self.options.lenient {
                return Err(self.missing_extension(name));
            }
            report.ignored(format!("the required extension {name} is not supported"));
        }
        let required = &self.json.extensions_required;
        for name in self.json.extensions_used.iter().filter(|n| !required.contains(n)) {
            let known = [SUPPORTED, ENCODINGS, HARMLESS].iter().any(|list| list.contains(&name.as_str()));
            if !known && !name.starts_with("KHR_materials_") {
                report.ignored(unsupported(name));
            }
        }
        Ok(())
    }

    fn missing_extension(&self, name: &str) -> LoadError {
        if ENCODINGS.contains(&name) {
            return self.unsupported("the file", name);
        }
        LoadError::UnknownExtension { path: self.path.to_owned(), extension: name.into() }
    }
}

/// The note about an extension without effect.
pub(super) fn unsupported(name: &str) -> String {
    format!("the extension {name} is not supported and has no effect")
}
