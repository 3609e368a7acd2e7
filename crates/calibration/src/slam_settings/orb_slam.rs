//! Settings of ORB-SLAM2 and ORB-SLAM3: flat keys with dots, `Camera.fx`, or `Camera1.fx` since version 1.0. Settings
//! of OpenVSLAM and stella_vslam, which have `Camera.model` or a map `Camera`. Sources: ORB_SLAM3, Settings.cc; the
//! example settings of each.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DMat3, DVec3};
use raycam_scene::{ErrorCode, Lens, LensModel, Notice, NoticeCode, PixelCenter};

use crate::document::number_format::{joined, matrix_rows34, yaml_float};
use crate::document::{Cursor, DocumentNode, Value, check_rotation, rigid, yaml};
use crate::intrinsics::{brown_lens, lens_of, pinhole_matrix, refuse_terms, set_panorama};
use crate::rig::{one_rig, poses_on_one_rig};
use crate::{Calibration, CameraRecord, OutputFiles, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// Keys of a camera, after `Camera.`, `Camera1.` or `Camera2.`.
const CAMERA: [&str; 31] = [
    "fx",
    "fy",
    "cx",
    "cy",
    "k1",
    "k2",
    "k3",
    "k4",
    "p1",
    "p2",
    "type",
    "width",
    "height",
    "fps",
    "bf",
    "RGB",
    "newWidth",
    "newHeight",
    "overlappingBegin",
    "overlappingEnd",
    "lappingBegin",
    "lappingEnd",
    "imageScale",
    "name",
    "model",
    "setup",
    "cols",
    "rows",
    "color_order",
    "focal_x_baseline",
    "depth_threshold",
];
/// Prefixes of keys that are settings of the program.
const SETTINGS: [&str; 24] = [
    "ORBextractor",
    "Viewer",
    "IMU",
    "ThDepth",
    "DepthMapFactor",
    "RGBD",
    "System",
    "File",
    "Stereo",
    "loopClosing",
    "Feature",
    "Mapping",
    "Tracking",
    "Preprocessing",
    "Initializer",
    "Relocalizer",
    "KeyframeInserter",
    "LoopDetector",
    "GraphOptimizer",
    "PangolinViewer",
    "MapViewer",
    "SocketPublisher",
    "Marker",
    "depthmap_factor",
];

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    let starts = |word: &str| text.lines().any(|line| line.trim_start().starts_with(word));
    ["Camera.fx", "Camera1.fx", "LEFT.K", "Camera.model"].into_iter().any(starts)
        || text.lines().any(|line| line.trim_end() == "Camera:") && starts("setup:") && starts("model:")
}

/// Returns the settings with the entries of the map `Camera` replaced by ORB-SLAM's flat keys, such as `Camera.fx`.
fn flat(mut node: DocumentNode) -> DocumentNode {
    let Value::Map(entries) = &mut node.value else { return node };
    let Some(i) = entries.iter().position(|(key, at)| key == "Camera" && matches!(at.value, Value::Map(_))) else {
        return node;
    };
    if let (_, DocumentNode { value: Value::Map(inner), .. }) = entries.remove(i) {
        entries.extend(inner.into_iter().map(|(key, at)| (format!("Camera.{key}"), at)));
    }
    node
}

