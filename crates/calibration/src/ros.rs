//! ROS CameraInfo: the YAML of `camera_info_manager`, the equivalent INI file, and the message itself
//! (`sensor_msgs/msg/CameraInfo`), of ROS 1 (D K R P) and 2 (d k r p). The camera describes the raw image by K and D,
//! cropped and binned as in `image_geometry`. R and P belong to the rectified image.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DMat3, DVec3};
use raycam_scene::{LensModel, Notice, NoticeCode, PixelCenter, counted};

use crate::document::number_format::{joined, matrix_rows3, quoted, yaml_float};
use crate::document::{Cursor, DocumentNode, check_rotation, ini, yaml};
use crate::rig::one_rig;
use crate::{Calibration, CameraRecord, Folder, OutputFiles, Pose, ReadHints};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

const KEYS: [&str; 24] = [
    "image_width",
    "image_height",
    "camera_name",
    "camera_matrix",
    "distortion_model",
    "distortion_coefficients",
    "rectification_matrix",
    "projection_matrix",
    "header",
    "width",
    "height",
    "K",
    "k",
    "D",
    "d",
    "R",
    "r",
    "P",
    "p",
    "binning_x",
    "binning_y",
    "roi",
    "serial_no",
    "board_name",
];

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    if ini::detect(text) {
        return true;
    }
    let has = |word: &str| text.contains(word);
    let manager = has("image_width") && (has("projection_matrix") || has("distortion_model:"));
    let message = has("distortion_model:") && has("width:") && (has("binning_x") || has("P:") || has("p:"));
    !has("opencv-matrix") && !has("opencv_storage") && (manager || message)
}

/// Returns the names of a pair's left and right files in a folder.
fn pair_of(folder: &Folder) -> Option<[String; 2]> {
    ["left", "right"]
        .map(|side| {
            let known = |name: &&String| {
                let lower = name.to_lowercase();
                lower.starts_with(side) && [".yaml", ".yml", ".ini"].iter().any(|ending| lower.ends_with(ending))
            };
            let mut found = folder.names.iter().filter(known);
            found.next().filter(|_| found.next().is_none()).cloned()
        })
        .into_iter()
        .collect::<Option<Vec<_>>>()?
        .try_into()
        .ok()
}

pub(crate) fn detect_pair(folder: &Folder, assets: &mut AssetRoot) -> bool {
    pair_of(folder).is_some_and(|pair| {
        pair.iter().all(|name| {
            let source = folder.read(name, assets);
            source.is_ok_and(|source| detect(&source, source.text().unwrap_or_default()))
        })
    })
}

/// Reads the raw cameras of a rectified pair. Their poses are in the axes of the rectified left camera: P contains the
/// baseline, and R the rotations.
pub(crate) fn read_pair(folder: &Folder, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let names = pair_of(folder).ok_or_else(|| {
        FormatError::unsupported(
            &folder.path,
            "expected files with left and \
        right in their names",
        )
    })?;
    let mut sides = Vec::new();
    for name in &names {
        let source = folder.read(name, assets)?;
        let mut cameras = cameras(&source)?;
        match (cameras.pop(), cameras.is_empty()) {
            (Some(node), true) => sides.push((source, node)),
            _ => {
                return Err(FormatError::whole(
                    &source.path,
                    "the file contains several cameras; expected one camera of a pair",
                ));
            }
        }
    }
    pair(&sides.iter().map(|(source, node)| (source, node)).collect::<Vec<_>>())
}

/// Returns the documents of the cameras in a file.
fn cameras(source: &InputFile) -> Result<Vec<DocumentNode>> {
    let text = source.text()?;
    match ini::detect(text) {
        true => ini::cameras(text, &source.path),
        false => Ok(vec![yaml::parse(text, &source.path)?]),
    }
}

