//! A description before interpretation: a tree of values with their positions in the text.

use std::ops::Range;

/// Value with its position in the text, if it came from a text.
#[derive(Clone, Debug, PartialEq)]
pub struct SpannedValue {
    /// The value.
    pub value: Value,
    /// Byte range in the text.
    pub span: Option<Range<usize>>,
}

/// Value of a description.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Python's `None`, as if the key were absent.
    Null,
    /// True or false.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// A whole number that does not fit into an `i64`.
    Unsigned(u64),
    /// Any number, finite or not.
    Float(f64),
    /// A string.
    String(String),
    /// Values in order.
    List(Vec<SpannedValue>),
    /// Values by key, in order of appearance; keys are unique.
    Table(Vec<Entry>),
    /// An array of numbers in row-major order, as in NumPy; equivalent to lists of lists.
    Floats {
        /// Length along each axis; their product is the length of `data`.
        shape: Vec<usize>,
        /// The numbers.
        data: Vec<f64>,
    },
    /// An array of whole numbers in row-major order.
    Integers {
        /// Length along each axis; their product is the length of `data`.
        shape: Vec<usize>,
        /// The numbers.
        data: Vec<i64>,
    },
}

/// Key and its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The key.
    pub key: String,
    /// Byte range of the key in the text.
    pub key_span: Option<Range<usize>>,
    /// The value.
    pub value: SpannedValue,
}

impl From<Value> for SpannedValue {
    fn from(value: Value) -> Self {
        Self { value, span: None }
    }
}

impl SpannedValue {
    /// Position in the text of a path such as `object[2].diffuse`, as in
    /// [`SceneError::Schema`](crate::SceneError::Schema); if the path itself is not in the text, the position of its
    /// nearest ancestor.
    pub fn span_at(&self, path: &str) -> Option<Range<usize>> {
        let mut node = self;
        let mut span = self.span.clone();
        for segment in path.split(['.', '[']).filter(|segment| !segment.is_empty()) {
            let found = match (&node.value, segment.strip_suffix(']')) {
                (Value::List(items), Some(index)) => index.parse().ok().and_then(|i: usize| items.get(i)),
                // A single table is accepted in place of a list with one table.
                (Value::Table(_), Some("0")) => Some(node),
                (Value::Table(entries), None) => entries.iter().find(|entry| entry.key == segment).map(|entry| {
                    span = entry.key_span.clone().or(span.take());
                    &entry.value
                }),
                _ => None,
            };
            let Some(next) = found else { break };
            node = next;
            span = node.span.clone().or(span);
        }
        span
    }
}
