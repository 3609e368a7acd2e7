//! Trajectories of a body that carries the camera: IMU, vehicle, marker frame.

use raycam_scene::NoticeCode;

use crate::{Calibration, ReadHints};

/// Converts the records' poses, which are poses of the body, to poses of the camera, if the caller's intrinsics contain
/// the camera's mount. Adds a notice in either case.
pub(crate) fn place_on_body(calibration: &mut Calibration, hints: &ReadHints, body: &str) {
    calibration.poses_of_body = true;
    let mount = hints.intrinsics.as_ref().and_then(|intrinsics| intrinsics.pose.as_ref());
    let Some(mount) = mount.filter(|mount| !mount.is_identity()) else {
        calibration.note(
            NoticeCode::PlacedCameras,
            format!(
                "the poses belong to {body}; without a mount, the cameras are placed at these poses. For the \
                 cameras' own poses, pass a camera with a mount, from a sensor.yaml with T_BS or a camchain, as \
                 intrinsics= (--intrinsics FILE), or use a rig: rig.at_pose(R, C), or raycam dataset WORLD \
                 -o FOLDER --rig FILE --poses FILE"
            ),
        );
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
