//! Intrinsics of RealSense cameras as commonly exported: `ppx`, `ppy`, `fx`, `fy`, `model`, `coeffs` (k1 k2 p1 p2 k3).
//! Source: librealsense, rs_types.h. The meaning of "Inverse Brown Conrady" differs between versions, so the reader
//! does not guess it.

use raycam_scene::{ErrorCode, LensModel, NoticeCode, PixelCenter};

use crate::document::lens_keys::plain;
use crate::document::{Cursor, yaml};
use crate::intrinsics::{lens_of, pinhole_matrix};
use crate::{Calibration, CameraRecord, ReadHints};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("ppx") && text.contains("ppy") && text.contains("coeffs")
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    if root.get("ppx").is_some() {
        calibration.records.push(camera(&root, source.stem().unwrap_or_else(|| "camera".into()))?);
        return Ok(calibration);
    }
    for (name, at) in root.entries()? {
        if at.get("ppx").is_some() {
            calibration.records.push(camera(&at, name.into())?);
        } else {
            at.refuse_lens(name)?;
            calibration.note_about(NoticeCode::IgnoredKey, format!("{name} (line {})", at.node.line), "ignored");
        }
    }
    Ok(calibration)
}

fn camera(at: &Cursor<'_>, name: String) -> Result<CameraRecord> {
    let mut record = CameraRecord::new(name, PixelCenter::Integer);
    let get = |key: &str| at.require(key)?.number();
    record.k = Some(pinhole_matrix([get("fx")?, get("fy")?, get("ppx")?, get("ppy")?]));
    record.size = match (at.get("width"), at.get("height")) {
        (Some(width), Some(height)) => Some([width.count()?, height.count()?]),
        _ => None,
    };
    let coefficients = at.require("coeffs")?;
    let values = coefficients.numbers()?;
    if values.iter().all(|value| *value == 0.0) {
        return Ok(record);
    }
    let model = at.require("model")?;
    let word = plain(model.word()?.rsplit('.').next().unwrap_or_default()).replace("rs2distortion", "");
    record.lens = match &word[..] {
        "brownconrady" | "4" => lens_of(LensModel::OpenCv, &values),
        "kannalabrandt4" | "5" => lens_of(LensModel::Fisheye, &values[..values.len().min(4)]),
        "inversebrownconrady" | "2" => {
            return Err(coefficients.fail(
                "Inverse Brown Conrady with coefficients is ambiguous: versions of librealsense disagree whether the \
                 coefficients map from the distorted image or to it. If they map to the distorted image, pass K and \
                 the coefficients to Camera(model=\"opencv\")",
            ));
        }
        _ => {
            return Err(model.fail_as(
                ErrorCode::UnsupportedFeature,
                format_args!(
                    "{:?} with coefficients is not supported; expected Brown Conrady or Kannala Brandt4",
                    model.word()?
                ),
            ));
        }
    }
    .map_err(|message| coefficients.fail(message))?;
    Ok(record)
}
