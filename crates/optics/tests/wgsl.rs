//! The GPU's half of "written once": every module yields WGSL that naga accepts and can translate, and the crate keeps
//! to pure functions with documentation.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Every module and its text, its imports included. A test below keeps the list complete.
fn modules() -> Vec<(&'static str, String)> {
    macro_rules! texts {
        ($($name:ident: $module:path),* $(,)?) => {{
            vec![$((stringify!($name), {
                use $module as module;
                module::WGSL_SOURCE.wgsl_source().expect(stringify!($name))
            })),*]
        }};
    }
    texts! {
        accumulation: optics::accumulation,
        allocation: optics::allocation,
        anisotropic: optics::anisotropic,
        antialiasing: optics::antialiasing,
        bounds: optics::bounds,
        bsdf: optics::bsdf,
        camera: optics::camera,
        closure: optics::closure,
        clusters: optics::clusters,
        color_nodes: optics::color_nodes,
        constants: optics::constants,
        dielectric: optics::dielectric,
        direct_light: optics::direct_light,
        distortion: optics::distortion,
        edge_stops: optics::edge_stops,
        equirect: optics::equirect,
        estimator: optics::estimator,
        falloff: optics::falloff,
        frame: optics::frame,
        fresnel: optics::fresnel,
        ggx: optics::ggx,
        glossy: optics::glossy,
        guiding: optics::guiding,
        history: optics::history,
        image_texture: optics::image_texture,
        interiors: optics::interiors,
        intersect: optics::intersect,
        iridescence: optics::iridescence,
        layered: optics::layered,
        layers: optics::layers,
        light: optics::light,
        light_profile: optics::light_profile,
        light_tree: optics::light_tree,
        lobes: optics::lobes,
        material: optics::material,
        math: optics::math,
        medium: optics::medium,
        mis: optics::mis,
        motion: optics::motion,
        moving_camera: optics::moving_camera,
        moving_light: optics::moving_light,
        noise: optics::noise,
        offset: optics::offset,
        oren_nayar: optics::oren_nayar,
        path: optics::path,
        pattern: optics::pattern,
        patterns: optics::patterns,
        phong: optics::phong,
        photons: optics::photons,
        plain: optics::plain,
        portal: optics::portal,
        random: optics::random,
        reprojection: optics::reprojection,
        reservoir: optics::reservoir,
        rounds: optics::rounds,
        scatter: optics::scatter,
        shaft: optics::shaft,
        shape: optics::shape,
        sheen: optics::sheen,
        shutter: optics::shutter,
        signal: optics::signal,
        sky: optics::sky,
        spatial_filter: optics::spatial_filter,
        spherical_rectangle: optics::spherical_rectangle,
        spherical_triangle: optics::spherical_triangle,
        terminator: optics::terminator,
        texture_node: optics::texture_node,
        texture_point: optics::texture_point,
        tonemap: optics::tonemap,
        vertex: optics::vertex,
        volume: optics::volume,
        voronoi: optics::voronoi,
        warp: optics::warp,
        wide_projection: optics::wide_projection,
    }
}

struct Valid {
    module: naga::Module,
    info: naga::valid::ModuleInfo,
}

/// Parses and validates WGSL without any optional capability.
fn validate(name: &str, text: &str) -> Valid {
    let module = naga::front::wgsl::parse_str(text)
        .unwrap_or_else(|e| panic!("{name} does not parse: {}", e.emit_to_string(text)));
    let info =
        // WGSL without extensions. What old versions of OpenGL lack of it, `unpack2x16float`, naga counts as a capability.
        naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32,
        )
            .validate(&module)
            .unwrap_or_else(|e| panic!("{name} is not valid: {}", e.emit_to_string(text)));
    Valid { module, info }
}

fn function_names(module: &naga::Module) -> BTreeSet<String> {
    module.functions.iter().filter_map(|(_, f)| f.name.clone()).collect()
}

/// All source files of the crate with their text.
fn sources() -> Vec<(PathBuf, String)> {
    fn walk(folder: &Path, found: &mut Vec<(PathBuf, String)>) {
        for entry in std::fs::read_dir(folder).expect("source folder") {
            let path = entry.expect("entry").path();
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = std::fs::read_to_string(&path).expect("source file");
                found.push((path, text));
            }
        }
    }
    let mut found = Vec::new();
    walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut found);
    found
}

/// Names of the modules that carry the attribute, and their text up to their own tests.
fn wgsl_modules(text: &str) -> Vec<(String, &str)> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(at) = rest.find("\n#[wgsl]\n") {
        rest = &rest[at + "\n#[wgsl]\n".len()..];
        let body = &rest[..rest.find("\n}\n").expect("end of the module")];
        let header = body.lines().find(|l| !l.starts_with("#[")).expect("module");
        let name = header.trim_start_matches("pub ").trim_start_matches("mod ").trim_end_matches(" {");
        found.push((name.to_owned(), body));
    }
    found
}

#[test]
fn every_module_is_valid() {
    for (name, text) in modules() {
        validate(name, &text);
    }
}

#[test]
fn no_module_is_forgotten() {
    let listed: BTreeSet<String> = modules().iter().map(|(name, _)| (*name).to_owned()).collect();
    let mut present = BTreeSet::new();
    for (_, text) in sources() {
        present.extend(wgsl_modules(&text).into_iter().map(|(name, _)| name));
    }
    present.remove("everything");
    assert!(present.len() >= 20, "found only {present:?}");
    assert_eq!(listed, present, "modules in this test and in the source");
    let found: BTreeSet<String> = optics::wgsl::modules().keys().map(|name| (*name).to_owned()).collect();
    assert_eq!(found, present, "modules that src/wgsl.rs finds and the source");
}

