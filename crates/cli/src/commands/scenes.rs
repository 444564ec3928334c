//! `alhazen scenes`: what can be rendered without any file.

use crate::console::print_result;
use std::fmt::Write;

/// List the built-in scenes and their parameters.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  alhazen scenes
  alhazen scenes --text cornell > my-scene.toml
  alhazen render lights -p models=4 -o lights.png")]
pub struct ScenesArgs {
    /// Print the scene file of this built-in scene, to start an own one from.
    #[arg(long, value_name = "SCENE", conflicts_with = "json")]
    text: Option<String>,
    /// Print the list as JSON.
    #[arg(long)]
    json: bool,
}

/// Prints the list.
pub fn run(args: &ScenesArgs) -> anyhow::Result<()> {
    if let Some(name) = &args.text {
        let Some(text) = alhazen::builtin::text(name) else {
            let known: Vec<_> = alhazen::builtin::list().iter().map(|b| b.name).collect();
            anyhow::bail!("there is no built-in scene {name}; known are {}", known.join(", "));
        };
        return print_result(text);
    }
    let scenes = alhazen::builtin::list();
    if args.json {
        let scene = |b: &alhazen::builtin::Builtin| {
            let parameters = b.parameters.iter().map(|p| {
                serde_json::json!({
                    "name": p.name, "about": p.about, "default": p.default.to_string(), "min": p.min, "max": p.max,
                })
            });
            serde_json::json!({ "name": b.name, "about": b.about, "parameters": parameters.collect::<Vec<_>>() })
        };
        let list: Vec<_> = scenes.iter().map(scene).collect();
        return print_result(&format!("{}\n", serde_json::json!(list)));
    }
    let mut text = String::new();
    for scene in &scenes {
        let is_default = if scene.name == alhazen::builtin::DEFAULT { " (the default)" } else { "" };
        writeln!(text, "{}{is_default}\n  {}", scene.name, scene.about)?;
        for p in &scene.parameters {
            let limits = match (p.min, p.max) {
                (Some(min), Some(max)) => format!(", {min} to {max}"),
                (Some(min), None) => format!(", at least {min}"),
                (None, Some(max)) => format!(", at most {max}"),
                (None, None) => String::new(),
            };
            let default = p.default.to_string();
            let default = if default.is_empty() { "none" } else { &default };
            writeln!(text, "    -p {}=…  {} [default: {default}{limits}]", p.name, p.about)?;
        }
    }
    print_result(&text)
}
