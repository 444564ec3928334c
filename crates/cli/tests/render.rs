//! `alhazen render` makes the pictures that it is asked for.

mod common;

use alhazen::Image;
use common::{fail, folder_with_triangle, names, run, succeed};
use film::{ExrFile, ExrSamples};
use std::path::Path;

fn colour(path: &Path) -> Image {
    ExrFile::read(path).unwrap().colour().unwrap()
}

#[test]
fn the_default_picture_at_a_small_size() {
    let folder = tempfile::tempdir().unwrap();
    let ran = succeed(folder.path(), "render --width 64 --height 36 --spp 4");
    assert_eq!(names(folder.path()), ["render.png"]);
    let image = Image::open(folder.path().join("render.png")).unwrap();
    assert_eq!((image.width(), image.height()), (64, 36));
    let mean = image.mean();
    assert!(mean.iter().all(|m| (0.05..0.95).contains(m)), "{mean:?}");
    assert!(
        ran.stderr.contains("render.png: 64×36, 4 spp") && ran.stderr.contains("samples/s"),
        "{}",
        ran.stderr
    );
    assert_eq!(ran.stdout, "");
}

#[test]
fn every_built_in_scene_renders() {
    let folder = tempfile::tempdir().unwrap();
    for scene in alhazen::builtin::list() {
        let arguments = format!("render {} -q --width 24 --height 16 --spp 2 -o {0}.exr", scene.name);
        let ran = succeed(folder.path(), &arguments);
        assert_eq!((ran.stdout.as_str(), ran.stderr.as_str()), ("", ""), "{arguments}");
        let image = colour(&folder.path().join(format!("{}.exr", scene.name)));
        assert!(image.mean().iter().sum::<f64>() > 0.01, "{} is black", scene.name);
        assert!(image.data().iter().all(|v| v.is_finite()));
    }
}

#[test]
fn every_format_shows_the_same_picture() {
    let folder = folder_with_triangle();
    let view = "--eye 0,0,3 --target 0,0,0 --environment 0.5,0.5,0.5 --width 32 --height 24 --spp 4";
    succeed(folder.path(), &format!("render triangle.obj {view} -o a.png -o a.exr -o a.HDR"));
    assert_eq!(names(folder.path()), ["a.HDR", "a.exr", "a.png", "triangle.mtl", "triangle.obj"]);
    let [png, exr, hdr] = ["a.png", "a.exr", "a.HDR"].map(|n| Image::open(folder.path().join(n)).unwrap());
    for (other, allowed) in [(png, 0.01), (hdr, 0.01)] {
        assert_eq!((other.width(), other.height()), (32, 24));
        let pairs = exr.data().iter().zip(other.data());
        assert!(
            pairs.clone().all(|(e, o)| (e - o).abs() <= allowed),
            "{:?}",
            pairs.take(9).collect::<Vec<_>>()
        );
    }
    let [red, green, _] = exr.rgb(16, 12);
    assert!(red > 3.0 * green, "the triangle is red: {red} {green}");
}

#[test]
fn exr_files_have_layers_and_settings() {
    let folder = folder_with_triangle();
    let aovs =
        "depth,position,normal,geometric-normal,uv,albedo,material,instance,primitive,samples,standard-error";
    let view = "--eye 0,0,3 --target 0,0,0 --environment 1,1,1 --width 16 --height 16 --spp 4 --seed 7";
    succeed(folder.path(), &format!("render triangle.obj -q {view} --aov {aovs} -o a.exr"));
    let file = ExrFile::read(&folder.path().join("a.exr")).unwrap();
    for layer in aovs.split(',') {
        assert!(file.layer(layer).is_some(), "no {layer} among {:?}", file.channels.iter().map(|c| &c.name));
    }
    let depth = file.layer("depth").unwrap();
    assert!((depth.pixel(8, 8)[0] - 3.0).abs() < 0.02, "{:?}", depth.pixel(8, 8));
    let setting =
        |key: &str| file.metadata.get(key).unwrap_or_else(|| panic!("no {key} in {:?}", file.metadata));
    assert_eq!(setting("seed"), "7");
    assert_eq!(setting("spp"), "4");
    assert_eq!(setting("scene"), "triangle.obj");
    assert_eq!(setting("clamp"), "none");
    assert!(setting("software").starts_with("Alhazen "));
    assert!(setting("material_names").contains("red"));
    ["camera", "integrator", "sampler", "tone_mapping"]
        .iter()
        .for_each(|key| assert!(!setting(key).is_empty()));
}

