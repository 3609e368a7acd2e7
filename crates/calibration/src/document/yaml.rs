//! Trees of YAML, and of JSON, which is a subset of YAML. Aliases are copied, up to a limit. A file with several
//! different documents is rejected.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use saphyr_parser::{Event, Parser, ScalarStyle};

use crate::document::lens_keys::refused_without_value;
use crate::document::{DocumentNode, MAX_DEPTH, Value};
use raycam_formats::{FormatError, Result};

/// Maximum number of values that aliases may add to a document, because a few lines of nested aliases could create any
/// number.
const MAX_COPIED_VALUES: usize = 1 << 16;

/// Indentation that is added to the second and later lines of a bracketed list, deeper than any key of a calibration.
const LIST_INDENT: &str = "                                                                ";

/// A list or map that is being read; a map is stored with the key whose value follows and with its previous keys.
enum Open {
    List(Vec<DocumentNode>),
    Map(Vec<(String, DocumentNode)>, Option<String>, HashSet<String>),
}

/// Parses a text to a tree. Files of OpenCV and of SLAM programs begin with `%YAML:1.0`, which is not valid YAML, and
/// OpenCV accepts keys without a space before their value. Both are therefore accepted in these files, and in files
/// that would otherwise not be valid YAML. JSON may contain tabs, and comments in OpenCV's notation.
pub(crate) fn parse(text: &str, path: &Path) -> Result<DocumentNode> {
    parse_any(text, path).map(without_node_name)
}

/// Returns the parameters of the only node in a parameter file of ROS 2, `/**: {ros__parameters: {...}}`. Any other
/// document is returned unchanged.
fn without_node_name(node: DocumentNode) -> DocumentNode {
    let mut inner = &node;
    // The name of the node may be nested in a namespace.
    for _ in 0..3 {
        let Value::Map(entries) = &inner.value else { break };
        let [(key, below)] = &entries[..] else { break };
        if key == "ros__parameters" {
            return below.clone();
        }
        inner = below;
    }
    node
}

fn parse_any(text: &str, path: &Path) -> Result<DocumentNode> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let start = text.trim_start();
    if let Some(list) = list_of_json_lines(start) {
        return parse_strict(&list, path);
    }
    if start.starts_with(['{', '[']) && ["\t", "//", "/*"].iter().any(|mark| text.contains(mark)) {
        return parse_strict(&without_comments(&text.replace('\t', " ")), path);
    }
    if start.starts_with("//") || start.starts_with("/*") {
        let plain = without_comments(text);
        if plain.trim_start().starts_with(['{', '[']) {
            return parse_strict(&plain.replace('\t', " "), path);
        }
    }
    let old = text.strip_prefix("%YAML:1.0").or_else(|| text.strip_prefix("%YAML 1.0"));
    let spaced = with_spaces(old.unwrap_or(text));
    let first = if old.is_some() { parse_strict(&spaced, path) } else { parse_strict(text, path) };
    first.or_else(|error| {
        let attempts = [spaced.clone(), with_indented_lists(&spaced)];
        let parsed = attempts.iter().filter(|attempt| *attempt != text).find_map(|text| parse_strict(text, path).ok());
        parsed.ok_or(error)
    })
}

/// Returns JSON Lines, with one object in each line, as a list in the same lines; `None` for another text.
fn list_of_json_lines(text: &str) -> Option<String> {
    let lines: Vec<&str> = text.trim_end().lines().map(str::trim).collect();
    let is_object = |line: &&str| line.starts_with('{') && line.ends_with('}');
    (lines.len() > 1 && lines.iter().all(is_object)).then(|| format!("[{}]", lines.join(",\n")))
}

