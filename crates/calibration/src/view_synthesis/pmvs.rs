//! Camera matrices P = K [R | t] of PMVS: `txt/00000000.txt`, with the word CONTOUR, then three lines of four numbers.
//! Source: PMVS-2's documentation, "Camera parameter file".

use raycam_scene::{PixelCenter, counted};

use crate::document::number_lines::{data_lines, numbers};
use crate::{Calibration, CameraRecord, Folder, ReadHints};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// First line of PMVS's files.
const FIRST_LINE: &str = "CONTOUR";
/// Folder of the cameras in PMVS's folder.
const CAMERAS: &str = "txt";

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    data_lines(text).next().is_some_and(|(_, line)| line == FIRST_LINE)
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let text = source.text()?;
    if !detect(source, text) {
        return Err(FormatError::line(&source.path, 1, format!("expected {FIRST_LINE} as the first line")));
    }
    let rows: Vec<[f64; 4]> =
        data_lines(text).skip(1).map(|(line, row)| numbers(&source.path, line, row)).collect::<Result<_>>()?;
    let count = rows.len();
    let matrix = rows.try_into().map_err(|_| {
        FormatError::whole(
            &source.path,
            format!("{} of numbers; expected the 3 rows of a camera matrix", counted(count, "line")),
        )
    })?;
    let stem = source.stem().unwrap_or_else(|| "camera".into());
    let record = CameraRecord { matrix: Some(matrix), ..CameraRecord::new(stem, PixelCenter::Integer) };
    Ok(Calibration { records: vec![record], ..Calibration::default() })
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
