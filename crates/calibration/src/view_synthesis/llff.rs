//! `poses_bounds.npy` of LLFF: for each image a 3x5 matrix (columns: down, right, backward, the centre, and height,
//! width, focal length), then two depths. Source: LLFF's README, "Using your own poses".

use glam::{DMat3, DVec3};
use raycam_scene::PixelCenter;

use crate::document::{check_rotation, npy};
use crate::intrinsics::{middle_of, pinhole_matrix};
use crate::{Calibration, CameraRecord, Folder, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

pub(crate) fn detect(source: &InputFile, _: &str) -> bool {
    npy::shape(&source.bytes).is_some_and(|shape| matches!(shape[..], [_, 17]))
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let path = &source.path;
    let fail = |message: String| FormatError::whole(path, message);
    let array = npy::array(&source.bytes).map_err(fail)?;
    let numbers = array.numbers().filter(|_| matches!(array.shape[..], [_, 17]));
    let numbers = numbers.ok_or_else(|| fail(format!("an array of {:?}; expected [n, 17]", array.shape)))?;
    let mut pictures = Folder::open(&path.parent().unwrap_or(path).join("images"), assets).names;
    // LLFF sorts image names as text, so the same order is used here.
    pictures.sort();
    pictures.retain(|name| ["jpg", "JPG", "png", "PNG", "jpeg"].iter().any(|ending| name.ends_with(ending)));
    if pictures.len() * 17 != numbers.len() {
        pictures.clear();
    }
    let mut calibration = Calibration::default();
    for (i, row) in numbers.chunks_exact(17).enumerate() {
        let column = |j: usize| DVec3::new(row[j], row[5 + j], row[10 + j]);
        let [height, width, focal] = column(4).to_array();
        let whole = |side: f64| side.fract() == 0.0 && (1.0..65537.0).contains(&side);
        if !(whole(height) && whole(width) && focal > 0.0 && focal.is_finite()) {
            return Err(fail(format!(
                "row {i}: height {height}, width {width}, focal length {focal}; expected whole numbers from 1 to \
                 65536 and a focal length greater than 0"
            )));
        }
        let (down, right, backward) = (column(0), column(1), column(2));
        let r = DMat3::from_cols(right, down, -backward);
        check_rotation(r).map_err(|message| fail(format!("row {i}: {message}")))?;
        let name = pictures.get(i).cloned();
        let mut record = CameraRecord::new(name.clone().unwrap_or_else(|| format!("{i:06}")), PixelCenter::Half);
        record.image = name.map(|name| format!("images/{name}"));
        let size = [width as u32, height as u32];
        record.size = Some(size);
        let [cx, cy] = middle_of(size, PixelCenter::Half);
        record.k = Some(pinhole_matrix([focal, focal, cx, cy]));
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), column(3)));
        calibration.records.push(record);
    }
    Ok(calibration)
}
