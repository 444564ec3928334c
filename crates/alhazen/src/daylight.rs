//! Light for scenes that have none: most model files come without, and a black picture helps nobody.

use scene::{Environment, LoadReport, Model, Scene, Sky};

/// Surfaces that emit no more than this are as bright as white paper on a cloudy day: screens, labels and glowing lines, but
/// no lamps. A scene whose only light they are is black around them.
const BRIGHTEST_PAPER: f32 = 1.0;

/// Puts a cloudy sky around a scene without light: no environment, no light source, no fog that shines, and no surface that is a lamp; and says so
/// in the report. Returns whether it did.
///
/// A scene of unlit surfaces only needs no light.
pub fn add_daylight_if_dark(scene: &mut Scene, report: &mut LoadReport) -> bool {
    let has_lamps = scene.materials.iter().any(|m| m.emission.max_element() > BRIGHTEST_PAPER);
    let fog_shines = scene.fog.as_ref().is_some_and(|fog| fog.medium.emission.max_element() > 0.0);
    let is_lit =
        scene.environment != Environment::Black || !scene.lights.is_empty() || has_lamps || fog_shines;
    let is_flat = !scene.materials.is_empty() && scene.materials.iter().all(|m| m.model == Model::Unlit);
    if is_lit || is_flat {
        return false;
    }
    scene.environment = Environment::Sky(Sky {
        horizon: glam::vec3(0.9, 0.92, 0.95),
        zenith: glam::vec3(0.6, 0.72, 0.95),
        ground: glam::vec3(0.35, 0.33, 0.3),
        sun: None,
    });
    let glows = scene.materials.iter().any(|m| m.is_emissive());
    let what = if glows { "is brighter than white paper" } else { "shines" };
    report.repaired(format!("nothing in the scene {what}: a sky was added"));
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::{Light, LightKind, Material};

    fn with(materials: impl IntoIterator<Item = Material>) -> (Scene, LoadReport) {
        let materials = materials.into_iter().collect();
        (Scene { materials, ..Scene::default() }, LoadReport::default())
    }

    fn emitter(emission: f32) -> Material {
        Material { emission: glam::Vec3::splat(emission), ..Material::default() }
    }

    fn unlit() -> Material {
        Material { model: Model::Unlit, ..Material::default() }
    }

    #[test]
    fn only_dark_scenes_get_a_sky() {
        let dark = [
            vec![],
            vec![Material::default()],
            vec![emitter(1.0), Material::default()],
            vec![unlit(), Material::default()],
        ];
        for materials in dark {
            let (mut scene, mut report) = with(materials);
            assert!(add_daylight_if_dark(&mut scene, &mut report));
            assert_eq!(report.notes.len(), 1);
            assert!(!add_daylight_if_dark(&mut scene, &mut report), "the sky shines now");
        }
        for materials in [vec![emitter(1.5), Material::default()], vec![unlit()]] {
            let (mut scene, mut report) = with(materials);
            assert!(!add_daylight_if_dark(&mut scene, &mut report) && report.notes.is_empty());
        }
        let (mut scene, mut report) = with([Material::default()]);
        let kind = LightKind::Point { position: glam::Vec3::ZERO, intensity: glam::Vec3::ONE };
        scene.lights.push(Light::new("lamp", kind));
        assert!(!add_daylight_if_dark(&mut scene, &mut report), "there is a light source");
    }

    #[test]
    fn the_report_tells_dim_from_dark() {
        for (materials, what) in [(emitter(0.5), "brighter than white paper"), (emitter(0.0), "scene shines")]
        {
            let (mut scene, mut report) = with([materials]);
            add_daylight_if_dark(&mut scene, &mut report);
            let text = format!("{:?}", report.notes);
            assert!(text.contains(what), "{text}");
        }
    }
}