/// Indents the lines of `[...]`, because OpenCV and PyYAML accept these lines at any column, and adds a comma between
/// the rows of an array that NumPy has printed.
fn with_indented_lists(text: &str) -> String {
    let mut indented = String::with_capacity(text.len());
    let mut depth = 0_usize;
    let mut closed = false;
    for line in text.split_inclusive('\n') {
        let start = line.trim_start_matches([' ', '\t']);
        let continues = depth > 0 && !start.trim().is_empty();
        if continues {
            indented.push_str(LIST_INDENT);
        }
        let (mut quote, mut last) = (None, '\n');
        for c in (if continues { start } else { line }).chars() {
            match (quote, c) {
                (Some(open), c) if open == c => quote = None,
                (None, '"' | '\'') => quote = Some(c),
                (None, '#') if last.is_whitespace() => quote = Some('\n'),
                (None, '[') => {
                    if closed && depth > 0 {
                        indented.push(',');
                    }
                    depth += 1;
                }
                (None, ']') => depth = depth.saturating_sub(1),
                _ => {}
            }
            if quote.is_none() && !c.is_whitespace() {
                closed = c == ']';
            }
            indented.push(c);
            last = c;
        }
    }
    indented
}

/// Returns the text with a space between `word:` and its value, as YAML requires.
fn with_spaces(text: &str) -> String {
    let mut spaced = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let start = line.trim_start();
        let key = start.bytes().take_while(|b| b.is_ascii_alphanumeric() || b"_.-".contains(b)).count();
        let colon = line.len() - start.len() + key;
        let value = line.get(colon + 1..).filter(|_| key > 0 && line.as_bytes().get(colon) == Some(&b':'));
        match value {
            Some(value) if !value.starts_with([' ', '\t', '\r', '\n', '/', '\\', ':']) && !value.is_empty() => {
                spaced.push_str(&line[..=colon]);
                spaced.push(' ');
                spaced.push_str(value);
            }
            _ => spaced.push_str(line),
        }
    }
    spaced
}

/// Removes comments from JSON: from `//` to the end of the line, and from `/*` to `*/`, outside quotes. Line breaks are
/// kept, so that line numbers do not change.
fn without_comments(text: &str) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut rest = text;
    let mut is_quoted = false;
    while let Some(c) = rest.chars().next() {
        let mut length = c.len_utf8();
        let mut is_comment = false;
        match c {
            '"' => is_quoted = !is_quoted,
            '\\' if is_quoted => length += rest[1..].chars().next().map_or(0, char::len_utf8),
            '/' if !is_quoted && rest.starts_with("//") => {
                (length, is_comment) = (rest.find('\n').unwrap_or(rest.len()), true);
            }
            '/' if !is_quoted && rest.starts_with("/*") => {
                (length, is_comment) = (rest.find("*/").map_or(rest.len(), |end| end + 2), true);
            }
            _ => {}
        }
        let (part, after) = rest.split_at(length);
        match is_comment {
            true => kept.extend(part.chars().filter(|c| *c == '\n')),
            false => kept.push_str(part),
        }
        rest = after;
    }
    kept
}

/// Number of nodes in a tree.
fn count_values(node: &DocumentNode) -> usize {
    match &node.value {
        Value::Scalar(_) => 1,
        Value::List(items) => 1 + items.iter().map(count_values).sum::<usize>(),
        Value::Map(entries) => 1 + entries.iter().map(|(_, value)| count_values(value)).sum::<usize>(),
    }
}

/// Returns the reason why an empty value cannot follow the current key; `None` if it can.
fn refused_empty(event: &Event<'_>, open: &[(Open, usize, usize)]) -> Option<String> {
    match (event, open.last()) {
        (Event::Scalar(word, ScalarStyle::Plain, ..), Some((Open::Map(_, Some(key), _), ..)))
            if word.is_empty() || word == "~" =>
        {
            refused_without_value(key)
        }
        _ => None,
    }
}

/// Key whose value contains entries of the enclosing map, as in `<<: *defaults`.
const MERGE_KEY: &str = "<<";