/// Reads the cameras of a pair from the document of the left and of the right camera.
fn pair(sides: &[(&InputFile, &DocumentNode)]) -> Result<Calibration> {
    let mut calibration = Calibration::default();
    for ((source, node), side) in sides.iter().zip(["left", "right"]) {
        let root = Cursor::root(node, &source.path);
        let mut found = camera(source, &root)?;
        let Some(mut record) = found.records.pop() else { continue };
        record.name = side.into();
        let matrix = |keys: &[&str]| root.any(keys).ok_or_else(|| root.fail(format_args!("{} is missing", keys[0])));
        let p = matrix(&["projection_matrix", "P", "p"])?.array::<12>()?;
        let at = matrix(&["rectification_matrix", "R", "r"])?;
        let r = at.matrix3()?;
        check_rotation(r).map_err(|message| at.fail(message))?;
        if p[0] == 0.0 || p[5] == 0.0 {
            return Err(at.fail("P has no focal length, so the pair is not rectified"));
        }
        record.pose = Some(Pose::from_r_c(r.transpose(), DVec3::new(-p[3] / p[0], -p[7] / p[5], 0.0)));
        calibration.records.push(record);
        let others = found.notices.into_iter().filter(|notice| notice.code != NoticeCode::RectifiedValues);
        calibration.notices.extend(others);
    }
    one_rig(&mut calibration.records, "rig");
    calibration.note(
        NoticeCode::PlacedCameras,
        "the raw cameras' poses are relative to the rectified left camera; rig.rectified() returns the rectified pair",
    );
    Ok(calibration)
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let found = cameras(source)?;
    if let [left, right] = &found[..] {
        // The file is `ost.txt` of a stereo calibration, with both cameras.
        return pair(&[(source, left), (source, right)]);
    }
    let mut calibration = Calibration::default();
    for node in &found {
        let found = camera(source, &Cursor::root(node, &source.path))?;
        calibration.records.extend(found.records);
        calibration.notices.extend(found.notices);
    }
    Ok(calibration)
}

/// Reads the camera of a document.
fn camera(source: &InputFile, root: &Cursor<'_>) -> Result<Calibration> {
    let either = |keys: &[&str]| root.any(keys).ok_or_else(|| root.fail(format_args!("{} is missing", keys[0])));
    let mut notices = root.unknown_keys(&KEYS)?;
    let name = root
        .get("camera_name")
        .map_or_else(|| Ok(source.stem().unwrap_or_else(|| "camera".into())), |at| at.word().map(str::to_owned))?;
    let mut record = CameraRecord::new(name, PixelCenter::Integer);
    let mut size = [either(&["image_width", "width"])?.count()?, either(&["image_height", "height"])?.count()?];
    let at_k = either(&["camera_matrix", "K", "k"])?;
    let mut k = at_k.matrix3()?;
    if k == DMat3::ZERO {
        let p = root.any(&["projection_matrix", "P", "p"]).and_then(|at| at.array::<12>().ok());
        return Err(at_k.fail(match p.filter(|p| *p != [0.0; 12]) {
            Some(_) => {
                "all numbers are 0: the raw camera is not calibrated, and the file contains only projection_matrix \
                 (P) of the rectified camera; to use this camera, write the first three columns of P as K and 0 as D"
            }
            None => "all numbers are 0: the camera is not calibrated (ROS publishes this before a calibration)",
        }));
    }
    let distortion = root.any(&["distortion_coefficients", "D", "d"]);
    let d = distortion.as_ref().map_or(Ok(vec![]), Cursor::numbers)?;
    let model = match root.get("distortion_model") {
        Some(at) => at.word()?,
        None if d.is_empty() => "none",
        None => "plumb_bob",
    };
    record.lens = distortion.as_ref().unwrap_or(root).lens(model, &d)?;
    let full = size;
    crop_and_bin(root, &mut k, &mut size)?;
    if size != full {
        notices.push(Notice::new(
            NoticeCode::AssumedConvention,
            format!(
                "roi and binning are applied, as in image_geometry: the camera has {} x {} pixels, and the full image \
                 has {} x {}; K is adjusted",
                size[0], size[1], full[0], full[1]
            ),
        ));
    }
    (record.k, record.size) = (Some(k), Some(size));
    let r = root.any(&["rectification_matrix", "R", "r"]).map_or(Ok(DMat3::IDENTITY), |at| at.matrix3())?;
    let plain = [k.x_axis.x, k.y_axis.x, k.z_axis.x, 0.0, 0.0, k.y_axis.y, k.z_axis.y, 0.0, 0.0, 0.0, 1.0, 0.0];
    let p = root.any(&["projection_matrix", "P", "p"]).map_or(Ok(plain), |at| at.array::<12>())?;
    if size == full && (p != plain || r != DMat3::IDENTITY) {
        notices.push(Notice::new(
            NoticeCode::RectifiedValues,
            "rectification_matrix and projection_matrix belong to the rectified image and are ignored; the camera has \
             camera_matrix and distortion_coefficients, which belong to the raw image",
        ));
    }
    Ok(Calibration { records: vec![record], notices, ..Calibration::default() })
}

