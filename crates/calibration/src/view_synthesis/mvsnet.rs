//! MVSNet's cameras, `cams/00000000_cam.txt`, of DTU, BlendedMVS and Tanks and Temples: `extrinsic` (camera_from_world,
//! four lines), `intrinsic` (three lines), a line of depths. Source: MVSNet's README, "File formats".

use glam::DMat3;
use raycam_scene::{Notice, NoticeCode, PixelCenter};

use crate::document::number_lines::{data_lines, numbers};
use crate::document::{check_rigid, rigid};
use crate::picture_size::size_of_picture;
use crate::{Calibration, CameraRecord, Folder, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// Folders of the images, relative to the folder of the cameras.
const PICTURES: [&str; 5] = ["../images", "../blended_images", "../image", "..", "."];

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    data_lines(text).next().is_some_and(|(_, line)| line == "extrinsic")
}

fn find_cameras(folder: &Folder, assets: &AssetRoot) -> Option<Folder> {
    let places = ["", "cams", "Cameras", "cameras", "cams_1"].into_iter();
    let places = places.filter(|name| name.is_empty() || folder.has(name));
    let mut places = places.map(|name| match name {
        "" => Folder::open(&folder.path, assets),
        name => folder.inner(name, assets),
    });
    places.find(|place| place.ending("_cam.txt").next().is_some())
}

pub(crate) fn detect_folder(folder: &Folder, assets: &mut AssetRoot) -> bool {
    find_cameras(folder, assets).is_some()
}

pub(crate) fn read_folder(folder: &Folder, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let fail = || FormatError::unsupported(&folder.path, "expected files cams/00000000_cam.txt and so on");
    let place = find_cameras(folder, assets).ok_or_else(fail)?;
    let mut calibration = Calibration::default();
    for name in place.ending("_cam.txt") {
        let found = read(&place.read(name, assets)?, assets, hints)?;
        calibration.records.extend(found.records);
        calibration.notices.extend(found.notices);
    }
    Ok(calibration)
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let path = &source.path;
    let stem = source.stem().unwrap_or_else(|| "camera".into());
    let name = stem.trim_end_matches("_cam");
    let mut record = CameraRecord::new(name, PixelCenter::Integer);
    let mut lines = data_lines(source.text()?);
    let mut next = |what: &str| {
        lines.next().ok_or_else(|| {
            FormatError::whole(
                path,
                format!(
                    "the file ends before \
        {what}"
                ),
            )
        })
    };
    next("extrinsic")?;
    let mut m = [0.0; 16];
    let mut first = 0;
    for row in m.chunks_exact_mut(4) {
        let (line, text) = next("four lines of a matrix")?;
        first = first.max(line);
        row.copy_from_slice(&numbers::<4>(path, line, text)?);
    }
    let rows = check_rigid(&m).map_err(|message| FormatError::line(path, first, message))?;
    let (r, t) = rigid(&rows);
    record.pose = Some(Pose::camera_from_world(Rotation::Matrix(r), t));
    let (line, word) = next("intrinsic")?;
    if word != "intrinsic" {
        return Err(FormatError::line(path, line, format!("{word:?}; expected the word intrinsic")));
    }
    let mut k = [0.0; 9];
    for row in k.chunks_exact_mut(3) {
        let (line, text) = next("three lines of K")?;
        row.copy_from_slice(&numbers::<3>(path, line, text)?);
    }
    record.k = Some(DMat3::from_cols_array(&k).transpose());
    let files = PICTURES.iter().flat_map(|folder| ["jpg", "png"].map(|ending| format!("{folder}/{name}.{ending}")));
    record.size = size_of_picture(assets, path, files);
    let notice = match record.size {
        Some([w, h]) => Notice::new(NoticeCode::UsedOtherFile, format!("the size was read from the image: {w} x {h}")),
        None => Notice::new(
            NoticeCode::PlacedCameras,
            "coordinates are in the file's unit, not in metres (DTU: millimetres)",
        ),
    };
    Ok(Calibration { records: vec![record], notices: vec![notice], ..Calibration::default() })
}
