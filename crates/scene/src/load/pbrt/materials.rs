//! Materials.

use super::Builder;
use super::parameters::{Parameters, Spectrum};
use crate::load::textures::Neutral;
use crate::{ColorSpace, Material, Model, TextureRef, Wrap};
use glam::{Vec3, Vec4};

/// Reflectance at normal incidence of common metals, linear Rec. 709.
///
/// Source: the measured refractive indices that pbrt names, evaluated at 630, 532 and 465 nm.
const METALS: [(&str, [f32; 3]); 7] = [
    ("Ag", [0.972, 0.960, 0.915]),
    ("Al", [0.912, 0.914, 0.920]),
    ("Au", [1.000, 0.766, 0.336]),
    ("Cu", [0.955, 0.637, 0.538]),
    ("CuZn", [0.910, 0.778, 0.423]),
    ("MgO", [0.072, 0.072, 0.073]),
    ("TiO2", [0.195, 0.210, 0.230]),
];

/// Indices of refraction of the glasses that pbrt names.
const GLASSES: [(&str, f32); 9] = [
    ("glass-BK7", 1.517),
    ("glass-BAF10", 1.670),
    ("glass-FK51A", 1.487),
    ("glass-LASF9", 1.850),
    ("glass-F5", 1.603),
    ("glass-F10", 1.624),
    ("glass-F11", 1.621),
    ("glass-SF5", 1.673),
    ("glass-SF11", 1.785),
];

