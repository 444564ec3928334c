//! A parsed file as values that know their place in the text.

use super::values::line_of;
use crate::load::LoadError;
use crate::load::session::Session;
use serde::Deserialize;
use serde::de::{DeserializeOwned, IntoDeserializer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A file that is being read: sections are taken out of it until nothing is left.
pub(super) struct Document<'a> {
    lines: Rc<Lines>,
    session: &'a Session,
    path: &'a Path,
    root: DeTable<'a>,
}

/// A table of the file with what messages call it.
pub(super) struct Entry<'a> {
    lines: Rc<Lines>,
    session: &'a Session,
    path: &'a Path,
    /// The object's kind and number or name, for messages.
    label: String,
    span: std::ops::Range<usize>,
    table: DeTable<'a>,
}

/// Where lines begin, so that finding the line of a place does not count through the text each time.
struct Lines(Vec<usize>);

impl Lines {
    fn new(text: &str) -> Self {
        Self(memchr::memchr_iter(b'\n', text.as_bytes()).collect())
    }

    /// The line of a byte of the text, from 1.
    fn of(&self, position: usize) -> usize {
        1 + self.0.partition_point(|end| *end < position)
    }
}

/// The largest magnitude that a number may have: its square still fits an `f32`.
const MAX_NUMBER: f64 = 1e18;

impl<'a> Document<'a> {
    /// Parses the text.
    pub fn parse(text: &'a str, path: &'a Path, session: &'a Session) -> Result<Self, LoadError> {
        let root = DeTable::parse(text).map_err(|error| {
            let line = error.span().map_or(1, |span| line_of(text, span.start));
            LoadError::malformed(path, format!("line {line}"), error.message())
        })?;
        Ok(Self { lines: Rc::new(Lines::new(text)), session, path, root: root.into_inner() })
    }

    fn error(&self, position: usize, object: &str, message: impl Into<String>) -> LoadError {
        LoadError::malformed(self.path, format!("line {}, {object}", self.lines.of(position)), message)
    }

    fn entry(&self, label: String, value: Spanned<DeValue<'a>>) -> Result<Entry<'a>, LoadError> {
        let span = value.span();
        match value.into_inner() {
            DeValue::Table(table) => {
                let (lines, session, path) = (self.lines.clone(), self.session, self.path);
                Ok(Entry { lines, session, path, label, span, table })
            }
            other => {
                Err(self.error(span.start, &label, format!("expected a table, not {}", with_article(&other))))
            }
        }
    }

    /// Takes a string out of the top level.
    pub fn take_string(&mut self, key: &str) -> Result<Option<String>, LoadError> {
        let Some(value) = self.root.remove(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::String(text) => Ok(Some(text.clone().into_owned())),
            other => Err(self.error(
                value.span().start,
                key,
                format!("expected a string, not {}", with_article(other)),
            )),
        }
    }

    /// Takes the table `[key]` out of the top level.
    pub fn take_table(&mut self, key: &str) -> Result<Option<Entry<'a>>, LoadError> {
        self.root.remove(key).map(|value| self.entry(key.to_owned(), value)).transpose()
    }

    /// Takes the tables `[key.NAME]` out of the top level.
    pub fn take_named(&mut self, key: &str) -> Result<Vec<(String, Entry<'a>)>, LoadError> {
        let Some(outer) = self.take_table(key)? else { return Ok(Vec::new()) };
        let singular = key.trim_end_matches('s');
        let entries = outer.table.into_iter().map(|(name, value)| {
            let name = name.into_inner().into_owned();
            Ok((name.clone(), self.entry(format!("{singular} `{name}`"), value)?))
        });
        entries.collect()
    }

