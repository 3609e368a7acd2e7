//! Poses of cameras in a second file, `extrinsics.json` next to `intrinsics.json`.

use std::path::Path;

use crate::document::{Cursor, zip_members};
use crate::opencv::key_view::KeyView;
use crate::opencv::keys;
use crate::opencv::poses_by_name::{self, CameraNames, contains_poses};
use crate::opencv::storage::parse;
use crate::opencv::{pose, stereo};
use crate::{Calibration, ReadHints};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_scene::{NoticeCode, counted};

/// True if the root is a map of cameras, each with R and T.
pub(super) fn has_poses(root: &Cursor<'_>) -> bool {
    let entries = root.entries().unwrap_or_default();
    entries
        .iter()
        .any(|(_, at)| keys::is_keyed(at) && pose::read_r_t(&KeyView::new(at.clone())).is_ok_and(|pose| pose.is_some()))
}

/// Sets the cameras' poses if no camera has one: the poses under the cameras' names in `extrinsics.json` next to
/// `intrinsics.json`.
pub(super) fn place_cameras(
    source: &InputFile,
    assets: &mut AssetRoot,
    hints: &ReadHints,
    calibration: &mut Calibration,
) -> Result<()> {
    if calibration.records.iter().any(|record| record.pose.is_some()) {
        return Ok(());
    }
    let Some(name) = stereo::partner(&source.path, "intrinsic", "extrinsic") else { return Ok(()) };
    let Ok(file) = assets.read_reference(Path::new(""), &name) else { return Ok(()) };
    let file = zip_members::unpacked(file, &mut assets.budget)?;
    let node = parse(&file, assets)?;
    let names = CameraNames::of(&calibration.records);
    let mut poses = vec![];
    for (key, at) in Cursor::root(&node, &file.path).entries().unwrap_or_default() {
        match names.get(key) {
            Some(camera) if contains_poses(&at, 0) || pose::has_part(&at) => poses.push((camera, at)),
            _ => calibration.notices.extend(at.notice_of_unread_key(key, format!("{key} of {name}"))),
        }
    }
    if poses.is_empty() {
        return Ok(());
    }
    calibration
        .note(NoticeCode::UsedOtherFile, format!("poses of {} were read from {name}", counted(poses.len(), "camera")));
    poses_by_name::place(&poses, "", &name, hints, calibration)
}
