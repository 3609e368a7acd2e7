//! AliceVision's and Meshroom's `.sfm`: AliceVision's JSON files, whose numbers are strings; versions 1.0 to 1.2.14.
//! Sources: AliceVision, jsonIO.cpp, IntrinsicScaleOffset.cpp and CHANGES.md.

use std::collections::HashMap;

use glam::{DMat3, DVec3};
use raycam_scene::{ErrorCode, Lens, LensModel, NoticeCode, PixelCenter};

use crate::document::{Cursor, check_rotation, yaml};
use crate::intrinsics::{brown_lens, lens_of, pinhole_matrix, set_panorama};
use crate::{Calibration, CameraRecord, Pose, ReadHints};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

/// The three numbers of a version.
type Version = [u32; 3];
const NEWEST: Version = [1, 2, 14];

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    let has = |key: &str| text.contains(key);
    has("\"version\"") && has("\"views\"") && has("\"intrinsics\"") && !has("sfm_data_version")
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    let at = root.require("version")?;
    let numbers: Result<Vec<u32>, _> = at.list()?.iter().map(Cursor::count).collect();
    let version: Version =
        numbers?.try_into().map_err(|_| at.fail("expected three numbers, such as \"1\", \"2\", \"11\""))?;
    let shown = version.map(|number| number.to_string()).join(".");
    if version[..2] > NEWEST[..2] || version[0] < 1 {
        let text = format!("unsupported AliceVision version {shown}; expected 1.0 to 1.2.14");
        return Err(at.fail_as(ErrorCode::UnsupportedFeature, text));
    }
    if version > NEWEST {
        let text = format!("version {shown} is newer than the newest supported version, and is read as version 1.2.14");
        calibration.note(NoticeCode::AssumedConvention, text);
    }
    let mut intrinsics = HashMap::new();
    for at in items(&root, "intrinsics")? {
        let made = camera(&at, version, &mut calibration)?;
        intrinsics.insert(at.require("intrinsicId")?.word()?, made);
    }
    let mut poses = HashMap::new();
    for at in items(&root, "poses")? {
        poses.insert(at.require("poseId")?.word()?, pose(&at.require("pose")?.require("transform")?)?);
    }
    let mut subs = HashMap::new();
    for rig in items(&root, "rigs")? {
        let id = rig.require("rigId")?.word()?;
        for (i, sub) in items(&rig, "subPoses")?.into_iter().enumerate() {
            let known = sub.get("status").map_or(Ok("estimated"), |at| at.word())? != "uninitialized";
            subs.insert((id, i.to_string()), known.then(|| pose(&sub.require("pose")?)).transpose()?);
        }
    }
    let (mut lost, mut names) = (Vec::new(), std::collections::HashSet::new());
    for view in items(&root, "views")? {
        let id = view.require("viewId")?.word()?;
        let path = view.get("path").map(|at| at.word()).transpose()?;
        let file = path.map_or(id, |path| path.rsplit(['/', '\\']).next().unwrap_or(path));
        let word = |key: &str| view.get(key).map(|at| at.word()).transpose();
        let body = word("poseId")?.and_then(|id| poses.get(id));
        let alone = matches!(word("isPoseIndependant")?, Some("1" | "true" | "True"));
        let mount = match (word("rigId")?, word("subPoseId")?) {
            (Some(rig), Some(sub)) if !alone => subs.get(&(rig, sub.to_owned())),
            _ => None,
        };
        let intrinsic = word("intrinsicId")?.and_then(|id| intrinsics.get(id));
        let (Some(body), Some(intrinsic), true) = (body, intrinsic, mount != Some(&None)) else {
            lost.push(file.to_owned());
            continue;
        };
        let mut record: CameraRecord = intrinsic.clone();
        record.name = if names.insert(file.to_owned()) { file.to_owned() } else { format!("{file}#{id}") };
        record.image = path.map(str::to_owned);
        record.pose = Some(mount.and_then(Option::as_ref).map_or_else(|| body.clone(), |sub| sub.compose(body)));
        calibration.records.push(record);
    }
    if calibration.records.is_empty() && lost.is_empty() || poses.is_empty() {
        // The file contains only intrinsics, without views.
        calibration.records = intrinsics.into_values().collect();
        calibration.records.sort_by(|a, b| a.name.cmp(&b.name));
        calibration.note(
            NoticeCode::MissingValue,
            "the file contains no poses; its intrinsics are returned as cameras at the origin",
        );
    } else {
        for file in lost {
            let message = "omitted, because the pose or the intrinsics are missing";
            calibration.note_about(NoticeCode::IgnoredElement, format!("view {file}"), message);
        }
    }
    calibration.note(
        NoticeCode::AssumedConvention,
        "AliceVision does not specify the position of pixel centres; the first pixel's centre is assumed at (0, 0), \
         as in its undistortion",
    );
    Ok(calibration)
}

/// Returns the elements of a list; AliceVision writes an empty list as an empty string.
fn items<'a>(at: &Cursor<'a>, key: &str) -> Result<Vec<Cursor<'a>>> {
    at.get(key).map_or(Ok(vec![]), |at| at.list())
}

