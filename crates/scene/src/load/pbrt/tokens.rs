//! Text to tokens: words, quoted strings, numbers, brackets; comments begin with `#`.

use std::path::Path;
use std::sync::Arc;

/// A token and where it is.
#[derive(Clone, Debug)]
pub(super) struct Token {
    pub kind: TokenKind,
    pub place: Place,
}

/// A file and a line in it, from 1.
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub file: Arc<Path>,
    pub line: u32,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}, line {}", self.file.display(), self.line)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum TokenKind {
    /// A directive, `true` or `false`.
    Word(String),
    /// What stood in quotes.
    Text(String),
    Number(f32),
    Open,
    Close,
}

/// Reads tokens of one file.
pub(super) struct Tokens {
    text: Vec<u8>,
    at: usize,
    line: u32,
    file: Arc<Path>,
}

impl Tokens {
    pub fn new(file: Arc<Path>, text: Vec<u8>) -> Self {
        Self { text, at: 0, line: 1, file }
    }

    pub fn file(&self) -> &Path {
        &self.file
    }

    pub fn place(&self) -> Place {
        Place { file: self.file.clone(), line: self.line }
    }

    fn skip_blank(&mut self) {
        while let Some(byte) = self.text.get(self.at) {
            match byte {
                b'\n' => self.line += 1,
                b'#' => {
                    let rest = &self.text[self.at..];
                    self.at += rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
                    continue;
                }
                byte if byte.is_ascii_whitespace() => {}
                _ => return,
            }
            self.at += 1;
        }
    }

    /// The next token; `None` at the end of the file.
    ///
    /// # Errors
    /// A sentence: a string without an end, or a word that is neither a number nor a name.
    pub fn next(&mut self) -> Result<Option<Token>, String> {
        self.skip_blank();
        let place = self.place();
        let Some(first) = self.text.get(self.at) else { return Ok(None) };
        let kind = match first {
            b'[' => {
                self.at += 1;
                TokenKind::Open
            }
            b']' => {
                self.at += 1;
                TokenKind::Close
            }
            b'"' => self.quoted()?,
            _ => self.word()?,
        };
        Ok(Some(Token { kind, place }))
    }

    fn quoted(&mut self) -> Result<TokenKind, String> {
        let rest = &self.text[self.at + 1..];
        let end = rest.iter().position(|b| matches!(b, b'"' | b'\n')).filter(|end| rest[*end] == b'"');
        let Some(end) = end else { return Err("a string has no end".into()) };
        let text = String::from_utf8_lossy(&rest[..end]).into_owned();
        self.at += end + 2;
        Ok(TokenKind::Text(text))
    }

    fn word(&mut self) -> Result<TokenKind, String> {
        let rest = &self.text[self.at..];
        let is_end = |b: &u8| b.is_ascii_whitespace() || matches!(b, b'[' | b']' | b'"' | b'#');
        let end = rest.iter().position(is_end).unwrap_or(rest.len());
        let word = String::from_utf8_lossy(&rest[..end]).into_owned();
        self.at += end;
        if word.starts_with(|c: char| c.is_ascii_alphabetic()) {
            return Ok(TokenKind::Word(word));
        }
        match word.parse() {
            Ok(number) => Ok(TokenKind::Number(number)),
            Err(_) => Err(format!("`{}` is not a number", word.chars().take(40).collect::<String>())),
        }
    }
}
