//! `alhazen info`: what is in a scene.

use crate::console::{bytes, json_line, print_result, seconds};
use alhazen::{
    AlphaMode, Camera, Distortion, Environment, Light, LightParameter, LoadOptions, Loaded, Material, Model,
    Projection, ProjectionParameter, Quantity, Scene, SceneTables, Shape, Texture, TextureRef,
};
use elementary::atan;
use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use std::fmt::Write;

/// Show what is in a scene: counts, sizes, materials, lights, cameras, and what the loader noticed.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  alhazen info model.glb
  alhazen info atrium --json
  alhazen info lights -p models=4")]
pub struct InfoArgs {
    /// Scene file or name of a built-in scene.
    #[arg(value_name = "FILE|SCENE")]
    scene: String,
    /// Parameter of the scene, as NAME=VALUE. May be given several times.
    #[arg(short, long = "param", value_name = "NAME=VALUE", value_parser = super::parse_parameter)]
    parameters: Vec<(String, String)>,
    /// Go on without what the file requires but Alhazen does not know.
    #[arg(long)]
    lenient: bool,
    #[command(flatten)]
    loading: super::loading::LoadingArgs,
    /// Print everything as JSON.
    #[arg(long)]
    json: bool,
}

/// Loads the scene and prints what is in it.
pub fn run(args: &InfoArgs) -> anyhow::Result<()> {
    let options =
        LoadOptions { lenient: args.lenient, ..args.loading.options_within(most_memory(&args.scene)) };
    let _limit = super::loading::memory_limit(&options);
    let loaded = super::load_scene(&args.scene, &args.parameters, &options)?;
    let tables = SceneTables::build(&loaded.scene);
    let text = if args.json {
        json_line(&as_json(&loaded, &tables))
    } else {
        as_text(&loaded, &tables)?.lines().map(|line| format!("{}\n", alhazen::plain(line))).collect()
    };
    print_result(&text)
}

/// What looking at a scene may take, in bytes: a small file is not looked at for long, whatever it asks for.
fn most_memory(scene: &str) -> u64 {
    const FREE: u64 = 768 << 20;
    const PER_BYTE: u64 = 64;
    let size = std::fs::metadata(scene).map_or(0, |metadata| metadata.len());
    // What a larger file refers to may be larger still.
    if size < 1 << 20 { FREE } else { FREE.saturating_add(size.saturating_mul(PER_BYTE)) }
}

/// How many there are of what.
struct Counts {
    vertices: usize,
    spheres: usize,
    parts: usize,
    pixels: usize,
    image_bytes: usize,
    hidden: usize,
    /// Materials whose backs may be culled.
    single_sided: usize,
}

impl Counts {
    fn of(scene: &Scene) -> Self {
        let parts = || scene.meshes.iter().flat_map(|m| &m.parts);
        let vertices =
            parts().map(|p| if let Shape::Triangles(m) = &p.shape { m.positions.len() } else { 0 }).sum();
        let spheres = parts().map(|p| if let Shape::Spheres(s) = &p.shape { s.len() } else { 0 }).sum();
        Self {
            vertices,
            spheres,
            parts: parts().count(),
            pixels: scene.images.iter().map(|i| i.width as usize * i.height as usize).sum(),
            image_bytes: scene.images.iter().map(|i| i.pixels.memory_bytes()).sum(),
            hidden: scene.instances.iter().filter(|i| !i.visible).count(),
            single_sided: scene.materials.iter().filter(|m| m.may_lose_backs()).count(),
        }
    }
}

fn culls_backs(scene: &Scene) -> bool {
    scene.defaults.cull_backs.unwrap_or(false)
}

fn as_text(loaded: &Loaded, tables: &SceneTables) -> anyhow::Result<String> {
    let mut text = String::new();
    write_sizes(&mut text, loaded, tables)?;
    write_contents(&mut text, loaded)?;
    Ok(text)
}

