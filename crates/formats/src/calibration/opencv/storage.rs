//! The document of an OpenCV file, YAML, JSON or XML.

use crate::calibration::document::{DocumentNode, xml, yaml};
use crate::error::FormatError;
use crate::io::input_file::InputFile;

/// The document of a file.
pub(super) fn parse(source: &InputFile) -> Result<DocumentNode, FormatError> {
    let text = source.text()?;
    match text.trim_start().starts_with('<') {
        true => xml::parse(text, &source.path),
        false => yaml::parse(text, &source.path),
    }
}