/// Returns ORB-SLAM's camera type; a model of OpenVSLAM is converted to the corresponding type.
fn kind_of<'a>(root: &Cursor<'a>) -> Result<&'a str> {
    let Some(at) = root.get("Camera.model") else {
        return root.get("Camera.type").map_or(Ok("PinHole"), |at| at.word());
    };
    match at.word()? {
        "perspective" => Ok("PinHole"),
        "fisheye" => Ok("KannalaBrandt8"),
        "equirectangular" => Ok("equirectangular"),
        other => Err(at.fail_as(
            ErrorCode::UnsupportedFeature,
            format_args!(
                "unsupported Camera.model {other:?}; expected perspective, fisheye or \
            equirectangular"
            ),
        )),
    }
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = flat(yaml::parse(source.text()?, &source.path)?);
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration { notices: other_keys(&root)?, ..Calibration::default() };
    let kind = kind_of(&root)?;
    if kind == "equirectangular" {
        calibration.records.push(CameraRecord::new("Camera", PixelCenter::Integer));
        pixels(&root, &mut calibration)?;
        set_panorama(&mut calibration.records[0]).map_err(|message| root.fail(message))?;
        return Ok(calibration);
    }
    if root.get("LEFT.K").is_some() {
        raw_pair(&root, &mut calibration)?;
        return Ok(calibration);
    }
    let first = if root.get("Camera1.fx").is_some() { "Camera1" } else { "Camera" };
    let pose = match root.any(&["Stereo.T_c1_c2", "Tlr"]) {
        Some(at) if root.get("Camera2.fx").is_some() => {
            let (r, c) = match at.numbers()?.len() {
                12 => rigid(&at.array()?),
                _ => at.matrix4()?,
            };
            check_rotation(r).map_err(|message| at.fail(message))?;
            Some(Pose::world_from_camera(Rotation::Matrix(r), c))
        }
        _ => None,
    };
    let base = root.get("Stereo.b").map(|at| at.number()).transpose()?;
    calibration.records.push(camera(&root, first, kind)?);
    if let Some(pose) = pose {
        let mut second = camera(&root, "Camera2", kind)?;
        second.pose = Some(pose);
        calibration.records.push(second);
    } else if let (Some(base), "Rectified") = (base, kind) {
        let mut right = CameraRecord { name: "Camera2".into(), ..calibration.records[0].clone() };
        right.pose = Some(Pose::world_from_camera(Rotation::Matrix(DMat3::IDENTITY), DVec3::new(base, 0.0, 0.0)));
        calibration.records.push(right);
        calibration.note(
            NoticeCode::PlacedCameras,
            format!(
                "a rectified pair: the second camera has the first camera's K and size, and is placed {base} m to its \
                 right"
            ),
        );
    } else if root.get("Camera2.fx").is_some() {
        return Err(root.fail("Camera2 has no pose; expected Stereo.T_c1_c2, camera 1 from camera 2 (or Tlr)"));
    } else if let Some(bf) = root
        .any(&["Camera.bf", "Camera.focal_x_baseline"])
        .map(|at| at.number())
        .transpose()?
        .or(base)
        .filter(|bf| *bf != 0.0)
    {
        let fx = root.require(&format!("{first}.fx"))?.number()?;
        let base = base.unwrap_or(bf / fx);
        calibration.note(
            NoticeCode::IgnoredKey,
            format!(
                "one camera is read, although the file has a baseline of {base} m; for a stereo pair, use \
                 Rig.stereo(camera, {base})"
            ),
        );
    }
    pixels(&root, &mut calibration)?;
    one_rig(&mut calibration.records, "rig");
    Ok(calibration)
}

/// Returns a notice for each unknown key of a camera; keys that look like a lens are errors.
fn other_keys(root: &Cursor<'_>) -> Result<Vec<Notice>> {
    let mut notices = Vec::new();
    for (key, at) in root.entries()? {
        let (group, own) = key.split_once('.').unwrap_or((key, ""));
        let sides = ["LEFT", "RIGHT"].contains(&group) && ["K", "D", "R", "P", "width", "height"].contains(&own);
        let known = group.starts_with("Camera") && CAMERA.contains(&own) || sides;
        if known || SETTINGS.iter().any(|start| key.starts_with(start)) || ["Tlr", "Tbc"].contains(&key) {
            continue;
        }
        at.refuse_lens(own)?;
        at.refuse_lens(key)?;
        notices.push(Notice::about(NoticeCode::IgnoredKey, format!("{key} (line {})", at.node.line), "ignored"));
    }
    if root.entries()?.iter().any(|(key, _)| key.starts_with("StereoRectifier")) {
        notices.push(Notice::new(
            NoticeCode::RectifiedValues,
            "StereoRectifier (the raw pair) is ignored; the rectified cameras are used",
        ));
    }
    if root.any(&["IMU.T_b_c1", "Tbc"]).is_some() {
        notices.push(Notice::new(
            NoticeCode::IgnoredKey,
            "IMU.T_b_c1 (Tbc), the mount of camera 1 on the body, is ignored; poses are relative to camera 1",
        ));
    }
    Ok(notices)
}

