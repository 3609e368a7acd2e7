//! `calibration.toml` of Anipose, Pose2Sim and FreeMoCap: one table per camera with `matrix`, `distortions`, `size`,
//! `rotation` (a rotation vector) and `translation`, camera_from_world. Sources: aniposelib, cameras.py; Pose2Sim,
//! calibration.py.

use glam::DVec3;
use raycam_scene::{LensModel, NoticeCode, PixelCenter, counted};

use crate::document::{Cursor, toml_tree};
use crate::intrinsics::lens_of;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    let key = |name: &str| text.lines().any(|line| line.trim_start().starts_with(name) && line.contains('='));
    ["matrix", "distortions", "rotation", "translation"].into_iter().all(key)
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = toml_tree::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    let mut long = 0.0_f64;
    for (key, at) in root.entries()? {
        if at.get("matrix").is_none() {
            if !matches!(key, "metadata" | "fisheye") {
                at.refuse_lens(key)?;
                calibration.note_about(NoticeCode::IgnoredKey, format!("{key} (line {})", at.node.line), "ignored");
            }
            continue;
        }
        let known = ["name", "size", "matrix", "distortions", "rotation", "translation", "fisheye"];
        calibration.notices.extend(at.unknown_keys(&known)?);
        let name = at.get("name").map_or(Ok(key), |at| at.word())?;
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        record.k = Some(at.require("matrix")?.matrix3()?);
        if let Some(size) = at.get("size") {
            let sides = size.list()?;
            let [width, height] = &sides[..] else {
                return Err(size.fail(format_args!("{}; expected width and height", counted(sides.len(), "number"))));
            };
            record.size = Some([width.count()?, height.count()?]);
        }
        let values = at.get("distortions").map_or(Ok(vec![]), |at| at.numbers())?;
        let metadata = root.get("metadata");
        let stated = at.get("fisheye").or_else(|| root.get("fisheye"));
        let stated = stated.or_else(|| metadata.as_ref().and_then(|metadata| metadata.get("fisheye")));
        let fisheye = matches!(stated.map(|at| at.word()).transpose()?, Some("true" | "1"));
        record.lens = match fisheye {
            true => lens_of(LensModel::Fisheye, &values),
            false => lens_of(LensModel::OpenCv, &values),
        }
        .map_err(|message| at.fail(format_args!("distortions: {message}")))?;
        match (at.get("rotation"), at.get("translation")) {
            (Some(turn), Some(t)) => {
                let rotation = match turn.numbers()?.len() {
                    9 => Rotation::Matrix(turn.matrix3()?),
                    _ => Rotation::from_vector(turn.array()?).map_err(|message| turn.fail(message))?,
                };
                let t = DVec3::from_array(t.array()?);
                long = long.max(t.length());
                record.pose = Some(Pose::camera_from_world(rotation, t));
            }
            (None, None) => {}
            (Some(turn), None) => return Err(turn.fail("rotation without translation; expected both")),
            (None, Some(t)) => return Err(t.fail("translation without rotation; expected both")),
        }
        calibration.records.push(record);
    }
    if long > 100.0 {
        calibration.note(
            NoticeCode::Implausible,
            format!("translations of up to {long:.1} are probably in millimetres, and are not converted; divide them by 1000"),
        );
    }
    Ok(calibration)
}
