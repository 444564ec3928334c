//! The text of scripts: a step a line, words separated by spaces; `#` begins a comment. Upper and
//! lower case are the same but in paths.

use crate::panels::Tab;
use crate::viewer::{COMMANDS, Command};
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
    /// `area LEFT TOP RIGHT BOTTOM`: selects what is in a rectangle; shares of the picture's size.
    Area([f32; 4]),
    /// `crop LEFT TOP RIGHT BOTTOM`: renders only a rectangle; shares of the picture's size.
    Crop([f32; 4]),
    /// `find TEXT`: in the tree of objects.
    Find(String),
    /// `command NAME`: a command of the palette.
    Command(Command),
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

/// Steps as they are written, and what they do: the list that help and errors show.
pub const STEPS: &[(&str, &str)] = &[
    ("wait N", "until the picture has N samples per pixel"),
    ("frames N", "N frames of the window"),
    ("open NAME", "load a file or a built-in scene"),
    ("drop FILE", "drop a file onto the window"),
    ("reload", "load the open file again"),
    ("error", "wait for an error and dismiss it"),
    ("resize WIDTH HEIGHT", "resize the window, pixels"),
    ("backend NAME", "what renders"),
    ("integrator NAME", "how light is computed"),
    ("spp N", "samples per pixel after which the picture is done"),
    ("denoise on|off", "take the noise out of pictures, or not"),
    ("show VIEW", "the displayed buffer of real-time frames"),
    ("filter on|off", "the filter of real-time frames"),
    ("material ID KEY VALUE", "change a number of a material"),
    ("select X Y", "click into the picture, in shares of its size"),
    ("area LEFT TOP RIGHT BOTTOM", "select what is in a rectangle, in shares of the picture"),
    ("crop LEFT TOP RIGHT BOTTOM", "render only a rectangle, in shares of the picture"),
    ("find TEXT", "type into the search of the objects"),
    ("command NAME", "run a command of the palette"),
    ("choose FILE", "answer the window's own file dialog"),
    ("tab NAME", "open a page"),
    ("layer NAME", "show a layer"),
    ("moment FRAME", "go to a frame of the scene's time"),
    ("fps N", "frames per second of the scene's time"),
    ("clip NAME", "what is played"),
    ("play SECONDS", "let time pass, and measure"),
    ("save FILE", "write the scene"),
    ("picture FILE", "write what was rendered"),
    ("screenshot FILE", "write what the window shows"),
    ("compare FILE", "compare with a picture"),
    ("record FILE FRAMES SPP", "record a turntable"),
    ("orbit SECONDS", "turn the camera, and measure"),
    ("restarts N", "begin the picture anew N times, and measure memory"),
    ("rounds SECONDS", "all steps before it again and again, and measure what is left behind"),
];

/// [`STEPS`] as text, a step a line.
pub fn steps_help() -> String {
    let line = |(step, does): &(&str, &str)| format!("  {step:<28}{does}\n");
    STEPS.iter().map(line).collect()
}

/// The verb of a step, as it is listed.
fn verb_of(step: &str) -> &str {
    step.split(' ').next().unwrap_or(step)
}

/// Reads a step. Names are the same in upper and lower case.
fn step(line: &str) -> Result<Step, String> {
    let (verb, rest) = line.split_once(' ').map_or((line, ""), |(verb, rest)| (verb, rest.trim()));
    let words = Words { verb: &verb.to_lowercase(), rest };
    if let Some(step) = picture_step(&words)? {
        return Ok(step);
    }
    if let Some(step) = scene_step(&words)? {
        return Ok(step);
    }
    let known: Vec<&str> = STEPS.iter().map(|(step, _)| verb_of(step)).collect();
    Err(format!("there is no step `{verb}`{}; steps are {}", nearest(verb, &known), known.join(", ")))
}

/// The words of a step.
struct Words<'w> {
    verb: &'w str,
    rest: &'w str,
}

