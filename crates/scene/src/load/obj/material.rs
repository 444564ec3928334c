//! What an MTL material means in terms of [`Material`]. The rules are in the documentation of the [module](super).

use super::mtl::{MtlMaterial, MtlTexture};
use crate::{AlphaMode, LoadReport, Material, Model};
use glam::Vec3;

/// Perceptual roughness of the GGX lobe that is about as wide as a Phong lobe of exponent `ns`.
///
/// The width is alpha = √(2 / (ns + 2)) (Walter et al. 2007, section 5.2) and roughness its square root.
pub fn roughness_from_exponent(ns: f32) -> f32 {
    (2.0 / (ns.max(0.0) + 2.0)).sqrt().sqrt()
}

/// The material without its textures. What is approximated or has no effect is noted in `report`.
pub fn interpret(mtl: &MtlMaterial, report: &mut LoadReport) -> Material {
    let mut notes = Notes { name: &mtl.name, report };
    let has = |slot| mtl.maps.contains_key(&slot);
    let mut material = Material {
        name: mtl.name.clone(),
        base_color: diffuse(mtl, &mut notes).extend(1.0),
        emission: emission(mtl, &mut notes),
        // OBJ files know no sides.
        double_sided: true,
        emission_two_sided: true,
        ..Material::default()
    };
    let opacity = opacity(mtl, &mut notes);
    if is_glass(mtl, opacity) {
        glass(mtl, &mut material, &mut notes);
        return material;
    }
    if opacity < 1.0 || has(MtlTexture::Dissolve) {
        material.base_color.w = opacity;
        material.alpha_mode = AlphaMode::Blend;
    }
    surface(mtl, &mut material, &mut notes);
    for (value, what) in [(mtl.clearcoat, "clearcoat"), (mtl.sheen, "sheen"), (mtl.anisotropy, "anisotropy")]
    {
        if value.is_some_and(|v| v != 0.0) {
            notes.approximated(format!("{what} is left out"));
        }
    }
    material
}

/// Prefixes notes with the material's name.
struct Notes<'a> {
    name: &'a str,
    report: &'a mut LoadReport,
}

impl Notes<'_> {
    fn repaired(&mut self, what: impl AsRef<str>) {
        self.report.repaired(format!("material {}: {}", self.name, what.as_ref()));
    }

    fn approximated(&mut self, what: impl AsRef<str>) {
        self.report.approximated(format!("material {}: {}", self.name, what.as_ref()));
    }
}

fn diffuse(mtl: &MtlMaterial, notes: &mut Notes) -> Vec3 {
    let textured = mtl.maps.contains_key(&MtlTexture::Diffuse);
    let Some(diffuse) = mtl.diffuse else { return Vec3::splat(if textured { 1.0 } else { 0.8 }) };
    if textured && diffuse == Vec3::ZERO {
        notes.repaired("a black Kd would hide map_Kd; white is used");
        return Vec3::ONE;
    }
    if diffuse.max_element() > 1.0 {
        notes.repaired("Kd is above 1 and was clamped");
    }
    diffuse.min(Vec3::ONE)
}

fn emission(mtl: &MtlMaterial, notes: &mut Notes) -> Vec3 {
    let emission = mtl.emission.unwrap_or_default();
    if emission != Vec3::ZERO {
        return emission;
    }
    if mtl.maps.contains_key(&MtlTexture::Emission) {
        if mtl.emission.is_some() {
            notes.repaired("a black Ke would hide map_Ke; white is used");
        }
        return Vec3::ONE;
    }
    match mtl.ambient {
        // A habit from before Ke existed: light sources have an ambient colour that nothing can reflect.
        Some(ambient) if ambient.max_element() > 1.0 => {
            notes.repaired("Ka is above 1 and taken for emission");
            ambient
        }
        _ => Vec3::ZERO,
    }
}

/// `d`, or 1 − `Tr`.
fn opacity(mtl: &MtlMaterial, notes: &mut Notes) -> f32 {
    let opacity = match (mtl.dissolve, mtl.transparency) {
        (Some(d), Some(tr)) => {
            if (d + tr - 1.0).abs() > 0.01 {
                notes.repaired("d and Tr contradict each other; d is used");
            }
            d
        }
        (Some(d), None) => d,
        (None, Some(tr)) if tr >= 1.0 && mtl.illum.is_none_or(|i| i <= 3) => {
            notes.repaired("Tr 1 would make it invisible and is taken for opaque");
            1.0
        }
        (None, Some(tr)) => 1.0 - tr,
        (None, None) => 1.0,
    };
    opacity.clamp(0.0, 1.0)
}

