//! Poses in a map whose keys are the names of cameras: next to the cameras' maps, or in a second file.

use std::collections::HashMap;

use crate::document::Cursor;
use crate::document::lens_keys::plain;
use crate::opencv::{keys, pose};
use crate::rig::one_rig;
use crate::{Calibration, CameraRecord, ReadHints, pose_map};
use raycam_formats::Result;
use raycam_scene::{Notice, NoticeCode};

/// Numbers of the cameras by their names, which are compared like keys.
pub(super) struct CameraNames(HashMap<String, usize>);

impl CameraNames {
    pub(super) fn of(records: &[CameraRecord]) -> Self {
        let named = records.iter().enumerate().rev().map(|(number, record)| (plain(&record.name), number));
        Self(named.collect())
    }

    pub(super) fn get(&self, name: &str) -> Option<usize> {
        self.0.get(&plain(name)).copied()
    }
}

/// Assigns poses to cameras, which are given by their numbers. `key` is the key of the poses' map, which may specify
/// their direction; it is empty if there is no such key. `map` names the map in notices about cameras without a pose; if
/// all cameras have a pose, they form a rig.
///
/// # Errors
/// An error for values that are not poses, and for a camera with another pose in its own map.
pub(super) fn place(
    poses: &[(usize, Cursor<'_>)],
    key: &str,
    map: &str,
    hints: &ReadHints,
    calibration: &mut Calibration,
) -> Result<()> {
    for (camera, inner) in poses {
        let pose = pose::pose_of_key(key, inner, hints, calibration)?;
        let record = &mut calibration.records[*camera];
        if record.pose.as_ref().is_some_and(|own| !own.is_near(&pose)) {
            return Err(
                inner.fail(format_args!("camera {} has another pose in its map; expected one pose", record.name))
            );
        }
        record.pose = Some(pose);
    }
    let without: Vec<_> = calibration.records.iter().filter(|record| record.pose.is_none()).collect();
    let text = format!("no pose in {map}; the camera is at the origin");
    let about =
        |record: &&CameraRecord| Notice::about(NoticeCode::AssumedConvention, record.name.clone(), text.clone());
    let notices: Vec<_> = without.iter().map(about).collect();
    if notices.is_empty() {
        one_rig(&mut calibration.records, "rig");
    }
    calibration.notices.extend(notices);
    Ok(())
}

/// True for a pose, or for a list or map with a pose at most `depth` levels below it.
pub(super) fn contains_poses(at: &Cursor<'_>, depth: usize) -> bool {
    if keys::is_keyed(at) && (pose::has_r_t(at) || pose_map::is_pose_map(at))
        || matches!(at.numbers().map(|numbers| numbers.len()), Ok(12 | 16))
    {
        return true;
    }
    let below = |at: &Cursor<'_>| depth > 0 && contains_poses(at, depth - 1);
    let listed = at.list().unwrap_or_default();
    at.entries().unwrap_or_default().iter().map(|(_, at)| at).chain(&listed).any(below)
}
