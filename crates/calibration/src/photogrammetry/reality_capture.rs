//! RealityCapture's and RealityScan's CSV of internal and external camera parameters. Source: nerfstudio's
//! realitycapture_utils.py, as corrected by its pull request 3131. Lengths are in units of the longer side.

use glam::{DMat3, DVec3};
use raycam_scene::{Lens, LensModel, NoticeCode, PixelCenter, counted};

use crate::intrinsics::{brown_lens, pinhole_matrix, refuse_terms, require_known_size};
use crate::picture_size::PictureSizes;
use crate::trajectory::convention::flip_columns;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// Film width in millimetres to which focal lengths refer.
pub(crate) const FILM: f64 = 36.0;
/// Text of the notice about t1 and t2.
pub(crate) const TANGENTIAL: &str = "programs disagree whether t1 and t2 are OpenCV's p1 and p2; they are interpreted \
    as p2 and p1, as in Epic's exporter and AliceVision";

/// Finds the column header; returns its line's index and its words in lower case.
fn header(text: &str) -> Option<(usize, Vec<String>)> {
    text.lines().enumerate().take(5).find_map(|(i, line)| {
        let words: Vec<String> =
            line.trim_start_matches('#').split(',').map(|word| word.trim().to_lowercase()).collect();
        let has = |name: &str| words.iter().any(|word| word == name);
        (has("heading") && has("alt") && has("f") && has("name")).then_some((i, words))
    })
}

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    header(text).is_some()
}

/// Returns the lens for RealityCapture's terms, in the order k1 k2 k3 k4 t1 t2; and true if t1 or t2 is not 0.
pub(crate) fn lens([k1, k2, k3, k4, t1, t2]: [f64; 6]) -> Result<(Lens, bool), String> {
    refuse_terms([("k4", k4)])?;
    Ok((brown_lens(k1, k2, t2, t1, k3)?, t1 != 0.0 || t2 != 0.0))
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let (path, text) = (&source.path, source.text()?);
    let (at, words) = header(text).ok_or_else(|| FormatError::whole(path, "expected #name,x,y,alt,heading,..."))?;
    let mut calibration = Calibration::default();
    let mut tangential = false;
    let column = words.iter().position(|word| word == "name").unwrap_or_default();
    let named = |line: &&str| !(line.trim().is_empty() || line.starts_with('#'));
    let names = text.lines().skip(at + 1).filter(named).filter_map(|line| line.split(',').nth(column)).map(str::trim);
    let places = |name: &str| [name.to_owned(), format!("images/{name}")];
    let mut sizes = PictureSizes::new(assets, path, names.flat_map(places), hints.size);
    for (i, line) in text.lines().enumerate().skip(at + 1) {
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        let fail = |message: String| FormatError::line(path, i + 1, message);
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        if cells.len() != words.len() {
            return Err(fail(format!(
                "the row has {}; the header has {}",
                counted(cells.len(), "column"),
                words.len()
            )));
        }
        let find = |name: &str| words.iter().position(|word| word == name).map(|column| cells[column]);
        let term = |name: &str| match find(name) {
            None => Ok(0.0),
            Some(word) => match word.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => Err(fail(format!("{name} is {word:?}; expected a finite number"))),
            },
        };
        for (word, cell) in words.iter().zip(&cells) {
            let digits = word.strip_prefix(['k', 't', 'p']).is_some_and(|rest| rest.parse::<u32>().is_ok());
            let known = ["k1", "k2", "k3", "k4", "t1", "t2"].contains(&word.as_str());
            if digits && !known && cell.parse::<f64>().is_ok_and(|value| value != 0.0) {
                return Err(fail(format!("{word} is {cell}; supported lens terms: k1 to k4, t1 and t2")));
            }
        }
        let name = find("name").unwrap_or_default();
        let mut record = CameraRecord::new(name, PixelCenter::Half);
        record.image = Some(name.to_owned());
        let size = require_known_size(sizes.size(assets, path, places(name)), path, "RealityCapture's CSV")?;
        record.size = Some(size);
        let [w, h] = size.map(f64::from);
        let longer = w.max(h);
        let f = term("f")?;
        let focal = f * longer / FILM;
        if focal <= 0.0 {
            return Err(fail(format!(
                "f is {f}; expected a focal length greater than 0, in millimetres for a 36 mm wide film"
            )));
        }
        record.k = Some(pinhole_matrix([focal, focal, 0.5 * w + term("px")? * longer, 0.5 * h + term("py")? * longer]));
        let terms = [term("k1")?, term("k2")?, term("k3")?, term("k4")?, term("t1")?, term("t2")?];
        let (lens, matters) = lens(terms).map_err(fail)?;
        record.lens = lens;
        tangential |= matters;
        let [heading, pitch, roll] = [term("heading")?, term("pitch")?, term("roll")?].map(f64::to_radians);
        let gl = DMat3::from_rotation_z(-heading) * DMat3::from_rotation_x(pitch) * DMat3::from_rotation_y(roll);
        let c = DVec3::new(term("x")?, term("y")?, term("alt")?);
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(flip_columns(gl)), c));
        calibration.records.push(record);
    }
    debug_assert!(LensModel::OpenCv.name() == "opencv");
    if tangential {
        calibration.note(NoticeCode::IgnoredFeature, TANGENTIAL);
    }
    calibration.notices.extend(sizes.notices());
    if calibration.records.iter().any(|record| record.r_c().1.truncate().length() > 1e5) {
        calibration.note(
            NoticeCode::PlacedCameras,
            "x and y have the magnitude of projected map coordinates; the cameras keep these coordinates, and meshes \
             must use the same coordinates",
        );
    }
    Ok(calibration)
}
