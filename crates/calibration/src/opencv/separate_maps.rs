//! Cameras in separate maps of an OpenCV file, and the poses next to these maps: R and T of a pair, or a map with a pose
//! for each camera (`extrinsics: {left: {R: ..., T: ...}, right: ...}`).

use std::path::Path;

use crate::document::Cursor;
use crate::document::lens_keys::plain;
use crate::opencv::camera_maps::{has_camera, list_of_cameras};
use crate::opencv::keys::{self, KeyView};
use crate::opencv::one_camera::{self, refuse_lens_without_k};
use crate::opencv::{partner, pose, stereo};
use crate::rig::one_rig;
use crate::{Calibration, Pose, ReadHints, pose_map};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_scene::{Notice, NoticeCode, counted};

/// Maximum nesting level of the poses below a map such as `extrinsics`.
const MAX_POSE_DEPTH: usize = 3;

/// Reads cameras in separate maps; two cameras with R and T form a pair. A file that contains only the poses of a pair is
/// read together with the file of its cameras, by `read_file`.
pub(super) fn read(
    view: &KeyView<'_>,
    source: &InputFile,
    assets: &mut AssetRoot,
    hints: &ReadHints,
    read_file: impl FnOnce(&InputFile, &mut AssetRoot, &ReadHints) -> Result<Calibration>,
) -> Result<Calibration> {
    let root = &view.at;
    let listed = list_of_cameras(root)?;
    let (cameras, others): (Vec<_>, Vec<_>) = listed.into_iter().partition(|(_, inner)| has_camera(&inner.at));
    let mut calibration = Calibration::default();
    for (name, inner) in cameras {
        let camera = one_camera::read(&inner, name, hints)?;
        calibration.records.extend(camera.records);
        calibration.notices.extend(camera.notices);
        calibration.used_convention |= camera.used_convention;
    }
    let mut poses = PosesBesideCameras { view, hints, pair: pose::read_r_t(view)?.map(|pose| (String::new(), pose)) };
    for (name, inner) in others {
        poses.add(&name, &inner, &mut calibration)?;
    }
    if calibration.records.is_empty() {
        if let Some(name) = stereo::partner(&source.path, "extrinsic", "intrinsic")
            && (partner::has_poses(root) || poses.pair.is_some())
            && let Ok(intrinsics) = assets.read_reference(Path::new(""), &name)
        {
            return read_file(&intrinsics, assets, hints);
        }
        return Err(
            root.fail("no camera found; expected a camera matrix such as K, camera_matrix, cameraMatrix or mtx")
        );
    }
    partner::place_cameras(source, assets, &mut calibration)?;
    place_pair(root, poses.pair, &mut calibration)?;
    Ok(calibration)
}

/// Sets the pose of a pair's second camera; `pair` is R and T with their key.
fn place_pair(root: &Cursor<'_>, pair: Option<(String, Pose)>, calibration: &mut Calibration) -> Result<()> {
    let Some((key, pose)) = pair else { return stereo::refuse_baseline(root, calibration) };
    let [first, second] = &calibration.records[..] else {
        return Err(root.fail(format_args!(
            "R and T outside the cameras' maps are only allowed for a pair, but the file has {}; write each camera's R and \
             T into its map, or remove R and T if they belong to another sensor",
            counted(calibration.records.len(), "camera")
        )));
    };
    // The cameras of `right_to_left` may be named `right_camera` and `left_cam`.
    let short = |name: &str| match plain(name).replace("camera", "").replace("cam", "") {
        rest if rest.chars().any(char::is_alphabetic) => rest,
        _ => plain(name),
    };
    let (first, second) = (&first.name, &second.name);
    let links = |a: &str, b: &str| {
        [(plain(&key), plain(a), plain(b)), (short(&key), short(a), short(b))].iter().any(|(key, a, b)| {
            [format!("{a}to{b}"), format!("{a}2{b}"), format!("{b}from{a}")].iter().any(|link| key.contains(link))
        })
    };
    let pose = if links(second, first) { pose.inverted() } else { pose };
    stereo::place_second(Some(pose), calibration).map_err(|error| root.fail(error))
}

/// Reader of the poses next to the cameras' maps.
struct PosesBesideCameras<'v, 'a> {
    view: &'v KeyView<'a>,
    hints: &'v ReadHints,
    /// R and T of a pair, with the key of their map.
    pair: Option<(String, Pose)>,
}