    /// Takes the tables `[[key]]`, or a single `[key]`, out of the top level.
    pub fn take_list(&mut self, key: &str) -> Result<Vec<Entry<'a>>, LoadError> {
        let Some(value) = self.root.remove(key) else { return Ok(Vec::new()) };
        let span = value.span();
        let values = match value.into_inner() {
            DeValue::Array(values) => values.into_iter().collect(),
            other => vec![Spanned::new(span, other)],
        };
        let entries = values.into_iter().enumerate().map(|(i, value)| {
            let name = value.get_ref().get("name").and_then(|name| name.get_ref().as_str());
            let label = match name {
                Some(name) => format!("{key} {} `{name}`", i + 1),
                None => format!("{key} {}", i + 1),
            };
            self.entry(label, value)
        });
        entries.collect()
    }

    /// Fails if a key is left at the top level.
    pub fn expect_empty(&self, known: &[&str]) -> Result<(), LoadError> {
        let Some((key, _)) = self.root.iter().next() else { return Ok(()) };
        let message = format!("unknown key `{}`, expected one of {}", key.get_ref(), quoted(known));
        Err(self.error(key.span().start, "top level", message))
    }

    /// Replaces `"${name}"` by the parameter's value and `${name}` inside a longer string by its text.
    pub fn substitute(&mut self, values: &BTreeMap<String, DeValue<'a>>) -> Result<(), LoadError> {
        let mut root = std::mem::take(&mut self.root);
        let result = root.iter_mut().try_for_each(|(_, value)| {
            visit(value, &mut |value| {
                let DeValue::String(text) = value.get_ref() else { return Ok(()) };
                let failed = |message: String| self.error(value.span().start, "a parameter", message);
                let Some(expanded) = expanded(text, values).map_err(failed)? else { return Ok(()) };
                self.session.budget().take(expanded.size() as u64, "parameters")?;
                let expanded = expanded.value();
                *value.get_mut() = expanded;
                Ok(())
            })
        });
        self.root = root;
        result
    }

    /// Fails if a number is not finite or too large to compute with.
    pub fn check_numbers(&mut self) -> Result<(), LoadError> {
        let mut root = std::mem::take(&mut self.root);
        let result = root.iter_mut().try_for_each(|(_, value)| {
            visit(value, &mut |value| {
                let text = match value.get_ref() {
                    DeValue::Float(number) => number.as_str(),
                    DeValue::Integer(number) if number.radix() == 10 => number.as_str(),
                    _ => return Ok(()),
                };
                if text.parse::<f64>().is_ok_and(|number| number.abs() <= MAX_NUMBER) {
                    return Ok(());
                }
                let message = format!("{text} is not a number that can be computed with");
                Err(self.error(value.span().start, "a number", message))
            })
        });
        self.root = root;
        result
    }
}

impl<'a> Entry<'a> {
    /// Reads the whole table.
    pub fn read<T: DeserializeOwned>(self) -> Result<T, LoadError> {
        let (lines, path, label, start) = (self.lines, self.path, self.label, self.span.start);
        let deserializer = Spanned::new(self.span, self.table).into_deserializer();
        T::deserialize(deserializer).map_err(|error| {
            let line = lines.of(error.span().map_or(start, |span| span.start));
            LoadError::malformed(path, format!("line {line}, {label}"), error.message())
        })
    }

    /// An error about this table.
    pub fn error(&self, message: impl Into<String>) -> LoadError {
        let line = self.lines.of(self.span.start);
        LoadError::malformed(self.path, format!("line {line}, {}", self.label), message)
    }

    /// What makes errors about this table once it is read.
    pub fn context(&self) -> Context {
        let line = self.lines.of(self.span.start);
        let (path, session) = (self.path.to_owned(), self.session.clone());
        Context { path, object: format!("line {line}, {}", self.label), session }
    }

    /// Takes a string out of the table; `None` if the key is missing.
    pub fn take_string(&mut self, key: &str) -> Result<Option<String>, LoadError> {
        let Some(value) = self.table.remove(key) else { return Ok(None) };
        match value.into_inner() {
            DeValue::String(text) => Ok(Some(text.into_owned())),
            other => Err(self.error(format!("`{key}` must be a string, not {}", with_article(&other)))),
        }
    }

    /// Takes a table out of the table; `None` if the key is missing or something else.
    pub fn take_table(&mut self, key: &str) -> Option<Entry<'a>> {
        if !self.table.get(key)?.get_ref().is_table() {
            return None;
        }
        let value = self.table.remove(key)?;
        let span = value.span();
        let DeValue::Table(table) = value.into_inner() else { return None };
        let label = format!("{}, `{key}`", self.label);
        let (lines, session, path) = (self.lines.clone(), self.session, self.path);
        Some(Entry { lines, session, path, label, span, table })
    }

    /// The keys that are left.
    pub fn keys(&self) -> Vec<String> {
        self.table.keys().map(|key| key.get_ref().clone().into_owned()).collect()
    }

    /// Splits the table: the keys of `keys` go to a new one.
    pub fn split(&mut self, keys: &[&str]) -> Entry<'a> {
        let mut table = DeTable::new();
        for key in keys {
            if let Some((name, value)) = self.table.remove_entry(*key) {
                table.insert(name, value);
            }
        }
        let (lines, session, path) = (self.lines.clone(), self.session, self.path);
        Entry { lines, session, path, label: self.label.clone(), span: self.span.clone(), table }
    }
}

