//! `cameras_sphere.npz` of IDR and NeuS: `world_mat_0` and so on, K [R | t] of any scale, and `scale_mat_0`,
//! world_from_normalised. Source: NeuS, dataset.py.

use raycam_scene::{NoticeCode, PixelCenter};

use crate::document::npy;
use crate::folder::by_numbers;
use crate::picture_size::size_of_picture;
use crate::{Calibration, CameraRecord, Folder, ReadHints};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

pub(crate) fn detect(source: &InputFile, _: &str) -> bool {
    npy::names(&source.bytes).iter().any(|name| name.starts_with("world_mat_"))
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let path = &source.path;
    let mut arrays = npy::arrays(&source.bytes, path, &mut assets.budget)?;
    arrays.sort_by(|(a, _), (b, _)| by_numbers(a, b));
    let parent = path.parent().unwrap_or(path);
    let found = ["image", "rgb", "images"].into_iter().find_map(|name| {
        let folder = Folder::open(&parent.join(name), assets);
        let pictures: Vec<String> =
            folder.names.iter().filter(|file| file.ends_with(".png") || file.ends_with(".jpg")).cloned().collect();
        (!pictures.is_empty()).then_some((name, pictures))
    });
    let mut calibration = Calibration::default();
    let mut normalised = false;
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
        record.matrix = Some([0, 1, 2].map(|i| [0, 1, 2, 3].map(|j| numbers[4 * i + j])));
        if let Some((folder, pictures)) = &found {
            record.image = pictures.get(calibration.records.len()).map(|file| format!("{folder}/{file}"));
            record.size = size_of_picture(assets, path, &record.image);
        }
        calibration.records.push(record);
    }
    if normalised {
        calibration.note(NoticeCode::PlacedCameras,
            "the cameras are in the world of world_mat; a mesh in the unit sphere needs scale_mat, world_from_normalised",
        );
    }
    if let Some(size) = calibration.records.first().and_then(|record| record.size) {
        calibration
            .note(NoticeCode::UsedOtherFile, format!("the sizes are those of the pictures, {} x {}", size[0], size[1]));
    }
    Ok(calibration)
}
