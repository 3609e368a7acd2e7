//! openMVG's `sfm_data.json`. Sources: openMVG, sfm_data_io_cereal.cpp; cereal, "Polymorphism": a type is written with
//! its name only the first time, and later only with the number of that name.

use std::collections::HashMap;

use glam::DVec3;
use raycam_scene::{ErrorCode, Lens, LensModel, NoticeCode, PixelCenter};

use crate::document::{Cursor, check_rotation, yaml};
use crate::intrinsics::{brown_lens, lens_of, pinhole_matrix, set_panorama};
use crate::{Calibration, CameraRecord, Pose, ReadHints};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

/// Bit of a type number that means that the type's name follows.
const NEW: u32 = 1 << 31;
/// Number of a missing object.
const NONE: u32 = u32::MAX;

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("\"sfm_data_version\"")
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    let list = |key: &str| root.get(key).map_or(Ok(vec![]), |at| at.list());
    let mut kinds: HashMap<u32, String> = HashMap::new();
    // Types are numbered in file order: first in the views, then in the intrinsics.
    for at in list("views")? {
        kind(&at.require("value")?, &mut kinds)?;
    }
    let mut cameras = HashMap::new();
    for at in list("intrinsics")? {
        let value = at.require("value")?;
        let kind = kind(&value, &mut kinds)?;
        let key = at.require("key")?.count()?;
        cameras.insert(key, camera(&value.require("ptr_wrapper")?.require("data")?, &kind, key)?);
    }
    let mut poses = HashMap::new();
    for at in list("extrinsics")? {
        let value = at.require("value")?;
        let rotation = value.require("rotation")?;
        let r = rotation.matrix3()?;
        check_rotation(r).map_err(|message| rotation.fail(message))?;
        let c = DVec3::from_array(value.require("center")?.array()?);
        poses.insert(at.require("key")?.count()?, Pose::from_r_c(r, c));
    }
    let mut names = std::collections::HashSet::new();
    for at in list("views")? {
        let data = at.require("value")?.require("ptr_wrapper")?.require("data")?;
        let data = data.get("value0").filter(|_| data.get("filename").is_none()).unwrap_or(data);
        let file = data.require("filename")?.word()?;
        let (intrinsic, pose) = (data.require("id_intrinsic")?.count()?, data.require("id_pose")?.count()?);
        let known = cameras.get(&intrinsic).filter(|_| intrinsic != NONE).zip(poses.get(&pose));
        let Some((camera, pose)) = known else {
            let message = "omitted, because the pose or the intrinsics are missing";
            calibration.note_about(NoticeCode::IgnoredElement, format!("view {file}"), message);
            continue;
        };
        let mut record: CameraRecord = camera.clone();
        let id = data.require("id_view")?.count()?;
        record.name = if names.insert(file) { file.to_owned() } else { format!("{file}#{id}") };
        let folder = data.get("local_path").map_or(Ok(""), |at| at.word())?;
        let joint = if folder.is_empty() || folder.ends_with('/') { "" } else { "/" };
        record.image = Some(format!("{folder}{joint}{file}"));
        record.pose = Some(pose.clone());
        calibration.records.push(record);
    }
    calibration.note(
        NoticeCode::AssumedConvention,
        "openMVG does not specify the position of pixel centres; the first pixel's centre is assumed at (0, 0), as in \
         its undistortion",
    );
    Ok(calibration)
}

/// Returns the name of a value's type; empty for the base class.
fn kind(value: &Cursor<'_>, kinds: &mut HashMap<u32, String>) -> Result<String> {
    let Some(at) = value.get("polymorphic_id") else { return Ok(String::new()) };
    let id = at.count()?;
    if let Some(name) = value.get("polymorphic_name") {
        kinds.insert(id & !NEW, name.word()?.to_owned());
    }
    // cereal writes the id 2^30 if the value's type is the declared base class.
    if id == 1 << 30 {
        return Ok(String::new());
    }
    let name = kinds.get(&(id & !NEW)).cloned();
    name.ok_or_else(|| at.fail("no polymorphic_name precedes this polymorphic_id"))
}

fn camera(data: &Cursor<'_>, kind: &str, key: u32) -> Result<CameraRecord> {
    let mut record = CameraRecord::new(key.to_string(), PixelCenter::Integer);
    // The values of a base class are next to the values of the derived type, or in value0.
    let mut places = vec![data.clone()];
    while let Some(inner) = places[places.len() - 1].get("value0") {
        places.push(inner);
    }
    let get = |key: &str| places.iter().find_map(|at| at.get(key));
    let require = |key: &str| get(key).ok_or_else(|| data.fail(format_args!("{key} is missing")));
    record.size = Some([require("width")?.count()?, require("height")?.count()?]);
    if kind == "spherical" {
        set_panorama(&mut record).map_err(|message| data.fail(message))?;
        return Ok(record);
    }
    let focal = require("focal_length")?.number()?;
    let [cx, cy] = require("principal_point")?.array()?;
    record.k = Some(pinhole_matrix([focal, focal, cx, cy]));
    let made = match kind {
        "pinhole" => Ok(Lens::Pinhole),
        "pinhole_radial_k1" => brown_lens(require("disto_k1")?.array::<1>()?[0], 0.0, 0.0, 0.0, 0.0),
        "pinhole_radial_k3" => {
            let [k1, k2, k3] = require("disto_k3")?.array()?;
            brown_lens(k1, k2, 0.0, 0.0, k3)
        }
        "pinhole_brown_t2" => {
            let [k1, k2, k3, t1, t2] = require("disto_t2")?.array()?;
            brown_lens(k1, k2, t1, t2, k3)
        }
        "fisheye" => lens_of(LensModel::Fisheye, &require("fisheye")?.array::<4>()?),
        _ => {
            return Err(data.fail_as(
                ErrorCode::UnsupportedFeature,
                format_args!(
                    "unsupported intrinsics type {kind:?}; expected pinhole, pinhole_radial_k1, pinhole_radial_k3, \
                 pinhole_brown_t2, fisheye or spherical"
                ),
            ));
        }
    };
    record.lens = made.map_err(|message| data.fail(message))?;
    let known =
        ["width", "height", "focal_length", "principal_point", "disto_k1", "disto_k3", "disto_t2", "fisheye", "value0"];
    for at in &places {
        at.unknown_keys(&known)?;
    }
    let all = ["disto_k1", "disto_k3", "disto_t2", "fisheye"];
    if kind == "pinhole" && all.iter().any(|key| get(key).is_some()) {
        return Err(
            data.fail("intrinsics of type pinhole cannot have distortion; use another type, or remove the distortion")
        );
    }
    Ok(record)
}
