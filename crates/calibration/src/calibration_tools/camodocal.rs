//! camodocal's `camera_models`, by `model_type`: VINS-Mono, VINS-Fusion, KITTI-360. Sources: camodocal, CataCamera.cc,
//! EquidistantCamera.cc, PinholeCamera.cc; VINS-Fusion, PinholeFullCamera.cc.

use std::fmt::Write as _;
use std::path::Path;

use raycam_scene::{ErrorCode, LensModel, Notice, NoticeCode, PixelCenter};

use crate::document::number_format::yaml_float;
use crate::document::{Cursor, yaml};
use crate::intrinsics::{lens_of, pinhole_matrix};
use crate::{Calibration, CameraRecord, OutputFiles, ReadHints};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// Keys of a camera's parameter groups.
pub(crate) const KEYS: [&str; 10] = [
    "model_type",
    "camera_name",
    "image_width",
    "image_height",
    "distortion_parameters",
    "projection_parameters",
    "mirror_parameters",
    "poly_parameters",
    "inv_poly_parameters",
    "affine_parameters",
];

/// Key of VINS that masks the corners of images, in spite of its name. It does not specify the lens model, as `model_type`
/// does.
pub(crate) const MASK_FLAG: &str = "fisheye";

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    // `model_type` alone may also name the lens model in another format.
    let starts = |word: &str| text.lines().any(|line| line.starts_with(word));
    starts("model_type") && KEYS.iter().any(|&key| key.ends_with("_parameters") && starts(key))
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut notices = root.unread_keys(|key| KEYS.contains(&key) || key == MASK_FLAG)?;
    if let Some(at) = root.get(MASK_FLAG) {
        let subject = format!("{MASK_FLAG} (line {})", at.node.line);
        notices.push(Notice::about(
            NoticeCode::IgnoredKey,
            subject,
            "ignored: in VINS, it masks the corners of images; model_type specifies the lens model",
        ));
    }
    let record = camera(&root, source.stem().unwrap_or_else(|| "camera".into()))?;
    Ok(Calibration { records: vec![record], notices, ..Calibration::default() })
}

/// Reads the parameters with these names from a group; any other parameter that is not 0 is an error.
fn group<const N: usize>(root: &Cursor<'_>, name: &str, keys: [&str; N]) -> Result<[f64; N]> {
    let at = root.require(name)?;
    for (key, inner) in at.entries()?.into_iter().filter(|(key, _)| !keys.contains(key)) {
        if inner.number()? != 0.0 {
            return Err(inner.fail(format_args!(
                "parameter {key} is not supported for this model_type; expected {}",
                keys.join(", ")
            )));
        }
    }
    let mut values = [0.0; N];
    for (value, key) in values.iter_mut().zip(keys) {
        *value = at.require(key)?.number()?;
    }
    Ok(values)
}

/// Reads the camera that a file's keys describe.
pub(crate) fn camera(root: &Cursor<'_>, stem: String) -> Result<CameraRecord> {
    let kind = root.require("model_type")?;
    let name = root.get("camera_name").map_or(Ok(stem), |at| at.word().map(str::to_owned))?;
    let mut record = CameraRecord::new(name, PixelCenter::Integer);
    record.size = Some([root.require("image_width")?.count()?, root.require("image_height")?.count()?]);
    let brown = ["k1", "k2", "p1", "p2"];
    let pinhole = ["fx", "fy", "cx", "cy"];
    let (focals, model, coefficients) = match kind.word()? {
        "PINHOLE" => {
            let lens = group(root, "distortion_parameters", brown)?;
            (group(root, "projection_parameters", pinhole)?, LensModel::OpenCv, lens.to_vec())
        }
        "PINHOLE_FULL" => {
            let keys = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"];
            let lens = group(root, "distortion_parameters", keys)?;
            (group(root, "projection_parameters", pinhole)?, LensModel::OpenCv, lens.to_vec())
        }
        "MEI" => {
            let [xi] = group(root, "mirror_parameters", ["xi"])?;
            let lens = group(root, "distortion_parameters", brown)?;
            let focals = group(root, "projection_parameters", ["gamma1", "gamma2", "u0", "v0"])?;
            (focals, LensModel::Omni, [&[xi][..], &lens].concat())
        }
        "KANNALA_BRANDT" => {
            let all = group(root, "projection_parameters", ["k2", "k3", "k4", "k5", "mu", "mv", "u0", "v0"])?;
            ([all[4], all[5], all[6], all[7]], LensModel::Fisheye, all[..4].to_vec())
        }
        "SCARAMUZZA" => {
            return Err(kind.fail_as(
                ErrorCode::UnsupportedFeature,
                "raycam does not support SCARAMUZZA, the polynomial of OCamCalib; calibrate as MEI or KANNALA_BRANDT \
                 (camodocal supports both)",
            ));
        }
        other => {
            return Err(kind.fail_as(
                ErrorCode::UnsupportedFeature,
                format_args!(
                    "unsupported model_type {other:?}; expected PINHOLE, PINHOLE_FULL, MEI \
                or KANNALA_BRANDT"
                ),
            ));
        }
    };
    record.k = Some(pinhole_matrix(focals));
    record.lens = lens_of(model, &coefficients).map_err(|message| kind.fail_as(ErrorCode::InvalidLens, message))?;
    Ok(record)
}

