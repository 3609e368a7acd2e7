//! Elements of an XML file with their lines, for formats other than OpenCV's storage.

use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

use raycam_formats::{FormatError, Result};
use raycam_scene::{ErrorCode, counted};

/// Parsed XML file.
pub(crate) struct XmlFile<'a> {
    document: Document<'a>,
    path: &'a Path,
}

/// Element of an XML file.
#[derive(Clone, Copy)]
pub(crate) struct XmlElement<'f> {
    file: &'f XmlFile<'f>,
    node: Node<'f, 'f>,
}

impl<'a> XmlFile<'a> {
    pub(crate) fn parse(text: &'a str, path: &'a Path) -> Result<Self> {
        let options = ParsingOptions { allow_dtd: false, nodes_limit: 1 << 22, ..ParsingOptions::default() };
        let document = Document::parse_with_options(text, options)
            .map_err(|error| FormatError::line(path, error.pos().row as usize, error.to_string()))?;
        Ok(Self { document, path })
    }

    pub(crate) fn root(&'a self) -> XmlElement<'a> {
        XmlElement { file: self, node: self.document.root_element() }
    }
}

impl<'f> XmlElement<'f> {
    pub(crate) fn fail(&self, message: impl std::fmt::Display) -> FormatError {
        self.fail_as(ErrorCode::Syntax, message)
    }

    /// Error of this element, with the given code.
    pub(crate) fn fail_as(&self, code: ErrorCode, message: impl std::fmt::Display) -> FormatError {
        let line = self.file.document.text_pos_at(self.node.range().start).row as usize;
        FormatError::line(self.file.path, line, code.message(format!("<{}>: {message}", self.name())))
    }

    pub(crate) fn name(&self) -> &'f str {
        self.node.tag_name().name()
    }

    pub(crate) fn children(&self) -> impl Iterator<Item = XmlElement<'f>> + use<'f> {
        let file = self.file;
        self.node.children().filter(Node::is_element).map(move |node| XmlElement { file, node })
    }

    /// The first child element with this name.
    pub(crate) fn child(&self, name: &str) -> Option<XmlElement<'f>> {
        self.children().find(|child| child.name() == name)
    }

    /// All elements with this name in the subtree of this element.
    pub(crate) fn all(&self, name: &'f str) -> impl Iterator<Item = XmlElement<'f>> + use<'f> {
        let file = self.file;
        let found = self.node.descendants().filter(move |node| node.is_element() && node.tag_name().name() == name);
        found.map(move |node| XmlElement { file, node })
    }

    /// Value of an attribute, in any namespace.
    pub(crate) fn attribute(&self, name: &str) -> Option<&'f str> {
        self.node.attributes().find(|attribute| attribute.name() == name).map(|attribute| attribute.value())
    }

    pub(crate) fn text(&self) -> &'f str {
        self.node.text().unwrap_or_default().trim()
    }

    /// Reads the numbers in a text that belongs to this element.
    pub(crate) fn numbers_of<const N: usize>(&self, what: &str, text: &str) -> Result<[f64; N]> {
        let values: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse::<f64>).collect();
        let values = values.ok().filter(|values| values.iter().all(|value| value.is_finite()));
        let values = values.ok_or_else(|| self.fail(format_args!("{what} {text:?}; expected finite numbers")))?;
        let count = counted(values.len(), "number");
        values.try_into().map_err(|_| self.fail(format_args!("{what} has {count}; expected {N}")))
    }

    /// Reads the numbers in the element's text.
    pub(crate) fn numbers<const N: usize>(&self) -> Result<[f64; N]> {
        self.numbers_of("the text", self.text())
    }
}
