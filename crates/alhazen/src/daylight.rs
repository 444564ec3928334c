//! Light for scenes that have none, or whose own light does not reach what is seen: most model files come without, and a
//! black picture helps nobody.

use crate::{Job, Limits, Renderer};
use backend::{BackendError, Control, Integrator, PathSettings};
use film::{Aov, AovData, Film};
use scene::{Camera, Environment, LoadReport, Model, Scene, Sky};

/// Surfaces that emit no more than this are as bright as white paper on a cloudy day: screens, labels and glowing lines, but
/// no lamps. A scene whose only light they are is black around them.
const BRIGHTEST_PAPER: f32 = 1.0;

/// Width, height and samples per pixel of the pictures by which a scene's own light is judged.
const PROBE: (u32, u32, u32) = (48, 27, 16);
/// Longest paths in them: light that comes by way of a ceiling counts.
const PROBE_DEPTH: u32 = 6;
/// Cameras of a file that are asked.
const MOST_CAMERAS: usize = 4;

/// Radiance times exposure that a display shows as 8 of 255: what reflects less looks black.
const BLACK: f64 = 0.0024;
/// Radiance times exposure of what shines by itself and can be seen without other light.
const SEEN_BY_ITSELF: f64 = 0.05;
/// Where less than this share of what needs light has some, the scene is dark.
const LEAST_LIT: f64 = 0.1;
/// Where less than this share of what is seen needs light, it may stay dark.
const LEAST_IN_NEED: f64 = 0.05;

/// Puts a cloudy sky around a scene whose own light leaves it dark, and says so in the report. Returns whether it did.
///
/// - A scene without environment, light sources, shining fog and surfaces that are lamps is dark. If it has some, they are
///   judged by small pictures from its cameras, or from [`Scene::default_camera`]: of what is seen and does not shine by
///   itself, at least a tenth reflects enough light to be told from black.
/// - `exposure`: with which the picture will be shown; `None` is what the scene asks for, or 1.
///
/// A scene of unlit surfaces needs no light, and one that [declares](Scene::declares_light) its own is left as it is. An
/// environment of radiance 0 keeps any scene dark.
pub fn add_daylight_if_dark(scene: &mut Scene, report: &mut LoadReport, exposure: Option<f32>) -> bool {
    let is_flat = !scene.materials.is_empty() && scene.materials.iter().all(|m| m.model == Model::Unlit);
    if scene.environment != Environment::Black || is_flat {
        return false;
    }
    let why = if has_lamps(scene) {
        let exposure = exposure.or(scene.defaults.exposure).unwrap_or(1.0);
        // What cannot be rendered says so when it is.
        let Ok(Some(dark)) = dark_share(scene, f64::from(exposure)) else { return false };
        format!("its lights leave {:.0} % of what is seen of the scene dark", 100.0 * dark)
    } else if scene.materials.iter().any(|m| m.is_emissive()) {
        "nothing in the scene is brighter than white paper".into()
    } else {
        "nothing in the scene shines".into()
    };
    scene.environment = Environment::Sky(Sky {
        horizon: glam::vec3(0.9, 0.92, 0.95),
        zenith: glam::vec3(0.6, 0.72, 0.95),
        ground: glam::vec3(0.35, 0.33, 0.3),
        sun: None,
    });
    report.repaired(format!("{why}: a sky was added; an environment of 0,0,0 leaves it out"));
    true
}

fn has_lamps(scene: &Scene) -> bool {
    let fog_shines = scene.fog.as_ref().is_some_and(|fog| fog.medium.emission.max_element() > 0.0);
    let is_lamp = |emission: glam::Vec3| emission.max_element() > BRIGHTEST_PAPER;
    fog_shines || !scene.lights.is_empty() || scene.materials.iter().any(|m| is_lamp(m.emission))
}

/// How much of what is seen of a scene is dark, if it is too much from every camera; `None` if its light suffices.
fn dark_share(scene: &Scene, exposure: f64) -> Result<Option<f64>, BackendError> {
    if scene.declares_light {
        return Ok(None);
    }
    let mut renderer = Renderer::cpu(None)?;
    renderer.load(scene)?;
    let own: Vec<Camera> = scene.cameras.iter().take(MOST_CAMERAS).cloned().collect();
    let cameras = if own.is_empty() { vec![scene.default_camera()] } else { own };
    let mut least: Option<f64> = None;
    for camera in cameras {
        let Some(dark) = dark_share_from(&mut renderer, scene, camera, exposure)? else { return Ok(None) };
        least = Some(least.map_or(dark, |least| least.min(dark)));
    }
    Ok(least)
}

