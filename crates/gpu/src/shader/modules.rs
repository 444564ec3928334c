//! Shaders as modules: WGSL files name what they import, and a shader's text is made of one of them and all that it needs.
//!
//! Lines of a file that begin with `#` are for this resolver:
//!
//! - `#import scene, optics::ggx`: the names of other modules. A module is a file of `shaders/` without its extension, a module
//!   of the optics, or a text that Rust makes ([`Linkage::generate`]). An abstract name stands for one of several modules
//!   ([`Linkage::bind`]).
//! - `#ifdef NAME`, `#ifndef NAME`, `#else`, `#endif`: lines that are there only if a name is defined ([`Linkage::define`]), or
//!   only if it is not. They do not nest.
//!
//! Names are global, as in WGSL itself: imports say what must be there, and do not rename it. `enable` directives are moved
//! to the beginning, where WGSL wants them.
//!
//! naga_oil (0.23) links modules, too, but mangles names, which the driver's messages show and `pipeline/spirv.rs` looks
//! for, and writes and parses the headers of imports again and again, which costs time at every start. wesl (0.6) does not
//! parse ray tracing pipelines, and neither has names that stand for one of several modules.

use super::abstract_modules::ABSTRACT;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

/// The files of `shaders/`, by name.
static FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

/// Why modules make no text.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ModuleError {
    /// Nothing has the name.
    #[error("the shader module `{importer}` imports `{name}`, which does not exist")]
    Unknown {
        /// Who imports it; the name itself if it is the root.
        importer: String,
        /// What is not there.
        name: String,
    },
    /// The name is abstract, and nothing was bound to it.
    #[error("the shader module `{importer}` imports `{name}`, which stands for nothing here")]
    Unbound {
        /// Who imports it.
        importer: String,
        /// The abstract name.
        name: String,
    },
    /// Modules need each other.
    #[error("shader modules import each other in a circle: {}", .0.join(", "))]
    Circle(
        /// The modules, from the first one to itself.
        Vec<String>,
    ),
    /// A line that begins with `#` makes no sense.
    #[error("the shader module `{module}`, line {line}: `{directive}` is no directive that can stand here")]
    Directive {
        /// Where it is.
        module: String,
        /// In which line, from 1 on.
        line: usize,
        /// The line.
        directive: String,
    },
}

/// What modules are linked with: what abstract names stand for, what Rust generates, and which names are defined.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Linkage {
    bound: BTreeMap<&'static str, &'static str>,
    generated: BTreeMap<&'static str, Cow<'static, str>>,
    defined: BTreeSet<&'static str>,
}

impl Linkage {
    /// An abstract name stands for a module from now on.
    #[must_use]
    pub fn bind(mut self, name: &'static str, module: &'static str) -> Self {
        self.bound.insert(name, module);
        self
    }

    /// A module whose text Rust makes. It may have imports as any file.
    #[must_use]
    pub fn generate(mut self, name: &'static str, text: impl Into<Cow<'static, str>>) -> Self {
        self.generated.insert(name, text.into());
        self
    }

    /// Defines a name for `#ifdef`.
    #[must_use]
    pub fn define(mut self, name: &'static str) -> Self {
        self.defined.insert(name);
        self
    }

    /// Adds all of another linkage, which counts where both say something.
    #[must_use]
    pub fn with(mut self, other: &Self) -> Self {
        self.bound.extend(&other.bound);
        self.generated.extend(other.generated.iter().map(|(name, text)| (*name, text.clone())));
        self.defined.extend(&other.defined);
        self
    }

    /// The text of module `root` and of all that it needs, each once, and in front of whatever imports it.
    ///
    /// # Errors
    /// When a name leads nowhere, or in a circle.
    pub fn text(&self, root: &str) -> Result<String, ModuleError> {
        let linker = self.link(root)?;
        let enables: String = linker.enables.iter().flat_map(|line| [*line, "\n"]).collect();
        Ok(enables + &linker.text)
    }

    /// For tests: the modules that a text consists of.
    #[cfg(test)]
    pub(crate) fn modules(&self, root: &str) -> Result<BTreeSet<String>, ModuleError> {
        self.link(root).map(|linker| linker.done)
    }