/// Returns the entries of a map with the entries of its merge key. The map's own entries take precedence, then the
/// entries of earlier maps in a list.
fn with_merged_entries(mut entries: Vec<(String, DocumentNode)>) -> Vec<(String, DocumentNode)> {
    let is_map = |node: &DocumentNode| matches!(node.value, Value::Map(_));
    let is_mergeable = |node: &DocumentNode| match &node.value {
        Value::List(items) => items.iter().all(is_map),
        _ => is_map(node),
    };
    let Some(at) = entries.iter().position(|(key, node)| key == MERGE_KEY && is_mergeable(node)) else {
        return entries;
    };
    let merged = match entries.remove(at).1 {
        DocumentNode { value: Value::List(items), .. } => items,
        node => vec![node],
    };
    let mut known: HashSet<String> = entries.iter().map(|(key, _)| key.clone()).collect();
    for node in merged {
        let Value::Map(inherited) = node.value else { continue };
        for (key, value) in inherited {
            if known.insert(key.clone()) {
                entries.push((key, value));
            }
        }
    }
    entries
}

fn parse_strict(body: &str, path: &Path) -> Result<DocumentNode> {
    let mut open: Vec<(Open, usize, usize)> = Vec::new();
    let mut anchors: HashMap<usize, DocumentNode> = HashMap::new();
    let mut copied = 0;
    let mut root: Option<DocumentNode> = None;
    for event in Parser::new_from_str(body) {
        let (event, span) = event.map_err(|error| FormatError::line(path, error.marker().line(), error.info()))?;
        let line = span.start.line();
        let fail = |message: &str| Err(FormatError::line(path, line, message));
        if let Some(reason) = refused_empty(&event, &open) {
            return fail(&reason);
        }
        let (anchor, done) = match event {
            Event::Scalar(word, _, anchor, _) => {
                (anchor, DocumentNode { value: Value::Scalar(word.into_owned()), line })
            }
            Event::SequenceStart(anchor, _) | Event::MappingStart(anchor, _) => {
                if open.len() >= MAX_DEPTH {
                    return fail("the file is nested too deeply for a calibration");
                }
                let new = match event {
                    Event::SequenceStart(..) => Open::List(vec![]),
                    _ => Open::Map(vec![], None, HashSet::new()),
                };
                open.push((new, line, anchor));
                continue;
            }
            Event::SequenceEnd | Event::MappingEnd => match open.pop() {
                Some((Open::List(items), line, anchor)) => (anchor, DocumentNode { value: Value::List(items), line }),
                Some((Open::Map(entries, None, _), line, anchor)) => {
                    (anchor, DocumentNode { value: Value::Map(with_merged_entries(entries)), line })
                }
                _ => return fail("a key without a value"),
            },
            Event::Alias(anchor) => {
                let Some(named) = anchors.get(&anchor) else {
                    return fail("alias (*) of an incomplete value; write the value out");
                };
                copied += count_values(named);
                if copied > MAX_COPIED_VALUES {
                    return fail("aliases (*) repeat too many values for a calibration; write the values out");
                }
                (0, named.clone())
            }
            Event::Nothing | Event::StreamStart | Event::StreamEnd | Event::DocumentStart(_) | Event::DocumentEnd => {
                continue;
            }
        };
        if anchor != 0 {
            anchors.insert(anchor, done.clone());
        }
        match open.last_mut() {
            // Tools end each message with `---`; an empty document after this line is ignored.
            None if matches!(&done.value, Value::Scalar(word) if word.is_empty() || word == "~") => {}
            None => match &root {
                None => root = Some(done),
                Some(first) if first.same_as(&done) => {}
                Some(_) => {
                    return fail(
                        "a second document that differs from the first; expected one calibration per file, so keep \
                         only one of the documents",
                    );
                }
            },
            Some((Open::List(items), ..)) => items.push(done),
            Some((Open::Map(entries, key, known), ..)) => match (key.take(), done) {
                (Some(key), value) => entries.push((key, value)),
                (None, DocumentNode { value: Value::Scalar(word), line }) => {
                    if !known.insert(word.clone()) {
                        return Err(FormatError::line(path, line, format!("{word} is defined twice")));
                    }
                    *key = Some(word);
                }
                (None, _) => return fail("expected a word as key"),
            },
        }
    }
    root.ok_or_else(|| FormatError::whole(path, "the file is empty"))
}
