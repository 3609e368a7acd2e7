//! Deserialisation errors, in plain words.

use std::fmt::{self, Display};
use std::ops::Range;

use serde::de::{Error, Expected, Unexpected};

use crate::error::suggestion;
use crate::error_code::{ErrorCode, Message};
use crate::foreign_terms::foreign_hint;

/// Deserialisation error. It is boxed to keep `Result` small, because a mesh has millions of numbers and each of them
/// returns a `Result`.
#[derive(Debug)]
pub struct DeError(pub Box<DeErrorDetails>);

/// Message and position of an error. The path is collected from the innermost value outwards.
#[derive(Debug)]
pub struct DeErrorDetails {
    /// `.key` and `[index]`, the innermost first.
    pub path: Vec<String>,
    pub message: Message,
    pub span: Option<Range<usize>>,
}

impl DeError {
    pub fn new(message: impl Into<Message>) -> Self {
        Self(Box::new(DeErrorDetails { path: Vec::new(), message: message.into(), span: None }))
    }

    /// Error of a value that is not as expected.
    fn unexpected(code: ErrorCode, given: Unexpected, expected: &dyn Expected) -> Self {
        Self::new(code.message(format!("{}; expected {}", found_text(given), expected_text(expected))))
    }

    /// Returns the error with the key or index of the enclosing table or list added.
    pub fn in_segment(mut self, segment: String, span: &Option<Range<usize>>) -> Self {
        self.0.path.push(segment);
        self.with_span(span)
    }

    /// Returns the error with this position in the text, if it has none yet.
    pub fn with_span(mut self, span: &Option<Range<usize>>) -> Self {
        if self.0.span.is_none() {
            self.0.span.clone_from(span);
        }
        self
    }
}

impl Display for DeError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0.message)
    }
}

impl std::error::Error for DeError {}

impl Error for DeError {
    fn custom<T: Display>(message: T) -> Self {
        Self::new(message.to_string())
    }

    fn invalid_type(given: Unexpected, expected: &dyn Expected) -> Self {
        Self::unexpected(ErrorCode::WrongType, given, expected)
    }

    fn invalid_value(given: Unexpected, expected: &dyn Expected) -> Self {
        Self::unexpected(ErrorCode::InvalidValue, given, expected)
    }

    fn invalid_length(length: usize, expected: &dyn Expected) -> Self {
        let message = format!("a list of length {length}; expected {}", expected_text(expected));
        Self::new(ErrorCode::WrongShape.message(message))
    }

    fn unknown_variant(given: &str, expected: &'static [&'static str]) -> Self {
        Self::new(ErrorCode::UnknownName.message(format!("unknown name {given:?}{}", hint(given, expected))))
    }

    fn unknown_field(given: &str, expected: &'static [&'static str]) -> Self {
        Self::new(ErrorCode::UnknownKey.message(format!("unknown key {given:?}{}", hint(given, expected))))
    }

    fn missing_field(field: &'static str) -> Self {
        Self::new(ErrorCode::MissingValue.message(format!("the key {field:?} is missing")))
    }

    fn duplicate_field(field: &'static str) -> Self {
        Self::new(ErrorCode::DuplicateName.message(format!("the key {field:?} occurs twice")))
    }
}

/// Returns a hint for a wrong name: the name that corresponds to a term of another program or to a misspelling, and all
/// expected names.
fn hint(given: &str, expected: &[&'static str]) -> String {
    let near = foreign_hint(given, expected).unwrap_or_else(|| suggestion(given, expected.iter().copied()));
    if expected.is_empty() || near.contains("expected one of") {
        return near;
    }
    format!("{near} (available: {})", expected.join(", "))
}

/// Describes the given value in plain words.
fn found_text(given: Unexpected) -> String {
    match given {
        Unexpected::Bool(v) => v.to_string(),
        Unexpected::Unsigned(v) => v.to_string(),
        Unexpected::Signed(v) => v.to_string(),
        Unexpected::Float(v) => v.to_string(),
        Unexpected::Str(v) => format!("{v:?}"),
        Unexpected::Unit => "nothing".into(),
        Unexpected::Seq => "a list".into(),
        Unexpected::Map => "a table".into(),
        other => other.to_string(),
    }
}

/// Rewrites serde's expectation in plain words.
fn expected_text(expected: &dyn Expected) -> String {
    let expected = expected.to_string();
    match expected.as_str() {
        "f32" | "f64" => "a number".into(),
        "u16" | "u32" | "u64" | "usize" => "a whole number >= 0".into(),
        "i32" | "i64" => "a whole number".into(),
        "a boolean" => "true or false".into(),
        "a sequence" => "a list".into(),
        other => match other.strip_prefix("an array of length ") {
            Some(length) => format!("a list of length {length}"),
            None if other.starts_with("struct ") => "a table".into(),
            None => expected,
        },
    }
}

/// Joins names in quotes, separated by commas.
pub fn quoted(names: &[&'static str]) -> String {
    names.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ")
}