fn is_glass(mtl: &MtlMaterial, opacity: f32) -> bool {
    let black = mtl.diffuse.is_some_and(|kd| kd.max_element() <= 0.0);
    let filter = mtl.transmission.filter(|tf| tf.max_element() > 0.0);
    match mtl.illum {
        _ if mtl.maps.contains_key(&MtlTexture::Dissolve) => false,
        Some(6 | 7) => true,
        Some(4 | 9) => opacity < 1.0 || filter.is_some_and(|tf| tf.min_element() < 1.0 || black),
        _ => opacity < 1.0 && filter.is_some() && mtl.ior.is_some_and(|ni| ni > 1.01),
    }
}

fn glass(mtl: &MtlMaterial, material: &mut Material, notes: &mut Notes) {
    material.model = Model::Dielectric;
    material.ior = match mtl.ior {
        Some(ni) if ni > 1.0 => ni.min(4.0),
        _ => {
            notes.approximated("glass without an index of refraction above 1; 1.5 is used");
            1.5
        }
    };
    // The classic model refracts sharply whatever Ns is, which only shapes the highlights of lights.
    material.roughness = mtl.roughness.unwrap_or(0.0).clamp(0.0, 1.0);
    let textured = mtl.maps.contains_key(&MtlTexture::Diffuse);
    let tint = [mtl.transmission, mtl.diffuse].into_iter().flatten().find(|c| c.max_element() > 0.0);
    let tint = if textured { Vec3::ONE } else { tint.unwrap_or(Vec3::ONE) };
    material.base_color = tint.min(Vec3::ONE).extend(1.0);
}

/// An opaque surface: diffuse, glossy, metallic or a mirror.
fn surface(mtl: &MtlMaterial, material: &mut Material, notes: &mut Notes) {
    let has = |slots: &[MtlTexture]| slots.iter().any(|s| mtl.maps.contains_key(s));
    let rough_map = has(&[
        MtlTexture::Roughness,
        MtlTexture::OcclusionRoughnessMetallic,
        MtlTexture::RoughnessMetallicOcclusion,
    ]);
    let metal_map = has(&[
        MtlTexture::Metallic,
        MtlTexture::OcclusionRoughnessMetallic,
        MtlTexture::RoughnessMetallicOcclusion,
    ]);
    let physical = mtl.roughness.is_some() || mtl.metallic.is_some() || rough_map || metal_map;
    let specular_map = has(&[MtlTexture::Specular]);
    let specular = mtl.specular.unwrap_or(if specular_map || physical { Vec3::ONE } else { Vec3::ZERO });

    let phong = mtl.exponent.map_or(0.5, roughness_from_exponent);
    material.roughness = mtl.roughness.unwrap_or(if rough_map { 1.0 } else { phong }).clamp(0.0, 1.0);
    material.metallic = mtl.metallic.unwrap_or(if metal_map { 1.0 } else { 0.0 }).clamp(0.0, 1.0);
    material.specular = specular.max_element().clamp(0.0, 1.0);
    if let Some(ni) = mtl.ior.filter(|ni| *ni > 1.01) {
        material.ior = ni.min(4.0);
    }

    let no_highlight = specular == Vec3::ZERO || (!physical && mtl.illum.is_some_and(|i| i <= 1));
    if no_highlight && material.metallic == 0.0 {
        material.model = Model::Lambert;
    } else if !physical && matches!(mtl.illum, Some(3 | 5 | 8)) && reflects(mtl, specular) {
        let diffuse = material.base_color.truncate();
        if diffuse.max_element() < 0.05 {
            material.model = Model::Mirror;
            material.base_color = specular.min(Vec3::ONE).extend(material.base_color.w);
        } else {
            notes.approximated("a mirror with a diffuse part became a metal");
            material.metallic = 1.0;
            material.base_color = (specular + diffuse).min(Vec3::ONE).extend(material.base_color.w);
        }
    } else if specular.max_element() - specular.min_element() > 0.1 {
        notes.approximated("the colour of Ks is left out");
    }
}

