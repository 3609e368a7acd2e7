//! ScanNet++'s `pose_intrinsic_imu.json` of an iPhone: for each image K, `pose` (in ARKit's world) and `aligned_pose`
//! (in the scan's world), world_from_camera with OpenCV's axes. Source: the ScanNet++ toolkit, iphone/arkit_pcl.py.

use raycam_scene::{NoticeCode, PixelCenter, counted};

use crate::document::{Cursor, yaml};
use crate::picture_size::size_of_picture;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    ["\"aligned_pose\"", "\"intrinsic\""].iter().all(|key| text.contains(key))
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    let entries = root.entries()?;
    let pictures = entries.iter().take(1).map(|(name, _)| format!("rgb/{name}.jpg"));
    let mut size = size_of_picture(assets, &source.path, pictures).or(hints.size);
    if size.is_none() {
        size = Some([1920, 1440]);
        calibration.note(
            NoticeCode::AssumedConvention,
            "no image found in the file's folder; the image size is assumed to be 1920 x 1440, as in ScanNet++'s \
             iPhone videos",
        );
    }
    let mut unaligned = 0;
    for (name, at) in entries {
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        record.k = Some(at.require("intrinsic")?.matrix3()?);
        record.size = size;
        record.image = Some(format!("rgb/{name}.jpg"));
        record.time = at.get("timestamp").map(|at| at.number()).transpose()?;
        let pose = match at.get("aligned_pose") {
            Some(pose) => pose,
            None => {
                unaligned += 1;
                at.require("pose")?
            }
        };
        let (r, c) = pose.matrix4()?;
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), c));
        calibration.records.push(record);
    }
    if unaligned > 0 {
        calibration.note(
            NoticeCode::PlacedCameras,
            format!(
                "{} without aligned_pose: the pose in ARKit's world coordinates is used",
                counted(unaligned, "image")
            ),
        );
    }
    Ok(calibration)
}
