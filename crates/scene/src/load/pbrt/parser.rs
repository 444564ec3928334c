//! Tokens to directives, through included files.

use super::parameters::{Parameters, Values};
use super::tokens::{Place, Token, TokenKind, Tokens};
use crate::{LoadError, LoadOptions};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Files may include each other this deep, and so many in all.
const MAX_DEPTH: usize = 32;
const MAX_FILES: usize = 4096;
/// What opening a file costs in the budget, in bytes.
const PER_FILE: u64 = 1 << 12;

/// Reads the tokens of a file and of the files that it includes.
pub(super) struct Parser<'o> {
    options: &'o LoadOptions,
    /// The files that are being read, the innermost last.
    stack: Vec<Tokens>,
    /// A token that was looked at and not taken.
    pending: Option<Token>,
    files: usize,
    pub bytes_read: u64,
}

impl<'o> Parser<'o> {
    pub fn new(path: &Path, text: Vec<u8>, options: &'o LoadOptions) -> Self {
        let bytes_read = text.len() as u64;
        let stack = vec![Tokens::new(Arc::from(path), text)];
        Self { options, stack, pending: None, files: 1, bytes_read }
    }

    /// The folder that file names are relative to.
    pub fn resolve(&self, place: &Place, name: &str) -> PathBuf {
        place.file.parent().unwrap_or(Path::new("")).join(name)
    }

    /// An error at a place.
    pub fn error(&self, place: &Place, message: impl Into<String>) -> LoadError {
        LoadError::malformed(&place.file, format!("line {}", place.line), message)
    }

    /// The next token of all files; `None` at the end of the first.
    pub fn next(&mut self) -> Result<Option<Token>, LoadError> {
        if let Some(token) = self.pending.take() {
            return Ok(Some(token));
        }
        while let Some(tokens) = self.stack.last_mut() {
            match tokens.next() {
                Ok(Some(token)) => return Ok(Some(token)),
                Ok(None) => {
                    self.stack.pop();
                }
                Err(message) => {
                    let place = tokens.place();
                    return Err(self.error(&place, message));
                }
            }
        }
        Ok(None)
    }

    /// Gives a token back: it comes next again.
    pub fn put_back(&mut self, token: Token) {
        self.pending = Some(token);
    }

    /// Goes on in another file, and comes back at its end.
    pub fn include(&mut self, place: &Place, name: &str) -> Result<(), LoadError> {
        let path = self.resolve(place, name);
        if self.stack.len() >= MAX_DEPTH || self.stack.iter().any(|file| file.file() == path) {
            return Err(
                self.error(place, format!("{} includes itself, or files are too deep", path.display()))
            );
        }
        self.files += 1;
        if self.files > MAX_FILES {
            return Err(self.error(place, format!("the scene includes more than {MAX_FILES} files")));
        }
        let text = self.options.read(&path)?;
        // Its text becomes numbers and words, each time that it is included.
        const PER_BYTE: u64 = 16;
        self.options.budget().take(text.len() as u64 * PER_BYTE + PER_FILE, "included files")?;
        self.bytes_read += text.len() as u64;
        let text = crate::load::text::decoded(&path, &text)?.into_owned();
        self.stack.push(Tokens::new(Arc::from(path), text));
        Ok(())
    }

    /// A string that must come next.
    pub fn text(&mut self, place: &Place) -> Result<String, LoadError> {
        match self.next()? {
            Some(Token { kind: TokenKind::Text(text), .. }) => Ok(text),
            other => Err(self.unexpected(place, "a string in quotes", other)),
        }
    }

    /// `N` numbers that must come next, with or without brackets.
    pub fn numbers<const N: usize>(&mut self, place: &Place) -> Result<[f32; N], LoadError> {
        let mut numbers = [0.0; N];
        let mut token = self.next()?;
        let bracketed = matches!(token, Some(Token { kind: TokenKind::Open, .. }));
        if bracketed {
            token = self.next()?;
        }
        for (i, number) in numbers.iter_mut().enumerate() {
            if i > 0 {
                token = self.next()?;
            }
            match token {
                Some(Token { kind: TokenKind::Number(value), .. }) => *number = value,
                other => return Err(self.unexpected(place, "a number", other)),
            }
        }
        if bracketed {
            match self.next()? {
                Some(Token { kind: TokenKind::Close, .. }) => {}
                other => return Err(self.unexpected(place, "`]`", other)),
            }
        }
        Ok(numbers)
    }

    /// All parameters that follow.
    pub fn parameters(&mut self, place: &Place) -> Result<Parameters, LoadError> {
        let mut parameters = Parameters::new(place.clone());
        loop {
            let token = self.next()?;
            let Some(Token { kind: TokenKind::Text(declaration), place }) = token else {
                self.pending = token;
                return Ok(parameters);
            };
            let mut words = declaration.split_whitespace();
            let (Some(kind), Some(name), None) = (words.next(), words.next(), words.next()) else {
                return Err(self.error(&place, format!("`{declaration}` is not a type and a name")));
            };
            let values = self.values(&place)?;
            parameters.insert(kind, name, values);
        }
    }

    fn values(&mut self, place: &Place) -> Result<Values, LoadError> {
        let first = self.next()?;
        let Some(Token { kind: TokenKind::Open, .. }) = first else {
            let mut values = None;
            self.value(place, first, &mut values)?;
            return Ok(values.unwrap_or(Values::Numbers(Vec::new())));
        };
        let mut values = None;
        loop {
            match self.next()? {
                Some(Token { kind: TokenKind::Close, .. }) => {
                    return Ok(values.unwrap_or(Values::Numbers(Vec::new())));
                }
                token => self.value(place, token, &mut values)?,
            }
        }
    }

    /// Adds a value to those before it, which must be of the same type.
    fn value(
        &self,
        place: &Place,
        token: Option<Token>,
        values: &mut Option<Values>,
    ) -> Result<(), LoadError> {
        let kind = token.as_ref().map(|t| &t.kind);
        match (kind, values) {
            (Some(TokenKind::Number(n)), Some(Values::Numbers(all))) => all.push(*n),
            (Some(TokenKind::Number(n)), none @ None) => *none = Some(Values::Numbers(vec![*n])),
            (Some(TokenKind::Text(t)), Some(Values::Texts(all))) => all.push(t.clone()),
            (Some(TokenKind::Text(t)), none @ None) => *none = Some(Values::Texts(vec![t.clone()])),
            (Some(TokenKind::Word(w)), Some(Values::Truths(all))) if is_truth(w) => all.push(w == "true"),
            (Some(TokenKind::Word(w)), none @ None) if is_truth(w) => {
                *none = Some(Values::Truths(vec![w == "true"]));
            }
            _ => return Err(self.unexpected(place, "a value of the parameter", token)),
        }
        Ok(())
    }

    pub fn unexpected(&self, place: &Place, expected: &str, found: Option<Token>) -> LoadError {
        let found_text = match found.as_ref().map(|t| &t.kind) {
            None => "the end of the file".into(),
            Some(TokenKind::Word(word)) => format!("`{word}`"),
            Some(TokenKind::Text(text)) => format!("\"{text}\""),
            Some(TokenKind::Number(number)) => format!("`{number}`"),
            Some(TokenKind::Open) => "`[`".into(),
            Some(TokenKind::Close) => "`]`".into(),
        };
        let place = found.as_ref().map_or(place, |t| &t.place);
        self.error(place, format!("expected {expected}, found {found_text}"))
    }
}

fn is_truth(word: &str) -> bool {
    matches!(word, "true" | "false")
}
