//! mrcal's `.cameramodel`: a Python literal with `lensmodel`, `intrinsics`, `extrinsics` (a rotation vector and t,
//! camera_from_reference) and `imagersize`. Source: mrcal's documentation, "Camera model file formats".

use glam::DVec3;
use raycam_scene::{ErrorCode, Lens, LensModel, PixelCenter, counted};

use crate::document::{Cursor, yaml};
use crate::intrinsics::{lens_of, pinhole_matrix};
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("LENSMODEL_") && text.contains("lensmodel")
}

/// Prefix of the names of lens models.
const MODEL_PREFIX: &str = "LENSMODEL_";

/// Converts the literal to YAML: strings in double quotes, tuples as lists, without comments. Only one byte string
/// (`b'...'`) is kept: the lens model's name. The packed input of the optimization is removed.
fn yaml_of(literal: &str) -> String {
    let mut text = String::with_capacity(literal.len());
    let mut chars = literal.chars().peekable();
    let mut bytes = false;
    while let Some(c) = chars.next() {
        match c {
            'b' if matches!(chars.peek(), Some('\'' | '"')) => bytes = true,
            'u' if matches!(chars.peek(), Some('\'' | '"')) => {}
            '\'' | '"' => {
                bytes &= !chars.clone().take(MODEL_PREFIX.len()).eq(MODEL_PREFIX.chars());
                text.push('"');
                while let Some(inner) = chars.next() {
                    match inner {
                        '\\' => {
                            let escaped = chars.next().unwrap_or(' ');
                            match (bytes, escaped) {
                                (false, '"' | '\\') => text.extend(['\\', escaped]),
                                (false, _) => text.push(escaped),
                                (true, _) => {}
                            }
                        }
                        _ if inner == c => break,
                        '"' if !bytes => text.push_str("\\\""),
                        '\n' => text.push('\n'),
                        _ if !bytes => text.push(inner),
                        _ => {}
                    }
                }
                text.push('"');
                bytes = false;
            }
            '#' => while chars.next_if(|c| *c != '\n').is_some() {},
            '(' => text.push('['),
            ')' => text.push(']'),
            '\t' => text.push(' '),
            c => text.push(c),
        }
    }
    text
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(&yaml_of(source.text()?), &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut record = CameraRecord::new(source.stem().unwrap_or_else(|| "camera".into()), PixelCenter::Integer);
    let model = root.any(&["lensmodel", "lens_model", "distortion_model"]);
    let model = model.ok_or_else(|| root.fail("lensmodel is missing"))?;
    let word = model.word()?;
    let name = word.trim_start_matches(MODEL_PREFIX);
    let at = root.require("intrinsics")?;
    let values = at.numbers()?;
    let count = name.strip_prefix("OPENCV").and_then(|count| count.parse::<usize>().ok());
    let coefficients = match (name, count) {
        ("PINHOLE", _) => 0,
        (_, Some(count @ (4 | 5 | 8 | 12))) => count,
        _ => {
            return Err(model.fail_as(
                ErrorCode::UnsupportedFeature,
                format_args!(
                    "unsupported lens model {word}; expected LENSMODEL_PINHOLE or OPENCV4, 5, 8, 12 \
                 (mrcal-convert-lensmodel converts other models)"
                ),
            ));
        }
    };
    if values.len() != 4 + coefficients {
        return Err(at.fail(format_args!("{}; {word} requires {}", counted(values.len(), "number"), 4 + coefficients)));
    }
    record.k = Some(pinhole_matrix([values[0], values[1], values[2], values[3]]));
    record.lens = match coefficients {
        0 => Lens::Pinhole,
        _ => lens_of(LensModel::OpenCv, &values[4..]).map_err(|message| at.fail_as(ErrorCode::InvalidLens, message))?,
    };
    let size = root.any(&["imagersize", "imager_size"]).map(|at| at.list()).transpose()?;
    if let Some([width, height]) = size.as_deref() {
        record.size = Some([width.count()?, height.count()?]);
    }
    let pose_of = |at: Cursor<'_>| {
        let [rx, ry, rz, x, y, z] = at.array()?;
        let rotation = Rotation::from_vector([rx, ry, rz]).map_err(|message| at.fail(message))?;
        Ok::<_, FormatError>(Pose::camera_from_world(rotation, DVec3::new(x, y, z)))
    };
    let mut named = None;
    for key in ["rt_cam_ref", "rt_ref_cam", "extrinsics"] {
        let Some(at) = root.get(key) else { continue };
        let pose = pose_of(at.clone())?;
        let pose = if key == "rt_ref_cam" { pose.inverted() } else { pose };
        if let Some((other, before)) = &record.pose.as_ref().zip(named)
            && !other.is_near(&pose)
        {
            return Err(at.fail(format_args!("{before} contains a different pose; expected only one pose")));
        }
        if record.pose.is_none() {
            (record.pose, named) = (Some(pose), Some(key));
        }
    }
    let known = [
        "lensmodel",
        "lens_model",
        "distortion_model",
        "intrinsics",
        "extrinsics",
        "rt_cam_ref",
        "rt_ref_cam",
        "imagersize",
        "imager_size",
        "valid_intrinsics_region",
        "icam_intrinsics",
        "optimization_inputs",
    ];
    Ok(Calibration { records: vec![record], notices: root.unknown_keys(&known)?, ..Calibration::default() })
}
