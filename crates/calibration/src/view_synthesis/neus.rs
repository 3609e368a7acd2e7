//! `cameras_sphere.npz` of IDR and NeuS: `world_mat_0` and so on (K [R | t] of any scale) and `scale_mat_0`
//! (world_from_normalised). DVR, pixelNeRF and Kubric store [R t] in `world_mat_0` and K in `camera_mat_0`, in units of
//! half the image size. Sources: NeuS, dataset.py; DVR and pixelNeRF, their loaders of DTU and ShapeNet.

use std::path::Path;

use glam::{DMat3, DVec3};
use raycam_scene::{Notice, NoticeCode, PixelCenter};

use crate::document::npy::{self, NumpyArray};
use crate::document::{rigid, rotation_of_any_scale};
use crate::folder::by_numbers;
use crate::intrinsics::require_known_size;
use crate::picture_size::size_of_picture;
use crate::{Calibration, CameraRecord, Folder, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

pub(crate) fn detect(source: &InputFile, _: &str) -> bool {
    npy::names(&source.bytes).iter().any(|name| name.starts_with("world_mat_"))
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let path = &source.path;
    let mut arrays = npy::arrays(&source.bytes, path, &mut assets.budget)?;
    arrays.sort_by(|(a, _), (b, _)| by_numbers(a, b));
    let found = pictures_beside(path, assets);
    let mut calibration = Calibration::default();
    let (mut normalised, mut separate, mut in_pixels) = (false, 0, Vec::new());
    for (name, array) in &arrays {
        let fail = |message: &str| FormatError::whole(path, format!("{name}: {message}"));
        if name.starts_with("scale_mat_") {
            let identity = |i: usize| if i.is_multiple_of(5) { 1.0 } else { 0.0 };
            let numbers = array.numbers().unwrap_or_default();
            normalised |= numbers.iter().enumerate().any(|(i, value)| *value != identity(i));
        }
        let Some(number) = name.strip_prefix("world_mat_").filter(|rest| rest.parse::<u32>().is_ok()) else {
            continue;
        };
        let numbers = array.numbers().filter(|_| matches!(array.shape[..], [3 | 4, 4]));
        let numbers = numbers.ok_or_else(|| fail("expected a 4x4 matrix of numbers"))?;
        if numbers.iter().any(|value| !value.is_finite()) {
            return Err(fail("expected finite numbers"));
        }
        let mut record = CameraRecord::new(number, PixelCenter::Integer);
        if let Some((folder, pictures)) = &found {
            record.image = pictures.get(calibration.records.len()).map(|file| format!("{folder}/{file}"));
            record.size = size_of_picture(assets, path, &record.image);
        }
        let rows = [0, 1, 2].map(|i| [0, 1, 2, 3].map(|j| numbers[4 * i + j]));
        let scaled_pose = pose_of_any_scale(&rows);
        match scaled_pose.clone().zip(intrinsics_of(&arrays, number)) {
            Some((pose, camera)) => {
                record.pose = Some(pose);
                if is_in_pixels(&camera) {
                    record.k = Some(camera);
                    in_pixels.push(format!("camera_mat_{number}"));
                } else {
                    let what = "camera_mat_i of DVR and pixelNeRF";
                    let size = require_known_size(record.size.or(hints.size), path, what)?;
                    record.size = Some(size);
                    record.pixel_center = PixelCenter::Half;
                    record.k = Some(to_pixels(size) * camera);
                    separate += 1;
                }
            }
            None if scaled_pose.is_some() => {
                return Err(fail(&format!(
                    "the matrix contains only a rotation and a translation [R t], and K is missing; add K as the matrix \
                     camera_mat_{number}, or multiply by K (world_mat_{number} = K [R t])"
                )));
            }
            None => record.matrix = Some(rows),
        }
        calibration.records.push(record);
    }
    if !in_pixels.is_empty() {
        let message = "read as K in pixels, because its principal point would be outside the image in units of half the \
                       image size; world_mat_i is read as camera_from_world [R t]";
        calibration.notices.push(Notice::about_all(NoticeCode::AssumedConvention, in_pixels.into_iter(), message));
    }
    if separate > 0 {
        calibration.note(
            NoticeCode::AssumedConvention,
            "camera_mat_i is K in units of half the image size, world_mat_i is camera_from_world [R t]",
        );
    }
    if normalised {
        calibration.note(
            NoticeCode::PlacedCameras,
            "the cameras' poses come from world_mat; multiply the vertices of a mesh in the unit sphere by scale_mat to \
             place the mesh in the same world",
        );
    }
    if let Some(size) = calibration.records.first().and_then(|record| record.size)
        && found.is_some()
    {
        calibration
            .note(NoticeCode::UsedOtherFile, format!("the sizes were read from the images: {} x {}", size[0], size[1]));
    }
    Ok(calibration)
}

/// Name of the first folder with images in the file's own folder, and the images' names.
fn pictures_beside(path: &Path, assets: &AssetRoot) -> Option<(&'static str, Vec<String>)> {
    let parent = path.parent().unwrap_or(path);
    ["image", "rgb", "images"].into_iter().find_map(|name| {
        let folder = Folder::open(&parent.join(name), assets);
        let pictures: Vec<String> =
            folder.names.iter().filter(|file| file.ends_with(".png") || file.ends_with(".jpg")).cloned().collect();
        (!pictures.is_empty()).then_some((name, pictures))
    })
}

/// Pose from a matrix [R | t] that is multiplied by any positive factor. The factor has no effect on projections.
fn pose_of_any_scale(rows: &[[f64; 4]; 3]) -> Option<Pose> {
    let flat: [f64; 12] = std::array::from_fn(|i| rows[i / 4][i % 4]);
    let (r, t) = rigid(&flat);
    let rotation = rotation_of_any_scale(r)?;
    Some(Pose::camera_from_world(Rotation::Matrix(rotation), t / r.determinant().cbrt()))
}

/// Returns `camera_mat_i`, if the file contains it.
fn intrinsics_of(arrays: &[(String, NumpyArray)], number: &str) -> Option<DMat3> {
    let (_, camera) = arrays.iter().find(|(name, _)| name.strip_prefix("camera_mat_") == Some(number))?;
    let numbers = camera.numbers().filter(|numbers| numbers.iter().all(|value| value.is_finite()))?;
    let columns = *camera.shape.last()?;
    let fits = matches!((camera.shape[..].len(), columns), (2, 3 | 4)) && numbers.len() >= 2 * columns + 3;
    let rows = fits.then(|| std::array::from_fn(|i| numbers[i / 3 * columns + i % 3]))?;
    Some(DMat3::from_cols_array(&rows).transpose())
}

/// True if the principal point is in pixels: in units of half the image size, it would be outside the image.
fn is_in_pixels(camera: &DMat3) -> bool {
    camera.z_axis.truncate().abs().max_element() > 2.0
}

/// Matrix that converts K from units of half the image size, relative to the image centre, to pixels.
fn to_pixels(size: [u32; 2]) -> DMat3 {
    let [width, height] = size.map(|side| 0.5 * f64::from(side));
    DMat3::from_cols(DVec3::X * width, DVec3::Y * height, DVec3::new(width, height, 1.0))
}