/// Parameter group: its name (empty if the previous group continues), keys and values.
type Parameters<'a> = (&'a str, &'a [&'a str], &'a [f64]);

pub(crate) fn write(records: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    let format = "camodocal's YAML";
    let [record] = records else {
        return Err(FormatError::encode(format!(
            "{format} stores one camera, got {}; write each camera to a separate file",
            records.len()
        )));
    };
    let [width, height] = record.require_size(format)?;
    let focals = record.focals_with(PixelCenter::Integer, format)?;
    let pinhole = ["fx", "fy", "cx", "cy"];
    let brown: &[&str] = &["k1", "k2", "p1", "p2"];
    let zero = [0.0; 4];
    let lens: (&str, Vec<Parameters<'_>>) = match record.lens.coefficients() {
        None => ("PINHOLE", vec![("distortion", brown, &zero), ("projection", &pinhole, &focals)]),
        Some((LensModel::OpenCv, d)) if d[4..].iter().all(|v| *v == 0.0) => {
            ("PINHOLE", vec![("distortion", brown, &d[..4]), ("projection", &pinhole, &focals)])
        }
        Some((LensModel::Omni, d)) => (
            "MEI",
            vec![
                ("mirror", &["xi"], &d[..1]),
                ("distortion", brown, if d.len() > 1 { &d[1..] } else { &zero }),
                ("projection", &["gamma1", "gamma2", "u0", "v0"], &focals),
            ],
        ),
        Some((LensModel::Fisheye, d)) => (
            "KANNALA_BRANDT",
            vec![("projection", &["k2", "k3", "k4", "k5"], d), ("", &["mu", "mv", "u0", "v0"], &focals)],
        ),
        Some((LensModel::OpenCv, d)) if d.len() == 5 || d.len() == 8 => (
            "PINHOLE_FULL",
            vec![
                ("distortion", &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"], d),
                ("projection", &pinhole, &focals),
            ],
        ),
        Some((model, d)) => {
            return Err(record.unsupported_error(format, &format!("lens model {} with distortion {d:?}", model.name())));
        }
    };
    let mut text = format!(
        "%YAML:1.0\n---\nmodel_type: {}\ncamera_name: {}\nimage_width: {width}\nimage_height: {height}\n",
        lens.0,
        record.name.replace(|c: char| !c.is_ascii_alphanumeric(), "_")
    );
    for (name, keys, values) in lens.1 {
        if !name.is_empty() {
            let _ = writeln!(text, "{name}_parameters:");
        }
        for (i, key) in keys.iter().enumerate() {
            let _ = writeln!(text, "   {key}: {}", yaml_float(values.get(i).copied().unwrap_or(0.0)));
        }
    }
    let notices = vec![Notice::new(NoticeCode::NotWritten, format!("{format} cannot store a pose; it is not written"))];
    Ok(OutputFiles { notices, ..OutputFiles::one(text) })
}