impl<'w> Words<'w> {
    fn word(&self, i: usize) -> Result<&'w str, String> {
        let syntax = STEPS.iter().find(|(step, _)| verb_of(step) == self.verb).map_or("", |(step, _)| step);
        self.rest.split_whitespace().nth(i).ok_or(format!("`{}` needs more words: {syntax}", self.verb))
    }

    fn number<T: std::str::FromStr>(&self, i: usize) -> Result<T, String> {
        let word = self.word(i)?;
        word.parse().map_err(|_| format!("`{word}` is not such a number"))
    }

    /// Left, top, right and bottom.
    fn rectangle(&self) -> Result<[f32; 4], String> {
        let sides: [f32; 4] = [self.number(0)?, self.number(1)?, self.number(2)?, self.number(3)?];
        let [left, top, right, bottom] = sides;
        let is_one = (0.0..right).contains(&left) && (0.0..bottom).contains(&top) && right.max(bottom) <= 1.0;
        if is_one { Ok(sides) } else { Err(format!("{sides:?} is no rectangle within the picture")) }
    }

    /// A name or a path, which may have spaces.
    fn all(&self) -> Result<&'w str, String> {
        if self.rest.is_empty() { Err(format!("`{}` needs a name", self.verb)) } else { Ok(self.rest) }
    }

    fn switch(&self) -> Result<bool, String> {
        match self.all()?.to_lowercase().as_str() {
            "on" => Ok(true),
            "off" => Ok(false),
            _ => Err(format!("`{}` is `on` or `off`", self.verb)),
        }
    }

    /// One of several things, by its name.
    fn one_of<T>(&self, all: impl IntoIterator<Item = (String, T)>) -> Result<T, String> {
        let name = self.all()?;
        let mut known = Vec::new();
        for (other, thing) in all {
            if other.eq_ignore_ascii_case(name) {
                return Ok(thing);
            }
            known.push(other);
        }
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        let near = nearest(name, &known);
        Err(format!("there is no {} `{name}`{near}; there are {}", self.verb, known.join(", ")))
    }
}

/// Steps that say what is rendered and shown.
fn picture_step(w: &Words<'_>) -> Result<Option<Step>, String> {
    Ok(Some(match w.verb {
        "wait" => Step::Wait(w.number(0)?),
        "frames" => Step::Frames(w.number(0)?),
        "resize" => Step::Resize(w.number(0)?, w.number(1)?),
        "backend" => {
            let name = w.all()?.to_lowercase();
            Step::Backend(name.parse().map_err(|e: alhazen::UnknownBackend| e.to_string())?)
        }
        "integrator" => {
            let names = Integrator::all().map(|integrator| integrator.name());
            Step::Integrator(w.one_of(names.map(|name| (name.to_owned(), name)))?)
        }
        "show" => {
            let name = w.all()?.to_lowercase();
            Step::Show(name.parse().map_err(|e: alhazen::UnknownFrameView| e.to_string())?)
        }
        "filter" => Step::Filter(w.switch()?),
        "denoise" => Step::Denoise(w.switch()?),
        "moment" => Step::Moment(w.number(0)?),
        "play" => Step::Play(w.number(0)?),
        "fps" => match w.number(0)? {
            fps if fps > 0.0 && f32::is_finite(fps) => Step::Fps(fps),
            fps => return Err(format!("{fps} frames a second are not possible")),
        },
        "clip" => Step::Clip(w.all()?.to_owned()),
        "spp" => Step::Spp(w.number(0)?),
        "layer" => Step::Layer(w.one_of(Layer::all().map(|layer| (layer.name().to_owned(), layer)))?),
        "compare" => Step::Compare(w.all()?.into()),
        "orbit" => Step::Orbit(w.number(0)?),
        "restarts" => Step::Restarts(w.number(0)?),
        "rounds" => Step::Rounds(w.number(0)?),
        _ => return Ok(None),
    }))
}

