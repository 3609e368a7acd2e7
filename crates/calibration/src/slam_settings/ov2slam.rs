//! Settings of OV2SLAM: `Camera.fxl` and similar keys of the left camera, `Camera.fxr` of the right one, and their
//! mounts, body_from_camera. Source: OV2SLAM, slam_params.cpp and calibration files.

use raycam_scene::{LensModel, NoticeCode, PixelCenter};

use crate::document::{Cursor, yaml};
use crate::intrinsics::{brown_lens, lens_of, pinhole_matrix};
use crate::rig::on_a_body;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.lines().any(|line| line.trim_start().starts_with("Camera.fxl"))
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    for (i, (side, end)) in [("left", 'l'), ("right", 'r')].into_iter().enumerate() {
        if root.get(&format!("Camera.fx{end}")).is_none() {
            continue;
        }
        let get = |key: &str| root.require(&format!("Camera.{key}{end}"))?.number();
        let term = |key: &str| root.number_or(&format!("Camera.{key}{end}"), 0.0);
        let mut record = CameraRecord::new(side, PixelCenter::Integer);
        record.k = Some(pinhole_matrix([get("fx")?, get("fy")?, get("cx")?, get("cy")?]));
        let size = |word: &str| root.require(&format!("Camera.{side}_n{word}"))?.count();
        record.size = Some([size("width")?, size("height")?]);
        let model = root.require(&format!("Camera.model_{side}"))?;
        record.lens = match model.word()? {
            "pinhole" => brown_lens(term("k1")?, term("k2")?, term("p1")?, term("p2")?, 0.0),
            // The program stores k1 to k4 of cv2.fisheye under k1, k2, p1, p2.
            "fisheye" => lens_of(LensModel::Fisheye, &[term("k1")?, term("k2")?, term("p1")?, term("p2")?]),
            other => return Err(model.fail(format_args!("{other:?}; expected pinhole or fisheye"))),
        }
        .map_err(|message| model.fail(message))?;
        if let Some(at) = root.get(&format!("body_T_cam{i}")) {
            let (r, c) = at.matrix4()?;
            record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), c));
            on_a_body(&mut record, "rig");
        }
        calibration.records.push(record);
    }
    if calibration.records.iter().any(|record| record.pose.is_none()) {
        calibration.note(
            NoticeCode::MissingValue,
            "body_T_cam0 or body_T_cam1 is missing; the camera without it is at the origin",
        );
    }
    calibration.note(NoticeCode::IgnoredKey, "keys for settings of OV2SLAM are ignored");
    Ok(calibration)
}