/// How much there is of everything, where it is, and what loading took.
fn write_sizes(text: &mut String, loaded: &Loaded, tables: &SceneTables) -> anyhow::Result<()> {
    let (scene, report) = (&loaded.scene, &loaded.report);
    let counts = Counts::of(scene);
    writeln!(text, "{}", scene.name)?;
    let (unique, instanced) = (scene.unique_triangles(), scene.instanced_triangles());
    writeln!(text, "  triangles    {unique} ({instanced} with all instances)")?;
    writeln!(text, "  vertices     {}", counts.vertices)?;
    writeln!(text, "  spheres      {}", counts.spheres)?;
    let undrawn = match report.undrawn_primitives {
        0 => String::new(),
        count => format!(" ({count} primitives of points or lines are not drawn)"),
    };
    writeln!(text, "  meshes       {} of {} parts{undrawn}", scene.meshes.len(), counts.parts)?;
    let hidden = if counts.hidden > 0 { format!(" ({} hidden)", counts.hidden) } else { String::new() };
    writeln!(text, "  instances    {}{hidden}", scene.instances.len())?;
    let (images, pixels) = (scene.images.len(), counts.pixels as f64 / 1e6);
    let size = bytes(counts.image_bytes as u64);
    let missing = match report.missing_images {
        0 => String::new(),
        count => format!(" ({count} missing)"),
    };
    writeln!(
        text,
        "  textures     {} of {images} images{missing}, {pixels:.2} megapixels, {size}",
        scene.textures.len()
    )?;
    match scene.bounds() {
        Some((low, high)) => {
            writeln!(text, "  bounds       {} to {} m", position(scene, low), position(scene, high))?;
            writeln!(text, "  size         {} m", vector((high - low).into()))?;
        }
        None => writeln!(text, "  bounds       nothing to see")?,
    }
    if scene.origin != DVec3::ZERO {
        writeln!(
            text,
            "  origin       {} m: the scene is stored relative to it",
            position(scene, Vec3::ZERO)
        )?;
    }
    writeln!(text, "  environment  {}", environment(scene))?;
    let tables_size = bytes(tables.memory_bytes() as u64);
    writeln!(text, "  tables       {tables_size}, {} light sources to sample", tables.lights.len())?;
    let elapsed = seconds(report.elapsed);
    writeln!(text, "  loaded       in {elapsed}, {} read from files", bytes(report.bytes_read))?;

    if counts.single_sided > 0 {
        let fate = if culls_backs(scene) {
            "left out"
        } else {
            "drawn and block light (--cull-backs leaves them out)"
        };
        let (single, all) = (counts.single_sided, scene.materials.len());
        writeln!(text, "  backs        of {single} of {all} materials, which are single-sided, are {fate}")?;
    }
    Ok(())
}

/// A line for each material, light, camera and note.
fn write_contents(text: &mut String, loaded: &Loaded) -> anyhow::Result<()> {
    let (scene, report) = (&loaded.scene, &loaded.report);
    heading(text, "materials", scene.materials.len())?;
    let width = scene.materials.iter().map(|m| m.name.chars().count()).max().unwrap_or(0).min(32);
    for material in &scene.materials {
        writeln!(text, "  {:<width$}  {}", material.name, material_line(scene, material))?;
    }
    heading(text, "lights", scene.lights.len())?;
    for light in &scene.lights {
        writeln!(text, "  {}: {}", light.name, light_line(scene, light))?;
    }
    heading(text, "cameras", scene.cameras.len())?;
    for camera in &scene.cameras {
        writeln!(text, "  {}: {}", camera.name, camera_line(scene, camera))?;
    }
    heading(text, "load report", report.notes.len())?;
    for note in &report.notes {
        writeln!(text, "  {note}")?;
    }
    Ok(())
}

fn heading(text: &mut String, what: &str, count: usize) -> std::fmt::Result {
    writeln!(text, "{what}: {}", if count == 0 { "none".into() } else { count.to_string() })
}

fn material_line(scene: &Scene, m: &Material) -> String {
    let mut line = format!("{} color {}", model_name(m.model), vector(m.base_color.truncate().into()));
    let mut add = |text: String| {
        line.push_str(", ");
        line.push_str(&text);
    };
    match m.model {
        Model::MetallicRoughness => add(format!("metallic {}, roughness {}", m.metallic, m.roughness)),
        Model::Dielectric => add(format!("ior {}, roughness {}", m.ior, m.roughness)),
        Model::Lambert | Model::Mirror | Model::Unlit | Model::Boundary => {}
    }
    if m.transmission > 0.0 {
        add(format!("transmission {}, ior {}", m.transmission, m.ior));
    }
    if let Some(medium) = &m.medium {
        let (absorption, scattering) = (vector(medium.absorption.into()), vector(medium.scattering.into()));
        add(format!("medium that absorbs {absorption} 1/m and scatters {scattering} 1/m"));
    }
    if m.is_emissive() {
        add(format!("emits {}", vector(m.emission.into())));
    }
    match m.alpha_mode {
        AlphaMode::Opaque => {}
        AlphaMode::Mask(cutoff) => add(format!("alpha mask at {cutoff}")),
        AlphaMode::Blend => add(format!("alpha {} blended", m.base_color.w)),
    }
    if m.checkerboard.is_some() {
        add("checkerboard".into());
    }
    for (slot, name) in textures(scene, m) {
        add(format!("{slot} {name}"));
    }
    line
}

