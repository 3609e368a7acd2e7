//! OpenSfM's `reconstruction.json` and `camera_models.json`, OpenDroneMap's `cameras.json`. Sources: OpenSfM,
//! doc/source/geometry.rst, io.py. Focal length and principal point are in units of the longer side, relative to the
//! centre.

use std::collections::HashMap;

use glam::DVec3;
use raycam_scene::{ErrorCode, Lens, LensModel, Notice, NoticeCode, PixelCenter, counted};

use crate::document::{Cursor, yaml};
use crate::intrinsics::{brown_lens, lens_of, pinhole_matrix, refuse_terms, set_panorama};
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("\"projection_type\"") || text.contains("\"shots\"") && text.contains("\"cameras\"")
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    if root.is_map() && root.get("shots").is_none() {
        for (name, at) in root.entries()? {
            calibration.records.push(camera(&at, name, &mut calibration.notices)?);
        }
        return Ok(calibration);
    }
    let all = if root.is_map() { vec![root.clone()] } else { root.list()? };
    let first = all.first().ok_or_else(|| root.fail("the file contains no reconstruction"))?;
    if all.len() > 1 {
        calibration.note(
            NoticeCode::FirstOnly,
            format!(
                "the file contains {} reconstructions, each of them a separate world; the cameras of the first one are used",
                all.len()
            ),
        );
    }
    let mut cameras = HashMap::new();
    for (name, at) in first.require("cameras")?.entries()? {
        cameras.insert(name, camera(&at, name, &mut calibration.notices)?);
    }
    let mut turned = 0;
    for (name, shot) in first.require("shots")?.entries()? {
        let id = shot.require("camera")?;
        let model = cameras.get(id.word()?).ok_or_else(|| {
            id.fail(format_args!("{:?} is not one of the file's cameras", id.word().unwrap_or_default()))
        })?;
        let mut record = model.clone();
        (record.name, record.image) = (name.to_owned(), Some(name.to_owned()));
        let at = shot.require("rotation")?;
        let rotation = Rotation::from_vector(at.array()?).map_err(|message| at.fail(message))?;
        let t = DVec3::from_array(shot.require("translation")?.array()?);
        record.pose = Some(Pose::camera_from_world(rotation, t));
        turned += usize::from(shot.number_or("orientation", 1.0)? > 1.0);
        calibration.records.push(record);
    }
    if turned > 0 {
        calibration.note(
            NoticeCode::IgnoredOrientation,
            format!(
                "the EXIF orientation of {} is ignored; intrinsics apply to images as stored",
                counted(turned, "image")
            ),
        );
    }
    if let Some(at) = first.get("reference_lla") {
        let get = |key: &str| at.number_or(key, 0.0);
        calibration.note(
            NoticeCode::PlacedCameras,
            format!(
                "the world's axes are east, north, up in metres about latitude {}, longitude {}, altitude {}",
                get("latitude")?,
                get("longitude")?,
                get("altitude")?
            ),
        );
    }
    Ok(calibration)
}

/// Keys that every camera has, and keys that only some cameras have.
const KEYS: [&str; 23] = [
    "projection_type",
    "width",
    "height",
    "focal",
    "focal_x",
    "focal_y",
    "c_x",
    "c_y",
    "k1",
    "k2",
    "k3",
    "k4",
    "k5",
    "k6",
    "p1",
    "p2",
    "s0",
    "s1",
    "s2",
    "s3",
    "transition",
    "aspect_ratio",
    "gps",
];

fn camera(at: &Cursor<'_>, name: &str, notices: &mut Vec<Notice>) -> Result<CameraRecord> {
    let mut record = CameraRecord::new(name, PixelCenter::Integer);
    notices.extend(at.unread_keys(|key| KEYS.contains(&key) || key.contains("prior"))?);
    let word = at.get("projection_type").as_ref().map_or(Ok("perspective"), Cursor::word)?;
    let size = [at.require("width")?.count()?, at.require("height")?.count()?];
    record.size = Some(size);
    let fail = |message: String| at.fail(message);
    if ["spherical", "equirectangular"].contains(&word) {
        set_panorama(&mut record).map_err(fail)?;
        return Ok(record);
    }
    let longer = f64::from(size[0].max(size[1]));
    let term = |key: &str| at.number_or(key, 0.0);
    let focals = match at.get("focal_x") {
        Some(fx) => [fx.number()?, at.require("focal_y")?.number()?],
        None => {
            let focal = at.require("focal")?.number()?;
            [focal, focal * at.number_or("aspect_ratio", 1.0)?]
        }
    };
    let middle = size.map(|side| 0.5 * (f64::from(side) - 1.0));
    let [cx, cy] = [term("c_x")? * longer + middle[0], term("c_y")? * longer + middle[1]];
    record.k = Some(pinhole_matrix([focals[0] * longer, focals[1] * longer, cx, cy]));
    record.lens = lens(at, word)?;
    Ok(record)
}

/// Returns the lens of a projection type; terms that this type does not have must be 0.
fn lens(at: &Cursor<'_>, word: &str) -> Result<Lens> {
    let fail = |message: String| at.fail(message);
    let names = ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2", "s0", "s1", "s2", "s3"];
    let mut terms = [0.0; 12];
    for (value, name) in terms.iter_mut().zip(names) {
        *value = at.number_or(name, 0.0)?;
    }
    let [k1, k2, k3, k4, k5, k6, p1, p2, s0, s1, s2, s3] = terms;
    let used: &[&str] = match word {
        "perspective" | "radial" | "fisheye" => &["k1", "k2"],
        "simple_radial" => &["k1"],
        "brown" => &["k1", "k2", "k3", "p1", "p2"],
        "fisheye_opencv" => &["k1", "k2", "k3", "k4"],
        "fisheye62" | "fisheye624" => &["k1", "k2", "k3", "k4", "p1", "p2", "s0", "s2"],
        _ => {
            return Err(at.fail_as(
                ErrorCode::UnsupportedFeature,
                format_args!(
                    "unsupported projection_type {word:?}; expected perspective, brown, \
                 radial, simple_radial, fisheye, fisheye_opencv, fisheye62, fisheye624 or spherical"
                ),
            ));
        }
    };
    let unused = names.into_iter().zip(terms).filter(|(name, _)| !used.contains(name));
    refuse_terms(unused).map_err(|message| fail(format!("{word}: {message}")))?;
    debug_assert!(word != "fisheye62" || [k5, k6, s1, s3] == [0.0; 4]);
    match word {
        "fisheye" => lens_of(LensModel::Fisheye, &[k1, k2, 0.0, 0.0]),
        "fisheye_opencv" => lens_of(LensModel::Fisheye, &[k1, k2, k3, k4]),
        // The tangential and prism terms apply to the equidistant point, before the radial polynomial.
        "fisheye62" | "fisheye624" => lens_of(LensModel::ThinPrismFisheye, &[k1, k2, p1, p2, k3, k4, s0, s2]),
        _ => brown_lens(k1, k2, p1, p2, k3),
    }
    .map_err(fail)
}
