//! Checks of K and lens against the image size: the most common mistakes are errors or notices.

use std::path::Path;

use glam::{DMat3, DVec2};
use raycam_scene::{Lens, Notice, NoticeCode};

use crate::CameraRecord;
use crate::files::about_cameras;
use raycam_formats::{FormatError, Result};

/// Maximum relative difference at which two ratios count as equal: the ratios of the principal point to the image
/// centre in x and in y, or such a ratio and 1.
const SAME_RATIO: f64 = 0.04;
/// Maximum ratio of the principal point to the image centre, or the reverse. If the ratio is larger, and the same in x
/// and y, K probably belongs to another resolution.
const OTHER_RESOLUTION: f64 = 1.25;
/// Number of columns and of rows of the pixel grid on which undistortion is tested.
const GRID: u32 = 12;

/// Notices about cameras that are valid but probably mistaken; one for each kind of mistake.
///
/// # Errors
/// [`FormatError::Syntax`] for K in units of the image size.
pub(crate) fn check_cameras(records: &[CameraRecord], path: &Path) -> Result<Vec<Notice>> {
    let (mut outside, mut resolution, mut blind, mut turned) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut short = Vec::new();
    let mut before: Option<(&CameraRecord, Option<f64>)> = None;
    for record in records {
        // If the record contains a camera matrix P, K comes from its decomposition.
        let Ok(k) = record.require_k("") else { continue };
        if focal_length_of_few_pixels(record, k) {
            short.push((record.name.as_str(), k.x_axis.x));
        }
        let Some(size) = record.size else { continue };
        let [width, height] = size.map(f64::from);
        let (cx, cy) = (k.z_axis.x, k.z_axis.y);
        let normalised = k.x_axis.x.abs() < 10.0 && k.y_axis.y.abs() < 10.0 && cx.abs() < 2.0 && cy.abs() < 2.0;
        if normalised && width.min(height) > 20.0 {
            return Err(FormatError::whole(
                path,
                format!(
                    "camera {:?}: fx {}, cx {cx} are in units of the image size; expected pixels; {}",
                    record.name,
                    k.x_axis.x,
                    conversion_to_pixels(cx, cy, height / width)
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
        // True if the principal point would be at the image centre if width and height were exchanged.
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
    let notices = [
        notice_of_short(&short),
        notice_of_outside(&outside),
        notice_of_resolution(&resolution),
        notice_of_turned(&turned),
        notice_of_blind(&blind),
    ];
    Ok(notices.into_iter().flatten().collect())
}

fn notice_of_short(found: &[(&str, f64)]) -> Option<Notice> {
    let (_, focal) = found.first()?;
    let message = format!(
        "the focal length is only {focal:.6} pixels; expected about the size of the image (K may be missing or in \
         other units)"
    );
    Some(about_cameras(NoticeCode::Implausible, found.iter().map(|(name, _)| *name), message))
}

fn notice_of_outside(found: &[(&CameraRecord, f64, f64)]) -> Option<Notice> {
    let (record, cx, cy) = found.first()?;
    let [width, height] = record.size.unwrap_or_default();
    let message = format!("the principal point is outside the image: cx {cx:.6}, cy {cy:.6} in {width} x {height}");
    Some(about_cameras(NoticeCode::Implausible, found.iter().map(|(record, ..)| record.name.as_str()), message))
}

fn notice_of_resolution(found: &[(&CameraRecord, f64, [u32; 2])]) -> Option<Notice> {
    let (_, ratio, [width, height]) = found.first()?;
    let message = format!(
        "K seems to belong to another resolution: the principal point is at the centre of {:.0} x {:.0}, but the \
         image has {width} x {height}; if so, use the size that K belongs to, and resize the camera (resized())",
        f64::from(*width) * ratio,
        f64::from(*height) * ratio
    );
    Some(about_cameras(NoticeCode::Implausible, found.iter().map(|(record, ..)| record.name.as_str()), message))
}

fn notice_of_turned(found: &[(&CameraRecord, [u32; 2])]) -> Option<Notice> {
    let (_, [width, height]) = found.first()?;
    let message = format!(
        "K seems to belong to the image rotated by 90 degrees: the principal point is at the centre of {height} x \
         {width}, but the image has {width} x {height}; if so, exchange width and height, or fx and fy, cx and cy"
    );
    Some(about_cameras(NoticeCode::Implausible, found.iter().map(|(record, _)| record.name.as_str()), message))
}

fn notice_of_blind(found: &[(&CameraRecord, f64)]) -> Option<Notice> {
    let (_, share) = found.first()?;
    let message =
        format!("most pixels ({:.0} %) have no ray, so the lens probably does not match K and the size", 100.0 * share);
    Some(about_cameras(NoticeCode::Implausible, found.iter().map(|(record, _)| record.name.as_str()), message))
}

/// Returns the remedy for a matrix K or P in units of the image size. (`cx`, `cy`) is its principal point; `aspect` is
/// height / width.
fn conversion_to_pixels(cx: f64, cy: f64, aspect: f64) -> &'static str {
    let is_near = |value: f64, expected: f64| (value - expected).abs() < 0.1;
    if is_near(cx, 0.0) && is_near(cy, 0.0) {
        "K is probably in image coordinates from -1 to 1, so in K (or P) replace row 1 by (row 1 + row 3) * width / 2, \
         and row 2 by (row 2 + row 3) * height / 2"
    } else if is_near(cx, 0.5) && is_near(cy, 0.5 * aspect) && !is_near(cy, 0.5) {
        "multiply the first and the second row of K (or P) by the width"
    } else {
        "multiply the first row of K (or P) by the width and the second by the height"
    }
}

/// True if the focal length in pixels is implausibly short: fewer than 8 pixels (unless the image is equally small) or,
/// for a pinhole, an angle of view of more than 168 degrees.
fn focal_length_of_few_pixels(record: &CameraRecord, k: DMat3) -> bool {
    if matches!(record.lens, Lens::Equirectangular | Lens::Cylindrical) {
        return false;
    }
    let focal = k.x_axis.x.abs().max(k.y_axis.y.abs());
    let side = record.size.map(|[width, height]| f64::from(width.max(height)));
    let pinhole = matches!(record.lens, Lens::Pinhole);
    focal < 8.0 && side.is_none_or(|side| side > 8.0 * focal) || pinhole && side.is_some_and(|side| focal < 0.05 * side)
}

/// Fraction of the pixels that have no ray; `None` for an invalid camera.
fn share_without_rays(record: &CameraRecord) -> Option<f64> {
    if matches!(record.lens, Lens::Pinhole | Lens::Equirectangular | Lens::Cylindrical) {
        return Some(0.0);
    }
    let mut record = record.clone();
    record.pose = None;
    if record.k.is_none() {
        return Some(0.0);
    }
    let camera = record.camera().ok()?;
    let [width, height] = camera.size().map(f64::from);
    let at = |i: u32, side: f64| (f64::from(i) + 0.5) / f64::from(GRID) * side;
    let pixels = (0..GRID).flat_map(|i| (0..GRID).map(move |j| DVec2::new(at(i, width), at(j, height))));
    let blind = pixels.filter(|pixel| !camera.ray(*pixel).1.is_finite()).count();
    Some(blind as f64 / f64::from(GRID * GRID))
}
