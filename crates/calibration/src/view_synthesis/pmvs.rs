//! Camera matrices P = K [R | t] without K: PMVS's `txt/00000000.txt` (the word CONTOUR, then three lines of four
//! numbers), DTU's `pos_001.txt` (the three lines alone), and NumPy arrays [3, 4] or [n, 3, 4]. Sources: PMVS-2's
//! documentation, "Camera parameter file"; DTU's MATLAB code for its point clouds.

use glam::{DMat3, DVec3};
use raycam_scene::PixelCenter;

use crate::document::focal_lengths_of;
use crate::document::npy;
use crate::document::number_lines::{data_lines, numbers};
use crate::{Calibration, CameraRecord, Folder, ReadHints};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

type CameraMatrix = [[f64; 4]; 3];

/// First line of PMVS's files.
const FIRST_LINE: &str = "CONTOUR";
/// Minimum focal length in pixels of a matrix that is read without the first line.
const MIN_FOCAL: f64 = 2.0;
/// Folder of the cameras in PMVS's folder.
const CAMERAS: &str = "txt";

pub(crate) fn detect(source: &InputFile, text: &str) -> bool {
    if npy::is_npy(&source.bytes) {
        let matrix = npy::shape(&source.bytes).is_some_and(|shape| matches!(shape[..], [3, 4] | [_, 3, 4]));
        return matrix && of_array(source).is_ok_and(|found| found.iter().all(is_camera_matrix));
    }
    if data_lines(text).next().is_some_and(|(_, line)| line == FIRST_LINE) {
        return true;
    }
    data_lines(text).count() == 3 && of_text(source, text).is_ok_and(|rows| is_camera_matrix(&rows))
}

/// True for K [R | t] of any scale: its focal lengths exceed [`MIN_FOCAL`], so it is not the matrix of a pose.
fn is_camera_matrix(rows: &CameraMatrix) -> bool {
    let [a, b, c] = rows.map(|[x, y, z, _]| DVec3::new(x, y, z));
    let k_r = DMat3::from_cols(a, b, c).transpose();
    focal_lengths_of(k_r).iter().all(|focal| *focal > MIN_FOCAL)
}

fn of_text(source: &InputFile, text: &str) -> Result<CameraMatrix> {
    let rows: Vec<[f64; 4]> = data_lines(text)
        .filter(|(_, line)| *line != FIRST_LINE)
        .map(|(line, row)| numbers(&source.path, line, row))
        .collect::<Result<_>>()?;
    let count = rows.len();
    <CameraMatrix>::try_from(rows).map_err(|_| {
        FormatError::whole(&source.path, format!("{count} lines of numbers; expected the 3 rows of a camera matrix"))
    })
}

fn of_array(source: &InputFile) -> Result<Vec<CameraMatrix>> {
    let array = npy::array(&source.bytes).map_err(|message| FormatError::whole(&source.path, message))?;
    let values = array.numbers().filter(|values| values.iter().all(|value| value.is_finite()));
    let values = values.ok_or_else(|| FormatError::whole(&source.path, "expected finite numbers"))?;
    let matrix = |part: &[f64]| [0, 1, 2].map(|i| std::array::from_fn(|j| part[4 * i + j]));
    Ok(values.chunks_exact(12).map(matrix).collect())
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let found = match npy::is_npy(&source.bytes) {
        true => of_array(source)?,
        false => vec![of_text(source, source.text()?)?],
    };
    let stem = source.stem().unwrap_or_else(|| "camera".into());
    let alone = found.len() == 1;
    let record = |(i, rows): (usize, CameraMatrix)| {
        let name = if alone { stem.clone() } else { format!("{i:06}") };
        CameraRecord { matrix: Some(rows), ..CameraRecord::new(name, PixelCenter::Integer) }
    };
    Ok(Calibration { records: found.into_iter().enumerate().map(record).collect(), ..Calibration::default() })
}

/// The folder with the cameras: the given folder, or the folder `txt` in it.
fn find_cameras(folder: &Folder, assets: &mut AssetRoot) -> Option<Folder> {
    let inner = folder.has(CAMERAS).then(|| folder.inner(CAMERAS, assets));
    inner.into_iter().chain([Folder::open(&folder.path, assets)]).find(|place| {
        let files: Vec<&String> = place.ending(".txt").collect();
        let numbered = files.iter().all(|name| name.contains(|c: char| c.is_ascii_digit()));
        let first = files.first().filter(|_| numbered && files.len() > 1);
        first.is_some_and(|name| {
            place.read(name, assets).is_ok_and(|source| source.text().is_ok_and(|text| detect(&source, text)))
        })
    })
}

pub(crate) fn detect_folder(folder: &Folder, assets: &mut AssetRoot) -> bool {
    find_cameras(folder, assets).is_some()
}

pub(crate) fn read_folder(folder: &Folder, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let fail = || FormatError::unsupported(&folder.path, "expected files txt/00000000.txt and so on");
    let place = find_cameras(folder, assets).ok_or_else(fail)?;
    let mut calibration = Calibration::default();
    for name in place.ending(".txt") {
        calibration.records.extend(read(&place.read(name, assets)?, assets, hints)?.records);
    }
    Ok(calibration)
}
