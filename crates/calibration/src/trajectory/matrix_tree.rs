//! Poses as matrices in JSON, YAML or `.npz`: a list of matrices, a map from image names to matrices, maps that contain
//! one matrix each, or one of these forms under a key (`poses`, `w2c`).

use std::path::Path;

use crate::document::lens_keys::plain;
use crate::document::npy::NumpyArray;
use crate::document::{Cursor, DocumentNode, npy, yaml, zip_members};
use crate::pose_map;
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};
use raycam_scene::Notice;

/// Maximum length of a text that is parsed to determine its format.
const MAX_DETECTED_BYTES: usize = 16 << 20;
/// Names of pose arrays in `.npz` files; `arr_0` comes from `np.savez(file, poses)`.
const ARRAYS: [&str; 13] = [
    "arr_0",
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
/// Keys next to a pose in a map; the value of such a key is the name of the pose's image, or its time.
const NAMES: [&str; 14] = [
    "file_path",
    "file",
    "filename",
    "image",
    "image_path",
    "image_name",
    "name",
    "frame",
    "frame_id",
    "id",
    "index",
    "timestamp",
    "time",
    "stamp",
];
/// Form of a pose in the maps of a list.
#[derive(Clone, Copy, PartialEq)]
enum PoseForm<'a> {
    QuaternionAndPosition,
    /// R and t, x = R X + t.
    RotationAndTranslation,
    /// The only matrix in a map, under this key.
    MatrixUnder(&'a str),
}

impl<'a> PoseForm<'a> {
    /// Key that states the direction of the poses; empty if the form does not state it.
    fn key(self) -> &'a str {
        match self {
            Self::QuaternionAndPosition => "",
            Self::RotationAndTranslation => "camera_from_world",
            Self::MatrixUnder(key) => key,
        }
    }

    /// True for a key of the pose in a map.
    fn is_part(self, key: &str) -> bool {
        match self {
            Self::QuaternionAndPosition => pose_map::is_part(key),
            Self::RotationAndTranslation => R_AND_T.contains(&&plain(key)[..]),
            Self::MatrixUnder(own) => own == key,
        }
    }

    /// Describes the pose in messages.
    fn description(self) -> String {
        match self {
            Self::QuaternionAndPosition => "a quaternion and a position".into(),
            Self::RotationAndTranslation => "R and t".into(),
            Self::MatrixUnder(key) => format!("under {key:?}"),
        }
    }
}

/// Matrices by rows, each with its name (if it has one) and its line.
pub(crate) type FoundMatrices = Vec<(Option<String>, usize, [f64; 16])>;

/// Poses of a document, and notices about keys that are not read.
pub(crate) struct PosesOfTree {
    /// Key whose value contains the poses; empty if the poses are at the root.
    pub(crate) key: String,
    pub(crate) matrices: FoundMatrices,
    /// True if the last columns are camera centres, whatever the direction of the rotations.
    pub(crate) has_centers: bool,
    pub(crate) notices: Vec<Notice>,
}

/// True for a document that contains poses.
pub(crate) fn detect(source: &InputFile, text: &str) -> bool {
    if zip_members::is_zip(&source.bytes) {
        return npy::names(&source.bytes).iter().any(|name| ARRAYS.contains(&name.as_str()))
            || npy::shapes(&source.bytes).is_some_and(|shapes| shapes.iter().all(|shape| is_matrix(shape)));
    }
    is_document(&source.path, text)
        && text.len() <= MAX_DETECTED_BYTES
        && yaml::parse(text, &source.path).is_ok_and(|node| {
            let root = Cursor::root(&node, &source.path);
            has_poses(&root) || root.entries().is_ok_and(|entries| entries.iter().any(|(_, at)| has_poses(at)))
        })
}

fn is_document(path: &Path, text: &str) -> bool {
    let named = path.extension().is_some_and(|ending| ["json", "yaml", "yml"].iter().any(|known| ending == *known));
    named || text.trim_start().starts_with(['[', '{'])
}

/// Reads the poses of a file; `None` for a text that is not a document of poses.
pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot) -> Result<Option<PosesOfTree>> {
    if zip_members::is_zip(&source.bytes) {
        return of_archive(source, assets).map(Some);
    }
    let text = source.text()?;
    if !is_document(&source.path, text) {
        return Ok(None);
    }
    let node: DocumentNode = match yaml::parse(text, &source.path) {
        Ok(node) => node,
        // The file is not a document; it may contain rows in brackets, as printed by NumPy.
        Err(_) if source.path.extension().is_none_or(|ending| ending != "json") => return Ok(None),
        Err(error) => return Err(error),
    };
    poses(&Cursor::root(&node, &source.path))
}

/// True for the shape of one pose.
fn is_matrix(shape: &[usize]) -> bool {
    matches!(shape, [3 | 4, 4])
}

/// True for the shape of one pose or of a list of poses.
pub(crate) fn is_poses(shape: &[usize]) -> bool {
    is_matrix(shape) || matches!(shape, [_, 3 | 4, 4])
}

