//! The text of scripts: a step a line, words separated by spaces; `#` begins a comment.

use crate::panels::Tab;
use crate::worker::Layer;
use alhazen::{BackendChoice, FrameView, Integrator};
use std::path::PathBuf;

/// A step of a script.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// `wait N`: until the picture has N samples per pixel and is as wanted.
    Wait(u32),
    /// `frames N`: N frames of the window.
    Frames(u64),
    /// `resize WIDTH HEIGHT`: of the window, physical pixels.
    Resize(u32, u32),
    /// `backend NAME`
    Backend(BackendChoice),
    /// `integrator NAME`
    Integrator(&'static str),
    /// `show VIEW`: what frames of `realtime` show.
    Show(FrameView),
    /// `filter on|off`: of `realtime`.
    Filter(bool),
    /// `denoise on|off`: of what is shown.
    Denoise(bool),
    /// `moment FRAME`: of the scene's time.
    Moment(u32),
    /// `play SECONDS`: lets the scene's time pass, and measures.
    Play(f64),
    /// `fps N`: frames per second of the scene's time.
    Fps(f32),
    /// `clip NAME`: what is played.
    Clip(String),
    /// `spp N`: samples per pixel after which the picture is done.
    Spp(u32),
    /// `material ID KEY VALUE`
    Material {
        /// The material.
        id: u32,
        /// `roughness`, `metallic`, `transmission`, `ior`, `red`, `green`, `blue` or `emission`.
        key: String,
        /// Its new value.
        value: f32,
    },
    /// `open NAME`: a file or a built-in scene.
    Open(String),
    /// `drop FILE`: onto the window.
    Drop(PathBuf),
    /// `reload`
    Reload,
    /// `error`: until there is an error; dismisses it.
    Error,
    /// `layer NAME`
    Layer(Layer),
    /// `tab NAME`
    Tab(Tab),
    /// `select X Y`: shares of the picture's size.
    Select(f32, f32),
    /// `command NAME`: a command of the palette.
    Command(String),
    /// `save FILE`: the scene.
    Save(PathBuf),
    /// `picture FILE`: what was rendered.
    Picture(PathBuf),
    /// `choose FILE`: in our own file dialog, once it is open.
    Choose(PathBuf),
    /// `compare FILE`
    Compare(PathBuf),
    /// `record FILE FRAMES SPP`: a turntable.
    Record {
        /// Where pictures go.
        path: PathBuf,
        /// How many.
        frames: usize,
        /// Samples per pixel.
        spp: u32,
    },
    /// `screenshot FILE`: what the window shows.
    Screenshot(PathBuf),
    /// `orbit SECONDS`: turns the camera, and measures.
    Orbit(f64),
    /// `restarts N`: begins the picture anew, and measures memory.
    Restarts(u32),
    /// `rounds SECONDS`: all steps before it again and again, and measures memory and open files.
    Rounds(f64),
}

/// A line that is no step.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line} of the script, `{text}`: {reason}")]
pub struct ScriptError {
    /// From 1.
    pub line: usize,
    /// Its text.
    pub text: String,
    /// What is wrong.
    pub reason: String,
}

/// Reads a script.
///
/// # Errors
/// For the first line that is no step.
pub fn parse(text: &str) -> Result<Vec<Step>, ScriptError> {
    let lines =
        text.lines().enumerate().map(|(i, line)| (i + 1, line.split('#').next().unwrap_or("").trim()));
    let steps = lines
        .filter(|(_, line)| !line.is_empty())
        .map(|(line, text)| step(text).map_err(|reason| ScriptError { line, text: text.to_owned(), reason }));
    steps.collect()
}