/// The textures of a material: what each is for, and the name of its image or what its graph is made of.
fn textures(scene: &Scene, m: &Material) -> Vec<(&'static str, String)> {
    let slots = [
        ("color-texture", m.base_color_texture),
        ("metallic-roughness-texture", m.metallic_roughness_texture),
        ("transmission-texture", m.transmission_texture),
        ("emission-texture", m.emission_texture),
        ("normal-texture", m.normal_texture),
    ];
    let name = |t: TextureRef| match scene.textures.get(t.texture as usize)? {
        Texture::Image(shown) => Some(scene.images.get(shown.image as usize)?.name.clone()),
        Texture::Graph(graph) => Some(graph.summary()),
    };
    slots.into_iter().filter_map(|(slot, texture)| Some((slot, name(texture?)?))).collect()
}

fn model_name(model: Model) -> &'static str {
    match model {
        Model::MetallicRoughness => "metallic-roughness",
        Model::Lambert => "lambert",
        Model::Dielectric => "dielectric",
        Model::Mirror => "mirror",
        Model::Unlit => "unlit",
        Model::Boundary => "boundary",
    }
}

fn light_line(scene: &Scene, light: &Light) -> String {
    let profile = light.profile.as_ref().map(|photometry| {
        let (table, axis) = (&photometry.profile, vector(photometry.axis.into()));
        format!(", with a profile of {} × {} directions aimed at {axis}", table.rows(), table.columns())
    });
    let mut kind = light.kind;
    let mut line = kind.name().to_owned();
    for (name, parameter) in kind.parameters() {
        line.push_str(&format!(", {} {}", name.to_lowercase(), parameter_text(scene, parameter)));
    }
    line + &profile.unwrap_or_default()
}

fn parameter_text(scene: &Scene, parameter: LightParameter) -> String {
    match parameter {
        LightParameter::Position(p) => position(scene, *p),
        LightParameter::Direction(d) => vector((*d).into()),
        LightParameter::Strength(strength, unit) => format!("{} {unit}", vector((*strength).into())),
        LightParameter::Angle(radians, _) => format!("{:.2}°", radians.to_degrees()),
        LightParameter::Picture(picture) => format!("texture {}", picture.texture),
    }
}

fn camera_line(scene: &Scene, camera: &Camera) -> String {
    let mut line = camera.projection.to_string();
    line.push_str(&format!(
        ", at {} looking at {}",
        position(scene, camera.eye),
        position(scene, camera.target)
    ));
    if camera.lens_radius > 0.0 {
        line.push_str(&format!(", lens {} m, focus {} m", camera.lens_radius, camera.focus_distance));
    }
    match camera.distortion {
        Some(Distortion::BrownConrady { .. }) => line.push_str(", lens by Brown and Conrady"),
        Some(Distortion::Fisheye { .. }) => line.push_str(", fisheye lens"),
        None => {}
    }
    if camera.path.is_some() {
        line.push_str(", moving");
    }
    line
}

fn environment(scene: &Scene) -> String {
    match &scene.environment {
        Environment::Black => "black".into(),
        Environment::Constant(c) => format!("constant {}", vector((*c).into())),
        Environment::Image { image, rotation, intensity } => {
            let name = scene.images.get(*image as usize).map_or("?", |i| i.name.as_str());
            format!("{name}, intensity {intensity}, turned by {:.1}°", rotation.to_degrees())
        }
        Environment::Daylight(daylight) => {
            let (elevation, azimuth) =
                (daylight.sun.elevation.to_degrees(), daylight.sun.azimuth.to_degrees());
            format!(
                "clear sky of turbidity {}, sun at {elevation:.1}°, {azimuth:.1}° from north",
                daylight.turbidity
            )
        }
        Environment::Sky(sky) => {
            let sun = if sky.sun.is_some() { " and sun" } else { "" };
            format!("gradient from {} to {}{sun}", vector(sky.horizon.into()), vector(sky.zenith.into()))
        }
    }
}

