//! Parameters: numbers and strings of a scene file that its user may set.

use super::document::{Document, quoted};
use crate::load::LoadError;
use serde::Deserialize;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use toml::de::DeValue;

/// Values for a scene's parameters, by name, as text: what a command line gives.
pub type Parameters = BTreeMap<String, String>;

/// A parameter of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// What it is when not given.
    pub default: Value,
    /// Smallest value, for numbers.
    pub min: Option<f64>,
    /// Largest value, for numbers.
    pub max: Option<f64>,
    /// What it does, in a line.
    pub about: String,
}

/// The value of a parameter; its type is that of the default.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged, expecting = "expected a boolean, a number or a string")]
pub enum Value {
    /// True or false.
    Boolean(bool),
    /// A whole number.
    Integer(i64),
    /// A number.
    Number(f64),
    /// Text.
    Text(String),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Value::Boolean(v) => v.fmt(f),
            Value::Integer(v) => v.fmt(f),
            Value::Number(v) => v.fmt(f),
            Value::Text(v) => v.fmt(f),
        }
    }
}

/// A declaration with limits: `name = { default = 5, min = 1, max = 9, about = "..." }`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Declaration {
    default: Value,
    min: Option<f64>,
    max: Option<f64>,
    #[serde(default)]
    about: String,
}

/// Takes the section `[parameters]` out of the file.
pub(super) fn declared(document: &mut Document) -> Result<Vec<Parameter>, LoadError> {
    let Some(mut section) = document.take_table("parameters")? else { return Ok(Vec::new()) };
    let mut parameters = Vec::new();
    for name in section.keys() {
        let (default, min, max, about) = if let Some(table) = section.take_table(&name) {
            let d: Declaration = table.read()?;
            (d.default, d.min, d.max, d.about)
        } else {
            let mut one: BTreeMap<String, Value> = section.split(&[&name]).read()?;
            let Some(default) = one.remove(&name) else { continue };
            (default, None, None, String::new())
        };
        parameters.push(Parameter { name, default, min, max, about });
    }
    Ok(parameters)
}

/// The value of each parameter: the given one, or the default.
pub(super) fn values(
    declared: &[Parameter],
    given: &Parameters,
    path: &Path,
) -> Result<BTreeMap<String, Value>, LoadError> {
    if let Some(unknown) = given.keys().find(|name| declared.iter().all(|p| p.name != **name)) {
        let known: Vec<&str> = declared.iter().map(|p| p.name.as_str()).collect();
        let message = if known.is_empty() {
            "the scene has no parameters".to_owned()
        } else {
            format!("unknown parameter; known are {}", quoted(&known))
        };
        return Err(LoadError::malformed(path, format!("parameter `{unknown}`"), message));
    }
    let value = |p: &Parameter| {
        let value = match given.get(&p.name) {
            Some(text) => p.parse(text),
            None => p.check(p.default.clone()),
        };
        value.map_err(|message| LoadError::malformed(path, format!("parameter `{}`", p.name), message))
    };
    declared.iter().map(|p| Ok((p.name.clone(), value(p)?))).collect()
}

impl Parameter {
    /// Reads a value from text.
    fn parse(&self, text: &str) -> Result<Value, String> {
        let wrong = |kind: &str| format!("`{text}` is not {kind}");
        let value = match self.default {
            Value::Boolean(_) => Value::Boolean(text.parse().map_err(|_| wrong("true or false"))?),
            Value::Integer(_) => Value::Integer(text.parse().map_err(|_| wrong("a whole number"))?),
            Value::Number(_) => Value::Number(text.parse().map_err(|_| wrong("a number"))?),
            Value::Text(_) => Value::Text(text.to_owned()),
        };
        self.check(value)
    }

    /// Checks the limits.
    fn check(&self, value: Value) -> Result<Value, String> {
        let number = match value {
            Value::Integer(v) => v as f64,
            Value::Number(v) => v,
            Value::Boolean(_) | Value::Text(_) => return Ok(value),
        };
        if !number.is_finite() {
            return Err(format!("{number} is not finite"));
        }
        if let Some(min) = self.min.filter(|min| number < *min) {
            return Err(format!("{number} is less than {min}"));
        }
        if let Some(max) = self.max.filter(|max| number > *max) {
            return Err(format!("{number} is more than {max}"));
        }
        Ok(value)
    }
}

/// The text of each value as it would stand in the file.
pub(super) fn literals(values: &BTreeMap<String, Value>) -> BTreeMap<String, String> {
    let literal = |value: &Value| match value {
        Value::Number(v) => format!("{v:?}"), // keeps the decimal point
        other => other.to_string(),
    };
    values.iter().map(|(name, value)| (name.clone(), literal(value))).collect()
}

/// The values as TOML. Its numbers can only be made from text, hence `literals`.
pub(super) fn to_toml<'a>(
    values: &BTreeMap<String, Value>,
    literals: &'a BTreeMap<String, String>,
) -> BTreeMap<String, DeValue<'a>> {
    let convert = |value: &Value, literal: &'a str| match value {
        Value::Boolean(v) => DeValue::Boolean(*v),
        Value::Text(_) => DeValue::String(Cow::Borrowed(literal)),
        Value::Integer(_) | Value::Number(_) => match DeValue::parse(literal) {
            Ok(number) => number.into_inner(),
            Err(_) => DeValue::String(Cow::Borrowed(literal)),
        },
    };
    let pairs = values.iter().zip(literals);
    pairs.map(|((name, value), (_, literal))| (name.clone(), convert(value, literal))).collect()
}
