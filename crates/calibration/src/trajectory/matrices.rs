//! Poses as 4x4 matrices by rows: four lines of four numbers (ScanNet, 7-Scenes), 16 numbers per line (`traj.txt` of
//! Replica in NICE-SLAM's version), an index or a time and 16 numbers (`cam0_to_world.txt` of KITTI-360), a time and 12
//! numbers, three lines (ICL-NUIM), NumPy arrays [n, 4, 4], or JSON. Camera matrices P = K R [I | -C], 3x4, are in the
//! same forms, or have 12 numbers per line (`pos_001.txt` of DTU). K may be in a file of the same form. Sources:
//! ScanNet's SensorData.py; nice-slam's datasets.py; kitti360Scripts; Hartley and Zisserman, Multiple View Geometry, 6.1
//! (P).

use std::fmt::Write as _;
use std::ops::Range;
use std::path::Path;

use glam::{DMat3, DVec3};
use raycam_scene::{Lens, LensModel, Notice, NoticeCode, PixelCenter, counted};

use crate::document::lens_keys::looks_like_lens;
use crate::document::number_format::{joined, matrix_rows34};
use crate::document::number_lines::data_lines;
use crate::document::number_text::words;
use crate::document::{Cursor, check_rigid, check_rotation, focal_lengths_of, npy, rigid, rotation_of_any_scale, yaml};
use crate::files::PoseConvention;
use crate::intrinsics::{lens_of, pinhole_matrix};
use crate::opencv::projection;
use crate::trajectory::convention::{convention_of, means_camera_from_world};
use crate::trajectory::matrix_tree::{self, FoundMatrices, PosesOfTree, is_poses};
use crate::trajectory::named_columns::columns_of;
use crate::trajectory::times::notice_of_odd_times;
use crate::{Calibration, CameraRecord, Folder, OutputFiles, ReadHints};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// Minimum focal length in pixels of a matrix that counts as a camera matrix in pixels.
const MIN_FOCAL_LENGTH: f64 = 2.0;
/// Range of a usual camera's principal point, in units of the image size; 0.5 is the image's centre.
const PRINCIPAL_POINTS: Range<f64> = 0.25..0.75;

/// Layout of the matrices in a text file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MatrixLayout {
    /// Poses of several lines of four numbers; the field is the number of lines per pose: 4, or 3 for the upper rows.
    Blocks(usize),
    /// One matrix per line; the field is the count of values per line: 16, 17 with an index or a time, 13 with a time, or
    /// 12 for camera matrices.
    Lines(usize),
    /// K, in three or four lines.
    Intrinsics,
}

fn values(line: &str) -> Option<Vec<f64>> {
    words(line).map(|word| word.parse().ok()).collect()
}

/// Layout of a text, if it contains poses or K as matrices.
pub(crate) fn layout(text: &str) -> Option<MatrixLayout> {
    let first = values(data_lines(text).next()?.1)?;
    let all = || data_lines(text).map(|(_, line)| values(line)).collect::<Option<Vec<_>>>();
    match first.len() {
        3 | 4 => {
            let rows = all()?;
            let even = rows.iter().all(|row| row.len() == first.len());
            if !even || rows.len() % first.len() != 0 && (first.len() == 3 || rows.len() % 3 != 0) {
                return None;
            }
            if first.len() == 4 && (are_upper_rows(&rows) || are_camera_matrices(&rows)) {
                return Some(MatrixLayout::Blocks(3));
            }
            if rows.len() % first.len() != 0 {
                return None;
            }
            let k = [0, 1, 2].map(|i| [rows[i][0], rows[i][1], rows[i][2]]);
            let upper = k[1][0] == 0.0 && k[2] == [0.0, 0.0, 1.0] && k[0][0] > 1.5 && k[1][1] > 1.5;
            let lower = k[0][1] == 0.0 && k[0][2] == 0.0 && k[1][2] == 0.0 && k[2][2] == 1.0 && k[0][0] > 1.5;
            match rows.len() == first.len() && (upper || lower) {
                true => Some(MatrixLayout::Intrinsics),
                false => (first.len() == 4).then_some(MatrixLayout::Blocks(4)),
            }
        }
        16 | 17 => Some(MatrixLayout::Lines(first.len())),
        13 => has_times(text).then_some(MatrixLayout::Lines(13)),
        12 => is_camera_matrix(first.first_chunk()?).then_some(MatrixLayout::Lines(12)),
        _ => None,
    }
}

