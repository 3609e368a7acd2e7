//! `SN*.conf` of ZED cameras: sections `LEFT_CAM_HD`, `RIGHT_CAM_HD` and `STEREO`. Source: the native OpenCV sample of
//! zed-opencv-native. The right camera is at +Baseline, in millimetres, in the axes of the left camera.

use std::collections::HashMap;

use glam::DVec3;
use raycam_scene::{NoticeCode, PixelCenter};

use crate::intrinsics::{brown_lens, pinhole_matrix, refuse_terms};
use crate::rig::one_rig;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// Names of resolutions in section names, with the numbers of columns and rows.
const RESOLUTIONS: [(&str, [u32; 2]); 4] =
    [("HD", [1280, 720]), ("FHD", [1920, 1080]), ("2K", [2208, 1242]), ("VGA", [672, 376])];

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("[LEFT_CAM_") && text.contains("[STEREO]")
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let path = &source.path;
    let mut section = "";
    let mut values: HashMap<(&str, &str), (usize, &str)> = HashMap::new();
    for (i, line) in source.text()?.lines().enumerate() {
        let line = line.trim();
        if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            section = name;
        } else if let Some((key, value)) = line.split_once('=') {
            values.insert((section, key.trim()), (i + 1, value.trim()));
        }
    }
    let find = |section: &str, key: &str| -> Result<Option<f64>> {
        let Some((line, word)) = values.get(&(section, key)) else { return Ok(None) };
        let number = word.parse::<f64>().ok().filter(|value| value.is_finite());
        number.map(Some).ok_or_else(|| FormatError::line(path, *line, format!("{key}={word}; expected a number")))
    };
    let has = |name: &str| values.contains_key(&(format!("LEFT_CAM_{name}").as_str(), "fx"));
    let chosen = RESOLUTIONS.iter().find(|(name, size)| has(name) && hints.size.is_none_or(|known| known == *size));
    let chosen = chosen.or_else(|| RESOLUTIONS.iter().find(|(name, _)| has(name)));
    let (name, size) = chosen.ok_or_else(|| {
        FormatError::whole(path, "none of the sections LEFT_CAM_HD, LEFT_CAM_FHD, LEFT_CAM_2K and LEFT_CAM_VGA found")
    })?;
    let mut calibration = Calibration::default();
    for side in ["LEFT", "RIGHT"] {
        let section = format!("{side}_CAM_{name}");
        let missing = |key: &str| FormatError::whole(path, format!("the section [{section}] has no {key}"));
        let get = |key: &str| find(&section, key)?.ok_or_else(|| missing(key));
        let term = |key: &str| Ok::<_, FormatError>(find(&section, key)?.unwrap_or(0.0));
        let mut record = CameraRecord::new(side.to_lowercase(), PixelCenter::Integer);
        record.size = Some(*size);
        record.k = Some(pinhole_matrix([get("fx")?, get("fy")?, get("cx")?, get("cy")?]));
        let lens = refuse_terms([("k4", term("k4")?), ("k5", term("k5")?), ("k6", term("k6")?)]);
        let made = brown_lens(term("k1")?, term("k2")?, term("p1")?, term("p2")?, term("k3")?);
        record.lens = lens.and(made).map_err(|message| FormatError::whole(path, format!("[{section}]: {message}")))?;
        calibration.records.push(record);
    }
    let turn = |key: &str| Ok::<_, FormatError>(find("STEREO", &format!("{key}_{name}"))?.unwrap_or(0.0));
    let base = find("STEREO", "Baseline")?.ok_or_else(|| {
        FormatError::whole(
            path,
            "the section [STEREO] has no \
        Baseline",
        )
    })?;
    let rotation = Rotation::from_vector([turn("RX")?, turn("CV")?, turn("RZ")?])
        .map_err(|message| FormatError::whole(path, format!("[STEREO] RX, CV and RZ: {message}")))?;
    let t = DVec3::new(-base, find("STEREO", "TY")?.unwrap_or(0.0), find("STEREO", "TZ")?.unwrap_or(0.0)) / 1000.0;
    calibration.records[1].pose = Some(Pose::camera_from_world(rotation, t));
    one_rig(&mut calibration.records, "rig");
    calibration.note(
        NoticeCode::FirstOnly,
        format!(
            "the sections of {name} ({} x {}) are used (select others with size= or --size); Baseline ({base} mm) is converted \
             to metres and places the right camera to the right of the left camera",
            size[0], size[1]
        ),
    );
    Ok(calibration)
}
