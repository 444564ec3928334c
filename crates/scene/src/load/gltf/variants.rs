//! `KHR_materials_variants`: other materials for the same primitives, chosen by name.

use super::json::{Gltf, List, VariantMapping};
use crate::{LoadError, LoadOptions, LoadReport};
use std::path::Path;

/// Gives every primitive the material that it has in [`LoadOptions::variant`].
///
/// # Errors
/// [`LoadError::UnknownVariant`].
pub(super) fn choose(
    path: &Path,
    options: &LoadOptions,
    json: &mut Gltf<'_>,
    report: &mut LoadReport,
) -> Result<(), LoadError> {
    let variants = json.extensions.variants.as_ref().map_or(&[][..], |v| &v.variants[..]);
    let Some(wanted) = &options.variant else {
        if !variants.is_empty() {
            let names: Vec<&str> = variants.iter().map(|v| v.name.as_str()).collect();
            report.info(format!(
                "the default materials are shown; there are the variants {}",
                names.join(", ")
            ));
        }
        return Ok(());
    };
    let Some(number) = variants.iter().position(|v| v.name == *wanted) else {
        let names: Vec<String> = variants.iter().map(|v| format!("`{}`", v.name)).collect();
        let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        return Err(LoadError::UnknownVariant { path: path.to_owned(), variant: wanted.clone(), known });
    };
    for primitive in json.meshes.iter_mut().flat_map(|mesh| mesh.primitives.iter_mut()) {
        let Some(mappings) = &primitive.extensions.variants else { continue };
        primitive.material = material(&mappings.mappings, number).or(primitive.material);
    }
    Ok(())
}

/// The material of a variant, if a primitive has one of its own there.
fn material(mappings: &List<VariantMapping>, variant: usize) -> Option<u32> {
    let of_variant = |m: &&VariantMapping| m.variants.iter().any(|&v| v as usize == variant);
    mappings.iter().find(of_variant).map(|m| m.material)
}