/// Steps that open, change and write.
fn scene_step(w: &Words<'_>) -> Result<Option<Step>, String> {
    Ok(Some(match w.verb {
        "material" => {
            let key = w.word(1)?.to_lowercase();
            Step::Material { id: w.number(0)?, key, value: w.number(2)? }
        }
        "open" => Step::Open(w.all()?.to_owned()),
        "drop" => Step::Drop(w.all()?.into()),
        "reload" => Step::Reload,
        "error" => Step::Error,
        "tab" => Step::Tab(w.one_of(Tab::ALL.map(|tab| (tab.name().to_owned(), tab)))?),
        "select" => Step::Select(w.number(0)?, w.number(1)?),
        "area" => Step::Area(w.rectangle()?),
        "crop" => Step::Crop(w.rectangle()?),
        "find" => Step::Find(w.all()?.to_owned()),
        "command" => {
            let names = COMMANDS.iter().map(|info| (info.name.to_owned(), info.command));
            let plain = names.clone().map(|(name, command)| (name.replace('…', ""), command));
            let text = w.all()?;
            let found = plain.into_iter().find(|(name, _)| name.eq_ignore_ascii_case(text));
            Step::Command(found.map_or_else(|| w.one_of(names), |(_, command)| Ok(command))?)
        }
        "save" => Step::Save(w.all()?.into()),
        "picture" => Step::Picture(w.all()?.into()),
        "choose" => Step::Choose(w.all()?.into()),
        "record" => Step::Record { path: w.word(0)?.into(), frames: w.number(1)?, spp: w.number(2)? },
        "screenshot" => Step::Screenshot(w.all()?.into()),
        _ => return Ok(None),
    }))
}

/// Those of `known` that somebody may have meant, as a half sentence; empty if there are none.
fn nearest(name: &str, known: &[&str]) -> String {
    let name = name.to_lowercase();
    let mut near: Vec<(usize, &str)> = Vec::new();
    for other in known {
        let lower = other.to_lowercase();
        let begins = lower.starts_with(&name) || name.starts_with(&lower);
        let distance = if begins { 1 } else { edit_distance(&name, &lower) };
        if distance <= 1 + name.chars().count() / 3 {
            near.push((distance, other));
        }
    }
    near.sort_by_key(|(distance, _)| *distance);
    let names: Vec<String> = near.iter().take(3).map(|(_, name)| format!("`{name}`")).collect();
    if names.is_empty() { String::new() } else { format!(", but {}", names.join(", ")) }
}

/// How many letters have to be added, left out or changed (Levenshtein 1966).
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, to) in b.iter().enumerate() {
            let changed = diagonal + usize::from(from != *to);
            diagonal = row[j + 1];
            row[j + 1] = changed.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
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
    fn upper_and_lower_case_are_the_same() {
        let text = "TAB objects\nBackend CPU\nIntegrator PATH\nDenoise OFF\nlayer Albedo\n\
                    command all commands\nCommand save the scene AS…\nMaterial 1 Roughness 0.5\n";
        let expected = [
            Step::Tab(Tab::Objects),
            Step::Backend(BackendChoice::Cpu),
            Step::Integrator("path"),
            Step::Denoise(false),
            Step::Layer(Layer::Aov(alhazen::Aov::Albedo)),
            Step::Command(Command::Palette),
            Step::Command(Command::SaveAs),
            Step::Material { id: 1, key: "roughness".into(), value: 0.5 },
        ];
        assert_eq!(parse(text).unwrap_or_else(|e| panic!("{e}")), expected);
    }

    #[test]
    fn every_step_is_listed_as_it_is_read() {
        for (syntax, does) in STEPS {
            let argument = |word: &str| match word {
                "NAME" if syntax.starts_with("backend") => "cpu".to_owned(),
                "NAME" if syntax.starts_with("integrator") => "path".to_owned(),
                "NAME" if syntax.starts_with("tab") => "Sky".to_owned(),
                "NAME" if syntax.starts_with("layer") => "picture".to_owned(),
                "NAME" if syntax.starts_with("command") => "Undo".to_owned(),
                "VIEW" => "mask".to_owned(),
                "on|off" => "on".to_owned(),
                "LEFT" | "TOP" => "0".to_owned(),
                word if word == word.to_uppercase() => "1".to_owned(),
                word => word.to_owned(),
            };
            let line = syntax.split(' ').map(argument).collect::<Vec<_>>().join(" ");
            assert_eq!(parse(&line).map(|steps| steps.len()), Ok(1), "{line}");
            assert!(steps_help().contains(&format!("{syntax} ")) && !does.is_empty());
        }
    }

    #[test]
    fn errors_name_the_line() {
        for (text, part) in [
            ("wait\n", "more words"),
            ("wait x", "`x`"),
            ("fly", "no step `fly`"),
            ("fly", "steps are wait, frames, open"),
            ("tabb objects", "but `tab`"),
            ("screensho x.png", "but `screenshot`"),
            ("tab object", "no tab `object`, but `Objects`"),
            ("layer x", "no layer"),
            ("command Dulpicate the object", "but `Duplicate the object`"),
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
