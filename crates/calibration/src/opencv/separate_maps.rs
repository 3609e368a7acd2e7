//! Cameras in separate maps of an OpenCV file, and the poses next to these maps: R and T of a pair, or a map with a pose
//! for each camera (`extrinsics: {left: {R: ..., T: ...}, right: ...}`).

use std::path::Path;

use crate::document::Cursor;
use crate::document::lens_keys::plain;
use crate::opencv::camera_maps::{has_camera, list_of_cameras};
use crate::opencv::key_view::KeyView;
use crate::opencv::keys;
use crate::opencv::one_camera::{self, refuse_lens_without_k};
use crate::opencv::poses_by_name::{self, CameraNames, contains_poses};
use crate::opencv::{partner, pose, stereo};
use crate::{Calibration, Pose, ReadHints};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_scene::counted;

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
    let pair = pose::read_r_t(view)?.map(|pose| (String::new(), pose));
    let mut poses = PosesBesideCameras { view, hints, pair, names: CameraNames::of(&calibration.records) };
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
    partner::place_cameras(source, assets, hints, &mut calibration)?;
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
    names: CameraNames,
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
        let poses = poses_of_cameras(&inner.at, &self.names);
        if !poses.is_empty() {
            return poses_by_name::place(&poses, inner.at.name(), "the map of poses", self.hints, calibration);
        }
        let holds_poses = pose::is_pose_word(name) && contains_poses(&inner.at, MAX_POSE_DEPTH);
        let is_r_t = keys::is_keyed(&inner.at)
            && !(holds_poses && has_cameras && !pose::has_r_t(&inner.at))
            && !keys::is_other_sensor(name, &inner.at);
        // R and T of a body, such as `base` or `robot`, may be the pair's, unless other keys specify the cameras' poses.
        let may_be_of_pair = keys::is_body(name)
            && matches!(&calibration.records[..], [first, second] if first.pose.is_none() && second.pose.is_none())
            && self.pair.is_none()
            && keys::is_keyed(&inner.at)
            && pose::has_r_t(&inner.at);
        let mut is_used = false;
        if self.pair.is_none() && is_r_t {
            self.pair = pose::read_r_t(&KeyView::new(inner.at.clone()))?.map(|pose| (name.to_owned(), pose));
            is_used = self.pair.is_some();
        } else if let (None, true, Some(around)) = (&self.pair, pose::is_part(view, name), inner.above.first()) {
            // R and T are next to the cameras, in a map below the root.
            self.pair = pose::read_r_t(around)?.map(|pose| (String::new(), pose));
        } else if may_be_of_pair
            || has_cameras && (holds_poses && self.pair.is_none() || pose::is_pose_key(view, name, &inner.at))
        {
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

/// The poses in a map whose keys are the names of cameras, with the numbers of the cameras; empty for another map.
fn poses_of_cameras<'a>(at: &Cursor<'a>, names: &CameraNames) -> Vec<(usize, Cursor<'a>)> {
    let Ok(entries) = at.entries() else { return vec![] };
    let camera_of = |(key, at): (&str, Cursor<'a>)| Some((names.get(key)?, at)).filter(|(_, at)| contains_poses(at, 0));
    let poses: Option<Vec<_>> = entries.into_iter().map(camera_of).collect();
    poses.unwrap_or_default()
}