/// Whether the mirror reflection outweighs the diffuse one.
fn reflects(mtl: &MtlMaterial, specular: Vec3) -> bool {
    let diffuse = mtl.diffuse.unwrap_or_default().max_element();
    !mtl.maps.contains_key(&MtlTexture::Diffuse) && specular.max_element() >= diffuse.max(0.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn material(text: &str) -> (Material, Vec<String>) {
        let mut report = LoadReport::default();
        let mtl = super::super::mtl::parse(format!("newmtl m\n{text}").as_bytes(), &mut report);
        let material = interpret(&mtl[0], &mut report);
        (material, report.notes.into_iter().map(|n| n.message).collect())
    }

    #[test]
    fn models_follow_the_documented_rules() {
        for (text, model) in [
            ("", Model::Lambert),
            ("Kd 1 0 0\nKs 0 0 0\nNs 10", Model::Lambert),
            ("Kd 1 0 0\nKs 1 1 1\nillum 1", Model::Lambert),
            ("Kd 1 0 0\nKs 1 1 1\nillum 2", Model::MetallicRoughness),
            ("Kd 1 0 0\nKs 0 0 0\nPr 0.5\nPm 0", Model::Lambert),
            ("Kd 1 0 0\nPr 0.5", Model::MetallicRoughness),
            ("Kd 1 0 0\nKs 0 0 0\nPm 1", Model::MetallicRoughness),
            ("Kd 0 0 0\nKs 0.9 0.9 0.9\nillum 3", Model::Mirror),
            ("Kd 0.2 0 0\nKs 0.9 0.9 0.9\nillum 5", Model::MetallicRoughness),
            ("Kd 0.8 0 0\nKs 0.5 0.5 0.5\nillum 3", Model::MetallicRoughness),
            ("Kd 0 0 0\nNi 1.5\nillum 7", Model::Dielectric),
            ("Kd 1 1 1\nillum 4\nd 1\nTf 1 1 1\nKs 0 0 0", Model::Lambert),
            ("Kd 1 1 1\nillum 4\nd 0.2\nNi 1.3", Model::Dielectric),
            ("Kd 1 1 1\nillum 2\nd 0.2\nNi 1.5\nTf 1 1 1", Model::Dielectric),
            ("Kd 1 1 1\nillum 2\nd 0.2\nNi 1.5", Model::Lambert),
            ("Kd 1 1 1\nillum 9\nmap_d leaf.png\nd 0.5", Model::Lambert),
        ] {
            assert_eq!(material(text).0.model, model, "{text}");
        }
    }

    #[test]
    fn factors() {
        assert!((roughness_from_exponent(0.0) - 1.0).abs() < 1e-6);
        assert!((roughness_from_exponent(30.0) - 0.5).abs() < 1e-6);
        let (m, _) = material("Kd 0.5 0.5 0.5\nKs 0.25 0.25 0.25\nNs 30\nNi 1.4\nillum 2\nd 0.75");
        assert_eq!((m.specular, m.roughness, m.ior, m.base_color.w), (0.25, 0.5, 1.4, 0.75));
        assert_eq!(m.alpha_mode, AlphaMode::Blend);
        let (m, _) = material("Kd 0.2 0 0\nKs 0.9 0.8 0.7\nillum 5");
        assert_eq!((m.metallic, m.base_color.truncate()), (1.0, Vec3::new(1.0, 0.8, 0.7)));
        let (m, _) = material("map_Pr a.png\nmap_Pm b.png");
        assert_eq!((m.metallic, m.roughness), (1.0, 1.0));
        let (m, _) = material("Tf 0.7 0.7 0.7\nNi 1.33\nillum 7\nPr 0.01\nKd 0 0 0");
        assert_eq!((m.ior, m.roughness, m.base_color.x), (1.33, 0.01, 0.7));
    }

    #[test]
    fn repairs_are_reported() {
        for (text, note) in [
            ("Ka 20 20 20\nKd 1 1 1", "material m: Ka is above 1 and taken for emission"),
            ("Kd 2 1 1", "material m: Kd is above 1 and was clamped"),
            ("Kd 0 0 0\nmap_Kd a.png", "material m: a black Kd would hide map_Kd; white is used"),
            ("d 0.75\nTr 0.5", "material m: d and Tr contradict each other; d is used"),
            ("Tr 1\nillum 2", "material m: Tr 1 would make it invisible and is taken for opaque"),
            ("Pr 0.5\nPc 1", "material m: clearcoat is left out"),
            ("Ks 1 0 0\nillum 2", "material m: the colour of Ks is left out"),
            ("illum 6", "material m: glass without an index of refraction above 1; 1.5 is used"),
        ] {
            assert_eq!(material(text).1, [note], "{text}");
        }
        assert_eq!(material("Ka 20 20 20").0.emission, Vec3::splat(20.0));
    }
}
