//! What shaders may know of everything in a scene.

use super::records::{Binding, INSTANCE_IDENTITY, INSTANCE_MIRRORED, Instance, LightRecord};
use crate::shader::constants::numbers;
use optics::material::MaterialRecord;
use scene::tables::NONE;
use std::fmt::Write;

/// What a scene has at all. Shaders that are made for it leave out the rest: code that never runs takes registers and room in the
/// caches of instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SceneTraits {
    /// The model of all materials, a `ModelTag`, if it is one.
    pub model: Option<u32>,
    /// Whether any material mixes models by its transmission.
    pub mixed_models: bool,
    /// `MATERIAL_…` bits that any material has.
    pub material_flags: u32,
    /// Bit `SLOT_…` is set if any material has a texture there.
    pub textures: u32,
    /// `BINDING_…` bits that any geometry has.
    pub geometry_flags: u32,
    /// Whether vertices of any geometry have colours.
    pub vertex_colors: bool,
    /// `INSTANCE_…` bits that any instance has.
    pub instance_flags: u32,
    /// Those that all instances have.
    pub common_instance_flags: u32,
    /// Whether any light's emission differs from place to place.
    pub textured_lights: bool,
}

impl Default for SceneTraits {
    /// Nothing is known.
    fn default() -> Self {
        Self {
            model: None,
            mixed_models: true,
            material_flags: u32::MAX,
            textures: u32::MAX,
            geometry_flags: u32::MAX,
            vertex_colors: true,
            instance_flags: u32::MAX,
            common_instance_flags: 0,
            textured_lights: true,
        }
    }
}

impl SceneTraits {
    /// Those of a scene with these records.
    pub(crate) fn of(
        materials: &[MaterialRecord],
        bindings: &[Binding],
        instances: &[Instance],
        lights: &[LightRecord],
    ) -> Self {
        let model = |m: &MaterialRecord| m.model as u32;
        let all_instances = INSTANCE_IDENTITY | INSTANCE_MIRRORED;
        Self {
            model: materials.first().map(model).filter(|&first| materials.iter().all(|m| model(m) == first)),
            mixed_models: materials.iter().any(|m| m.transmission > 0.0),
            material_flags: materials.iter().fold(0, |flags, m| flags | m.flags),
            textures: materials.iter().fold(0, |slots, m| slots | textures(m)),
            geometry_flags: bindings.iter().fold(0, |flags, b| flags | b.flags),
            vertex_colors: bindings.iter().any(|b| b.first_color != NONE),
            instance_flags: instances.iter().fold(0, |flags, i| flags | i.flags),
            common_instance_flags: instances.iter().fold(all_instances, |flags, i| flags & i.flags),
            textured_lights: lights.iter().any(|l| l.textured_material != NONE),
        }
    }

    /// What is true of two scenes.
    pub(super) fn or(self, other: Self) -> Self {
        Self {
            model: self.model.filter(|_| self.model == other.model),
            mixed_models: self.mixed_models | other.mixed_models,
            material_flags: self.material_flags | other.material_flags,
            textures: self.textures | other.textures,
            geometry_flags: self.geometry_flags | other.geometry_flags,
            vertex_colors: self.vertex_colors | other.vertex_colors,
            instance_flags: self.instance_flags | other.instance_flags,
            common_instance_flags: self.common_instance_flags & other.common_instance_flags,
            textured_lights: self.textured_lights | other.textured_lights,
        }
    }

    /// The constants that shaders ask.
    pub(crate) fn constants(self) -> String {
        let mut text = numbers([
            ("ALL_MODELS_ARE", self.model.unwrap_or(NONE)),
            ("FLAGS_OF_MATERIALS", self.material_flags),
            ("SLOTS_WITH_TEXTURES", self.textures),
            ("FLAGS_OF_GEOMETRIES", self.geometry_flags),
            ("FLAGS_OF_INSTANCES", self.instance_flags),
            ("FLAGS_OF_ALL_INSTANCES", self.common_instance_flags),
        ]);
        for (name, is_on) in [
            ("SCENE_MIXES_MODELS", self.mixed_models),
            ("SCENE_HAS_VERTEX_COLORS", self.vertex_colors),
            ("LIGHTS_HAVE_TEXTURES", self.textured_lights),
        ] {
            let _ = writeln!(text, "const {name}: bool = {is_on};"); // writing to a string cannot fail
        }
        text
    }
}

/// Bit `SLOT_…` is set if a material has a texture there.
fn textures(material: &MaterialRecord) -> u32 {
    (0..).zip(&material.textures).filter(|(_, t)| t.is_some()).fold(0, |slots, (slot, _)| slots | 1 << slot)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{materials, records, words::Words};
    use optics::material::{
        MATERIAL_CHECKERBOARD, MATERIAL_EMISSIVE, ModelTag, SLOT_BASE_COLOR, SLOT_NORMAL,
    };
    use records::{BINDING_SPHERES, BINDING_UV0};
    use scene::tables::SceneTables;

    fn traits(scene: &scene::Scene) -> SceneTraits {
        let tables = SceneTables::build(scene);
        let words = Words::new(&tables);
        SceneTraits::of(
            &materials::materials(&tables, &words),
            &records::bindings(&tables, &words),
            &records::instances(&tables),
            &records::lights(&tables, &words),
        )
    }

    #[test]
    fn plain_scenes_have_little() {
        let cornell = traits(&testkit::scenes::cornell());
        assert_eq!(cornell.model, Some(ModelTag::Lambert as u32));
        assert_eq!(cornell.material_flags & (MATERIAL_CHECKERBOARD | MATERIAL_EMISSIVE), MATERIAL_EMISSIVE);
        assert_eq!(cornell.geometry_flags & (BINDING_SPHERES | BINDING_UV0), 0);
        assert_eq!(cornell.common_instance_flags, INSTANCE_IDENTITY);
        assert_eq!(cornell.textures, 0);
        assert!(!cornell.mixed_models && !cornell.vertex_colors && !cornell.textured_lights);
    }

    #[test]
    fn what_is_there_is_noticed() {
        let all = traits(&testkit::scenes::assortment());
        let slots = 1 << SLOT_BASE_COLOR | 1 << SLOT_NORMAL;
        assert_eq!(all.textures & slots, slots);
        assert_eq!(all.geometry_flags & (BINDING_SPHERES | BINDING_UV0), BINDING_SPHERES | BINDING_UV0);
        assert_eq!((all.model, all.common_instance_flags), (None, 0));
        assert!(all.vertex_colors && all.mixed_models);
    }

    #[test]
    fn what_has_been_there_stays() {
        let [plain, all] = [testkit::scenes::cornell(), testkit::scenes::assortment()].map(|s| traits(&s));
        assert_eq!(
            (plain.or(all), all.or(plain), plain.or(plain)),
            (all.or(all).or(plain), plain.or(all), plain)
        );
        assert_eq!(plain.or(SceneTraits::default()), SceneTraits::default());
    }
}
