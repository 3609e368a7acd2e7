//! XML as a tree. In OpenCV's files, elements called `_` are the items of a list, and several words form a list. In other
//! files, attributes are entries, and elements with the same name form a list.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

use crate::document::{DocumentNode, MAX_DEPTH, Value, number_text};
use raycam_formats::{FormatError, Result};

/// Parses the tree below the root element.
pub(crate) fn parse(text: &str, path: &Path) -> Result<DocumentNode> {
    let options = ParsingOptions { allow_dtd: false, nodes_limit: 1 << 22, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options)
        .map_err(|error| FormatError::line(path, error.pos().row as usize, error.to_string()))?;
    let root = document.root_element();
    let lines = text.match_indices('\n').map(|(at, _)| at).collect();
    Tree { lines, path, is_opencv: root.tag_name().name() == "opencv_storage" }.node(root, 0)
}

/// Converter of the elements of one file.
struct Tree<'p> {
    /// Positions of the line ends.
    lines: Vec<usize>,
    path: &'p Path,
    is_opencv: bool,
}

impl Tree<'_> {
    fn node(&self, element: Node<'_, '_>, depth: usize) -> Result<DocumentNode> {
        let line = 1 + self.lines.partition_point(|&at| at < element.range().start);
        if depth >= MAX_DEPTH {
            return Err(FormatError::line(self.path, line, "the file is nested too deeply for a calibration"));
        }
        let children: Vec<_> = element.children().filter(Node::is_element).collect();
        let text: String = element.children().filter_map(|child| child.text()).collect();
        let text = text.trim();
        let value = if children.is_empty() && (!text.is_empty() || self.attributes(element, "", line).is_empty()) {
            value_of_text(text, line, element.tag_name().name() == "data")
        } else if !children.is_empty() && children.iter().all(|child| child.tag_name().name() == "_") {
            let items: Result<_, _> = children.into_iter().map(|child| self.node(child, depth + 1)).collect();
            Value::List(items?)
        } else {
            self.map(element, &children, line, depth)?
        };
        Ok(DocumentNode { value, line })
    }

    /// Entries of an element: its attributes and its children. The attributes of a child that contains only a text become
    /// entries with the keys `CHILD.ATTRIBUTE`.
    fn map(&self, element: Node<'_, '_>, children: &[Node<'_, '_>], line: usize, depth: usize) -> Result<Value> {
        let mut entries = self.attributes(element, "", line);
        let mut groups: Vec<(&str, Vec<DocumentNode>)> = Vec::new();
        let mut places: HashMap<&str, usize> = HashMap::new();
        for child in children {
            let name = child.tag_name().name();
            let inner = self.node(*child, depth + 1)?;
            let place = *places.entry(name).or_insert(groups.len());
            if place == groups.len() {
                groups.push((name, vec![]));
            } else if self.is_opencv {
                return Err(FormatError::line(self.path, inner.line, format!("{name} is defined twice")));
            }
            if !matches!(inner.value, Value::Map(_)) {
                entries.extend(self.attributes(*child, &format!("{name}."), inner.line));
            }
            groups[place].1.push(inner);
        }
        for (name, nodes) in &groups {
            let attribute = entries.iter().find(|(key, _)| key == name).map(|(_, node)| &node.value);
            if let (Some(attribute), Some(first)) = (attribute, nodes.first())
                && (nodes.len() > 1 || first.value != *attribute)
            {
                let text = format!("{name} is both an attribute and an element; remove one of the two");
                return Err(FormatError::line(self.path, first.line, text));
            }
        }
        let value_of = |mut nodes: Vec<DocumentNode>| match (nodes.len(), nodes.first().map_or(line, |node| node.line))
        {
            (1, _) => nodes.remove(0),
            (_, line) => DocumentNode { value: Value::List(nodes), line },
        };
        entries.extend(groups.into_iter().map(|(name, nodes)| (name.to_owned(), value_of(nodes))));
        let mut known = HashSet::new();
        entries.retain(|(key, _)| known.insert(key.clone()));
        Ok(Value::Map(entries))
    }

    /// Attributes of an element as entries whose keys begin with `prefix`; none for OpenCV's files, whose attributes are
    /// the types of the values.
    fn attributes(&self, element: Node<'_, '_>, prefix: &str, line: usize) -> Vec<(String, DocumentNode)> {
        let own = element
            .attributes()
            .filter(|attribute| !self.is_opencv && attribute.namespace().is_none() && attribute.name() != "type_id");
        let entry = |attribute: roxmltree::Attribute<'_, '_>| {
            let value = Value::Scalar(attribute.value().trim().to_owned());
            (format!("{prefix}{}", attribute.name()), DocumentNode { value, line })
        };
        own.map(entry).collect()
    }
}

/// Value of an element that contains only a text: a word, or a list of words; the text of the element `data` is always a
/// list. Numbers in another notation, such as `500, 0, 320`, are one word.
fn value_of_text(text: &str, line: usize, is_data: bool) -> Value {
    let word = |word: &str| Value::Scalar(word.to_owned());
    if let Some(quoted) = text.strip_prefix('"').and_then(|text| text.strip_suffix('"')) {
        return word(quoted);
    }
    if text.contains([',', ';', '[', '(']) && number_text::numbers(text).is_some() {
        return word(text);
    }
    if is_data || text.split_whitespace().nth(1).is_some() {
        let item = |text| DocumentNode { value: word(text), line };
        return Value::List(text.split_whitespace().map(item).collect());
    }
    word(text)
}