/// Sets the image sizes; adds a notice if the program resizes images to another size, which is ignored.
fn pixels(root: &Cursor<'_>, calibration: &mut Calibration) -> Result<()> {
    let side = |names: [&str; 2]| root.any(&names);
    if let (Some(width), Some(height)) = (side(["Camera.width", "Camera.cols"]), side(["Camera.height", "Camera.rows"]))
    {
        let size = Some([width.count()?, height.count()?]);
        for record in &mut calibration.records {
            record.size = size;
        }
    }
    if let Some(at) = root.any(&["Camera.newWidth", "Camera.newHeight", "Camera.imageScale"]) {
        calibration.note(
            NoticeCode::IgnoredKey,
            format!(
                "{} (line {}): ORB-SLAM3 resizes images to this size; K belongs to Camera.width x Camera.height",
                at.key, at.node.line
            ),
        );
    }
    Ok(())
}

fn camera(root: &Cursor<'_>, group: &str, kind: &str) -> Result<CameraRecord> {
    let mut record = CameraRecord::new(group, PixelCenter::Integer);
    let get = |key: &str| root.require(&format!("{group}.{key}"))?.number();
    let term = |key: &str| root.number_or(&format!("{group}.{key}"), 0.0);
    record.k = Some(pinhole_matrix([get("fx")?, get("fy")?, get("cx")?, get("cy")?]));
    let [k1, k2, k3, k4] = [term("k1")?, term("k2")?, term("k3")?, term("k4")?];
    let [p1, p2] = [term("p1")?, term("p2")?];
    let named = |name: &'static str, value: f64| (name, value);
    let lens = match kind {
        "PinHole" | "Pinhole" => refuse_terms([named("k4", k4)]).and_then(|()| brown_lens(k1, k2, p1, p2, k3)),
        "KannalaBrandt8" => refuse_terms([named("p1", p1), named("p2", p2)])
            .and_then(|()| lens_of(LensModel::Fisheye, &[k1, k2, k3, k4])),
        "Rectified" => refuse_terms([("k1", k1), ("k2", k2), ("k3", k3), ("k4", k4), ("p1", p1), ("p2", p2)])
            .map(|()| Lens::Pinhole),
        _ => {
            return Err(root
                .require("Camera.type")?
                .fail(format_args!("{kind:?}; expected PinHole, Rectified or KannalaBrandt8")));
        }
    };
    record.lens = lens.map_err(|message| root.fail(format_args!("{group}: {message}")))?;
    Ok(record)
}

/// Reads the raw pair of ORB-SLAM2: R is the rotation rectified_from_raw, and P belongs to the rectified cameras.
fn raw_pair(root: &Cursor<'_>, calibration: &mut Calibration) -> Result<()> {
    for side in ["LEFT", "RIGHT"] {
        let get = |key: &str| root.require(&format!("{side}.{key}"));
        let mut record = CameraRecord::new(side.to_lowercase(), PixelCenter::Integer);
        record.k = Some(get("K")?.matrix3()?);
        let d = root.get(&format!("{side}.D")).map_or(Ok(vec![]), |at| at.numbers())?;
        record.lens =
            lens_of(LensModel::OpenCv, &d).map_err(|message| root.fail(format_args!("{side}.D: {message}")))?;
        record.size = match (root.get(&format!("{side}.width")), root.get(&format!("{side}.height"))) {
            (Some(width), Some(height)) => Some([width.count()?, height.count()?]),
            _ => None,
        };
        let at = get("R")?;
        let r = at.matrix3()?;
        check_rotation(r).map_err(|message| at.fail(message))?;
        let p = get("P")?.array::<12>()?;
        let c = DVec3::new(-p[3] / p[0], -p[7] / p[5], 0.0);
        record.pose = Some(Pose::from_r_c(r.transpose(), c));
        calibration.records.push(record);
    }
    one_rig(&mut calibration.records, "rig");
    calibration.note(
        NoticeCode::RectifiedValues,
        "the raw pair of LEFT and RIGHT is used, in the axes of the rectified left camera; Camera.fx and similar keys \
         belong to the rectified camera and are ignored",
    );
    Ok(())
}