#[test]
fn mattes_cover_what_is_seen() {
    let folder = tempfile::tempdir().unwrap();
    let picture = "render cornell -q --width 20 --height 20 --spp 8 --integrator aov \
                   --aov cryptomatte-object,cryptomatte-material,material";
    succeed(folder.path(), &format!("{picture} -o a.exr"));
    let file = ExrFile::read(&folder.path().join("a.exr")).unwrap();
    let values = |name: &str| {
        let channel = file.channels.iter().find(|c| c.name == name);
        match &channel.unwrap_or_else(|| panic!("no {name}")).samples {
            ExrSamples::Float(values) => values.clone(),
            other => panic!("{name} is {other:?}"),
        }
    };
    let manifest =
        file.attributes.iter().find(|(key, value)| key.ends_with("/name") && *value == "crypto_material");
    let key = manifest.unwrap().0.replace("/name", "/manifest");
    let manifest: serde_json::Value = serde_json::from_str(&file.attributes[&key]).unwrap();
    let names: Vec<String> = serde_json::from_str(&file.metadata["material_names"]).unwrap();

    // The box is closed but for its front: behind every pixel there is something, and shares are whole samples.
    let coverages = ["00.G", "00.A", "01.G", "01.A", "02.G", "02.A"];
    let coverages = coverages.map(|c| values(&format!("crypto_material{c}")));
    let first_id = values("crypto_material00.R");
    let first_hits = file.channels.iter().find(|c| c.name == "material.I").unwrap();
    let ExrSamples::Uint(first_hits) = &first_hits.samples else { panic!("ids") };
    let mut edges = 0;
    for pixel in 0..400 {
        let shares = coverages.each_ref().map(|c| c[pixel]);
        assert!(shares.is_sorted_by(|a, b| a >= b) && shares.iter().sum::<f32>() <= 1.0, "{shares:?}");
        assert!(shares.iter().all(|share| (share * 8.0).fract() == 0.0), "{shares:?}");
        if shares[0] == 1.0 {
            let hex = format!("{:08x}", first_id[pixel].to_bits());
            assert_eq!(manifest[&names[first_hits[pixel] as usize]], hex.as_str());
        }
        edges += usize::from(shares[1] > 0.0);
    }
    assert!((10..200).contains(&edges), "{edges} pixels show several materials");

    for (i, tile) in
        ["--tile 1/2", "--tile 2/2 --sample-range 0..3", "--tile 2/2 --sample-range 3..8"].iter().enumerate()
    {
        succeed(folder.path(), &format!("{picture} {tile} --part -o part-{i}.exr"));
    }
    succeed(folder.path(), "merge part-2.exr part-0.exr part-1.exr -o merged.exr");
    let merged = ExrFile::read(&folder.path().join("merged.exr")).unwrap();
    assert!(merged.channels == file.channels && merged.attributes == file.attributes);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let folder = tempfile::tempdir().unwrap();
    for threads in [1, 2, 5] {
        let arguments =
            "render cornell -q --width 48 --height 48 --spp 8 --aov depth,albedo,material,standard-error";
        succeed(folder.path(), &format!("{arguments} --threads {threads} -o {threads}.exr"));
    }
    let [one, two, five] =
        ["1.exr", "2.exr", "5.exr"].map(|n| ExrFile::read(&folder.path().join(n)).unwrap());
    assert_eq!(one.channels, two.channels);
    assert_eq!(one.channels, five.channels);
}