#[test]
fn the_complete_text_has_everything_once() {
    let whole = validate("all", &optics::wgsl::all());
    let names = function_names(&whole.module);
    for (name, text) in modules() {
        for function in function_names(&validate(name, &text).module) {
            assert!(names.contains(&function), "{function} of {name} is missing");
        }
    }
    // naga refuses second definitions, so a function that is there is there once.
    assert!(names.len() > 100, "{} functions", names.len());
}

/// Shaders are made of single modules, which have to say the same as the whole.
#[test]
fn modules_with_their_imports_make_the_complete_text() {
    fn add(name: &'static str, done: &mut BTreeSet<&'static str>, text: &mut String) {
        if done.insert(name) {
            let module = optics::wgsl::module(name).unwrap_or_else(|| panic!("no module {name}"));
            module.imports.iter().for_each(|import| add(import, done, text));
            text.push_str(&module.text);
        }
    }
    let (mut done, mut text) = (BTreeSet::new(), String::new());
    optics::wgsl::modules().keys().for_each(|name| add(name, &mut done, &mut text));
    let lines = |text: &str| {
        let mut lines: Vec<_> = text.lines().map(str::to_owned).collect();
        lines.sort();
        lines
    };
    assert_eq!(lines(&text), lines(&optics::wgsl::all()));
    assert!(optics::wgsl::module("nothing").is_none());
}

/// What drivers are given: SPIR-V for Vulkan, HLSL for Direct3D 12, MSL for Metal.
#[test]
fn the_complete_text_translates_for_every_driver() {
    let Valid { module, info } = validate("all", &optics::wgsl::all());

    let options = naga::back::spv::Options { lang_version: (1, 4), ..Default::default() };
    let words = naga::back::spv::write_vec(&module, &info, &options, None).expect("SPIR-V");
    assert!(words.len() > 1000);

    let mut hlsl = String::new();
    let options = naga::back::hlsl::Options::default();
    let pipeline = naga::back::hlsl::PipelineOptions::default();
    naga::back::hlsl::Writer::new(&mut hlsl, &options, &pipeline).write(&module, &info, None).expect("HLSL");
    assert!(hlsl.contains("ggx_d"));

    let (msl, _) = naga::back::msl::write_string(
        &module,
        &info,
        &naga::back::msl::Options { lang_version: (2, 4), ..Default::default() },
        &naga::back::msl::PipelineOptions::default(),
    )
    .expect("MSL");
    assert!(msl.contains("ggx_d"));
}

#[test]
#[should_panic(expected = "does not parse")]
fn broken_text_is_rejected() {
    let text = optics::wgsl::all().replacen("fn ggx_d(", "fn ggx_d(oops ", 1);
    validate("broken", &text);
}

#[test]
#[should_panic(expected = "ggx_d")]
fn a_wrong_type_is_rejected() {
    let text = format!("{}\nfn wrong() -> f32 {{ return ggx_d(1.0, 2.0); }}", optics::wgsl::all());
    validate("wrong", &text);
}

/// Every function, constant, structure and field says what it is. (The lint cannot: the attribute makes a static in
/// each module that nobody can document.)
#[test]
fn everything_public_is_documented() {
    let mut missing = Vec::new();
    let mut seen = 0;
    for (path, text) in sources() {
        let lines: Vec<&str> = text.split("#[cfg(test)]").next().unwrap_or_default().lines().collect();
        for (i, line) in lines.iter().enumerate() {
            let item = line.trim_start();
            let is_module = item.starts_with("pub mod ");
            if !item.starts_with("pub ") || item.starts_with("pub use ") || is_module {
                continue;
            }
            seen += 1;
            let above = lines[..i].iter().rev().map(|l| l.trim_start()).find(|l| !l.starts_with("#["));
            if !above.is_some_and(|l| l.starts_with("///")) {
                missing.push(format!("{}:{}: {item}", path.display(), i + 1));
            }
        }
    }
    assert!(seen > 200, "saw only {seen} items");
    assert!(missing.is_empty(), "without documentation:\n{}", missing.join("\n"));
}

/// The modules are pure functions of numbers: who fetches data is somebody else.
#[test]
fn modules_touch_no_data_and_no_device() {
    const FORBIDDEN: [&str; 16] = [
        "std::sync",
        "std::thread",
        "static ",
        "unsafe",
        "texture!",
        "textureSample",
        "texture_1d",
        "texture_2d",
        "texture_3d",
        "texture_cube",
        "texture_depth",
        "sampler!",
        "storage!",
        "uniform!",
        "workgroup!",
        "#[compute]",
    ];
    for (path, text) in sources() {
        for (name, body) in wgsl_modules(&text) {
            for word in FORBIDDEN {
                let code = body.lines().filter(|l| !l.trim_start().starts_with("//"));
                let found = code.clone().find(|l| l.contains(word));
                assert!(found.is_none(), "{} (module {name}) has {word:?}: {found:?}", path.display());
            }
        }
    }
    for (name, text) in modules() {
        let module = validate(name, &text).module;
        assert!(module.global_variables.is_empty() && module.entry_points.is_empty(), "{name} has bindings");
    }
}