pub(crate) fn write(records: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    let format = "ORB-SLAM's settings";
    if records.len() > 2 {
        return Err(FormatError::encode(format!("{format} store one camera or a pair, got {}", records.len())));
    }
    let mut notices = Vec::new();
    let poses = poses_on_one_rig(records, format, &mut notices)?;
    let fisheye = |record: &CameraRecord| matches!(record.lens, Lens::Fisheye(_));
    if records.iter().any(fisheye) && !records.iter().all(fisheye) {
        return Err(FormatError::encode(format!(
            "{format} have one Camera.type for both cameras, but only one camera has lens model fisheye"
        )));
    }
    let kind = if fisheye(&records[0]) { "KannalaBrandt8" } else { "PinHole" };
    let mut text = format!("%YAML:1.0\n\nFile.version: \"1.0\"\n\nCamera.type: \"{kind}\"\n\n");
    for (i, record) in records.iter().enumerate() {
        let focals = record.focals_with(PixelCenter::Integer, format)?;
        let (names, values): (&[&str], &[f64]) = match record.lens.coefficients() {
            None => (&[], &[]),
            Some((LensModel::Fisheye, d)) => (&["k1", "k2", "k3", "k4"], d),
            Some((LensModel::OpenCv, d)) if d[5.min(d.len())..].iter().all(|v| *v == 0.0) => {
                (&["k1", "k2", "p1", "p2", "k3"], &d[..d.len().min(5)])
            }
            Some((model, d)) => {
                return Err(
                    record.unsupported_error(format, &format!("the lens model {} with distortion {d:?}", model.name()))
                );
            }
        };
        let focals = ["fx", "fy", "cx", "cy"].iter().zip(&focals);
        for (name, value) in focals.chain(names.iter().zip(values)) {
            let _ = writeln!(text, "Camera{}.{name}: {}", i + 1, yaml_float(*value));
        }
        text += "\n";
    }
    let size = records[0].require_size(format)?;
    if records.iter().any(|record| record.size != Some(size)) {
        return Err(FormatError::encode(format!("{format} have one size for both cameras; expected equal sizes")));
    }
    let _ = writeln!(text, "Camera.width: {}\nCamera.height: {}", size[0], size[1]);
    if let [first, second] = &poses[..] {
        let (r, c) = second.compose(&first.inverted()).world_r_c();
        let rows = matrix_rows34(r.matrix(), c);
        let _ = writeln!(
            text,
            "\nStereo.T_c1_c2: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: f\n  data: [{}, 0.0, 0.0, 0.0, 1.0]",
            joined(rows.as_flattened(), ", ")
        );
        notices.push(Notice::new(
            NoticeCode::NotWritten,
            format!("{format} store the second camera's pose relative to the first; world poses are not written"),
        ));
    } else if !poses[0].is_identity() {
        notices.push(Notice::new(NoticeCode::NotWritten, format!("{format} cannot store a pose; it is not written")));
    }
    notices.push(Notice::new(
        NoticeCode::NotWritten,
        "ORB-SLAM3's settings (fps, ORBextractor, Stereo.ThDepth, IMU) are not written; add them to the file",
    ));
    Ok(OutputFiles { notices, ..OutputFiles::one(text) })
}
