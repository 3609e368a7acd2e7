//! Poses as matrices in JSON, YAML or `.npz`: a list of them, a map by the names of pictures, maps that have one each, or
//! one of these under a key (`poses`, `w2c`).

use std::path::Path;

use crate::calibration::document::{Cursor, DocumentNode, npy, yaml, zip_members};
use crate::error::FormatError;
use crate::io::asset_root::AssetRoot;
use crate::io::input_file::InputFile;

/// Longest text that is parsed to find out what it is.
const MAX_DETECTED_BYTES: usize = 16 << 20;
/// Names of arrays of poses in `.npz` files.
const ARRAYS: [&str; 12] = [
    "poses",
    "pose",
    "c2w",
    "w2c",
    "c2ws",
    "w2cs",
    "extrinsics",
    "extrinsic",
    "trajectory",
    "cam_poses",
    "camera_poses",
    "cam2world",
];
/// Keys of a map that say which picture its matrix is of.
const NAMES: [&str; 9] = ["file_path", "file", "filename", "image", "image_path", "name", "frame", "id", "index"];

/// Matrices by rows, each with its name, if it has one, and its line.
pub(crate) type FoundMatrices = Vec<(Option<String>, usize, [f64; 16])>;

/// The poses of a document, and what of it is not read.
pub(crate) struct PosesOfTree {
    /// The key above the poses; empty where there is none.
    pub(crate) key: String,
    pub(crate) matrices: FoundMatrices,
    pub(crate) notices: Vec<String>,
}

/// True for a document that has poses.
pub(crate) fn detect(source: &InputFile, text: &str) -> bool {
    if zip_members::is_zip(&source.bytes) {
        return npy::names(&source.bytes).iter().any(|name| ARRAYS.contains(&name.as_str()));
    }
    is_document(&source.path, text)
        && text.len() <= MAX_DETECTED_BYTES
        && yaml::parse(text, &source.path)
            .is_ok_and(|node| poses(&Cursor::root(&node, &source.path)).is_ok_and(|found| found.is_some()))
}

fn is_document(path: &Path, text: &str) -> bool {
    let named = path.extension().is_some_and(|ending| ["json", "yaml", "yml"].iter().any(|known| ending == *known));
    named || text.trim_start().starts_with(['[', '{'])
}

/// The poses of a file; None for a text that is no document of poses.
pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot) -> Result<Option<PosesOfTree>, FormatError> {
    let node: DocumentNode = if zip_members::is_zip(&source.bytes) {
        npy::document(&npy::arrays(&source.bytes, &source.path, &mut assets.budget)?)
    } else {
        let text = source.text()?;
        if !is_document(&source.path, text) {
            return Ok(None);
        }
        match yaml::parse(text, &source.path) {
            Ok(node) => node,
            // Rows in brackets, as NumPy prints them.
            Err(_) if source.path.extension().is_none_or(|ending| ending != "json") => return Ok(None),
            Err(error) => return Err(error),
        }
    };
    poses(&Cursor::root(&node, &source.path))
}

fn poses(root: &Cursor<'_>) -> Result<Option<PosesOfTree>, FormatError> {
    if has_poses(root) {
        let mut notices = Vec::new();
        let matrices = all(root, &mut notices)?;
        return Ok(Some(PosesOfTree { key: String::new(), matrices, notices }));
    }
    let Ok(entries) = root.entries() else { return Ok(None) };
    let groups: Vec<_> = entries.into_iter().filter(|(_, at)| has_poses(at)).collect();
    match &groups[..] {
        [] => Ok(None),
        [(key, at)] => {
            let mut notices = root.unread_keys(|other| other == *key)?;
            let matrices = all(at, &mut notices)?;
            Ok(Some(PosesOfTree { key: (*key).to_owned(), matrices, notices }))
        }
        [(first, _), (second, at), ..] => {
            Err(at.fail(format_args!("poses here and under {first}: which? Expected one of {first} and {second}")))
        }
    }
}

/// True for a matrix, a list of them, a map by names, or a list of maps with one each.
fn has_poses(at: &Cursor<'_>) -> bool {
    if matrix(at).is_some() {
        return true;
    }
    match at.entries() {
        Ok(entries) => {
            let count = entries.iter().filter(|(_, at)| matrix(at).is_some()).count();
            // One matrix among other things is something else, as the transform of a data set is.
            count > 1 || count == 1 && entries.len() == 1
        }
        Err(_) => at.list().is_ok_and(|items| {
            let first = items.first();
            first.is_some_and(|at| matrix(at).is_some() || matrix_of_map(at).is_some())
        }),
    }
}

/// The only matrix among the values of a map, and its key.
fn matrix_of_map<'a>(at: &Cursor<'a>) -> Option<(&'a str, Cursor<'a>)> {
    let mut found = at.entries().ok()?.into_iter().filter(|(_, at)| matrix(at).is_some());
    found.next().filter(|_| found.next().is_none())
}

/// The matrices of a node that has some.
fn all(at: &Cursor<'_>, notices: &mut Vec<String>) -> Result<FoundMatrices, FormatError> {
    let required = |at: &Cursor<'_>| {
        matrix(at).ok_or_else(|| at.fail("expected a pose: 4 rows of 4 numbers, 3 rows of 4, or 16 numbers"))
    };
    if let Some(numbers) = matrix(at) {
        return Ok(vec![(None, at.node.line, numbers)]);
    }
    if let Ok(entries) = at.entries() {
        let is_pose = |key: &str| at.get(key).is_some_and(|at| matrix(&at).is_some());
        notices.extend(at.unread_keys(is_pose)?);
        let named = entries.into_iter().filter(|(key, _)| is_pose(key));
        return named.map(|(key, at)| Ok((Some(key.to_owned()), at.node.line, required(&at)?))).collect();
    }
    let mut found = FoundMatrices::new();
    for item in at.list()? {
        if !item.is_map() {
            found.push((None, item.node.line, required(&item)?));
            continue;
        }
        let (key, inner) = matrix_of_map(&item).ok_or_else(|| item.fail("expected one pose, a 4x4 matrix, in it"))?;
        let unread = item.unread_keys(|other| other == key || NAMES.contains(&other))?;
        if found.is_empty() {
            notices.extend(unread);
        }
        let name = item.any(&NAMES).and_then(|at| at.word().ok().map(str::to_owned));
        found.push((name, inner.node.line, required(&inner)?));
    }
    Ok(found)
}

/// The numbers of a matrix of three or four rows, or of 16 numbers; None for another node.
fn matrix(at: &Cursor<'_>) -> Option<[f64; 16]> {
    let items = at.list().ok()?;
    let rows: Vec<Vec<f64>> = match items.len() {
        3 | 4 => items.iter().map(row).collect::<Option<_>>()?,
        16 => row(at)?.chunks(4).map(<[f64]>::to_vec).collect(),
        _ => return None,
    };
    let mut numbers = [0.0; 16];
    numbers[15] = 1.0;
    for (i, row) in rows.iter().enumerate() {
        numbers[4 * i..4 * i + 4].copy_from_slice(<&[f64; 4]>::try_from(&row[..]).ok()?);
    }
    Some(numbers)
}

/// The numbers of a list, which may be infinite or none, as those of lost frames are.
fn row(at: &Cursor<'_>) -> Option<Vec<f64>> {
    let number = |cell: &Cursor<'_>| {
        let word = cell.word().ok()?;
        word.parse().or_else(|_| word.replace('.', "").parse()).ok()
    };
    at.list().ok()?.iter().map(number).collect()
}