/// Reads the pose camera_from_world from a rotation, stored by columns, and a centre.
fn pose(at: &Cursor<'_>) -> Result<Pose> {
    let rotation = at.require("rotation")?;
    let r = DMat3::from_cols_array(&rotation.array()?);
    check_rotation(r).map_err(|message| rotation.fail(message))?;
    Ok(Pose::from_r_c(r, DVec3::from_array(at.require("center")?.array()?)))
}

fn camera(at: &Cursor<'_>, version: Version, calibration: &mut Calibration) -> Result<CameraRecord> {
    let mut record = CameraRecord::new(at.require("intrinsicId")?.word()?, PixelCenter::Integer);
    let size = [at.require("width")?.count()?, at.require("height")?.count()?];
    record.size = Some(size);
    let kind = at.get("type").map_or(Ok("pinhole"), |at| at.word())?;
    if ["equirectangular", "spherical"].contains(&kind) {
        set_panorama(&mut record).map_err(|message| at.fail(message))?;
        return Ok(record);
    }
    let [w, h] = size.map(f64::from);
    let ratio = at.number_or("pixelRatio", 1.0)?;
    let focals = if version < [1, 2, 2] {
        let focal = at.require("pxFocalLength")?;
        match focal.numbers() {
            Ok(pair) if pair.len() == 2 => [pair[0], pair[1]],
            Ok(many) => return Err(focal.fail(format_args!("{} numbers; expected one or two", many.len()))),
            Err(_) => [focal.number()?; 2],
        }
    } else {
        if h > w {
            let message = "for images higher than wide, AliceVision's programs disagree whether sensorWidth refers to \
                the width or to the longer side; the width is used";
            calibration.note(NoticeCode::AssumedConvention, message);
        }
        let focal = at.require("focalLength")?.number()? / at.require("sensorWidth")?.number()? * w;
        match version {
            version if version < [1, 2, 5] => [focal, focal / ratio],
            version if version < [1, 2, 11] => [focal, focal * ratio],
            _ => [focal / ratio, focal],
        }
    };
    let [x, y] = at.get("principalPoint").map_or(Ok([0.0; 2]), |at| at.array())?;
    let middle = if version < [1, 2, 1] { [0.0; 2] } else { [0.5 * w, 0.5 * h] };
    record.k = Some(pinhole_matrix([focals[0], focals[1], x + middle[0], y + middle[1]]));
    record.lens = lens(at, kind, version)?;
    Ok(record)
}

fn lens(at: &Cursor<'_>, kind: &str, version: Version) -> Result<Lens> {
    let listed = |key: &str| items(at, key)?.iter().map(Cursor::number).collect::<Result<Vec<f64>, _>>();
    let (undistortion, parameters) = (listed("undistortionParams")?, listed("distortionParams")?);
    let undistorts = at.get("undistortionType").map_or(Ok("none"), |at| at.word())?;
    if !undistorts.eq_ignore_ascii_case("none") && undistortion.iter().any(|value| *value != 0.0) {
        return Err(at.fail_as(
            ErrorCode::UnsupportedFeature,
            format_args!("unsupported undistortionType {undistorts:?}; expected none"),
        ));
    }
    if !["pinhole", "radial1", "radial3", "brown", "fisheye4", "fisheye1", "fisheye"].contains(&kind) {
        return Err(at.fail_as(
            ErrorCode::UnsupportedFeature,
            format_args!(
                "unsupported intrinsics type {kind:?}; expected pinhole, radial1, radial3, brown, fisheye4, \
                 fisheye1 or fisheye"
            ),
        ));
    }
    let word = match version < [1, 2, 8] {
        true if kind == "pinhole" => "none",
        true => kind,
        false => at.get("distortionType").map_or(Ok("none"), |at| at.word())?,
    };
    let d = |count: usize| match parameters.len() {
        found if found == count => Ok(&parameters[..]),
        found => Err(at.fail(format_args!("{found} distortionParams; {word} requires {count}"))),
    };
    let zero = parameters.iter().all(|value| *value == 0.0);
    let made = match &word.to_lowercase()[..] {
        _ if zero && !word.to_lowercase().starts_with("fisheye") => Ok(Lens::Pinhole),
        "radial1" | "radialk1" => brown_lens(d(1)?[0], 0.0, 0.0, 0.0, 0.0),
        "radial3" | "radialk3" => {
            let d = d(3)?;
            brown_lens(d[0], d[1], 0.0, 0.0, d[2])
        }
        "brown" => {
            let d = d(5)?;
            brown_lens(d[0], d[1], d[3], d[4], d[2])
        }
        "fisheye" | "fisheye4" => lens_of(LensModel::Fisheye, d(4)?),
        "fisheye1" => lens_of(LensModel::Fov, d(1)?),
        _ => {
            return Err(at.fail_as(
                ErrorCode::UnsupportedFeature,
                format_args!(
                    "unsupported distortion {word:?} with {parameters:?}; export \
                 undistorted images (PrepareDenseScene), or calibrate with brown, radialk3 or fisheye4"
                ),
            ));
        }
    };
    made.map_err(|message| at.fail(message))
}