#[test]
fn crops_fit_together_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "render three-spheres -q --width 40 --height 30 --spp 4";
    succeed(folder.path(), &format!("{arguments} -o whole.exr -o whole.png"));
    succeed(folder.path(), &format!("{arguments} --crop 0,0,17,30 -o left.exr -o left.png"));
    succeed(folder.path(), &format!("{arguments} --crop 17,0,23,30 -o right.exr -o right.png"));
    for ending in ["exr", "png"] {
        let open = |name: &str| Image::open(folder.path().join(format!("{name}.{ending}"))).unwrap();
        let whole = open("whole");
        // An .exr file says where in the whole picture its part is, and is opened as the whole.
        let part = |name: &str, x: u32, width: u32| match open(name) {
            image if ending == "exr" => image.crop(x, 0, width, 30),
            image => image,
        };
        assert!(whole.crop(0, 0, 17, 30).data() == part("left", 0, 17).data(), "{ending}");
        assert!(whole.crop(17, 0, 23, 30).data() == part("right", 17, 23).data(), "{ending}");
    }
    let right = ExrFile::read(&folder.path().join("right.exr")).unwrap();
    assert_eq!((right.width, right.height, right.x, right.y), (40, 30, 17, 0));
}

#[test]
fn another_seed_makes_other_noise() {
    let folder = tempfile::tempdir().unwrap();
    for seed in [0, 1] {
        succeed(
            folder.path(),
            &format!("render cornell -q --width 16 --height 16 --spp 2 --seed {seed} -o {seed}.exr"),
        );
    }
    assert_ne!(colour(&folder.path().join("0.exr")), colour(&folder.path().join("1.exr")));
}

#[test]
fn frames_are_numbered_and_the_camera_moves() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        "render three-spheres --quiet --width 16 --height 12 --spp 1 --frames 2..4 --fps 2 --json -o f.png";
    let ran = succeed(folder.path(), arguments);
    assert_eq!(names(folder.path()), ["f.0002.png", "f.0003.png"]);
    let lines: Vec<serde_json::Value> =
        ran.stdout.lines().map(|l| serde_json::from_str(l).expect("one JSON value a line")).collect();
    assert_eq!(lines.len(), 2);
    assert_eq!(lines[1]["output"][0], "f.0003.png");
    let [a, b] = ["f.0002.png", "f.0003.png"].map(|n| Image::open(folder.path().join(n)).unwrap());
    assert_ne!(a, b);
}

#[test]
fn json_says_what_was_done() {
    let folder = tempfile::tempdir().unwrap();
    let ran = succeed(folder.path(), "render cornell --json --width 20 --height 10 --spp 3 -o a.png");
    let json = ran.json();
    assert_eq!((json["width"].as_u64(), json["height"].as_u64()), (Some(20), Some(10)));
    assert_eq!((json["spp"].as_u64(), json["samples"].as_u64()), (Some(3), Some(600)));
    assert_eq!(json["backend"], "cpu");
    assert_eq!(json["invalid_samples"], 0);
    assert!(json["rays"].as_u64() > Some(600) && json["render_seconds"].as_f64() > Some(0.0));
}

#[test]
fn time_limits_end_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let ran = succeed(folder.path(), "render cornell -q --json --width 16 --height 16 --time 0.2s -o a.png");
    let json = ran.json();
    let (spp, seconds) = (json["spp"].as_u64().unwrap(), json["render_seconds"].as_f64().unwrap());
    assert!((1..65_536).contains(&spp), "{spp} samples");
    // Generous: the machine may be busy.
    assert!(seconds < 20.0, "{seconds} s");
}

#[test]
fn noise_limits_end_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let run = |noise: &str| {
        let arguments = format!("render cornell -q --json --width 16 --height 16 --noise {noise} -o a.png");
        let json = succeed(folder.path(), &arguments).json();
        (json["spp"].as_u64().unwrap(), json["noise"].as_f64().unwrap())
    };
    let (coarse_spp, coarse) = run("0.2");
    let (fine_spp, fine) = run("0.05");
    assert!(coarse <= 0.2 && fine <= 0.05, "{coarse} {fine}");
    assert!(coarse_spp < fine_spp && fine_spp < 65_536, "{coarse_spp} {fine_spp}");
}

#[test]
fn parameters_reach_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    for count in [1, 3] {
        let arguments =
            format!("render material-grid -q -p columns={count} -p rows=1 --width 32 --spp 1 -o {count}.exr");
        succeed(folder.path(), &arguments);
    }
    assert_ne!(colour(&folder.path().join("1.exr")), colour(&folder.path().join("3.exr")));
}

