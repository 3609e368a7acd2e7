//! Conversion of rigs from and to files that contain one rig.

use crate::rig_mount::RigMount;
use crate::{CameraRecord, Pose};
use raycam_formats::{FormatError, Result};
use raycam_scene::{Notice, NoticeCode};

/// Makes the cameras of a file one rig, whose body is the world of the file; a single camera does not become a rig.
pub(crate) fn one_rig<'a>(records: impl IntoIterator<Item = &'a mut CameraRecord>, rig: &str) {
    let records: Vec<_> = records.into_iter().collect();
    // A camera with parallel rays cannot be part of a rig.
    if records.len() < 2 || records.iter().any(|record| record.require_pose().is_err()) {
        return;
    }
    for record in records {
        on_a_body(record, rig);
    }
}

/// Mounts a camera on a rig whose body is the world of the file, as specified by its format.
pub(crate) fn on_a_body(record: &mut CameraRecord, rig: &str) {
    let Ok(camera) = record.require_pose() else { return };
    record.mount = Some(RigMount {
        rig: rig.into(),
        frame: rig.into(),
        name: record.name.clone(),
        camera,
        body: Pose::identity(),
    });
}

/// Returns the poses of cameras for a format that stores one rig: camera_from_body for cameras on a rig. Adds notices
/// about data that is lost.
///
/// # Errors
/// [`FormatError::Encode`] if the cameras belong to several rigs, or to one rig at several poses.
pub(crate) fn poses_on_one_rig(records: &[CameraRecord], format: &str, notices: &mut Vec<Notice>) -> Result<Vec<Pose>> {
    let mounts: Option<Vec<&RigMount>> = records.iter().map(|record| record.mount.as_ref()).collect();
    let Some(mounts) = mounts else { return records.iter().map(CameraRecord::require_pose).collect() };
    let first = mounts[0];
    let other = |mount: &&&RigMount| (&mount.rig, &mount.frame) != (&first.rig, &first.frame);
    if let Some(other) = mounts.iter().find(other) {
        return Err(FormatError::encode(format!(
            "{format} stores one rig at one pose; got rig {:?} at pose {:?} and rig {:?} at pose {:?}",
            first.rig, first.frame, other.rig, other.frame
        )));
    }
    if !first.body.is_identity() {
        notices.push(Notice::new(
            NoticeCode::NotWritten,
            format!("{format} cannot store a rig's pose in the world; the pose is not written"),
        ));
    }
    Ok(mounts.iter().map(|mount| mount.camera.clone()).collect())
}