/// Smallest whole number before a pose that counts as a time, not as the index of an image: one in September 2001, in
/// seconds since 1970.
const MIN_WHOLE_TIME: f64 = 1e9;

/// True if the numbers before the poses are times: if one of them has a fraction, or is too large for an index.
pub(crate) fn has_times(text: &str) -> bool {
    let is_time = |time: f64| time.fract() != 0.0 || time >= MIN_WHOLE_TIME;
    data_lines(text).any(|(_, line)| words(line).next().and_then(|word| word.parse().ok()).is_some_and(is_time))
}

/// True for the upper three rows of consecutive poses, without the row 0 0 0 1.
fn are_upper_rows(rows: &[Vec<f64>]) -> bool {
    let row = |i: usize| DVec3::new(rows[i][0], rows[i][1], rows[i][2]);
    let last = rows.get(3).is_some_and(|row| row[..3].iter().all(|value| *value == 0.0));
    rows.len().is_multiple_of(3)
        && !last
        && check_rotation(DMat3::from_cols(row(0), row(1), row(2)).transpose()).is_ok()
}

/// True for rows of four numbers whose first three are a camera matrix P.
fn are_camera_matrices(rows: &[Vec<f64>]) -> bool {
    let first = rows.get(..3).map(<[Vec<f64>]>::concat);
    rows.len().is_multiple_of(3) && first.is_some_and(|rows| rows.first_chunk().is_some_and(is_camera_matrix))
}

/// True for a camera matrix P = K R [I | -C], given by rows. A matrix whose left part is almost a rotation, of any
/// scale, does not count as a camera matrix, because it is more likely a pose with an error.
fn is_camera_matrix(rows: &[f64; 12]) -> bool {
    let k_r = rigid(rows).0;
    if k_r.determinant() == 0.0 || !k_r.determinant().is_finite() || rotation_of_any_scale(k_r).is_some() {
        return false;
    }
    let [u, v, axis] = [0, 1, 2].map(|i| k_r.row(i));
    let principal_point = [u, v].map(|row| row.dot(axis) / axis.length_squared());
    // The matrix is in pixels, or in units of the image size; `check_cameras` rejects the latter with a
    // message that contains the conversion.
    focal_lengths_of(k_r).iter().all(|focal| *focal >= MIN_FOCAL_LENGTH)
        || principal_point.iter().all(|at| PRINCIPAL_POINTS.contains(at))
}

pub(crate) fn detect(source: &InputFile, text: &str) -> bool {
    layout(text).is_some() && columns_of(text).is_none()
        || npy::shape(&source.bytes).is_some_and(|shape| is_poses(&shape))
        || matrix_tree::detect(source, text)
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let mut calibration = Calibration::default();
    let (path, stem) =
        (&source.path, source.stem().map_or_else(|| "camera".into(), |stem| stem.trim_end_matches(".pose").to_owned()));
    let text = if npy::is_npy(&source.bytes) { "" } else { source.text().unwrap_or_default() };
    if layout(text) == Some(MatrixLayout::Intrinsics) {
        let mut record = CameraRecord::new(stem, PixelCenter::Integer);
        record.k = Some(intrinsics(text, path)?);
        record.lens = lens_beside(source, assets, hints, &mut calibration)?;
        calibration.records.push(record);
        return Ok(calibration);
    }
    let mut found = poses_of(source, assets)?;
    calibration.notices.append(&mut found.notices);
    let content = content_of(&found, &stem, hints, &mut calibration.notices);
    let poses = found.matrices;
    let alone = poses.len() == 1;
    let are_times = matches!(layout(text), Some(MatrixLayout::Lines(13 | 17))) && has_times(text);
    let mut lost = 0;
    for (i, (index, line, rows)) in poses.into_iter().enumerate() {
        let name = index.unwrap_or_else(|| if alone { stem.clone() } else { format!("{i:06}") });
        let time = if are_times { name.parse().ok() } else { None };
        let record = content.record(name, rows).map_err(|message| FormatError::line(path, line, message))?;
        lost += usize::from(record.is_none());
        calibration.records.extend(record.map(|record| CameraRecord { time, ..record }));
    }
    calibration.notices.extend(notice_of_odd_times(&calibration.records));
    if lost > 0 {
        calibration.note(
            NoticeCode::IgnoredElement,
            format!("{} omitted: numbers that are not finite (lost frames)", counted(lost, "pose")),
        );
    }
    if hints.intrinsics.is_none() {
        beside(assets, &mut calibration)?;
    }
    Ok(calibration)
}

