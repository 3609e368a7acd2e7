//! The two cameras of a stereo calibration: `M1 D1 M2 D2 R T` of OpenCV's `stereo_calib`, `K_left`, `mtxR`, and similar
//! keys.

use std::path::Path;

use crate::document::lens_keys::plain;
use crate::document::{Cursor, zip_members};
use crate::opencv::key_view::KeyView;
use crate::opencv::keys;
use crate::opencv::storage::parse;
use crate::opencv::{camera, pose, quaternion_pose};
use crate::rig::one_rig;
use crate::{Calibration, CameraRecord, Pose, ReadHints};
use raycam_formats::io::AssetRoot;
use raycam_formats::{FormatError, Result};
use raycam_scene::{Notice, NoticeCode};

/// Markers of the keys of the first and of the second camera.
const SIDES: [(&str, [&[&str]; 2]); 3] = [
    ("camera", [&["1", "cam1", "camera1"], &["2", "cam2", "camera2"]]),
    ("", [&["left", "l"], &["right", "r"]]),
    ("camera", [&["0", "cam0", "camera0"], &["1", "cam1", "camera1"]]),
];

/// Returns the two cameras, each with its name; `None` if the file does not contain a pair.
pub(super) fn pair<'a>(root: &Cursor<'a>) -> Option<[(String, KeyView<'a>); 2]> {
    if keys::marks(root).len() > 2 {
        return None;
    }
    SIDES.iter().find_map(|(name, sides)| {
        let side = |side: &[&str]| side.iter().map(|mark| (*mark).to_owned()).collect();
        let views = sides.map(|marks| KeyView::marked(root.clone(), side(marks)));
        let has_k = |view: &KeyView<'_>| view.all(&keys::K).iter().any(keys::is_matrix) || view.intrinsics().is_some();
        let named = |view: KeyView<'a>| (format!("{name}{}", view.side[0]), view);
        views.iter().all(has_k).then(|| views.map(named))
    })
}

/// Reads both cameras; R and T map points from the first camera to the second.
pub(super) fn read(
    root: &Cursor<'_>,
    pair: [(String, KeyView<'_>); 2],
    assets: &mut AssetRoot,
    hints: &ReadHints,
) -> Result<Calibration> {
    let both = KeyView::new(root.clone());
    let known = |key: &str| both.knows(key) || both.is_rectified(key) || pair.iter().any(|(_, view)| view.knows(key));
    for (key, at) in root.entries()?.iter().filter(|(key, _)| !known(key)) {
        if pose::is_pose_key(&both, key, at) {
            return Err(at.fail(
                "poses of a pair are read only from R and T; write R and T, which map points from the first camera to \
                 the second",
            ));
        }
    }
    let mut calibration = Calibration { notices: root.unread_keys(known)?, ..Calibration::default() };
    if !both.all(&keys::RECTIFIED).is_empty() {
        calibration.note(
            NoticeCode::RectifiedValues,
            "R1, R2, P1, P2 and Q belong to the rectified pair; the raw cameras are returned (rig.rectified() \
             rectifies them)",
        );
    }
    for (name, view) in pair {
        camera::read(&view, name, quaternion_pose::read(&view, hints)?, hints, &mut calibration)?;
    }
    let size = camera::size(&both)?;
    for record in &mut calibration.records {
        record.size = record.size.or(size);
    }
    let pose = match pose::read_r_t(&both)? {
        Some(pose) => Some(pose),
        None => from_partner(root.file(), assets, &mut calibration)?,
    };
    if pose.is_none() {
        refuse_baseline(root, &calibration)?;
    }
    place_second(pose, &mut calibration).map_err(|error| root.fail(error))?;
    Ok(calibration)
}

/// Rejects a baseline next to two cameras without poses, because the direction of the baseline is not specified.
pub(super) fn refuse_baseline(root: &Cursor<'_>, calibration: &Calibration) -> Result<()> {
    let entries = root.entries().unwrap_or_default();
    let found = entries.into_iter().find(|(key, at)| plain(key).starts_with("baseline") && at.number().is_ok());
    match found {
        Some((_, at)) if calibration.records.iter().all(|record| record.pose.is_none()) => Err(at.fail(
            "a baseline without a direction; write R and T, which map points from the first camera to the second: for a \
             right camera, R is the identity and T is [-baseline, 0, 0]",
        )),
        _ => Ok(()),
    }
}

/// Sets the pose of a pair's second camera from R and T.
pub(super) fn place_second(pose: Option<Pose>, calibration: &mut Calibration) -> Result<()> {
    let Some(pose) = pose else {
        let mounted = |record: &CameraRecord| record.pose.is_some();
        let placed = calibration.records.iter().filter(|record| mounted(record)).count();
        if let [first, second] = &mut calibration.records[..]
            && placed == 1
            && [&*first, &*second].iter().all(|record| record.mount.is_none())
        {
            let (origin, other) = if mounted(first) { (second, first) } else { (first, second) };
            origin.pose = Some(Pose::identity());
            let message = format!(
                "R and T of {} are interpreted as the transform from {} to {}; {} has no R and T and is placed at the origin",
                other.name, origin.name, other.name, origin.name
            );
            one_rig(&mut calibration.records, "rig");
            calibration.note(NoticeCode::AssumedConvention, message);
        } else if placed < calibration.records.len() {
            let message = "R and T are missing; cameras without a pose are at the origin";
            calibration.note(NoticeCode::MissingValue, message);
        } else if calibration.records.iter().all(|record| record.mount.is_none()) {
            one_rig(&mut calibration.records, "rig");
        }
        return Ok(());
    };
    let (_, t) = pose.r_t();
    if t.length() > 10.0 {
        calibration.note(
            NoticeCode::Implausible,
            format!(
                "T has length {:.6}, is probably in millimetres, and is not converted; divide T by 1000",
                t.length()
            ),
        );
    }
    let [first, second] = &mut calibration.records[..] else { return Ok(()) };
    if let Some(record) = [&*first, &*second].into_iter().find(|record| record.pose.is_some()) {
        return Err(FormatError::encode(format!(
            "camera {:?} has its own pose in addition to R and T of the pair; expected either R and T or a pose",
            record.name
        )));
    }
    if second.name.ends_with("right") && pose.r_c().1.x < 0.0 {
        calibration.notices.push(Notice::new(NoticeCode::Implausible, format!(
            "the right camera is at x = {} in the left camera's axes; R and T must map points from the left camera to \
             the right camera, so the file may contain the inverse",
            pose.r_c().1.x
        )));
    }
    second.pose = Some(pose);
    one_rig([first, second], "rig");
    Ok(())
}

/// Reads R and T from the second file that OpenCV's sample writes: extrinsics.yml next to intrinsics.yml.
fn from_partner(path: &Path, assets: &mut AssetRoot, calibration: &mut Calibration) -> Result<Option<Pose>> {
    let Some(partner) = partner(path, "intrinsic", "extrinsic") else { return Ok(None) };
    let Ok(source) = assets.read_reference(Path::new(""), &partner) else { return Ok(None) };
    let source = zip_members::unpacked(source, &mut assets.budget)?;
    let node = parse(&source, assets)?;
    let root = Cursor::root(&node, &source.path);
    let pose = pose::read_r_t(&KeyView::new(root))?;
    if pose.is_some() {
        calibration.note(NoticeCode::UsedOtherFile, format!("R and T were read from {partner}"));
    }
    Ok(pose)
}

/// Name of the partner of a file: the same name with `word` replaced by `other`.
pub(super) fn partner(path: &Path, word: &str, other: &str) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    name.contains(word).then(|| name.replace(word, other))
}