/// Returns the matrices of an array with the shape of one pose or a list of poses; `None` for another shape.
pub(crate) fn of_array(array: &NumpyArray, name: Option<&str>) -> Option<FoundMatrices> {
    let numbers = array.numbers().filter(|_| is_poses(&array.shape))?;
    let rows = array.shape[array.shape.len() - 2];
    let matrix = |part: &[f64]| {
        let mut m = [0.0; 16];
        m[15] = 1.0;
        m[..part.len()].copy_from_slice(part);
        (name.map(str::to_owned), 1, m)
    };
    Some(numbers.chunks_exact(4 * rows).map(matrix).collect())
}

/// Reads the poses of a `.npz` file: one array of all poses, or one array per pose.
fn of_archive(source: &InputFile, assets: &mut AssetRoot) -> Result<PosesOfTree> {
    let arrays = npy::arrays(&source.bytes, &source.path, &mut assets.budget)?;
    let fail = |message: String| FormatError::whole(&source.path, message);
    let lists: Vec<_> = arrays.iter().filter(|(_, array)| is_poses(&array.shape) && array.shape.len() == 3).collect();
    let (key, taken) = match &lists[..] {
        [] => (String::new(), arrays.iter().filter(|(_, array)| is_matrix(&array.shape)).collect()),
        [one] => (one.0.clone(), vec![*one]),
        [first, second, ..] => {
            return Err(fail(format!(
                "poses under both {} and {}; expected only one array of poses",
                first.0, second.0
            )));
        }
    };
    let mut matrices = FoundMatrices::new();
    for (name, array) in &taken {
        let named = (array.shape.len() == 2 && taken.len() > 1).then_some(name.as_str());
        let unread = || fail(format!("{name}: {}; expected numbers", array.reason()));
        matrices.extend(of_array(array, named).ok_or_else(unread)?);
    }
    if matrices.is_empty() {
        let shapes: Vec<_> = arrays.iter().map(|(name, array)| format!("{name} {:?}", array.shape)).collect();
        return Err(fail(format!(
            "no poses found; expected an array [n, 4, 4] or [n, 3, 4], but the file contains {}",
            shapes.join(", ")
        )));
    }
    let names: Vec<&str> = taken.iter().map(|(name, _)| name.as_str()).collect();
    let document = npy::document(&arrays);
    let notices = Cursor::root(&document, &source.path).unread_keys(|key| names.contains(&key))?;
    let key = if taken.len() == 1 { names[0].to_owned() } else { key };
    Ok(PosesOfTree { key, matrices, has_centers: false, notices })
}

fn poses(root: &Cursor<'_>) -> Result<Option<PosesOfTree>> {
    if has_poses(root) {
        let mut notices = Vec::new();
        let (key, matrices) = all(root, &mut notices)?;
        return Ok(Some(PosesOfTree { key, matrices, has_centers: has_centers(root), notices }));
    }
    let Ok(entries) = root.entries() else { return Ok(None) };
    let groups: Vec<_> = entries.into_iter().filter(|(_, at)| has_poses(at)).collect();
    match &groups[..] {
        [] => Ok(None),
        [(key, at)] => {
            let mut notices = root.unread_keys(|other| other == *key)?;
            let (inner, matrices) = all(at, &mut notices)?;
            let key = format!("{key} {inner}").trim_end().to_owned();
            Ok(Some(PosesOfTree { key, matrices, has_centers: has_centers(at), notices }))
        }
        [(first, _), (second, at), ..] => {
            Err(at.fail(format_args!("poses both here and under {first}; expected only one of {first} and {second}")))
        }
    }
}

/// True for a node that is a matrix, a list of matrices, a map from names to matrices, or a list of maps with one
/// matrix each.
fn has_poses(at: &Cursor<'_>) -> bool {
    if matrix(at).is_some() {
        return true;
    }
    match at.entries() {
        Ok(entries) => {
            let count = entries.iter().filter(|(_, at)| matrix(at).is_some()).count();
            // A single matrix among other values is probably not a camera's pose, but for example the transform of a
            // data set.
            count > 1 || count == 1 && entries.len() == 1
        }
        Err(_) => at.list().is_ok_and(|items| {
            items.first().is_some_and(|at| {
                matrix(at).is_some() || matrix_of_map(at).is_some() || r_and_t(at).is_ok_and(|found| found.is_some())
            })
        }),
    }
}

/// True for a node whose first pose is a map with a position.
fn has_centers(at: &Cursor<'_>) -> bool {
    let first_of_list = at.list().ok().and_then(|items| items.into_iter().next());
    let first_of_map = || at.entries().ok()?.into_iter().map(|(_, at)| at).find(|at| matrix(at).is_some());
    match matrix(at) {
        Some(_) => pose_map::has_center(at),
        None => first_of_list.or_else(first_of_map).is_some_and(|at| at.is_map() && pose_map::has_center(&at)),
    }
}