/// Reads the matrices of a file: one or several NumPy arrays, a document, or a text of numbers.
pub(crate) fn poses_of(source: &InputFile, assets: &mut AssetRoot) -> Result<PosesOfTree> {
    let fail = |message: String| FormatError::whole(&source.path, message);
    let alone = |matrices| PosesOfTree { key: String::new(), matrices, has_centers: false, notices: vec![] };
    if npy::is_npy(&source.bytes) {
        let array = npy::array(&source.bytes).map_err(fail)?;
        let found = matrix_tree::of_array(&array, None);
        return found
            .map(alone)
            .ok_or_else(|| fail(format!("an array of {:?}; expected [n, 4, 4] or [n, 3, 4]", array.shape)));
    }
    if let Some(found) = matrix_tree::read(source, assets)? {
        return Ok(found);
    }
    let text = source.text()?;
    match layout(text) {
        Some(layout) if layout != MatrixLayout::Intrinsics => matrices(text, &source.path, layout).map(alone),
        _ => Err(fail(
            "expected a 4x4 matrix as four lines, as 16 numbers in a line, as an index or a time and 16 numbers, or as \
             a list in JSON"
                .into(),
        )),
    }
}

/// Content of a file's matrices: poses or camera matrices.
pub(crate) enum MatrixContent {
    /// Poses of this convention.
    Poses(PoseConvention),
    /// Rotations of this convention, next to camera centres.
    Centers(PoseConvention),
    /// Camera matrices P.
    CameraMatrices,
}

/// Determines from the first matrix of a file whether the matrices are poses or camera matrices. The direction of poses
/// may follow from `name` (of the file or folder) or from the key.
pub(crate) fn content_of(
    found: &PosesOfTree,
    name: &str,
    hints: &ReadHints,
    notices: &mut Vec<Notice>,
) -> MatrixContent {
    if has_camera_matrices(&found.matrices) && hints.poses.is_empty() {
        return MatrixContent::CameraMatrices;
    }
    let is_inverse = [name, &found.key].into_iter().any(means_camera_from_world) || is_normalized_p(found);
    let convention = convention_of(is_inverse, hints, notices);
    if found.has_centers { MatrixContent::Centers(convention) } else { MatrixContent::Poses(convention) }
}

/// True for poses under the key of a camera matrix: P = [R t], without K, maps from the world to the camera. A numbered
/// key may be the name of an image.
fn is_normalized_p(found: &PosesOfTree) -> bool {
    let names_p = |name: &str| projection::is_key(name) && !name.ends_with(|c: char| c.is_ascii_digit());
    names_p(&found.key) || found.matrices.iter().all(|(name, ..)| name.as_deref().is_some_and(names_p))
}

