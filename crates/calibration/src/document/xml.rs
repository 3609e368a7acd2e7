//! OpenCV's XML as a tree: elements called `_` are the items of a list, and several words form a list.

use std::collections::HashSet;
use std::path::Path;

use roxmltree::{Document, ParsingOptions};

use crate::document::{DocumentNode, MAX_DEPTH, Value};
use raycam_formats::{FormatError, Result};

/// Parses the tree below the element `opencv_storage`.
pub(crate) fn parse(text: &str, path: &Path) -> Result<DocumentNode> {
    let options = ParsingOptions { allow_dtd: false, nodes_limit: 1 << 22, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options)
        .map_err(|error| FormatError::line(path, error.pos().row as usize, error.to_string()))?;
    let lines: Vec<usize> = text.match_indices('\n').map(|(at, _)| at).collect();
    let root = document.root_element();
    if root.tag_name().name() != "opencv_storage" {
        let name = root.tag_name().name();
        return Err(FormatError::whole(
            path,
            format!("the root element is <{name}>; expected <opencv_storage>, OpenCV's XML"),
        ));
    }
    node(root, &lines, path, 0)
}

fn node(element: roxmltree::Node<'_, '_>, lines: &[usize], path: &Path, depth: usize) -> Result<DocumentNode> {
    let line = 1 + lines.partition_point(|&at| at < element.range().start);
    if depth >= MAX_DEPTH {
        return Err(FormatError::line(path, line, "the file is nested too deeply for a calibration"));
    }
    let children: Vec<_> = element.children().filter(roxmltree::Node::is_element).collect();
    let word = |word: &str| Value::Scalar(word.to_owned());
    let value = if children.is_empty() {
        let text: String = element.children().filter_map(|child| child.text()).collect();
        let text = text.trim();
        if let Some(quoted) = text.strip_prefix('"').and_then(|text| text.strip_suffix('"')) {
            word(quoted)
        } else if text.split_whitespace().nth(1).is_some() || element.tag_name().name() == "data" {
            let item = |text| DocumentNode { value: word(text), line };
            Value::List(text.split_whitespace().map(item).collect())
        } else {
            word(text)
        }
    } else if children.iter().all(|child| child.tag_name().name() == "_") {
        let items: Result<_, _> = children.into_iter().map(|child| node(child, lines, path, depth + 1)).collect();
        Value::List(items?)
    } else {
        let mut entries: Vec<(String, DocumentNode)> = Vec::new();
        let mut known = HashSet::new();
        for child in children {
            let name = child.tag_name().name();
            let inner = node(child, lines, path, depth + 1)?;
            if !known.insert(name) {
                return Err(FormatError::line(path, inner.line, format!("{name} is defined twice")));
            }
            entries.push((name.to_owned(), inner));
        }
        Value::Map(entries)
    };
    Ok(DocumentNode { value, line })
}
