//! Trajectories of a body that carries the camera: IMU, vehicle, marker frame.

use raycam_scene::NoticeCode;

use crate::{Calibration, ReadHints};

/// Puts cameras, whose poses are those of the body so far, where the mount of the intrinsics has them.
pub(crate) fn place_on_body(calibration: &mut Calibration, hints: &ReadHints, body: &str) {
    calibration.poses_of_body = true;
    let mount = hints.intrinsics.as_ref().and_then(|intrinsics| intrinsics.pose.as_ref());
    let Some(mount) = mount.filter(|mount| !mount.is_identity()) else {
        calibration.note(NoticeCode::PlacedCameras, format!(
            "the poses are those of {body}, and the cameras stand in its axes: for the camera itself give intrinsics \
             with its mount (--intrinsics sensor.yaml with T_BS, a camchain), or drive a rig: --rig FILE --poses"
        ));
        return;
    };
    for record in &mut calibration.records {
        record.pose = record.pose.take().map(|body| mount.compose(&body));
    }
    calibration.note(NoticeCode::PlacedCameras, format!(
        "the poses are those of {body}; the cameras stand where the pose of the intrinsics (T_BS, the mount) puts them"
    ));
}