/// Applies `roi` and `binning_x`, `binning_y` to K and the size.
fn crop_and_bin(root: &Cursor<'_>, k: &mut DMat3, size: &mut [u32; 2]) -> Result<()> {
    let count = |at: &Cursor<'_>, key: &str| at.get(key).map_or(Ok(0), |at| at.count());
    if let Some(roi) = root.get("roi") {
        let [x, y, width, height] =
            [count(&roi, "x_offset")?, count(&roi, "y_offset")?, count(&roi, "width")?, count(&roi, "height")?];
        if width > 0 || height > 0 {
            let fits = |start: u32, length: u32, all: u32| u64::from(start) + u64::from(length) <= u64::from(all);
            if !(fits(x, width, size[0]) && fits(y, height, size[1]) && width > 0 && height > 0) {
                return Err(roi.fail(format_args!(
                    "the region x {x}, y {y}, {width} x {height} is empty or extends beyond the image of {} x {}",
                    size[0], size[1]
                )));
            }
            k.z_axis -= DVec3::new(f64::from(x), f64::from(y), 0.0);
            *size = [width, height];
        }
    }
    let binning = [count(root, "binning_x")?.max(1), count(root, "binning_y")?.max(1)];
    if binning != [1, 1] {
        let scale = DVec3::new(1.0 / f64::from(binning[0]), 1.0 / f64::from(binning[1]), 1.0);
        *k = DMat3::from_diagonal(scale) * *k;
        *size = [size[0] / binning[0], size[1] / binning[1]];
    }
    Ok(())
}

pub(crate) fn write(records: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    let [record] = records else {
        return Err(FormatError::encode(format!(
            "ROS CameraInfo stores one camera, got {}; write each camera to a separate file",
            records.len()
        )));
    };
    let format = "ROS CameraInfo";
    let k = record.k_with(PixelCenter::Integer, format)?;
    let (model, d) = match record.lens.coefficients() {
        None => ("plumb_bob", vec![0.0; 5]),
        Some((LensModel::OpenCv, [k1, k2, p1, p2])) => ("plumb_bob", vec![*k1, *k2, *p1, *p2, 0.0]),
        Some((LensModel::OpenCv, d)) if d.len() == 5 => ("plumb_bob", d.to_vec()),
        Some((LensModel::OpenCv, d)) if d.len() == 8 => ("rational_polynomial", d.to_vec()),
        Some((LensModel::Fisheye, d)) => ("equidistant", d.to_vec()),
        Some((model, d)) => {
            return Err(record.unsupported_error(
                format,
                &format!("lens model {} with {}", model.name(), counted(d.len(), "coefficient")),
            ));
        }
    };
    let [width, height] = record.require_size(format)?;
    let mut text = String::new();
    let _ = writeln!(text, "image_width: {width}\nimage_height: {height}");
    let _ = writeln!(text, "camera_name: {}", quoted(&record.name));
    let mut matrix = |name: &str, rows: usize, cols: usize, values: &[f64]| {
        let data = joined(values, ", ");
        let _ = writeln!(text, "{name}:\n  rows: {rows}\n  cols: {cols}\n  data: [{data}]");
    };
    matrix("camera_matrix", 3, 3, &matrix_rows3(k));
    matrix("distortion_coefficients", 1, d.len(), &d);
    matrix("rectification_matrix", 3, 3, &matrix_rows3(DMat3::IDENTITY));
    let mut p = [0.0; 12];
    for (to, from) in p.chunks_mut(4).zip(matrix_rows3(k).chunks(3)) {
        to[..3].copy_from_slice(from);
    }
    matrix("projection_matrix", 3, 4, &p);
    let at = text.find("distortion_coefficients").unwrap_or(0);
    text.insert_str(at, &format!("distortion_model: {model}\n"));
    let mut written = OutputFiles::one(text);
    let (r, c) = record.r_c();
    if (r, c) != (DMat3::IDENTITY, DVec3::ZERO) {
        written.notices.push(Notice::new(
            NoticeCode::NotWritten,
            format!(
                "camera {:?}: ROS CameraInfo cannot store a pose; the pose at {} {} {} is not written",
                record.name,
                yaml_float(c.x),
                yaml_float(c.y),
                yaml_float(c.z)
            ),
        ));
    }
    Ok(written)
}