impl MatrixContent {
    /// The camera of one matrix; `None` for a lost frame, whose numbers are not finite.
    pub(crate) fn record(&self, name: String, matrix: [f64; 16]) -> Result<Option<CameraRecord>, String> {
        if is_lost(&matrix) {
            return Ok(None);
        }
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        match self {
            Self::Poses(convention) => record.pose = Some(convention.pose(&check_rigid(&matrix)?)),
            Self::Centers(convention) => {
                let (rotation, center) = rigid(&check_rigid(&matrix)?);
                record.pose = Some(convention.pose_at(rotation, center));
            }
            Self::CameraMatrices => {
                let rows = camera_matrix_of(&matrix).ok_or(
                    "not a camera matrix P = K R [I | -C], unlike the first matrix; expected only camera matrices",
                )?;
                record.matrix = Some([0, 1, 2].map(|i| [0, 1, 2, 3].map(|j| rows[4 * i + j])));
            }
        }
        Ok(Some(record))
    }
}

/// True if the first matrix is a camera matrix P.
pub(crate) fn has_camera_matrices(found: &FoundMatrices) -> bool {
    found.first().is_some_and(|(.., matrix)| camera_matrix_of(matrix).is_some())
}

/// The upper three rows of a matrix if they are a camera matrix P.
fn camera_matrix_of(matrix: &[f64; 16]) -> Option<[f64; 12]> {
    let rows = *matrix.first_chunk::<12>()?;
    (matrix[12..] == [0.0, 0.0, 0.0, 1.0] && is_camera_matrix(&rows)).then_some(rows)
}

/// Returns the first three rows of a pose; `None` for a lost frame, whose numbers are not finite.
pub(crate) fn checked(m: [f64; 16]) -> Result<Option<[f64; 12]>, String> {
    if is_lost(&m) { Ok(None) } else { check_rigid(&m).map(Some) }
}

/// True for the matrix of a lost frame, whose numbers are not finite.
fn is_lost(m: &[f64; 16]) -> bool {
    m.iter().any(|value| !value.is_finite())
}

/// Reads the matrices of a text: for each matrix, its name (the index that precedes it, if any), its line
/// number and its elements.
pub(crate) fn matrices(text: &str, path: &Path, layout: MatrixLayout) -> Result<FoundMatrices> {
    let mut found = FoundMatrices::new();
    let mut block: Vec<f64> = Vec::new();
    for (line, row) in data_lines(text) {
        let fail = |message: String| FormatError::line(path, line, message);
        let mut numbers = values(row).ok_or_else(|| fail(format!("{row:?}; expected numbers")))?;
        let expected = if let MatrixLayout::Lines(count) = layout { count } else { 4 };
        if numbers.len() != expected {
            return Err(fail(format!("{}; expected {expected}", counted(numbers.len(), "number"))));
        }
        let mut index = None;
        if matches!(layout, MatrixLayout::Lines(13 | 17)) {
            numbers.remove(0);
            index = words(row).next().map(str::to_owned);
        }
        block.extend(numbers);
        if matches!(layout, MatrixLayout::Blocks(3) | MatrixLayout::Lines(12 | 13)) && block.len() == 12 {
            block.extend([0.0, 0.0, 0.0, 1.0]);
        }
        if let Ok(matrix) = <[f64; 16]>::try_from(&block[..]) {
            found.push((index, line, matrix));
            block.clear();
        }
    }
    match block.is_empty() {
        true => Ok(found),
        false => {
            Err(FormatError::whole(path, format!("the file ends after {} of the 16 numbers of a matrix", block.len())))
        }
    }
}

/// Reads K from a text of three or four lines.
pub(crate) fn intrinsics(text: &str, path: &Path) -> Result<DMat3> {
    let rows: Vec<Vec<f64>> = data_lines(text).filter_map(|(_, line)| values(line)).collect();
    let fail = |message: &str| Err(FormatError::whole(path, message));
    if rows.len() < 3 || rows.iter().any(|row| row.len() < 3) {
        return fail("expected K as three lines of three numbers");
    }
    let k = DMat3::from_cols_array(&std::array::from_fn(|i| rows[i % 3][i / 3]));
    if k.z_axis.truncate() == glam::DVec2::ZERO && k.row(2).truncate() != glam::DVec2::ZERO {
        return fail("cx and cy are in the last row, so K is transposed, as in MATLAB; write K by rows");
    }
    let further = rows.iter().enumerate().any(|(i, row)| row.get(3).is_some_and(|v| *v != f64::from(u8::from(i == 3))));
    if further {
        return fail("K has four columns, and the last one is not 0 0 0 1");
    }
    Ok(k)
}

