//! Companions: files that a mesh file names and can do without. Where one is missing or may not be read, the mesh is
//! shown without it and a notice says so.
//!
//! A name is searched inside the root, in this order, and whatever is not as written gets a notice:
//!
//! 1. as written, from the folder of the file that names it, and from where a link to that file leads;
//! 2. in other case;
//! 3. the ends of a path (`textures/wood.png`, `wood.png` for `C:\me\textures\wood.png`) from the same folder;
//! 4. the same name in the folders of [`USUAL_FOLDERS`].

use std::path::Path;

use raycam_scene::{Notice, NoticeCode};

use crate::error::{FormatError, Result};
use crate::io::{AssetRoot, InputFile, reference};

/// Folders in which images lie by custom, from the folder of a mesh: those of exporters, and of Gazebo's models.
const USUAL_FOLDERS: [&str; 9] = [
    "textures",
    "texture",
    "images",
    "maps",
    "materials/textures",
    "../materials/textures",
    "../textures",
    "../texture",
    "../images",
];

/// The file of this name, as written in the file `from`.
pub(crate) fn optional_file(
    from: &Path,
    name: &[u8],
    assets: &mut AssetRoot,
    notices: &mut Vec<Notice>,
) -> Result<Option<InputFile>> {
    match companion_file(from, name, assets, notices) {
        Err(error) if can_be_left_out(&error) => {
            notices.push(Notice::new(NoticeCode::MissingFile, format!("{}: left out: {error}", from.display())));
            Ok(None)
        }
        source => source.map(Some),
    }
}

/// True if the error of a file that a model can do without is no reason to refuse the model: only exceeded budgets and a
/// full disk are.
pub(crate) fn can_be_left_out(error: &FormatError) -> bool {
    match error {
        FormatError::Named { source, .. } => can_be_left_out(source),
        FormatError::Budget { .. } | FormatError::Scene { .. } | FormatError::Encode(_) => false,
        _ => true,
    }
}

/// The file of this name, searched as the head of this file says.
pub(crate) fn companion_file(
    from: &Path,
    name: &[u8],
    assets: &mut AssetRoot,
    notices: &mut Vec<Notice>,
) -> Result<InputFile> {
    let written = reference::with_slashes(name);
    let error = match assets.read_reference(from, &written) {
        Err(error @ (FormatError::Io { .. } | FormatError::Reference { .. })) => error,
        read => return read,
    };
    let bare = reference::bare(&written);
    if let Some(bare) = &bare
        && let Ok(file) = assets.read_reference(from, bare)
    {
        return Ok(file);
    }
    if !assets.may_search() {
        return Err(error);
    }
    let Some((found, how)) = search(from, &bare.unwrap_or(written), assets) else { return Err(error) };
    let file = assets.read_reference(from, &found)?;
    notices.push(Notice::new(
        NoticeCode::SubstitutedFile,
        format!(
            "{}: {:?} is not there; {} is used, {how}",
            from.display(),
            reference::shown(name),
            file.path.display()
        ),
    ));
    Ok(file)
}

/// The name of a file that is most like the one written, and how it was found.
fn search(from: &Path, written: &[u8], assets: &mut AssetRoot) -> Option<(Vec<u8>, &'static str)> {
    if let Some(found) = assets.in_other_case(from, written) {
        return Some((found, "the same name in other case"));
    }
    let tails = reference::tails(written);
    for tail in &tails {
        if assets.is_file(from, tail) {
            return Some((tail.clone(), "found from the folder of the file that names it"));
        }
        if let Some(found) = assets.in_other_case(from, tail) {
            return Some((found, "found from the folder of the file that names it, in other case"));
        }
    }
    let base = written.rsplit(|&byte| byte == b'/').next().filter(|base| !base.is_empty())?;
    for folder in USUAL_FOLDERS {
        let name = [folder.as_bytes(), b"/", base].concat();
        if assets.is_file(from, &name) {
            return Some((name, "found in a folder for images"));
        }
    }
    None
}