impl PosesBesideCameras<'_, '_> {
    /// Reads an entry that is not a camera: the poses in it are assigned to the cameras or to the pair.
    ///
    /// # Errors
    /// An error for poses that belong to no camera, and for a lens without a camera.
    fn add(&mut self, name: &str, inner: &KeyView<'_>, calibration: &mut Calibration) -> Result<()> {
        let view = self.view;
        if view.has_name(name, &keys::LENS) {
            refuse_lens_without_k(view)?;
        }
        let has_cameras = !calibration.records.is_empty();
        if has_cameras {
            inner.at.refuse_lens(name)?;
        }
        if place_by_name(&inner.at, self.hints, calibration)? {
            return Ok(());
        }
        let holds_poses = pose::is_pose_word(name) && contains_poses(&inner.at, MAX_POSE_DEPTH);
        let is_r_t = keys::is_keyed(&inner.at)
            && !(holds_poses && has_cameras && !pose::has_r_t(&inner.at))
            && !keys::is_other_sensor(name, &inner.at);
        let mut is_used = false;
        if self.pair.is_none() && is_r_t {
            self.pair = pose::read_r_t(&KeyView::new(inner.at.clone()))?.map(|pose| (name.to_owned(), pose));
            is_used = self.pair.is_some();
        } else if let (None, true, Some(around)) = (&self.pair, pose::is_part(view, name), inner.above.first()) {
            // R and T are next to the cameras, in a map below the root.
            self.pair = pose::read_r_t(around)?.map(|pose| (String::new(), pose));
        } else if has_cameras && (holds_poses && self.pair.is_none() || pose::is_pose_key(view, name, &inner.at)) {
            return Err(inner.at.fail(
                "the pose is outside the cameras' maps; move it into its camera's map. For a pair of cameras, write R and T, \
                 which map points from the first camera to the second. If the pose belongs to another sensor, remove it",
            ));
        }
        if !(view.knows(name) || view.is_rectified(name) || is_used) {
            let subject = format!("{name} (line {})", inner.at.node.line);
            calibration.notices.extend(inner.at.notice_of_unread_key(name, subject));
        }
        Ok(())
    }
}

/// Assigns the poses in a map whose keys are the names of cameras; returns false for another map.
fn place_by_name(at: &Cursor<'_>, hints: &ReadHints, calibration: &mut Calibration) -> Result<bool> {
    let entries = at.entries().unwrap_or_default();
    let names: Vec<String> = calibration.records.iter().map(|record| plain(&record.name)).collect();
    let camera_of = |key: &str| names.iter().position(|name| *name == plain(key));
    let is_pose = |at: &Cursor<'_>| contains_poses(at, 0);
    let own: Vec<_> = entries.iter().filter_map(|(key, at)| Some((camera_of(key)?, at))).collect();
    if own.is_empty() || own.len() != entries.len() || !own.iter().all(|(_, at)| is_pose(at)) {
        return Ok(false);
    }
    for (camera, inner) in own {
        let pose = pose::pose_of_key(at.name(), inner, hints, calibration)?;
        let record = &mut calibration.records[camera];
        if record.pose.as_ref().is_some_and(|own| !own.is_near(&pose)) {
            return Err(
                inner.fail(format_args!("camera {} has another pose in its map; expected one pose", record.name))
            );
        }
        record.pose = Some(pose);
    }
    let without: Vec<_> = calibration.records.iter().filter(|record| record.pose.is_none()).collect();
    let text = "no pose in the map of poses; the camera is at the origin";
    let notices: Vec<_> =
        without.iter().map(|record| Notice::about(NoticeCode::AssumedConvention, record.name.clone(), text)).collect();
    if notices.is_empty() {
        one_rig(&mut calibration.records, "rig");
    }
    calibration.notices.extend(notices);
    Ok(true)
}

/// True for a pose, or for a list or map with a pose at most `depth` levels below it.
fn contains_poses(at: &Cursor<'_>, depth: usize) -> bool {
    if keys::is_keyed(at) && (pose::has_r_t(at) || pose_map::is_pose_map(at))
        || matches!(at.numbers().map(|numbers| numbers.len()), Ok(12 | 16))
    {
        return true;
    }
    let below = |at: &Cursor<'_>| depth > 0 && contains_poses(at, depth - 1);
    let listed = at.list().unwrap_or_default();
    at.entries().unwrap_or_default().iter().map(|(_, at)| at).chain(&listed).any(below)
}
