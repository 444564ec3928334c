//! Job templates of [Open Job Description](https://github.com/OpenJobDescription/openjd-specifications), revision 2023-09.

use super::plan::JobPlan;
use anyhow::{Context, ensure};
use serde_json::{Value, json};
use std::path::Path;

/// A template and what the user should know of it.
pub struct Job {
    /// JSON.
    pub text: String,
    /// What to give when submitting.
    pub notices: Vec<String>,
}

impl Job {
    /// The template of a plan, to be written to a file in `folder`: paths in templates are relative to it.
    pub fn new(plan: &JobPlan, name: &str, folder: &Path) -> anyhow::Result<Self> {
        let marks = plan.arguments.iter().chain([&plan.scene]).find(|a| a.contains("{{"));
        ensure!(marks.is_none(), "{marks:?}: `{{{{` has a meaning in job templates");
        let mut template = Template::new(folder);
        let scene = template.scene(&plan.scene)?;
        let arguments = template.environment(&plan.arguments)?;
        template.folder_parameter(
            "OutputFolder",
            plan.folder(),
            "OUT",
            "Where parts and pictures are written.",
        )?;

        let mut render = vec![json!("render"), json!(scene), json!("--quiet")];
        render.extend(arguments.iter().map(|a| json!(a)));
        let mut render_space = Vec::new();
        let mut merge = vec![json!("merge")];
        let mut merge_space = Vec::new();
        if let Some((first, end)) = plan.frames {
            let frames = json!({ "name": "Frame", "type": "INT", "range": format!("{first}-{}", end - 1) });
            render_space.push(frames.clone());
            merge_space.push(frames);
            render.extend(["--frames", "{{Task.Param.Frame}}"].map(|a| json!(a)));
            merge.extend(["--frame", "{{Task.Param.Frame}}"].map(|a| json!(a)));
        }
        let in_folder = |name: &str| json!(format!("{{{{Param.OutputFolder}}}}/{name}"));
        let outputs: Vec<Value> =
            plan.output_names().flat_map(|name| [json!("--output"), in_folder(&name)]).collect();
        if plan.is_divided() {
            for (name, option, count) in
                [("Tile", "--tile", plan.tiles), ("Samples", "--sample-range", plan.ranges)]
            {
                render_space.push(json!({ "name": name, "type": "INT", "range": format!("1-{count}") }));
                render.extend([json!(option), json!(format!("{{{{Task.Param.{name}}}}}/{count}"))]);
            }
            let part = plan.part_name("{{Task.Param.Tile}}", "{{Task.Param.Samples}}");
            render.extend([json!("--output"), in_folder(&part)]);
            merge.extend(
                plan.parts().map(|(t, r)| in_folder(&plan.part_name(&t.to_string(), &r.to_string()))),
            );
            merge.extend(outputs);
        } else {
            render.extend(outputs);
        }
        let mut steps = vec![step("Render", &render, &render_space)];
        if plan.is_divided() {
            let mut merge = step("Merge", &merge, &merge_space);
            merge["dependencies"] = json!([{ "dependsOn": "Render" }]);
            steps.push(merge);
        }
        let job = json!({
            "specificationVersion": "jobtemplate-2023-09",
            "name": name,
            "parameterDefinitions": template.parameters,
            "steps": steps,
        });
        let text = serde_json::to_string_pretty(&job).context("the template cannot be written as JSON")?;
        Ok(Self { text: text + "\n", notices: template.notices })
    }
}

/// A step that runs `alhazen` once for each combination of its parameters.
fn step(name: &str, arguments: &[Value], space: &[Value]) -> Value {
    let mut step = json!({
        "name": name,
        "script": { "actions": { "onRun": { "command": "{{Param.Alhazen}}", "args": arguments } } },
    });
    if !space.is_empty() {
        step["parameterSpace"] = json!({ "taskParameterDefinitions": space });
    }
    step
}

/// A template in the making.
struct Template<'a> {
    folder: &'a Path,
    parameters: Vec<Value>,
    notices: Vec<String>,
}

impl<'a> Template<'a> {
    /// A template whose command can be chosen.
    fn new(folder: &'a Path) -> Self {
        let command = json!({
            "name": "Alhazen", "type": "STRING", "default": "alhazen",
            "description": "The command that renders, on the machines that work.",
        });
        Self { folder, parameters: vec![command], notices: Vec::new() }
    }

    /// What stands for the scene in arguments. A file comes with its folder, where its textures are.
    fn scene(&mut self, scene: &str) -> anyhow::Result<String> {
        let path = Path::new(scene);
        let Some(name) = path.file_name().filter(|_| path.is_file()) else { return Ok(scene.to_owned()) };
        let folder = path.parent().unwrap_or(Path::new(""));
        self.folder_parameter("SceneFolder", folder, "IN", "The scene's folder with all that it refers to.")?;
        Ok(format!("{{{{Param.SceneFolder}}}}/{}", name.to_string_lossy()))
    }

    /// The arguments with what stands for the environment's file, if there is one.
    fn environment(&mut self, arguments: &[String]) -> anyhow::Result<Vec<String>> {
        let mut arguments = arguments.to_vec();
        let option = arguments.iter().position(|a| a == "--environment" || a.starts_with("--environment="));
        let Some(at) = option else { return Ok(arguments) };
        let (value_at, value) = match arguments[at].split_once('=') {
            Some((_, value)) => (at, value.to_owned()),
            None => (at + 1, arguments.get(at + 1).cloned().unwrap_or_default()),
        };
        if !Path::new(&value).is_file() {
            return Ok(arguments);
        }
        let default = self.default_of("Environment", Path::new(&value))?;
        self.parameters.push(path_parameter("Environment", "FILE", "IN", default, "Light from outside."));
        let stands = "{{Param.Environment}}";
        arguments[value_at] = if value_at == at { format!("--environment={stands}") } else { stands.into() };
        Ok(arguments)
    }

    fn folder_parameter(&mut self, name: &str, path: &Path, flow: &str, about: &str) -> anyhow::Result<()> {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        let default = self.default_of(name, path)?;
        self.parameters.push(path_parameter(name, "DIRECTORY", flow, default, about));
        Ok(())
    }

    /// `path` as it is seen from the template; nothing, but a notice, if it is not beside or below it.
    fn default_of(&mut self, name: &str, path: &Path) -> anyhow::Result<Option<String>> {
        let absolute = |p: &Path| {
            let p = if p.as_os_str().is_empty() { Path::new(".") } else { p };
            std::path::absolute(p).map(|p| p.components().collect::<std::path::PathBuf>())
        };
        let (base, path) = (absolute(self.folder)?, absolute(path)?);
        if let Ok(below) = path.strip_prefix(&base) {
            let below = below.to_string_lossy().replace('\\', "/");
            return Ok(Some(if below.is_empty() { ".".into() } else { below }));
        }
        self.notices.push(format!(
            "{} is not below the template's folder: give it as a parameter, -p {name}={}",
            path.display(),
            path.display()
        ));
        Ok(None)
    }
}

fn path_parameter(name: &str, kind: &str, flow: &str, default: Option<String>, about: &str) -> Value {
    let mut parameter = json!({
        "name": name, "type": "PATH", "objectType": kind, "dataFlow": flow, "description": about,
    });
    if let Some(default) = default {
        parameter["default"] = json!(default);
    }
    parameter
}
