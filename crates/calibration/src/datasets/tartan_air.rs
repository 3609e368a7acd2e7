//! TartanAir's trajectories: lines of x y z qx qy qz qw, world_from_camera, where camera and world have x forward, y
//! right, z down (NED). Source: TartanAir's page and tools, "Camera pose file" and "Camera intrinsics".

use glam::{DMat3, DVec3};
use raycam_scene::{NoticeCode, PixelCenter};

use crate::document::number_lines::{data_lines, looks_like, numbers};
use crate::intrinsics::pinhole_matrix;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// Focal length in pixels: half the image width, because half the angle of view is 45 degrees.
const FOCAL: f64 = 320.0;

pub(crate) fn detect(source: &InputFile, text: &str) -> bool {
    let stem = source.stem().unwrap_or_default();
    let named = ["pose_left", "pose_right", "pose_lcam", "pose_rcam"].iter().any(|start| stem.starts_with(start));
    named && looks_like(text, 7)
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let path = &source.path;
    let second = source.stem().is_some_and(|stem| stem.starts_with("pose_lcam") || stem.starts_with("pose_rcam"));
    let size: [u32; 2] = if second { [640, 640] } else { [640, 480] };
    // The columns are the directions of OpenCV's x, y and z in TartanAir's camera axes.
    let axes = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
    let mut calibration = Calibration::default();
    for (line, row) in data_lines(source.text()?) {
        let [x, y, z, qx, qy, qz, qw] = numbers(path, line, row)?;
        let rotation = Rotation::unit_quaternion([qw, qx, qy, qz]).map_err(|message| {
            FormatError::line(path, line, format!("{message}; expected the columns x y z qx qy qz qw"))
        })?;
        let mut record = CameraRecord::new(format!("{:06}", calibration.records.len()), PixelCenter::Half);
        if hints.intrinsics.is_none() {
            let [width, height] = size.map(f64::from);
            record.k = Some(pinhole_matrix([FOCAL, FOCAL, 0.5 * width, 0.5 * height]));
            record.size = Some(size);
        }
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(rotation.matrix() * axes), DVec3::new(x, y, z)));
        calibration.records.push(record);
    }
    if hints.intrinsics.is_none() {
        calibration.note(
            NoticeCode::AssumedConvention,
            format!(
                "K and size are TartanAir's: f = 320, {} x {} (set another K with intrinsics= or --intrinsics)",
                size[0], size[1]
            ),
        );
    }
    calibration.note(NoticeCode::PlacedCameras, "the world's axes are TartanAir's: x forward, y right, z down");
    Ok(calibration)
}
