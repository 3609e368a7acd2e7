//! Camera matrices P [3, 4] in pixels, in files without K: keys such as `P: [[...], [...], [...]]`,
//! `projection_matrix`, `P1` and `P2`, at the top of the file or in the map of each camera.

use raycam_scene::PixelCenter;

use crate::document::{Cursor, lens_keys::plain, rigid, rotation_of_any_scale};
use crate::opencv::key_view::KeyView;
use crate::opencv::keys;
use crate::opencv::{camera, pose};
use crate::{Calibration, CameraRecord};
use raycam_formats::Result;

/// Keys of a camera matrix, without the number or the side of its camera.
const P: [&str; 9] = [
    "p",
    "pmatrix",
    "pmat",
    "projection",
    "projectionmatrix",
    "projectionmat",
    "projmatrix",
    "projmat",
    "cameraprojectionmatrix",
];

/// True for the key of a camera matrix, possibly with the number or the side of its camera.
pub(crate) fn is_key(key: &str) -> bool {
    let key = plain(key);
    let base = key.trim_end_matches(|c: char| c.is_ascii_digit());
    let sides = ["", "left", "right", "l", "r", "cam"].map(|side| base.strip_suffix(side));
    sides.into_iter().flatten().any(|base| P.contains(&base))
}

/// True if a map, or one of the maps in it, contains a camera matrix.
pub(super) fn is_in(root: &Cursor<'_>) -> bool {
    !matrices(root).is_empty() || cameras(root).iter().any(|(_, at)| !matrices(at).is_empty())
}

pub(super) fn read(root: &Cursor<'_>, stem: Option<String>) -> Result<Calibration> {
    let mut calibration = Calibration::default();
    let stem = stem.unwrap_or_else(|| "camera".into());
    read_map(root, &stem, None, &mut calibration)?;
    let size = camera::size(&KeyView::new(root.clone()))?;
    for (name, at) in cameras(root) {
        read_map(&at, &name, size, &mut calibration)?;
    }
    Ok(calibration)
}

/// Appends the cameras of one map.
fn read_map(at: &Cursor<'_>, name: &str, around: Option<[u32; 2]>, calibration: &mut Calibration) -> Result<()> {
    let found = matrices(at);
    if found.is_empty() {
        return Ok(());
    }
    let view = KeyView::new(at.clone());
    let below: Vec<String> = cameras(at).into_iter().map(|(name, _)| name).collect();
    let pose =
        at.entries()?.into_iter().find(|(key, at)| pose::is_part(&view, key) || pose::is_pose_key(&view, key, at));
    if let Some((_, pose)) = pose.filter(|(key, _)| !is_key(key)) {
        return Err(pose.fail(
            "the camera matrix P = K [R | t] already contains a pose; remove this pose, or write K instead of P",
        ));
    }
    let others = at.unread_keys(|key| {
        is_key(key)
            || below.iter().any(|name| name == key)
            || [&keys::SIZE[..], &keys::WIDTH, &keys::HEIGHT, &["name"]]
                .iter()
                .any(|known| known.contains(&&plain(key)[..]))
    })?;
    calibration.notices.extend(others);
    let size = camera::size(&view)?.or(around);
    let is_single = found.len() == 1;
    for (key, matrix) in found {
        let mut record = CameraRecord::new(if is_single { name } else { key }, PixelCenter::Integer);
        record.matrix = Some(matrix);
        record.size = size;
        calibration.records.push(record);
    }
    Ok(())
}

/// The maps in a map or a list, by key or index.
fn cameras<'a>(root: &Cursor<'a>) -> Vec<(String, Cursor<'a>)> {
    let listed = root.list().unwrap_or_default().into_iter().enumerate().map(|(i, at)| (format!("camera{i}"), at));
    let keyed = root.entries().unwrap_or_default().into_iter().map(|(key, at)| (key.to_owned(), at));
    listed.chain(keyed).filter(|(key, at)| at.is_map() && !is_key(key)).collect()
}

/// The camera matrices of a map, by key.
fn matrices<'a>(at: &Cursor<'a>) -> Vec<(&'a str, [[f64; 4]; 3])> {
    let entries = at.entries().unwrap_or_default();
    entries.into_iter().filter_map(|(key, at)| Some((key, matrix(&at).filter(|_| is_key(key))?))).collect()
}

/// A matrix of three rows and four columns that is not the matrix of a pose.
fn matrix(at: &Cursor<'_>) -> Option<[[f64; 4]; 3]> {
    let numbers: [f64; 12] = at.array().ok()?;
    let nested = at.list().ok().filter(|rows| rows.len() != 12);
    let rows = at.get("rows").and_then(|rows| rows.count().ok()).or(nested.map(|rows| rows.len() as u32));
    let k_r = rigid(&numbers).0;
    let is_camera_matrix = k_r.determinant() != 0.0 && rotation_of_any_scale(k_r).is_none();
    (rows.is_none_or(|rows| rows == 3) && is_camera_matrix)
        .then(|| [0, 1, 2].map(|i| [0, 1, 2, 3].map(|j| numbers[4 * i + j])))
}