fn step(line: &str) -> Result<Step, String> {
    let (verb, rest) = line.split_once(' ').map_or((line, ""), |(verb, rest)| (verb, rest.trim()));
    let words: Vec<&str> = rest.split_whitespace().collect();
    let word = |i: usize| words.get(i).copied().ok_or(format!("`{verb}` needs more words"));
    fn number<T: std::str::FromStr>(word: &str) -> Result<T, String> {
        word.parse().map_err(|_| format!("`{word}` is not such a number"))
    }
    // Names and paths may have spaces.
    let all = || if rest.is_empty() { Err(format!("`{verb}` needs a name")) } else { Ok(rest) };
    Ok(match verb {
        "wait" => Step::Wait(number(word(0)?)?),
        "frames" => Step::Frames(number(word(0)?)?),
        "resize" => Step::Resize(number(word(0)?)?, number(word(1)?)?),
        "backend" => Step::Backend(all()?.parse().map_err(|e: alhazen::UnknownBackend| e.to_string())?),
        "integrator" => {
            let names = Integrator::all().map(|integrator| integrator.name());
            let named = names.into_iter().find(|name| *name == rest);
            Step::Integrator(named.ok_or_else(|| format!("integrators are {}", names.join(", ")))?)
        }
        "show" => Step::Show(all()?.parse().map_err(|e: alhazen::UnknownFrameView| e.to_string())?),
        "filter" => match all()? {
            "on" => Step::Filter(true),
            "off" => Step::Filter(false),
            _ => return Err("the filter is `on` or `off`".into()),
        },
        "denoise" => match all()? {
            "on" => Step::Denoise(true),
            "off" => Step::Denoise(false),
            _ => return Err("denoising is `on` or `off`".into()),
        },
        "moment" => Step::Moment(number(word(0)?)?),
        "play" => Step::Play(number(word(0)?)?),
        "fps" => match number(word(0)?)? {
            fps if fps > 0.0 && f32::is_finite(fps) => Step::Fps(fps),
            fps => return Err(format!("{fps} frames a second are not possible")),
        },
        "clip" => Step::Clip(all()?.to_owned()),
        "spp" => Step::Spp(number(word(0)?)?),
        "material" => {
            Step::Material { id: number(word(0)?)?, key: word(1)?.to_owned(), value: number(word(2)?)? }
        }
        "open" => Step::Open(all()?.to_owned()),
        "drop" => Step::Drop(all()?.into()),
        "reload" => Step::Reload,
        "error" => Step::Error,
        "layer" => {
            let name = all()?;
            let layer = Layer::all().find(|l| l.name().eq_ignore_ascii_case(name));
            let known = || Layer::all().map(|l| l.name().to_owned()).collect::<Vec<_>>().join(", ");
            Step::Layer(layer.ok_or_else(|| format!("there is no layer `{name}`, but {}", known()))?)
        }
        "tab" => {
            let name = all()?;
            let tab = Tab::ALL.into_iter().find(|t| t.name().eq_ignore_ascii_case(name));
            let known = || Tab::ALL.map(Tab::name).join(", ");
            Step::Tab(tab.ok_or_else(|| format!("there is no tab `{name}`, but {}", known()))?)
        }
        "select" => Step::Select(number(word(0)?)?, number(word(1)?)?),
        "command" => Step::Command(all()?.to_owned()),
        "save" => Step::Save(all()?.into()),
        "picture" => Step::Picture(all()?.into()),
        "choose" => Step::Choose(all()?.into()),
        "compare" => Step::Compare(all()?.into()),
        "record" => Step::Record { path: word(0)?.into(), frames: number(word(1)?)?, spp: number(word(2)?)? },
        "screenshot" => Step::Screenshot(all()?.into()),
        "orbit" => Step::Orbit(number(word(0)?)?),
        "restarts" => Step::Restarts(number(word(0)?)?),
        "rounds" => Step::Rounds(number(word(0)?)?),
        _ => return Err(format!("there is no step `{verb}`")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_become_steps() {
        let text =
            "# a comment\nwait 8\n\nopen a file.glb # with spaces\nmaterial 2 roughness 0.5\ntab sky\n";
        let expected = [
            Step::Wait(8),
            Step::Open("a file.glb".into()),
            Step::Material { id: 2, key: "roughness".into(), value: 0.5 },
            Step::Tab(Tab::Sky),
        ];
        assert_eq!(parse(text).expect("steps"), expected);
    }

    #[test]
    fn steps_of_time_have_numbers_and_clips_names() {
        let steps =
            parse("moment 3\nplay 10\nrounds 2.5\nfps 24\nclip Walk cycle\nintegrator hybrid\nshow mask\nfilter off\n")
                .expect("steps");
        let expected = [
            Step::Moment(3),
            Step::Play(10.0),
            Step::Rounds(2.5),
            Step::Fps(24.0),
            Step::Clip("Walk cycle".into()),
            Step::Integrator("hybrid"),
            Step::Show(FrameView::Mask),
            Step::Filter(false),
        ];
        assert_eq!(steps, expected);
        for text in ["moment", "moment x", "play", "play x", "fps inf", "clip", "integrator ink"] {
            assert_eq!(parse(text).expect_err(text).line, 1);
        }
    }

    #[test]
    fn errors_name_the_line() {
        for (text, part) in [
            ("wait\n", "more words"),
            ("wait x", "`x`"),
            ("fly", "no step `fly`"),
            ("layer x", "no layer"),
            ("fps 0", "not possible"),
            ("backend x", "unknown back end"),
            ("show x", "unknown view"),
            ("filter", "needs a name"),
            ("filter x", "`on` or `off`"),
            ("denoise x", "`on` or `off`"),
        ] {
            let error = parse(&format!("reload\n{text}")).expect_err(text);
            assert!(error.line == 2 && error.to_string().contains(part), "{error}");
        }
    }
}
