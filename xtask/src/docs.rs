//! `cargo xtask docs`: figures, tables and pictures that are made from the code.

use crate::shell::{cargo, release_binary, root, run as run_command};
use crate::{display, learn, tables, test};
use anyhow::Context;
use std::process::{Child, Command, Stdio};

/// Size of the viewer's window in the pictures.
const WINDOW: &str = "1280x800";

/// Write the figures, tables and pictures of docs/ that are made from the code and from docs/data.
#[derive(Debug, clap::Args)]
pub struct DocsArgs {
    /// Write only the tables of measurements, from the numbers in docs/data. Nothing is built.
    #[arg(long)]
    tables: bool,
}

/// Writes the tables and figures, which tests compare with their sources, and the pictures.
pub fn run(args: &DocsArgs) -> anyhow::Result<()> {
    tables::update()?;
    if args.tables {
        return Ok(());
    }
    for (package, test) in [("gpu", "shader_binding_table"), ("scene", "formats_page")] {
        let mut command = cargo(&["test", "--package", package, "--test", test]);
        run_command(command.env("ALHAZEN_UPDATE_DOCS", "1"))?;
    }
    realtime()?;
    volumes()?;
    motion_blur()?;
    caustics()?;
    subdivision()?;
    explained_path()?;
    learn::pictures()?;
    denoising()?;
    viewer()
}

/// Crops of noisy, denoised and converged pictures. Where Open Image Denoise is not named, they stay as they are.
fn denoising() -> anyhow::Result<()> {
    if std::env::var_os("ALHAZEN_OIDN").is_none() {
        println!(
            "the pictures of docs/denoising.md stay: ALHAZEN_OIDN does not say where Open Image Denoise is"
        );
        return Ok(());
    }
    let mut command = Command::new(release_binary()?);
    command.current_dir(root()).args(["bench", "denoise", "atrium", "glass", "cornell", "--backend", "cpu"]);
    command.args(["--width", "384", "--height", "216", "--spp", "8", "--seeds", "1"]);
    command.args(["--reference-spp", "1024", "--denoiser", "network,oidn", "--crops", "docs/images"]);
    command.arg("--report").arg(std::env::temp_dir().join("alhazen-docs-denoising"));
    run_command(&mut command)
}

/// Pictures of the real-time path tracer, on whatever GPU or software driver there is.
fn realtime() -> anyhow::Result<()> {
    let pictures: [(&str, &[&str]); 4] = [
        ("raw", &["--no-filter", "--spp", "1"]),
        ("filtered", &["--spp", "16"]),
        ("noise", &["--frame-samples", "4..16", "--spp", "4", "--show", "blurred-noise"]),
        ("samples", &["--frame-samples", "4..16", "--spp", "4", "--show", "samples"]),
    ];
    let (variables, binary) = (test::driver(), release_binary()?);
    for (name, arguments) in pictures {
        let mut command = Command::new(&binary);
        command.args(["render", "cornell", "--integrator", "realtime", "--backend", "gpu", "--quiet"]);
        command.args(["--width", "256", "--height", "256"]).args(arguments);
        command.arg("--output").arg(root().join(format!("docs/images/realtime-{name}.png")));
        command.envs(variables.iter().map(|(name, value)| (name, value)));
        run_command(&mut command)?;
    }
    Ok(())
}

/// The picture of media.
fn volumes() -> anyhow::Result<()> {
    let mut command = Command::new(release_binary()?);
    command.current_dir(root()).args([
        "render",
        "docs/scenes/volumes.toml",
        "--backend",
        "cpu",
        "--spp",
        "200",
    ]);
    command.args(["--denoise", "--width", "480", "--height", "270", "--output", "docs/images/volumes.png"]);
    run_command(&mut command)
}

/// The picture of things that move.
fn motion_blur() -> anyhow::Result<()> {
    let mut command = Command::new(release_binary()?);
    command.current_dir(root()).args(["render", "docs/scenes/motion-blur.toml", "--backend", "cpu"]);
    command.args(["--spp", "200", "--denoise", "--width", "480", "--height", "270"]);
    run_command(command.args(["--output", "docs/images/motion-blur.png"]))
}

