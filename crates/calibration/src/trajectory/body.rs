//! Trajectories of a body that carries the camera: IMU, vehicle, marker frame.

use raycam_scene::NoticeCode;

use crate::{Calibration, ReadHints};

/// Moves cameras, which have the poses of the body, to the mount of the intrinsics.
pub(crate) fn place_on_body(calibration: &mut Calibration, hints: &ReadHints, body: &str) {
    calibration.poses_of_body = true;
    let mount = hints.intrinsics.as_ref().and_then(|intrinsics| intrinsics.pose.as_ref());
    let Some(mount) = mount.filter(|mount| !mount.is_identity()) else {
        calibration.note(NoticeCode::PlacedCameras, format!(
            "the poses belong to {body}, and the cameras are in its axes; to get the camera's poses, pass intrinsics \
             with its mount (--intrinsics sensor.yaml with T_BS, or a camchain), or use a rig: --rig FILE --poses"
        ));
        return;
    };
    for record in &mut calibration.records {
        record.pose = record.pose.take().map(|body| mount.compose(&body));
    }
    calibration.note(
        NoticeCode::PlacedCameras,
        format!("the poses belong to {body}; the cameras are placed by the mount's pose T_BS in the intrinsics file"),
    );
}
