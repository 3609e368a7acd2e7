//! Checks of K and lens against the size of the pictures: the commonest mistakes are errors or notices.

use std::path::Path;

use glam::DVec2;
use raycam_scene::{Lens, Notice, NoticeCode};

use crate::CameraRecord;
use raycam_formats::{FormatError, Result};

/// Ratios of principal points and middles of pictures that are equal, in x and in y, within this.
const SAME_RATIO: f64 = 0.04;
/// The least ratio that is that of another resolution, and no principal point off the middle.
const OTHER_RESOLUTION: f64 = 1.25;
/// Columns and rows of the grid of pixels whose rays are looked for.
const GRID: u32 = 12;

/// The notices of cameras that can be, and are likely to be mistaken; one for each kind of mistake.
///
/// # Errors
/// [`FormatError::Syntax`] for K in units of the picture's size.
pub(crate) fn check_cameras(records: &[CameraRecord], path: &Path) -> Result<Vec<Notice>> {
    let (mut outside, mut resolution, mut blind, mut turned) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut before: Option<(&CameraRecord, Option<f64>)> = None;
    for record in records {
        let (Some(k), Some(size)) = (record.k, record.size) else { continue };
        let [width, height] = size.map(f64::from);
        let (cx, cy) = (k.z_axis.x, k.z_axis.y);
        let normalised = k.x_axis.x.abs() < 10.0 && k.y_axis.y.abs() < 10.0 && cx.abs() < 2.0 && cy.abs() < 2.0;
        if normalised && width.min(height) > 20.0 {
            return Err(FormatError::whole(
                path,
                format!(
                    "camera {:?}: fx {}, cx {cx} are in units of the picture's size: expected pixels; multiply the first \
                     row of K by the width and the second by the height",
                    record.name, k.x_axis.x
                ),
            ));
        }
        let panorama = matches!(record.lens, Lens::Equirectangular | Lens::Cylindrical);
        let (x, y) = (2.0 * cx / width, 2.0 * cy / height);
        let same = (x / y - 1.0).abs() < SAME_RATIO && x > 0.0;
        if same && !panorama && !(1.0 / OTHER_RESOLUTION..=OTHER_RESOLUTION).contains(&x) {
            resolution.push((record, x, size));
        } else if !(panorama || (-0.5..=width).contains(&cx) && (-0.5..=height).contains(&cy)) {
            outside.push((record, cx, cy));
        }
        // In the middle of the picture with columns and rows exchanged.
        let middle = |at: f64, side: f64| (2.0 * at / side - 1.0).abs() < SAME_RATIO;
        let is_turned = middle(cx, height) && middle(cy, width) && (width / height - 1.0).abs() > 4.0 * SAME_RATIO;
        turned.extend((is_turned && !panorama).then_some((record, size)));
        let alike =
            |other: &CameraRecord| other.k == record.k && other.lens == record.lens && other.size == record.size;
        let share = match before {
            Some((other, share)) if alike(other) => share,
            _ => share_without_rays(record),
        };
        before = Some((record, share));
        blind.extend(share.filter(|share| *share > 0.5).map(|share| (record, share)));
    }
    let mut notices = Vec::new();
    let mut note = |message: String| notices.push(Notice::new(NoticeCode::Implausible, message));
    if let Some((record, cx, cy)) = outside.first() {
        note(format!(
            "the principal point of {} cameras is outside of the picture: camera {:?} has cx {cx:.6}, cy {cy:.6} of {:?}",
            outside.len(),
            record.name,
            record.size.unwrap_or_default()
        ));
    }
    if let Some((record, ratio, [width, height])) = resolution.first() {
        note(format!(
            "K of {} cameras seems to be that of another resolution: camera {:?} has its principal point in the middle \
             of {:.0} x {:.0}, and the pictures are {width} x {height}; if so, give the size that K belongs to and \
             resize (resized())",
            resolution.len(),
            record.name,
            f64::from(*width) * ratio,
            f64::from(*height) * ratio
        ));
    }
    if let Some((record, [width, height])) = turned.first() {
        note(format!(
            "K of {} cameras seems to be that of the picture turned by a quarter: camera {:?} has its principal point in \
             the middle of {height} x {width}, and the pictures are {width} x {height}; if so, exchange the size, or fx and \
             fy, cx and cy",
            turned.len(),
            record.name
        ));
    }
    if let Some((record, share)) = blind.first() {
        note(format!(
            "most pixels of {} cameras have no ray: {:.0} % of camera {:?}; the lens does not fit K and the size",
            blind.len(),
            100.0 * share,
            record.name
        ));
    }
    Ok(notices)
}

/// The share of pixels that no direction is seen in; None for a camera that is none.
fn share_without_rays(record: &CameraRecord) -> Option<f64> {
    if matches!(record.lens, Lens::Pinhole | Lens::Equirectangular | Lens::Cylindrical) {
        return Some(0.0);
    }
    let mut record = record.clone();
    record.pose = None;
    let camera = record.camera().ok()?;
    let [width, height] = camera.size().map(f64::from);
    let at = |i: u32, side: f64| (f64::from(i) + 0.5) / f64::from(GRID) * side;
    let pixels = (0..GRID).flat_map(|i| (0..GRID).map(move |j| DVec2::new(at(i, width), at(j, height))));
    let blind = pixels.filter(|pixel| !camera.ray(*pixel).1.is_finite()).count();
    Some(blind as f64 / f64::from(GRID * GRID))
}
