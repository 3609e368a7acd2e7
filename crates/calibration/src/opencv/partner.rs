//! Poses of cameras in a second file, `extrinsics.json` next to `intrinsics.json`.

use std::path::Path;

use crate::Calibration;
use crate::document::{Cursor, zip_members};
use crate::opencv::keys::{self, KeyView};
use crate::opencv::storage::parse;
use crate::opencv::{pose, stereo};
use crate::rig::one_rig;
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

/// Sets the cameras' poses if no camera has one: R and T under the cameras' names in `extrinsics.json` next to
/// `intrinsics.json`.
pub(super) fn place_cameras(source: &InputFile, assets: &mut AssetRoot, calibration: &mut Calibration) -> Result<()> {
    if calibration.records.iter().any(|record| record.pose.is_some()) {
        return Ok(());
    }
    let Some(name) = stereo::partner(&source.path, "intrinsic", "extrinsic") else { return Ok(()) };
    let Ok(file) = assets.read_reference(Path::new(""), &name) else { return Ok(()) };
    let file = zip_members::unpacked(file, &mut assets.budget)?;
    let node = parse(&file, assets)?;
    let root = Cursor::root(&node, &file.path);
    let mut placed = 0;
    for record in &mut calibration.records {
        if let Some(at) = root.get(&record.name).filter(Cursor::is_map) {
            record.pose = pose::read_r_t(&KeyView::new(at))?;
            placed += usize::from(record.pose.is_some());
        }
    }
    if placed == 0 {
        return Ok(());
    }
    calibration
        .note(NoticeCode::UsedOtherFile, format!("R and T of {} were read from {name}", counted(placed, "camera")));
    if placed == calibration.records.len() {
        one_rig(&mut calibration.records, "rig");
    }
    Ok(())
}
