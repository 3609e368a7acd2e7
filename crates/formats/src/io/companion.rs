//! Companions: files to which a mesh file refers and that are not required. If such a file is missing or must not be
//! read, the mesh is shown without the file, with a notice.
//!
//! A name is searched inside the root, in this order; every deviation from the written name causes a notice:
//!
//! 1. as written, from the folder of the file that refers to it, and from the folder of the target if that file is a
//!    link;
//! 2. with different upper and lower case;
//! 3. the trailing parts of a path (`textures/wood.png`, then `wood.png` for `C:\me\textures\wood.png`) from the same
//!    folder;
//! 4. the same name in the folders of [`USUAL_FOLDERS`].

use std::path::Path;

use raycam_scene::{ErrorCode, Notice, NoticeCode};

use crate::error::{FormatError, Result};
use crate::io::{AssetRoot, InputFile, reference};

/// Usual folders of images, relative to the folder of a mesh, as used by exporters and by Gazebo's models.
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

/// File with this name, as written in the file `from`; `None`, with a notice, if the file cannot be read.
pub(crate) fn optional_file(
    from: &Path,
    name: &[u8],
    assets: &mut AssetRoot,
    notices: &mut Vec<Notice>,
) -> Result<Option<InputFile>> {
    match companion_file(from, name, assets, notices) {
        Err(error) if can_be_left_out(&error) => {
            let code = match error.code() {
                ErrorCode::OutsideRoot => NoticeCode::OutsideRoot,
                _ => NoticeCode::MissingFile,
            };
            notices.push(Notice::new(code, format!("{}: referenced file omitted: {error}", from.display())));
            Ok(None)
        }
        source => source.map(Some),
    }
}

/// True if the error of an optional file does not prevent reading the model: all errors except exceeded budgets, errors
/// of writing, and errors of `raycam_scene`, such as a full disk.
pub(crate) fn can_be_left_out(error: &FormatError) -> bool {
    match error {
        FormatError::Named { source, .. } => can_be_left_out(source),
        FormatError::Budget { .. } | FormatError::Scene { .. } | FormatError::Encode(_) => false,
        _ => true,
    }
}

/// File with this name, searched as described at the top of this file.
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
        format!("{}: {:?} is missing; {} is used, {how}", from.display(), reference::shown(name), file.path.display()),
    ));
    Ok(file)
}

/// Searches for an existing file under names other than the written name, in the order described at the top of this
/// file. Returns the file's name, and a description of how the file was found.
fn search(from: &Path, written: &[u8], assets: &mut AssetRoot) -> Option<(Vec<u8>, &'static str)> {
    if let Some(found) = assets.in_other_case(from, written) {
        return Some((found, "the same name with different upper and lower case"));
    }
    let tails = reference::tails(written);
    for tail in &tails {
        if assets.is_file(from, tail) {
            return Some((tail.clone(), "found relative to the folder of the file that refers to it"));
        }
        if let Some(found) = assets.in_other_case(from, tail) {
            return Some((
                found,
                "found relative to the folder of the file that refers to it, with different upper and \
                lower case",
            ));
        }
    }
    let base = written.rsplit(|&byte| byte == b'/').next().filter(|base| !base.is_empty())?;
    for folder in USUAL_FOLDERS {
        let name = [folder.as_bytes(), b"/", base].concat();
        if assets.is_file(from, &name) {
            return Some((name, "found in one of the folders that often contain images"));
        }
    }
    None
}