/// Light by mirrors and through glass, found by paths alone and with photons, in about the same time.
fn caustics() -> anyhow::Result<()> {
    for (scene, photons) in [("ring", "56"), ("pool", "32")] {
        for (technique, switch, spp) in [("path", "off", "160"), ("photons", "on", photons)] {
            let mut command = Command::new(release_binary()?);
            command.current_dir(root()).args([
                "render",
                &format!("docs/scenes/{scene}.toml"),
                "--backend",
                "cpu",
            ]);
            command.args(["--caustics", switch, "--spp", spp, "--width", "400", "--height", "225"]);
            command.args(["--output", &format!("docs/images/caustics-{scene}-{technique}.png")]);
            run_command(&mut command)?;
        }
    }
    Ok(())
}

/// Subdivision surfaces and displacement.
fn subdivision() -> anyhow::Result<()> {
    for name in ["surfaces", "displacement"] {
        let mut command = Command::new(release_binary()?);
        let scene = format!("docs/scenes/subdivision-{name}.toml");
        command.current_dir(root()).args(["render", &scene, "--backend", "cpu", "--spp", "200", "--denoise"]);
        command.args(["--width", "480", "--height", "180", "--quiet"]);
        command.args(["--output", &format!("docs/images/subdivision-{name}.png")]);
        run_command(&mut command)?;
    }
    Ok(())
}

/// A path drawn over its picture.
fn explained_path() -> anyhow::Result<()> {
    let mut command = Command::new(release_binary()?);
    command.current_dir(root()).args(["explain", "cornell", "--pixel", "150,380", "--quiet"]);
    command.args(["--draw", "docs/images/explain-cornell.png"]);
    run_command(&mut command)
}

/// Pictures of the viewer's window, on a display without a screen.
fn viewer() -> anyhow::Result<()> {
    let mut variables = test::driver();
    test::merge(&mut variables, display::prepare());
    let display = Display::start(&variables)?;
    let images = root().join("docs/images");
    let image = |name: &str| images.join(name).display().to_string();
    let script = format!(
        "wait 64\ntab Render\nframes 3\nscreenshot {}\ntab Objects\nselect 0.5 0.45\nframes 60\nwait 64\nscreenshot {}\n\
         command Keep the picture as a snapshot\nwait 128\ntab Image\nframes 60\n\
         command Compare with the current picture\nframes 90\nscreenshot {}\n\
         command End the comparison\ntab Speed\norbit 4\nwait 64\nscreenshot {}\n",
        image("viewer.png"),
        image("viewer-objects.png"),
        image("viewer-image.png"),
        image("viewer-speed.png")
    );
    window(&display, &variables, &["material-grid", "--backend", "cpu"], &script)?;
    let frames = format!(
        "integrator realtime\nspp 32\nwait 32\ntab Render\nframes 3\nscreenshot {}\n",
        image("viewer-realtime.png")
    );
    let arguments = ["cornell", "--backend", "gpu", "--width", "480", "--height", "360"];
    window(&display, &variables, &arguments, &frames)
}

/// Runs a script in the viewer's window.
fn window(
    display: &Display,
    variables: &crate::vulkan::Variables,
    arguments: &[&str],
    script: &str,
) -> anyhow::Result<()> {
    let path = std::env::temp_dir().join(format!("alhazen-docs-{}.txt", std::process::id()));
    std::fs::write(&path, script).with_context(|| format!("cannot write {}", path.display()))?;
    let mut command = Command::new(release_binary()?);
    command.arg("view").args(arguments).args(["--smoke", "3", "--window", WINDOW]);
    command.arg("--smoke-script").arg(&path).env("DISPLAY", &display.name).env_remove("WAYLAND_DISPLAY");
    command.envs(variables.iter().map(|(name, value)| (name, value)));
    let result = run_command(&mut command);
    let _ = std::fs::remove_file(&path);
    result
}

/// A display without a screen.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    fn start(variables: &crate::vulkan::Variables) -> anyhow::Result<Self> {
        let program = variables.iter().find(|(name, _)| name == "ALHAZEN_XVFB").map_or("Xvfb", |(_, v)| v);
        let mut command = Command::new(program);
        command.args(["-displayfd", "1", "-screen", "0", "1400x900x24", "-nolisten", "tcp"]);
        let mut server =
            command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().context("cannot start Xvfb")?;
        let out = server.stdout.take().context("Xvfb has no output")?;
        let mut number = String::new();
        std::io::BufRead::read_line(&mut std::io::BufReader::new(out), &mut number)?;
        Ok(Self { server, name: format!(":{}", number.trim()) })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