impl Builder<'_> {
    /// The material that shapes without one have.
    pub(super) fn add_default_material(&mut self) {
        let base_color = Vec3::splat(0.5).extend(1.0);
        let material = Material { name: "default".into(), base_color, ..lambert() };
        self.scene.materials.push(material);
    }

    /// Adds a material; returns its number.
    pub(super) fn material(&mut self, kind: &str, p: &Parameters) -> u32 {
        let mut material = self.model(kind, p);
        let _ = p.text("type");
        material.name = format!("{kind} {}", self.scene.materials.len());
        self.set_roughness_texture(&mut material, p);
        if let Some(name) = p.text("normalmap") {
            let path = self.parser.resolve(&p.place, name);
            let image = self.images.file(&path, Neutral::FlatNormal);
            let texture = self.texture(image, ColorSpace::Linear, Wrap::Repeat);
            material.normal_texture = Some(TextureRef::new(texture));
        }
        if p.texture("displacement").is_some() {
            // Heights turn normals, as in pbrt: what displaces there is `shape`.
            let heights = self.value(p, "displacement", Vec3::ZERO);
            material.normal_texture = self.graph_of(heights);
        }
        self.scene.materials.push(material);
        self.scene.materials.len() as u32 - 1
    }

    fn model(&mut self, kind: &str, p: &Parameters) -> Material {
        match kind {
            "diffuse" => {
                let mut material = lambert();
                self.set_color(&mut material, p, "reflectance", Vec3::splat(0.5));
                material
            }
            "coateddiffuse" => {
                let mut material = Material { metallic: 0.0, ..Material::default() };
                self.set_color(&mut material, p, "reflectance", Vec3::splat(0.5));
                material.roughness = self.roughness(p, 0.0);
                material.ior = self.index(p, 1.5);
                let _ = (p.number("thickness"), p.number("g"), p.number("maxdepth"), p.number("nsamples"));
                self.report.approximated("coateddiffuse is a dielectric layer over a diffuse one");
                material
            }
            "conductor" | "coatedconductor" => {
                let prefix = if kind == "conductor" { "" } else { "conductor." };
                let mut material = Material { metallic: 1.0, ..Material::default() };
                let metal = self.metal(p, prefix);
                self.set_color(&mut material, p, "reflectance", metal);
                material.roughness = self.roughness_of(p, prefix, 0.0);
                if kind == "coatedconductor" {
                    self.report.approximated(format!("{}: the coat of a conductor is left out", p.place));
                }
                material
            }
            "dielectric" | "thindielectric" => {
                let thin_walled = kind == "thindielectric";
                let base_color = Vec4::ONE;
                let model = Model::Dielectric;
                let roughness = if thin_walled { 0.0 } else { self.roughness(p, 0.0) };
                let (ior, transmission, metallic) = (self.index(p, 1.5), 1.0, 0.0);
                let own = Material {
                    base_color,
                    model,
                    roughness,
                    ior,
                    transmission,
                    metallic,
                    ..Material::default()
                };
                Material { thin_walled, double_sided: true, ..own }
            }
            "diffusetransmission" => {
                let mut material = lambert();
                self.set_color(&mut material, p, "reflectance", Vec3::splat(0.25));
                self.report.approximated(format!("{}: diffuse transmission is left out", p.place));
                material
            }
            "mix" => {
                self.report.approximated(format!("{}: of mixed materials the first is used", p.place));
                let first = p.text("materials").and_then(|name| self.named_materials.get(name));
                let first = first.and_then(|number| self.scene.materials.get(*number as usize));
                first.cloned().unwrap_or_else(lambert)
            }
            "interface" | "" => {
                self.report.approximated(format!(
                    "{}: a surface without a material is clear glass of index 1",
                    p.place
                ));
                let clear = Material {
                    base_color: Vec4::ONE,
                    model: Model::Dielectric,
                    ior: 1.0,
                    ..Material::default()
                };
                Material { roughness: 0.0, transmission: 1.0, thin_walled: true, double_sided: true, ..clear }
            }
            other => {
                self.report.approximated(format!("{}: the material {other} is taken as diffuse", p.place));
                let mut material = lambert();
                self.set_color(&mut material, p, "reflectance", Vec3::splat(0.5));
                material
            }
        }
    }

    fn set_color(&mut self, material: &mut Material, p: &Parameters, name: &str, default: Vec3) {
        let value = self.value(p, name, default);
        material.base_color = value.factor.clamp(Vec3::ZERO, Vec3::ONE).extend(1.0);
        material.base_color_texture = value.image;
    }

    /// The colour of a metal by its name, its reflectance, or its index of refraction.
    fn metal(&mut self, p: &Parameters, prefix: &str) -> Vec3 {
        let (eta, k) = (p.spectrum(&format!("{prefix}eta")), p.spectrum(&format!("{prefix}k")));
        let copper = Vec3::from_array(METALS[3].1);
        match (eta, k) {
            (Some(Spectrum::Named(name)), _) => {
                let metal = name.strip_prefix("metal-").and_then(|n| n.strip_suffix("-eta"));
                let known = metal.and_then(|m| METALS.iter().find(|(name, _)| *name == m));
                if known.is_none() {
                    self.report.approximated(format!("{}: the metal {name} is taken as copper", p.place));
                }
                known.map_or(copper, |(_, color)| Vec3::from_array(*color))
            }
            (Some(Spectrum::Color(eta)), Some(Spectrum::Color(k))) => {
                let below = (eta + 1.0) * (eta + 1.0) + k * k;
                ((eta - 1.0) * (eta - 1.0) + k * k) / below
            }
            _ => copper,
        }
    }

    fn index(&mut self, p: &Parameters, default: f32) -> f32 {
        let index = match p.spectrum("eta") {
            None => default,
            Some(Spectrum::Color(color)) => color.x,
            Some(Spectrum::Named(name)) => {
                let known = GLASSES.iter().find(|(glass, _)| *glass == name);
                self.report.approximated(format!("{}: {name} has one index for all colours", p.place));
                known.map_or(default, |(_, index)| *index)
            }
            Some(Spectrum::Texture(_)) => default,
        };
        if index.is_finite() { index.max(1.0) } else { default }
    }

    fn roughness(&mut self, p: &Parameters, default: f32) -> f32 {
        self.roughness_of(p, "", default)
    }

    /// Perceptual roughness, of which the width of the distribution is the square.
    fn roughness_of(&mut self, p: &Parameters, prefix: &str, default: f32) -> f32 {
        let named = |name: &str| p.number(&format!("{prefix}{name}"));
        let along = named("uroughness").zip(named("vroughness"));
        if along.is_some_and(|(u, v)| u != v) {
            self.report
                .approximated(format!("{}: roughness is the same in all directions: their mean", p.place));
        }
        let single = named("roughness").unwrap_or(default);
        let value = along.map_or(single, |(u, v)| 0.5 * (u + v)).clamp(0.0, 1.0);
        // Remapped, the width is the square root of the value.
        let remapped = p.truth("remaproughness").unwrap_or(true);
        if remapped { value.sqrt().sqrt() } else { value.sqrt() }
    }

    /// The current material, made to shine if the shape does.
    pub(super) fn shape_material(&mut self, triangles: bool) -> u32 {
        let number = self.state.material.unwrap_or(0);
        let Some(light) = self.state.area_light else { return number };
        let key = (number, light.emission.to_array().map(f32::to_bits), light.two_sided);
        if let Some(known) = self.shining.get(&key) {
            return *known;
        }
        let base = self.scene.materials[number as usize].clone();
        let shining = Material {
            name: format!("{}, shining", base.name),
            emission: light.emission,
            emission_two_sided: light.two_sided,
            double_sided: base.double_sided || (light.two_sided && triangles),
            ..base
        };
        self.scene.materials.push(shining);
        let made = self.scene.materials.len() as u32 - 1;
        self.shining.insert(key, made);
        made
    }
}

fn lambert() -> Material {
    Material {
        model: Model::Lambert,
        roughness: 1.0,
        metallic: 0.0,
        specular: 0.0,
        double_sided: true,
        ..Material::default()
    }
}
