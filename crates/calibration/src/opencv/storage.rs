//! Document of an OpenCV file: YAML, JSON, XML, `.npz`, or several `.npy` files in one folder.

use std::path::Path;

use crate::Folder;
use crate::document::{DocumentNode, csv_tree, npy, toml_tree, xml, yaml, zip_members};
use crate::opencv::keys;
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// Parses a file to a document; for a `.npy` file, the document includes the other arrays in its folder.
pub(super) fn parse(source: &InputFile, assets: &mut AssetRoot) -> Result<DocumentNode> {
    if zip_members::is_zip(&source.bytes) {
        return Ok(npy::document(&npy::arrays(&source.bytes, &source.path, &mut assets.budget)?));
    }
    if npy::is_npy(&source.bytes) {
        return arrays_beside(source, assets);
    }
    parse_text(source)
}

/// Reads the arrays of a calibration whose `.npy` files are in one folder; the keys are the file names.
fn arrays_beside(source: &InputFile, assets: &mut AssetRoot) -> Result<DocumentNode> {
    let own = source.stem().unwrap_or_default();
    let fail = |path: &Path, message: String| FormatError::whole(path, message);
    let array = |file: &InputFile| npy::array(&file.bytes).map_err(|message| fail(&file.path, message));
    let mut arrays = vec![(own.clone(), array(source)?)];
    let folder = Folder::open(source.path.parent().unwrap_or(Path::new("")), assets);
    for name in folder.ending(".npy").filter(|name| keys::is_known(name.trim_end_matches(".npy"))) {
        let stem = name.trim_end_matches(".npy");
        if stem != own {
            let file = folder.read(name, assets)?;
            arrays.push((stem.to_owned(), array(&file)?));
        }
    }
    Ok(npy::document(&arrays))
}

/// Parses a text to a document.
pub(super) fn parse_text(source: &InputFile) -> Result<DocumentNode> {
    parse_tree(source.text()?, &source.path)
}

/// Parses a text in XML, TOML, YAML or JSON, or a table with a header.
pub(super) fn parse_tree(text: &str, path: &Path) -> Result<DocumentNode> {
    if text.trim_start().starts_with('<') {
        return xml::parse(text, path);
    }
    if let Some(table) = csv_tree::parse(text, keys::is_focal_length) {
        return Ok(table);
    }
    if toml_tree::is_toml(text) { toml_tree::parse(text, path) } else { yaml::parse(text, path) }
}
