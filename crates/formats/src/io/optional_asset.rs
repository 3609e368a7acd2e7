//! Files that a mesh file names and can do without: where one is missing or may not be read, the mesh is shown without it
//! and a notice says so.

use std::path::Path;

use crate::error::FormatError;
use crate::io::asset_root::AssetRoot;
use crate::io::input_file::InputFile;

/// The file of this name, as written in the file `from`.
pub(crate) fn optional_file(
    from: &Path,
    name: &str,
    assets: &mut AssetRoot,
    notices: &mut Vec<String>,
) -> Result<Option<InputFile>, FormatError> {
    // Files from Windows have the other slash; before a space it is that of a shell.
    let name = name.replace("\\ ", " ").replace('\\', "/");
    match assets.read_reference(from, &name) {
        Err(error @ (FormatError::Io { .. } | FormatError::Reference { .. })) => {
            notices.push(format!("{}: left out: {error}", from.display()));
            Ok(None)
        }
        source => source.map(Some),
    }
}
