//! KITTI-360: `poses.txt` has lines with an index and the rows of world_from_body (12 numbers); `calib_cam_to_pose.txt`
//! has the mounts of its cameras, body_from_camera. Source: kitti360Scripts, project.py.

use glam::DMat3;
use raycam_scene::{NoticeCode, PixelCenter};

use crate::document::number_lines::{data_lines, looks_like, numbers};
use crate::document::rigid;
use crate::rig::on_a_body;
use crate::trajectory::body::place_on_body;
use crate::trajectory::matrices::{checked34, has_times};
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    looks_like(text, 13) && !has_times(text) || is_mounts(text)
}

fn is_mounts(text: &str) -> bool {
    data_lines(text).next().is_some_and(|(_, line)| line.starts_with("image_0") && line.contains(':'))
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let (path, text) = (&source.path, source.text()?);
    if is_mounts(text) {
        return mounts(source, assets, hints);
    }
    let mut calibration = Calibration::default();
    for (line, row) in data_lines(text) {
        let all: [f64; 13] = numbers(path, line, row)?;
        let rows: [f64; 12] = std::array::from_fn(|i| all[i + 1]);
        checked34(&rows).map_err(|message| FormatError::line(path, line, message))?;
        if all[0].fract() != 0.0 {
            return Err(FormatError::line(
                path,
                line,
                format!(
                    "frame index {}; expected a whole number before the 12 numbers of the pose (format=\"poses\" reads \
                     times)",
                    all[0]
                ),
            ));
        }
        let mut record = CameraRecord::new(row.split_whitespace().next().unwrap_or_default(), PixelCenter::Integer);
        let (r, c) = rigid(&rows);
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), c));
        calibration.records.push(record);
    }
    place_on_body(&mut calibration, hints, "KITTI-360's body (GPS/IMU)");
    Ok(calibration)
}

/// Reads the cameras, with poses in the axes of the body. K of the rectified cameras comes from `perspective.txt` in
/// the same folder, and K of the fisheye cameras from their own files.
fn mounts(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let mut calibration = Calibration::default();
    let perspective = assets.read_reference(std::path::Path::new(""), "perspective.txt").ok();
    for (line, row) in data_lines(source.text()?) {
        let fail = |message: &str| FormatError::line(&source.path, line, message);
        let (key, values) =
            row.split_once(':').ok_or_else(|| fail("expected a key and 12 numbers, as in image_00: 0.037 ..."))?;
        let rows = numbers::<12>(&source.path, line, values)?;
        checked34(&rows).map_err(|message| fail(&message))?;
        let (mut r, c) = rigid(&rows);
        let mut record = CameraRecord::new(key, PixelCenter::Integer);
        let number = key.trim_start_matches("image_");
        if let Some(file) = &perspective {
            let find = |name: String| {
                let mut lines = data_lines(file.text().ok()?);
                lines.find_map(|(line, row)| Some((line, row.strip_prefix(&name)?.strip_prefix(':')?)))
            };
            if let Some((line, values)) = find(format!("P_rect_{number}")) {
                let p = numbers::<12>(&file.path, line, values)?;
                record.k = Some(rigid(&p).0);
            }
            if let Some((line, values)) = find(format!("R_rect_{number}")) {
                // Reading the rows as columns gives the transpose: the rotation raw_from_rectified.
                r *= DMat3::from_cols_array(&numbers::<9>(&file.path, line, values)?);
            }
            if let Some((line, values)) = find(format!("S_rect_{number}")) {
                record.size = Some(numbers::<2>(&file.path, line, values)?.map(|side| side as u32));
            }
        }
        if record.k.is_none()
            && let Ok(own) = assets.read_reference(std::path::Path::new(""), format!("{key}.yaml"))
            && let Some(camera) = crate::calibration_tools::camodocal::read(&own, assets, hints)?.records.pop()
        {
            (record.k, record.size, record.lens) = (camera.k, camera.size, camera.lens);
        }
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), c));
        on_a_body(&mut record, "rig");
        calibration.records.push(record);
    }
    calibration.note(
        NoticeCode::PlacedCameras,
        match perspective {
            Some(_) => "camera poses are relative to the body; the cameras of perspective.txt are rectified",
            None => {
                "camera poses are relative to the body; the cameras have no K, because perspective.txt and \
                 image_02.yaml are not in the same folder"
            }
        },
    );
    Ok(calibration)
}