/// As [`dark_share`], from one camera.
fn dark_share_from(
    renderer: &mut Renderer,
    scene: &Scene,
    camera: Camera,
    exposure: f64,
) -> Result<Option<f64>, BackendError> {
    let (width, height, spp) = PROBE;
    let job = Job { camera, width, height, aovs: vec![Aov::Depth], ..Job::for_scene(scene) };
    let mut picture = |max_depth| {
        let integrator = Integrator::Path(PathSettings { max_depth, ..PathSettings::default() });
        let limits = Limits { spp, ..Limits::default() };
        renderer.render(&Job { integrator, ..job.clone() }, &limits, &Control::new())?;
        Ok::<_, BackendError>(renderer.film()?.cloned())
    };
    // The same rays see what shines by itself and what all the light makes of it.
    let Some((direct, whole)) = picture(1)?.zip(picture(PROBE_DEPTH)?) else { return Ok(None) };
    let Some(AovData::Float(depth)) = direct.aov(Aov::Depth) else { return Ok(None) };
    let level = |film: &Film, i: usize| film.pixels()[i].mean().into_iter().fold(0.0, f64::max) * exposure;
    let seen: Vec<_> = (0..direct.pixels().len()).filter(|i| depth.data()[*i] > 0.0).collect();
    let in_need: Vec<_> = seen.iter().filter(|i| level(&direct, **i) < SEEN_BY_ITSELF).collect();
    let is_lit = |i: usize| level(&whole, i) - level(&direct, i) >= BLACK;
    let lit = in_need.iter().filter(|i| is_lit(***i)).count() as f64 / in_need.len().max(1) as f64;
    let is_dark = in_need.len() as f64 > LEAST_IN_NEED * seen.len() as f64 && lit < LEAST_LIT;
    Ok(is_dark.then_some(1.0 - lit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Affine3A, Vec3};
    use scene::{Instance, Light, LightKind, Material, Mesh, Shape, TriangleMesh};

    fn with(materials: impl IntoIterator<Item = Material>) -> (Scene, LoadReport) {
        let materials = materials.into_iter().collect();
        (Scene { materials, ..Scene::default() }, LoadReport::default())
    }

    fn emitter(emission: f32) -> Material {
        Material { emission: Vec3::splat(emission), ..Material::default() }
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
            assert!(add_daylight_if_dark(&mut scene, &mut report, None));
            assert_eq!(report.notes.len(), 1);
            assert!(!add_daylight_if_dark(&mut scene, &mut report, None), "the sky shines now");
        }
        for materials in [vec![emitter(1.5), Material::default()], vec![unlit()]] {
            let (mut scene, mut report) = with(materials);
            assert!(!add_daylight_if_dark(&mut scene, &mut report, None) && report.notes.is_empty());
        }
        let (mut scene, mut report) = with([Material::default()]);
        let kind = LightKind::Point { position: Vec3::ZERO, intensity: Vec3::ONE };
        scene.lights.push(Light::new("lamp", kind));
        assert!(!add_daylight_if_dark(&mut scene, &mut report, None), "there is a light source");
    }

    #[test]
    fn the_report_tells_dim_from_dark() {
        for (materials, what) in [(emitter(0.5), "brighter than white paper"), (emitter(0.0), "scene shines")]
        {
            let (mut scene, mut report) = with([materials]);
            add_daylight_if_dark(&mut scene, &mut report, None);
            let text = format!("{:?}", report.notes);
            assert!(text.contains(what), "{text}");
        }
    }

    /// A square of half size `half` about `center`, whose front looks along `normal`.
    fn square(scene: &mut Scene, center: Vec3, normal: Vec3, half: f32, material: u32) {
        let x = normal.any_orthonormal_vector() * half;
        let y = normal.cross(x);
        let positions = vec![center - x - y, center + x - y, center + x + y, center - x + y];
        let mesh = TriangleMesh { positions, indices: vec![[0, 1, 2], [0, 2, 3]], ..TriangleMesh::default() };
        let index = scene.meshes.len() as u32;
        scene.meshes.push(Mesh::single("square", Shape::Triangles(mesh), material));
        scene.instances.push(Instance::new("square", index, Affine3A::IDENTITY));
    }

    /// A grey panel that looks along +Z, towards the default camera, and a material that shines.
    fn panel(emission: f32) -> Scene {
        let mut scene =
            with([Material { model: Model::Lambert, ..Material::default() }, emitter(emission)]).0;
        square(&mut scene, Vec3::ZERO, Vec3::Z, 1.0, 0);
        scene
    }

    /// Whether a sky is added, with the first note.
    fn daylight(scene: &Scene, exposure: Option<f32>) -> (bool, String) {
        let (mut scene, mut report) = (scene.clone(), LoadReport::default());
        let added = add_daylight_if_dark(&mut scene, &mut report, exposure);
        assert_eq!(added, matches!(scene.environment, Environment::Sky(_)));
        (added, report.notes.first().map(ToString::to_string).unwrap_or_default())
    }

    #[test]
    fn lamps_that_do_not_reach_what_is_seen_do_not_keep_the_sky_away() {
        // Behind the panel, turned away from it, and between its back and a wall.
        let mut behind = panel(4.0);
        square(&mut behind, Vec3::new(0.0, 0.0, -0.2), Vec3::Z, 0.01, 1);
        let mut away = panel(50.0);
        square(&mut away, Vec3::new(0.0, 0.0, 0.5), Vec3::Z, 0.1, 1);
        let mut enclosed = panel(50.0);
        for (center, normal) in [(Vec3::X, Vec3::X), (Vec3::Y, Vec3::Y), (Vec3::Z, Vec3::Z)] {
            square(&mut enclosed, center, normal, 1.0, 0);
            square(&mut enclosed, -center, normal, 1.0, 0);
        }
        square(&mut enclosed, Vec3::ZERO, Vec3::Y, 0.2, 1);
        let mut weak = panel(2.0);
        square(&mut weak, Vec3::new(0.0, 0.0, 1.0), Vec3::NEG_Z, 1e-3, 1);
        let sun = |z: f32| {
            let mut scene = panel(0.0);
            let direction = Vec3::new(0.0, 0.0, z);
            let kind = LightKind::Directional { direction, irradiance: Vec3::ONE, angular_diameter: 0.0 };
            scene.lights.push(Light::new("sun", kind));
            scene
        };
        for (what, scene) in
            [("behind", behind), ("away", away), ("enclosed", enclosed), ("weak", weak), ("sun", sun(1.0))]
        {
            let (added, note) = daylight(&scene, None);
            assert!(added, "{what}");
            assert!(note.contains("its lights leave 100 % of what is seen"), "{what}: {note}");
            let declared = Scene { declares_light: true, ..scene.clone() };
            assert!(!daylight(&declared, None).0, "{what}: the file says what light there is");
            let black = Scene { environment: Environment::Constant(Vec3::ZERO), ..scene };
            assert!(!daylight(&black, None).0, "{what}: black is an environment, too");
        }
        assert_eq!(daylight(&sun(-1.0), None), (false, String::new()));
    }

    #[test]
    fn light_that_arrives_suffices() {
        let mut direct = panel(4.0);
        square(&mut direct, Vec3::new(0.0, 0.0, 1.5), Vec3::NEG_Z, 0.3, 1);
        // Of a lamp that shines away from the panel, by way of a wall behind the camera.
        let mut indirect = panel(80.0);
        square(&mut indirect, Vec3::new(0.0, 0.0, 40.0), Vec3::NEG_Z, 30.0, 0);
        square(&mut indirect, Vec3::new(0.0, 0.0, 30.0), Vec3::Z, 10.0, 1);
        indirect.cameras.push(Camera::perspective("c", Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 0.6));
        // What shines by itself needs no light.
        let mut sign = panel(9.0);
        sign.instances.clear();
        square(&mut sign, Vec3::ZERO, Vec3::Z, 1.0, 1);
        // One of two cameras sees the lamp's side.
        let mut sides = panel(20.0);
        square(&mut sides, Vec3::new(0.0, 0.0, -1.0), Vec3::Z, 0.5, 1);
        for z in [4.0, -0.9] {
            sides.cameras.push(Camera::perspective("c", Vec3::new(0.8, 0.0, z), Vec3::ZERO, 0.9));
        }
        for (what, scene) in [("direct", direct), ("indirect", indirect), ("sign", sign), ("sides", sides)] {
            assert_eq!(daylight(&scene, None), (false, String::new()), "{what}");
        }
    }

    #[test]
    fn exposure_decides_what_is_dark() {
        let mut dim = panel(0.0);
        let kind = LightKind::Point { position: Vec3::new(0.0, 0.0, 2.0), intensity: Vec3::splat(1e-3) };
        dim.lights.push(Light::new("lamp", kind));
        assert!(daylight(&dim, None).0);
        assert!(!daylight(&dim, Some(1000.0)).0, "the picture will be bright enough");
        dim.defaults.exposure = Some(1000.0);
        assert!(!daylight(&dim, None).0);
        assert!(daylight(&dim, Some(1.0)).0, "what is asked for counts");
    }
}