/// Reads the lens from a text file next to the file with K. The file is recognised by its name, such as
/// `cameraDistortion.txt` or `dist.csv`.
fn lens_beside(
    source: &InputFile,
    assets: &mut AssetRoot,
    hints: &ReadHints,
    calibration: &mut Calibration,
) -> Result<Lens> {
    let own = source.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let ending = own.rsplit_once('.').map_or("", |(_, ending)| ending);
    let folder = Folder::open(source.path.parent().unwrap_or(Path::new("")), assets);
    let is_lens = |name: &&String| **name != own && name.split(['_', '-', '.', ' ']).any(looks_like_lens);
    let found: Vec<&String> = folder.ending(ending).filter(is_lens).collect();
    let [name] = found[..] else {
        return match found.first() {
            None => Ok(Lens::Pinhole),
            Some(first) => Err(FormatError::whole(
                &source.path,
                format!(
                    "the folder contains {} lens files ({first} ...), but only one is expected; write K and the \
                     distortion of one camera into one file (K, dist, image_size)",
                    found.len()
                ),
            )),
        };
    };
    let file = folder.read(name, assets)?;
    let fail = |message: String| FormatError::whole(&file.path, message);
    let listed = data_lines(file.text()?).map(|(_, line)| values(line)).collect::<Option<Vec<_>>>();
    let numbers = listed
        .ok_or_else(|| {
            fail("the file contains words; a file of this name must contain only numbers, the lens coefficients".into())
        })?
        .concat();
    calibration.note(NoticeCode::UsedOtherFile, format!("the lens was read from {name}"));
    lens_of(hints.lens.unwrap_or(LensModel::OpenCv), &numbers).map_err(fail)
}

/// Assigns K of Replica's `cam_params.json`, which is next to the trajectory or in the folder above.
fn beside(assets: &mut AssetRoot, calibration: &mut Calibration) -> Result<()> {
    for name in ["cam_params.json", "../cam_params.json"] {
        let Ok(source) = assets.read_reference(Path::new(""), name) else { continue };
        let node = yaml::parse(source.text()?, &source.path)?;
        let root = Cursor::root(&node, &source.path);
        let camera = root.get("camera").unwrap_or(root);
        let get = |key: &str| camera.require(key)?.number();
        let k = pinhole_matrix([get("fx")?, get("fy")?, get("cx")?, get("cy")?]);
        let size = Some([camera.require("w")?.count()?, camera.require("h")?.count()?]);
        camera.unknown_keys(&["fx", "fy", "cx", "cy", "w", "h", "scale"])?;
        calibration.note(NoticeCode::UsedOtherFile, format!("K and size were read from {name}"));
        for record in &mut calibration.records {
            (record.k, record.size) = (Some(k), size);
        }
        break;
    }
    Ok(())
}

/// Returns an error if the left part of a 3x4 matrix, given by rows, is not a rotation.
pub(crate) fn checked34(rows: &[f64; 12]) -> Result<(), String> {
    check_rotation(rigid(rows).0)
}

pub(crate) fn write(records: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    let mut text = String::new();
    for record in records {
        let (r, c) = record.require_pose()?.world_r_c();
        let rows = matrix_rows34(r.matrix(), c);
        let _ = writeln!(text, "{} 0.0 0.0 0.0 1.0", joined(rows.as_flattened(), " "));
    }
    Ok(OutputFiles {
        notices: vec![Notice::new(
            NoticeCode::NotWritten,
            "4x4 matrices, world_from_camera, store only poses; names, times, sizes, K and lens are not written",
        )],
        ..OutputFiles::one(text)
    })
}