/// Makes errors about one object.
#[derive(Clone, Debug)]
pub(super) struct Context {
    path: std::path::PathBuf,
    object: String,
    session: Session,
}

impl Context {
    /// An error about the object.
    pub fn error(&self, message: impl Into<String>) -> LoadError {
        LoadError::malformed(&self.path, self.object.clone(), message)
    }

    /// Takes bytes out of the scene's budget before something is made.
    pub fn take(&self, bytes: u64, what: &str) -> Result<(), LoadError> {
        self.session.budget().take(bytes, what)
    }

    /// Asks whether the scene's budget has room for what is counted once it is made.
    pub fn check_room(&self, bytes: u64, what: &str) -> Result<(), LoadError> {
        self.session.budget().check_room(bytes, what)
    }
}

/// Calls `action` for every value in the tree that is not a list or table.
fn visit<'a, E>(
    value: &mut Spanned<DeValue<'a>>,
    action: &mut impl FnMut(&mut Spanned<DeValue<'a>>) -> Result<(), E>,
) -> Result<(), E> {
    match value.get_mut() {
        DeValue::Array(values) => values.iter_mut().try_for_each(|value| visit(value, action)),
        DeValue::Table(table) => table.iter_mut().try_for_each(|(_, value)| visit(value, action)),
        _ => action(value),
    }
}

/// A text with parameters, filled in but not yet put together.
enum Expanded<'v, 'a> {
    /// It is a parameter and nothing else.
    Parameter(&'v DeValue<'a>),
    /// Pieces of it in turns with values.
    Text(Vec<&'v str>),
}

impl<'a> Expanded<'_, 'a> {
    /// Bytes that the value will take.
    fn size(&self) -> usize {
        match self {
            Self::Parameter(DeValue::String(text)) => text.len(),
            Self::Parameter(_) => 0,
            Self::Text(pieces) => pieces.iter().map(|piece| piece.len()).sum(),
        }
    }

    fn value(&self) -> DeValue<'a> {
        match self {
            Self::Parameter(value) => (*value).clone(),
            Self::Text(pieces) => DeValue::String(Cow::Owned(pieces.concat())),
        }
    }
}

/// What a text becomes when parameters are filled in; `None` if it has none.
fn expanded<'v, 'a>(
    text: &'v str,
    values: &'v BTreeMap<String, DeValue<'a>>,
) -> Result<Option<Expanded<'v, 'a>>, String> {
    if !text.contains("${") {
        return Ok(None);
    }
    let find =
        |name: &str| values.get(name).ok_or_else(|| format!("`{name}` is not among the file's [parameters]"));
    if let Some(name) = text.strip_prefix("${").and_then(|rest| rest.strip_suffix('}'))
        && !name.contains('}')
    {
        return Ok(Some(Expanded::Parameter(find(name)?)));
    }
    let mut pieces = Vec::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("${") {
        let (name, tail) = after.split_once('}').ok_or("`${` without `}`")?;
        pieces.push(before);
        pieces.push(match find(name)? {
            DeValue::String(text) => text,
            DeValue::Integer(number) => number.as_str(),
            DeValue::Float(number) => number.as_str(),
            DeValue::Boolean(true) => "true",
            DeValue::Boolean(false) => "false",
            DeValue::Datetime(_) | DeValue::Array(_) | DeValue::Table(_) => "",
        });
        rest = tail;
    }
    pieces.push(rest);
    Ok(Some(Expanded::Text(pieces)))
}

fn with_article(value: &DeValue) -> String {
    let kind = value.type_str();
    let article = if kind.starts_with(['a', 'i', 'o']) { "an" } else { "a" };
    format!("{article} {kind}")
}

/// Names in backticks, separated by commas.
pub(super) fn quoted(names: &[&str]) -> String {
    names.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ")
}

/// A name, or a table that describes the thing in place; errors in the table keep their own words.
#[derive(Clone, Debug)]
pub(super) enum NameOr<T> {
    /// A string.
    Name(String),
    /// A table.
    Table(T),
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for NameOr<T> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor<T>(std::marker::PhantomData<T>);
        impl<'de, T: Deserialize<'de>> serde::de::Visitor<'de> for Visitor<T> {
            type Value = NameOr<T>;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a string or a table")
            }
            fn visit_str<E>(self, text: &str) -> Result<Self::Value, E> {
                Ok(NameOr::Name(text.to_owned()))
            }
            fn visit_map<A: serde::de::MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                T::deserialize(serde::de::value::MapAccessDeserializer::new(map)).map(NameOr::Table)
            }
        }
        deserializer.deserialize_any(Visitor(std::marker::PhantomData))
    }
}