    /// For tests: what a module itself says.
    #[cfg(test)]
    pub(crate) fn own_text(&self, name: &str) -> Option<&str> {
        let optics = || Some(optics::wgsl::module(name.strip_prefix("optics::")?)?.text.as_str());
        self.source(name).or_else(optics)
    }

    fn link(&self, root: &str) -> Result<Linker<'_>, ModuleError> {
        let (path, done, enables) = (Vec::new(), BTreeSet::new(), BTreeSet::new());
        let mut linker = Linker { linkage: self, path, done, enables, text: String::new() };
        linker.add(root)?;
        Ok(linker)
    }

    /// The text of a file or of what Rust generates.
    fn source(&self, name: &str) -> Option<&str> {
        let file = || FILES.binary_search_by_key(&name, |file| file.0).ok().map(|at| FILES[at].1);
        self.generated.get(name).map(|text| &**text).or_else(file)
    }
}

/// For tests: the names of all files, and their texts.
#[cfg(test)]
pub(crate) fn files() -> impl Iterator<Item = (&'static str, &'static str)> {
    FILES.iter().copied()
}

/// Makes one text.
struct Linker<'a> {
    linkage: &'a Linkage,
    /// The modules that wait for what they import, from the root on.
    path: Vec<String>,
    done: BTreeSet<String>,
    enables: BTreeSet<&'a str>,
    text: String,
}

impl<'a> Linker<'a> {
    /// Adds the module that a name stands for, behind all that it imports.
    fn add(&mut self, name: &str) -> Result<(), ModuleError> {
        let name = self.linkage.bound.get(name).copied().unwrap_or(name);
        if self.done.contains(name) {
            return Ok(());
        }
        if self.path.iter().any(|waiting| waiting == name) {
            let start = self.path.iter().position(|waiting| waiting == name).unwrap_or_default();
            let circle = self.path[start..].iter().cloned().chain([name.to_owned()]);
            return Err(ModuleError::Circle(circle.collect()));
        }
        let importer = self.path.last().map_or(name, String::as_str).to_owned();
        self.path.push(name.to_owned());
        if let Some(module) = name.strip_prefix("optics::").and_then(optics::wgsl::module) {
            module.imports.iter().try_for_each(|import| self.add(&format!("optics::{import}")))?;
            self.text.push_str(&module.text);
        } else if let Some(source) = self.linkage.source(name) {
            let body = self.follow(name, source)?;
            self.text.push_str(&body);
        } else if ABSTRACT.iter().any(|(is_abstract, _)| *is_abstract == name) {
            return Err(ModuleError::Unbound { importer, name: name.to_owned() });
        } else {
            return Err(ModuleError::Unknown { importer, name: name.to_owned() });
        }
        self.done.extend(self.path.pop());
        Ok(())
    }

    /// Does what the directives of a module say, and returns the lines that are left.
    fn follow(&mut self, module: &str, source: &'a str) -> Result<String, ModuleError> {
        let mut body = String::with_capacity(source.len());
        // Whether lines are taken, within `#ifdef`.
        let mut condition: Option<bool> = None;
        for (number, line) in source.lines().enumerate() {
            let wrong = || ModuleError::Directive {
                module: module.to_owned(),
                line: number + 1,
                directive: line.to_owned(),
            };
            let is_defined = |name: &str| self.linkage.defined.contains(name);
            match line.split_once(' ').unwrap_or((line, "")) {
                ("#ifdef", name) if condition.is_none() => condition = Some(is_defined(name)),
                ("#ifndef", name) if condition.is_none() => condition = Some(!is_defined(name)),
                ("#else", _) => condition = Some(!condition.ok_or_else(wrong)?),
                ("#endif", _) => {
                    condition.take().ok_or_else(wrong)?;
                }
                ("#import", names) if condition != Some(false) => {
                    names.split(',').try_for_each(|name| self.add(name.trim()))?;
                }
                ("#import", _) => {}
                (directive, _) if directive.starts_with('#') => return Err(wrong()),
                _ if condition == Some(false) => {}
                ("enable", _) => {
                    self.enables.insert(line);
                }
                _ => body.extend([line, "\n"]),
            }
        }
        Ok(body)
    }
}

#[cfg(test)]
mod tests;
