//! Words, quoted texts and signs, each with its line.

use super::At;
use crate::error::ModelError;

/// A piece of a text file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Token {
    pub text: String,
    pub line: usize,
    pub quoted: bool,
}

/// What a word is made of, and how a comment begins.
#[derive(Clone, Copy)]
pub(super) struct Style {
    pub format: &'static str,
    /// Characters of words beside letters, digits, `_` and `.`.
    pub in_words: &'static str,
    /// A sign that makes the rest of the line a comment, beside `//`.
    pub comment: Option<char>,
}

/// The tokens of a file, read one by one.
pub(super) struct Tokens {
    style: Style,
    all: Vec<Token>,
    next: usize,
}

impl Tokens {
    pub fn read(text: &str, style: Style) -> Result<Self, ModelError> {
        let mut tokens = Vec::new();
        let mut line = 1;
        let mut chars = text.chars().peekable();
        let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.' || style.in_words.contains(c);
        while let Some(c) = chars.next() {
            let start = line;
            if c == '\n' {
                line += 1;
            } else if style.comment == Some(c) || c == '/' && chars.peek() == Some(&'/') {
                while chars.next_if(|c| *c != '\n').is_some() {}
            } else if c == '/' && chars.peek() == Some(&'*') {
                let mut last = ' ';
                let mut closed = false;
                chars.next();
                for c in chars.by_ref() {
                    if c == '\n' {
                        line += 1;
                    }
                    if last == '*' && c == '/' {
                        closed = true;
                        break;
                    }
                    last = c;
                }
                if !closed {
                    return Err(style.at(start).error("a comment without end", "`*/`"));
                }
            } else if c == '"' {
                let mut quoted = String::new();
                let mut closed = false;
                for c in chars.by_ref() {
                    if c == '\n' {
                        line += 1;
                    }
                    if c == '"' {
                        closed = true;
                        break;
                    }
                    quoted.push(c);
                }
                if !closed {
                    return Err(style.at(start).error("a text without end", "`\"`"));
                }
                tokens.push(Token {
                    text: quoted,
                    line: start,
                    quoted: true,
                });
            } else if is_word(c) {
                let mut word = String::from(c);
                loop {
                    // The sign of an exponent belongs to its number.
                    let exponent = word.starts_with(|c: char| c.is_ascii_digit() || c == '.')
                        && word.ends_with(['e', 'E']);
                    match chars.next_if(|c| is_word(*c) || exponent && (*c == '+' || *c == '-')) {
                        Some(c) => word.push(c),
                        None => break,
                    }
                }
                tokens.push(Token {
                    text: word,
                    line,
                    quoted: false,
                });
            } else if !c.is_whitespace() {
                tokens.push(Token {
                    text: c.into(),
                    line,
                    quoted: false,
                });
            }
        }
        Ok(Self {
            style,
            all: tokens,
            next: 0,
        })
    }

    /// Where the next token stands.
    pub fn at(&self) -> At {
        let token = self.all.get(self.next).or(self.all.last());
        self.style.at(token.map_or(1, |token| token.line))
    }

    pub fn peek(&self) -> Option<&Token> {
        self.all.get(self.next)
    }

    pub fn advance(&mut self) -> Option<Token> {
        let token = self.all.get(self.next).cloned();
        self.next += 1;
        token
    }

    /// Whether the next token is this sign or word; it is then passed.
    pub fn pass(&mut self, text: &str) -> bool {
        let here = self
            .peek()
            .is_some_and(|token| token.text == text && !token.quoted);
        if here {
            self.next += 1;
        }
        here
    }

    pub fn expect(&mut self, text: &str) -> Result<(), ModelError> {
        if self.pass(text) {
            return Ok(());
        }
        Err(self.unexpected(&format!("`{text}`")))
    }

    /// A name: a word or a quoted text.
    pub fn name(&mut self, what: &str) -> Result<String, ModelError> {
        let is_name = self.peek().is_some_and(|t| {
            t.quoted
                || t.text
                    .starts_with(|c: char| c.is_alphanumeric() || "_.-+".contains(c))
        });
        match self.advance() {
            Some(token) if is_name => Ok(token.text),
            _ => {
                self.next -= 1;
                Err(self.unexpected(what))
            }
        }
    }

    /// Passes everything up to and with this sign.
    pub fn skip_past(&mut self, text: &str) -> Result<(), ModelError> {
        while self.peek().is_some() {
            if self.pass(text) {
                return Ok(());
            }
            self.next += 1;
        }
        Err(self.unexpected(&format!("`{text}`")))
    }

    pub fn unexpected(&self, expected: &str) -> ModelError {
        let found = self
            .peek()
            .map_or("the end of the file".into(), |token| format!("`{}`", token.text));
        self.at().error(found, expected)
    }
}

impl Style {
    fn at(self, line: usize) -> At {
        At {
            format: self.format,
            line,
        }
    }
}