/// A position in the world of the scene's file.
fn position(scene: &Scene, position: Vec3) -> String {
    if scene.origin == DVec3::ZERO {
        return vector(position.into());
    }
    let number = |x: f64| {
        let rounded = format!("{x:.3}");
        rounded.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    format!("({})", scene.to_world(position).to_array().map(number).join(" "))
}

/// A position in the world of the scene's file, with all digits.
fn position_json(scene: &Scene, position: Vec3) -> Value {
    if scene.origin == DVec3::ZERO {
        return json!(position.to_array());
    }
    json!(scene.to_world(position).to_array())
}

/// Three numbers with as many digits as tell something.
fn vector(v: [f32; 3]) -> String {
    let number = |x: f32| {
        let rounded = format!("{x:.3}");
        let short = rounded.trim_end_matches('0').trim_end_matches('.');
        // What is small is shown in full rather than as zero.
        if x != 0.0 && (x.abs() < 0.01 || x.abs() >= 1e7) { format!("{x:e}") } else { short.to_owned() }
    };
    format!("({})", v.map(number).join(" "))
}

fn as_json(loaded: &Loaded, tables: &SceneTables) -> Value {
    let (scene, report) = (&loaded.scene, &loaded.report);
    let counts = Counts::of(scene);
    let note = |n: &alhazen::Note| json!({ "severity": n.severity.to_string(), "message": n.message, "count": n.count });
    let image = |i: &alhazen::SceneImage| json!({ "name": i.name, "width": i.width, "height": i.height });
    json!({
        "name": scene.name,
        "unique_triangles": scene.unique_triangles(),
        "instanced_triangles": scene.instanced_triangles(),
        "vertices": counts.vertices,
        "spheres": counts.spheres,
        "meshes": scene.meshes.len(),
        "parts": counts.parts,
        "undrawn_primitives": report.undrawn_primitives,
        "instances": scene.instances.len(),
        "hidden_instances": counts.hidden,
        "bounds": scene.bounds().map(|(low, high)| json!([position_json(scene, low), position_json(scene, high)])),
        "origin": scene.origin.to_array(),
        "environment": environment(scene),
        "images": scene.images.iter().map(image).collect::<Vec<_>>(),
        "image_bytes": counts.image_bytes,
        "missing_images": report.missing_images,
        "single_sided_materials": counts.single_sided,
        "culls_backs": culls_backs(scene),
        "materials": scene.materials.iter().map(|m| material_json(scene, m)).collect::<Vec<_>>(),
        "lights": scene.lights.iter().map(|l| json!({ "name": l.name, "about": light_line(scene, l) })).collect::<Vec<_>>(),
        "light_sources": tables.lights.len(),
        "cameras": scene.cameras.iter().map(|c| camera_json(scene, c)).collect::<Vec<_>>(),
        "table_bytes": tables.memory_bytes(),
        "load_seconds": report.elapsed.as_secs_f64(),
        "bytes_read": report.bytes_read,
        "notes": report.notes.iter().map(note).collect::<Vec<_>>(),
    })
}

fn material_json(scene: &Scene, m: &Material) -> Value {
    let alpha = match m.alpha_mode {
        AlphaMode::Opaque => "opaque",
        AlphaMode::Mask(_) => "mask",
        AlphaMode::Blend => "blend",
    };
    let cutoff = if let AlphaMode::Mask(cutoff) = m.alpha_mode { Some(cutoff) } else { None };
    let textures: serde_json::Map<_, _> =
        textures(scene, m).into_iter().map(|(slot, name)| (slot.to_owned(), name.into())).collect();
    json!({
        "name": m.name,
        "model": model_name(m.model),
        "base_color": m.base_color.to_array(),
        "metallic": m.metallic,
        "roughness": m.roughness,
        "specular": m.specular,
        "ior": m.ior,
        "transmission": m.transmission,
        "thin_walled": m.thin_walled,
        "emission": m.emission.to_array(),
        "alpha_mode": alpha,
        "alpha_cutoff": cutoff,
        "double_sided": m.double_sided,
        "textures": textures,
    })
}

fn camera_json(scene: &Scene, camera: &Camera) -> Value {
    let (fov, height) = match (camera.projection, camera.projection.parameter()) {
        (Projection::Intrinsics { focal, .. }, _) => (Some(2.0 * atan(0.5 / focal.y)), None),
        (_, Some((ProjectionParameter { quantity: Quantity::Angle, .. }, angle))) => (Some(angle), None),
        (_, Some((_, height))) => (None, Some(height)),
        (_, None) => (None, None),
    };
    json!({
        "name": camera.name,
        "projection": camera.projection.name(),
        "fov_degrees": fov.map(f32::to_degrees),
        "height": height,
        "eye": position_json(scene, camera.eye),
        "target": position_json(scene, camera.target),
        "up": camera.up.to_array(),
        "aspect": camera.aspect,
        "lens_radius": camera.lens_radius,
        "focus_distance": camera.focus_distance,
        "moves": camera.path.is_some(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_but_never_hidden() {
        assert_eq!(vector([0.0, 1.5, -20.0]), "(0 1.5 -20)");
        assert_eq!(vector([0.8, 1.0 / 3.0, 1e-5]), "(0.8 0.333 1e-5)");
    }
}