#[test]
fn integrators_can_be_chosen() {
    let folder = tempfile::tempdir().unwrap();
    for integrator in ["path", "direct", "hybrid", "aov", "ao --ambient-distance 0.5 --ambient-samples 2"] {
        let arguments =
            format!("render cornell -q --json --integrator {integrator} --width 16 --spp 2 -o a.exr");
        let name = integrator.split(' ').next();
        assert_eq!(succeed(folder.path(), &arguments).json()["integrator"].as_str(), name);
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_what_is_there() {
    use std::process::{Command, Stdio};
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_alhazen"));
    let arguments = "render cornell -q --width 32 --height 32 --spp 1000000000 -o a.png";
    command.args(arguments.split(' ')).current_dir(folder.path()).stderr(Stdio::piped());
    let child = command.spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(1500));
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("stopped before the end") && !stderr.contains("panicked"), "{stderr}");
    assert_eq!(names(folder.path()), ["a.png"]);
}

#[test]
fn a_failed_render_leaves_an_existing_picture_alone() {
    let folder = folder_with_triangle();
    let picture = folder.path().join("a.png");
    std::fs::write(&picture, "precious").unwrap();
    std::fs::write(folder.path().join("bad.obj"), "v 0 0 0\nf 1 2 9\nf x\n").unwrap();
    let failures = ["render bad.gltf -o a.png", "render triangle.obj --crop 0,0,9999,1 -o a.png -q"];
    for arguments in failures {
        assert_ne!(run(folder.path(), arguments).code, Some(0), "{arguments}");
        assert_eq!(std::fs::read(&picture).unwrap(), b"precious", "{arguments}");
    }
    succeed(folder.path(), "render triangle.obj -q --width 8 --height 8 --spp 1 -o a.png");
    assert!(std::fs::read(&picture).unwrap().starts_with(b"\x89PNG"));
    assert_eq!(names(folder.path()), ["a.png", "bad.obj", "triangle.mtl", "triangle.obj"]);
}

#[test]
fn models_without_light_get_a_sky() {
    let folder = folder_with_triangle();
    let arguments = "render triangle.obj --width 8 --height 8 --spp 1 -o a.exr";
    let ran = succeed(folder.path(), arguments);
    assert!(ran.stderr.contains("a sky was added"), "{}", ran.stderr);
    assert!(colour(&folder.path().join("a.exr")).mean()[2] > 0.1);
    succeed(folder.path(), &format!("{arguments} --environment 0,0,0"));
    assert_eq!(colour(&folder.path().join("a.exr")).mean(), [0.0; 3]);
}

#[test]
fn adaptive_pictures_have_an_uneven_number_of_samples_and_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "render cornell -q --json --width 24 --height 24 --spp 48 --sampling adaptive --min-spp 8 \
                     --aov samples -o a.exr";
    let json = succeed(folder.path(), arguments).json();
    let samples = json["samples"].as_u64().unwrap();
    assert!((24 * 24 * 40..24 * 24 * 56).contains(&samples), "{samples}");
    let file = ExrFile::read(&folder.path().join("a.exr")).unwrap();
    assert_eq!(file.metadata["sampling"], "adaptive");
    let number = |key: &str| file.metadata[key].parse::<u64>().unwrap();
    assert!(number("least_samples") >= 8 && number("most_samples") > 64, "{:?}", file.metadata);
    let counts = file.layer("samples").unwrap();
    assert_eq!(counts.data().iter().map(|n| *n as u64).sum::<u64>(), samples);
    fail(
        folder.path(),
        "render cornell --sampling adaptive --tile 1/2 -o b.exr",
        "--tile and --sampling adaptive",
    );
}

