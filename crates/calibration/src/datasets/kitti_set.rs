//! Data set in KITTI's folders: one `poses.txt` for all images, or one `object/training/calib/000000.txt` per image.

use crate::picture_size::size_of_picture;
use crate::{Calibration, CameraRecord, Folder, ReadHints, kitti};
use raycam_formats::io::AssetRoot;
use raycam_formats::{FormatError, Result};
use raycam_scene::{NoticeCode, counted};

const CALIBRATIONS: &str = "object/training/calib";
const PICTURES: &str = "object/training/image_2";

pub(crate) fn detect(folder: &Folder, assets: &mut AssetRoot) -> bool {
    folder.has("poses.txt") && folder.inner(CALIBRATIONS, assets).ending(".txt").next().is_some()
}

/// Reads the left colour camera (P2) at every pose.
pub(crate) fn read(folder: &Folder, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let mut calibration = kitti::read_poses(&folder.read("poses.txt", assets)?, assets, hints)?;
    let files = folder.inner(CALIBRATIONS, assets);
    let names: Vec<String> = files.ending(".txt").cloned().collect();
    if names.len() != calibration.records.len() {
        let message = format!(
            "{}, but {} in {CALIBRATIONS}; expected equal numbers",
            counted(calibration.records.len(), "pose"),
            counted(names.len(), "file")
        );
        return Err(FormatError::whole(&folder.file("poses.txt"), message));
    }
    for (record, name) in calibration.records.iter_mut().zip(&names) {
        let found = kitti::read(&files.read(name, assets)?, assets, hints)?;
        let own = found.records.into_iter().find(|own| own.name == "P2");
        let own = own.ok_or_else(|| FormatError::whole(&files.file(name), "the file contains no P2"))?;
        let stem = name.trim_end_matches(".txt");
        let image = format!("{PICTURES}/{stem}.png");
        let k = own.require_k("a camera")?;
        let size = size_of_picture(assets, &folder.file("any"), [&image]);
        *record = CameraRecord { name: stem.into(), k: Some(k), size, image: Some(image), ..record.clone() };
    }
    calibration
        .note(NoticeCode::UsedOtherFile, "each image's camera is P2 of its calibration file, with the image's size");
    Ok(calibration)
}