/// Returns the only matrix among the values of a map, with its key.
fn matrix_of_map<'a>(at: &Cursor<'a>) -> Option<(&'a str, Cursor<'a>)> {
    let mut found = at.entries().ok()?.into_iter().filter(|(_, at)| matrix(at).is_some());
    found.next().filter(|_| found.next().is_none())
}

/// Returns the matrices of a node for which [`has_poses`] is true, and the key of the matrix in each map of a list, which
/// may state the direction.
fn all(at: &Cursor<'_>, notices: &mut Vec<Notice>) -> Result<(String, FoundMatrices)> {
    let required = |at: &Cursor<'_>| {
        matrix(at).ok_or_else(|| at.fail("expected a pose: 4 rows of 4 numbers, 3 rows of 4, or 16 numbers"))
    };
    if let Some(numbers) = matrix(at) {
        return Ok((String::new(), vec![(None, at.node.line, numbers)]));
    }
    if let Ok(entries) = at.entries() {
        let is_pose = |key: &str| at.get(key).is_some_and(|at| matrix(&at).is_some());
        notices.extend(at.unread_keys(is_pose)?);
        let named = entries.into_iter().filter(|(key, _)| is_pose(key));
        let found = named.map(|(key, at)| Ok((Some(key.to_owned()), at.node.line, required(&at)?)));
        return Ok((String::new(), found.collect::<Result<_>>()?));
    }
    let mut shared: Option<PoseForm<'_>> = None;
    let mut found = FoundMatrices::new();
    for item in at.list()? {
        if !item.is_map() {
            found.push((None, item.node.line, required(&item)?));
            continue;
        }
        let (form, line, numbers) = match matrix(&item) {
            Some(numbers) => (PoseForm::QuaternionAndPosition, item.node.line, numbers),
            None => match (matrix_of_map(&item), r_and_t(&item)?) {
                (Some((key, inner)), _) => (PoseForm::MatrixUnder(key), inner.node.line, required(&inner)?),
                (None, Some(numbers)) => (PoseForm::RotationAndTranslation, item.node.line, numbers),
                (None, None) => {
                    return Err(
                        item.fail("expected exactly one pose: a 4x4 matrix, R and t, or a quaternion and a position")
                    );
                }
            },
        };
        let shared = shared.get_or_insert(form);
        if *shared != form {
            return Err(item.fail(format_args!(
                "the pose is {}, but the poses above are {}; expected the same form and key in all maps",
                form.description(),
                shared.description()
            )));
        }
        let unread = item.unread_keys(|key| form.is_part(key) || NAMES.contains(&key))?;
        if found.is_empty() {
            notices.extend(unread);
        }
        let name = item.any(&NAMES).and_then(|at| at.word().ok().map(str::to_owned));
        found.push((name, line, numbers));
    }
    Ok((shared.map_or("", PoseForm::key).to_owned(), found))
}

/// Keys of R and t, camera_from_world.
const R_AND_T: [&str; 8] = ["r", "rotation", "rotationmatrix", "rmat", "t", "translation", "tvec", "translationvector"];

/// The pose R, t of a map as a matrix.
fn r_and_t(at: &Cursor<'_>) -> Result<Option<[f64; 16]>> {
    let Ok(entries) = at.entries() else { return Ok(None) };
    let find = |names: &[&str], count: usize| {
        let fits = |at: &Cursor<'_>| at.numbers().is_ok_and(|numbers| numbers.len() == count);
        entries.iter().find(|(key, at)| names.contains(&&plain(key)[..]) && fits(at)).map(|(_, at)| at.numbers())
    };
    let (Some(r), Some(t)) = (find(&R_AND_T[..4], 9).transpose()?, find(&R_AND_T[4..], 3).transpose()?) else {
        return Ok(None);
    };
    let mut rows = [0.0; 16];
    for i in 0..3 {
        rows[4 * i..4 * i + 3].copy_from_slice(&r[3 * i..3 * i + 3]);
        rows[4 * i + 3] = t[i];
    }
    rows[15] = 1.0;
    Ok(Some(rows))
}

/// Reads a matrix that is written as three or four rows, as 16 numbers, or as a map with a quaternion and a position;
/// `None` for another node.
fn matrix(at: &Cursor<'_>) -> Option<[f64; 16]> {
    if at.is_map() {
        let rows = pose_map::read(at).ok().flatten()?;
        let mut numbers = [0.0; 16];
        numbers[..12].copy_from_slice(&rows);
        numbers[15] = 1.0;
        return Some(numbers);
    }
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

/// Reads the numbers of a list; the numbers of lost frames may be infinite or NaN.
fn row(at: &Cursor<'_>) -> Option<Vec<f64>> {
    let number = |cell: &Cursor<'_>| {
        let word = cell.word().ok()?;
        word.parse().or_else(|_| word.replace('.', "").parse()).ok()
    };
    at.list().ok()?.iter().map(number).collect()
}
