//! Light for scenes that have none: most model files come without, and a black picture helps nobody.

use scene::{Environment, LoadReport, Model, Scene, Sky};

/// Puts a cloudy sky around a scene in which nothing shines, and says so in the report. Returns whether it did.
pub fn add_daylight_if_dark(scene: &mut Scene, report: &mut LoadReport) -> bool {
    let shines = |m: &scene::Material| m.is_emissive() || m.model == Model::Unlit;
    let is_dark = scene.environment == Environment::Black
        && scene.lights.is_empty()
        && !scene.materials.iter().any(shines);
    if is_dark {
        scene.environment = Environment::Sky(Sky {
            horizon: glam::vec3(0.9, 0.92, 0.95),
            zenith: glam::vec3(0.6, 0.72, 0.95),
            ground: glam::vec3(0.35, 0.33, 0.3),
            sun: None,
        });
        report.repaired("nothing in the scene shines: a sky was added");
    }
    is_dark
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::Material;

    #[test]
    fn only_dark_scenes_get_a_sky() {
        let (mut scene, mut report) = (Scene::default(), LoadReport::default());
        scene.materials.push(Material { emission: glam::Vec3::ONE, ..Material::default() });
        assert!(!add_daylight_if_dark(&mut scene, &mut report) && report.notes.is_empty());
        scene.materials.clear();
        assert!(add_daylight_if_dark(&mut scene, &mut report));
        assert_eq!(report.notes.len(), 1);
        assert!(!add_daylight_if_dark(&mut scene, &mut report), "the sky shines now");
    }
}