#[test]
fn denoised_pictures_keep_the_noisy_one_and_name_the_filter() {
    let folder = tempfile::tempdir().unwrap();
    succeed(folder.path(), "render cornell -q --width 96 --height 96 --spp 8 --denoise -o a.exr");
    succeed(folder.path(), "render cornell -q --width 96 --height 96 --spp 128 --seed 9 -o truth.exr");
    let file = ExrFile::read(&folder.path().join("a.exr")).unwrap();
    assert!(file.metadata["denoiser"].contains("Alhazen"), "{:?}", file.metadata);
    let truth = colour(&folder.path().join("truth.exr"));
    let error = |image: &Image| film::metrics::rel_mse(&truth, image).unwrap();
    let (noisy, denoised) = (error(&file.layer("noisy").unwrap()), error(&file.colour().unwrap()));
    assert!(denoised < noisy / 2.0, "{noisy} became {denoised}");
    fail(folder.path(), "render cornell --denoise --tile 1/2 -o b.exr", "cannot be used with");
}

/// What desktops call for a preview of a file: its options have to exist.
#[test]
fn the_thumbnailer_makes_a_picture() {
    let folder = folder_with_triangle();
    let entry =
        testkit::repository_root().join("packaging/desktop/io.github.alhazen_render.alhazen.thumbnailer");
    let text = std::fs::read_to_string(entry).expect("readable");
    let command = text.lines().find_map(|line| line.strip_prefix("Exec=alhazen ")).expect("a command");
    let arguments = command.replace("%s", "32").replace("%o", "preview.png").replace("%i", "triangle.obj");
    succeed(folder.path(), &arguments.replace("--time 3s", "--time 1s"));
    assert_eq!(Image::open(folder.path().join("preview.png")).unwrap().width(), 32);
}

/// A studio lights a model more than a night does, and from other sides than a sky.
#[test]
fn ready_made_environments_light_a_model() {
    let folder = folder_with_triangle();
    let means = ["studio", "sky", "night"].map(|name| {
        let arguments = format!(
            "render triangle.obj -q --backend cpu --width 24 --height 16 --spp 8 --environment {name} -o {name}.exr"
        );
        succeed(folder.path(), &arguments);
        let mean = colour(&folder.path().join(format!("{name}.exr"))).mean();
        mean.iter().sum::<f64>() / mean.len() as f64
    });
    assert!(means[0] > 2.0 * means[2] && means[1] > 2.0 * means[2] && means[2] > 1e-3, "{means:?}");
    assert!((means[0] - means[1]).abs() > 1e-3, "{means:?}");
    // A file of that name comes first, and this is none.
    std::fs::write(folder.path().join("sky"), "no picture").unwrap();
    fail(folder.path(), "render triangle.obj -q --environment sky -o a.png", "sky");
}

/// The growing picture and the finished one, with its layers, arrive; where nobody listens, nothing is rendered.
#[test]
fn a_tev_is_shown_the_picture() {
    let folder = folder_with_triangle();
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let thread = std::thread::spawn(move || {
        let mut sent = Vec::new();
        std::io::Read::read_to_end(&mut listener.accept().unwrap().0, &mut sent).unwrap();
        sent
    });
    let picture = "render triangle.obj -q --backend cpu --width 24 --height 16 --spp 2 --aov depth -o a.exr";
    succeed(folder.path(), &format!("{picture} --tev {address}"));
    let sent = thread.join().unwrap();
    let length = |at: usize| u32::from_le_bytes(sent[at..at + 4].try_into().unwrap()) as usize;
    // Room is made for a picture, and its pixels come.
    let second = length(0);
    assert_eq!((sent[4], sent[second + 4], second + length(second)), (4, 6, sent.len()));
    let text = String::from_utf8_lossy(&sent);
    assert!(text.contains("alhazen: triangle.obj\0") && text.contains("depth."), "{text}");
    let values = sent[sent.len() - 4 * 24 * 16..].chunks_exact(4);
    let values: Vec<f32> = values.map(|v| f32::from_le_bytes(v.try_into().unwrap())).collect();
    let file = ExrFile::read(&folder.path().join("a.exr")).unwrap();
    let is_same = |samples: &ExrSamples| matches!(samples, ExrSamples::Float(stored) if *stored == values);
    assert!(file.channels.iter().any(|channel| is_same(&channel.samples)), "not the values of the file");
    let ran = fail(folder.path(), &format!("{picture} --tev {address}"), "no tev listens");
    assert_eq!(ran.code, Some(6));
}
