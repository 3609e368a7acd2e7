//! `transforms.json` of NeRF, instant-ngp and nerfstudio, and of the synthetic NeRF scenes made with Blender, which
//! have an angle as their only intrinsics. Poses are world from camera with OpenGL's axes (x right, y up, z backward),
//! the centre of the first pixel is (0.5, 0.5). Source: docs.nerf.studio, "Data conventions"; nerfstudio's
//! `camera_utils`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use glam::DMat3;
use raycam_scene::{ErrorCode, Lens, LensModel, Notice, NoticeCode, PixelCenter, counted};

use crate::document::Cursor;
use crate::document::number_format::{joined, matrix_rows34, quoted, yaml_float};
use crate::document::yaml;
use crate::intrinsics::{pinhole_matrix, set_panorama};
use crate::picture_size::size_of_picture;
use crate::trajectory::convention::flip_columns;
use crate::{Calibration, CameraRecord, OutputFiles, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

/// Keys of intrinsics, for all frames or for one frame.
const INTRINSICS: [&str; 19] = [
    "x_fov",
    "y_fov",
    "camera_angle_x",
    "camera_angle_y",
    "fl_x",
    "fl_y",
    "cx",
    "cy",
    "w",
    "h",
    "k1",
    "k2",
    "k3",
    "k4",
    "p1",
    "p2",
    "camera_model",
    "is_fisheye",
    "distortion_params",
];
const FRAME: [&str; 9] = [
    "file_path",
    "transform_matrix",
    "rotation",
    "sharpness",
    "depth_file_path",
    "mask_path",
    "colmap_im_id",
    "time",
    "colmap_image_id",
];
const ROOT: [&str; 15] = [
    "scale",
    "offset",
    "enable_depth_loading",
    "integer_depth_scale",
    "frames",
    "applied_transform",
    "aabb_scale",
    "applied_scale",
    "ply_file_path",
    "train_filenames",
    "val_filenames",
    "test_filenames",
    "orientation_override",
    "depth_unit_scale_factor",
    "from_na",
];

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("\"transform_matrix\"") && text.contains("\"frames\"")
}

pub(crate) fn detect_blender(_: &InputFile, _: &str) -> bool {
    false // the reader of `nerf` reads both formats; this format is only written
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, known: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration =
        Calibration { notices: root.unknown_keys(&[&INTRINSICS[..], &ROOT].concat())?, ..Calibration::default() };
    calibration.notices.extend(moved_world(&root));
    let mut names = std::collections::HashSet::new();
    let (mut measured, mut lent, mut shared) = (0, 0, None);
    let mut unread = BTreeMap::<&str, usize>::new();
    for frame in root.require("frames")?.list()? {
        for (key, at) in frame.entries()? {
            if !INTRINSICS.contains(&key) && !FRAME.contains(&key) {
                at.refuse_lens(key)?;
                *unread.entry(key).or_default() += 1;
            }
        }
        // Files written on Windows may contain backslashes.
        let file = frame.get("file_path").map(|at| at.word()).transpose()?.map(|file| file.replace('\\', "/"));
        let file = file.as_deref();
        let count = calibration.records.len();
        let mut name = file.map_or_else(|| count.to_string(), |file| file.trim_start_matches("./").to_owned());
        if !names.insert(name.clone()) {
            name = format!("{name}#{count}");
            names.insert(name.clone());
        }
        let mut record = CameraRecord::new(name, PixelCenter::Half);
        record.image = file.map(str::to_owned);
        record.time = frame.get("time").map(|at| at.number()).transpose()?;
        let has_size = frame.any(&["w", "h"]).or_else(|| root.any(&["w", "h"])).is_some();
        if let (Some(file), false) = (file, has_size) {
            // Files of the format `blender` contain image names without extension.
            let own = size_of_picture(assets, &source.path, [format!("{file}.png"), file.to_owned()]);
            measured += usize::from(own.is_some());
            if own.is_none() && known.size.is_none() {
                record.size = *shared.get_or_insert_with(|| any_size(&root, assets, &source.path));
                lent += usize::from(record.size.is_some());
            }
            record.size = own.or(record.size);
        }
        intrinsics(&mut record, &frame, &root, known)?;
        let (gl, c) = frame.require("transform_matrix")?.matrix4()?;
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(flip_columns(gl)), c));
        calibration.records.push(record);
    }
    if measured > 0 {
        calibration.note(
            NoticeCode::UsedOtherFile,
            format!("the file has no w and h; image sizes are read from the images ({})", counted(measured, "camera")),
        );
    }
    if lent > 0 {
        calibration.note(
            NoticeCode::AssumedConvention,
            format!(
                "cameras without an image file get the size of the first existing image ({}; set another \
                 with size= or --size)",
                counted(lent, "camera")
            ),
        );
    }
    if let Some(panorama) = calibration.records.first().filter(|record| is_panorama(record)) {
        calibration.notices.extend(odd_panorama(&root, panorama));
    }
    calibration.notices.extend(unread.iter().map(|(key, count)| {
        Notice::about(NoticeCode::IgnoredKey, format!("{key} of {}", counted(*count, "frame")), "ignored")
    }));
    Ok(calibration)
}

/// Returns the size of the first existing image.
fn any_size(root: &Cursor<'_>, assets: &mut AssetRoot, from: &Path) -> Option<[u32; 2]> {
    let frames = root.require("frames").and_then(|frames| frames.list()).ok()?;
    let files = frames.iter().filter_map(|frame| frame.get("file_path")?.word().ok());
    size_of_picture(assets, from, files.flat_map(|file| [format!("{file}.png"), file.replace('\\', "/")]))
}

/// Returns a notice if the file's world differs from the world of the original reconstruction.
fn moved_world(root: &Cursor<'_>) -> Option<Notice> {
    let numbers = |key: &str| root.get(key).and_then(|at| at.numbers().ok());
    let (moved, scale) = (numbers("applied_transform"), root.get("applied_scale").and_then(|at| at.number().ok()));
    let scale = scale.filter(|scale| *scale != 1.0);
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let moved = moved.filter(|moved| moved.len() >= 12 && moved[..12] != identity);
    if root.get("scale").is_some() || root.get("offset").is_some() {
        let message = "scale and offset, which map the scene to instant-ngp's box, are not applied; the cameras \
                       keep the file's coordinates";
        return Some(Notice::new(NoticeCode::PlacedCameras, message));
    }
    if moved.is_none() && scale.is_none() {
        return None;
    }
    let moved = moved.map(|moved| format!("applied_transform [{}]", joined(&moved, ", ")));
    let scale = scale.map(|scale| format!("applied_scale {scale}"));
    let what: Vec<String> = moved.into_iter().chain(scale).collect();
    let message = format!(
        "the cameras keep the file's coordinates, which include its {}; apply the same transform to a mesh of the \
         original reconstruction (COLMAP)",
        what.join(" and ")
    );
    Some(Notice::new(NoticeCode::PlacedCameras, message))
}

fn intrinsics(record: &mut CameraRecord, frame: &Cursor<'_>, root: &Cursor<'_>, known: &ReadHints) -> Result<()> {
    let get = |key: &str| frame.get(key).or_else(|| root.get(key));
    let real = |key: &str| get(key).map(|at| at.number()).transpose();
    record.size = match (get("w"), get("h")) {
        (Some(w), Some(h)) => Some([w.count()?, h.count()?]),
        _ => record.size.or(known.size),
    };
    let focals = [real("fl_x")?, real("fl_y")?];
    let degrees = [real("x_fov")?, real("y_fov")?].map(|angle| angle.map(f64::to_radians));
    let angles = match degrees {
        [None, None] => [real("camera_angle_x")?, real("camera_angle_y")?],
        degrees => degrees,
    };
    if angles == [None; 2] && focals == [None; 2] {
        return if known.intrinsics.is_some() {
            Ok(())
        } else {
            Err(root.fail(
                "fl_x or camera_angle_x is required; \
            both are missing",
            ))
        };
    }
    let Some(size) = record.size else {
        if let (Some(fx), Some(cx), Some(cy)) = (focals[0], real("cx")?, real("cy")?) {
            record.k = Some(pinhole_matrix([fx, focals[1].unwrap_or(fx), cx, cy]));
            return lens(record, frame, root);
        }
        return Err(root.fail_as(
            ErrorCode::MissingArgument,
            "w and h are missing, and K requires the image size; set it with --size WIDTHxHEIGHT or size=(width, \
             height)",
        ));
    };
    let sides = size.map(f64::from);
    let half = |angle: Option<f64>, side: f64| angle.map(|angle| 0.5 * side / (0.5 * angle).tan());
    let fx = focals[0].or_else(|| half(angles[0], sides[0]));
    let fy = focals[1].or_else(|| half(angles[1], sides[1]).filter(|_| focals[0].is_none()));
    let (Some(fx), Some(fy)) = (fx.or(fy), fy.or(fx)) else { return Err(root.fail("fl_x is missing")) };
    let [cx, cy] = [real("cx")?.unwrap_or(0.5 * sides[0]), real("cy")?.unwrap_or(0.5 * sides[1])];
    record.k = Some(pinhole_matrix([fx, fy, cx, cy]));
    lens(record, frame, root)
}

/// Reads the coefficients k1 k2 k3 k4 p1 p2: by name, or from nerfstudio's `distortion_params`.
fn coefficients(frame: &Cursor<'_>, root: &Cursor<'_>) -> Result<[f64; 6]> {
    let get = |key: &str| frame.get(key).or_else(|| root.get(key));
    let mut values = [0.0; 6];
    for (value, key) in values.iter_mut().zip(["k1", "k2", "k3", "k4", "p1", "p2"]) {
        *value = get(key).map_or(Ok(0.0), |at| at.number())?;
    }
    let names = ["k1", "k2", "k3", "k4", "p1", "p2"];
    let (own, listed) = (frame.any(&names).is_some(), frame.get("distortion_params"));
    let Some(at) = listed.clone().or_else(|| root.get("distortion_params").filter(|_| !own)) else {
        return Ok(values);
    };
    if listed.is_some() && !own {
        return at.array::<6>();
    }
    let listed = at.array::<6>()?;
    if values != [0.0; 6] && values != listed {
        return Err(at.fail("the lens coefficients are given twice, here and as k1 to p2; remove one of them"));
    }
    Ok(listed)
}

fn lens(record: &mut CameraRecord, frame: &Cursor<'_>, root: &Cursor<'_>) -> Result<()> {
    let get = |key: &str| frame.get(key).or_else(|| root.get(key));
    let at = get("camera_model").unwrap_or_else(|| root.clone());
    let fisheye = get("is_fisheye").map_or(Ok("false"), |at| at.word())?;
    let model = match get("camera_model") {
        Some(at) => at.word()?,
        None if matches!(fisheye, "true" | "True") => "OPENCV_FISHEYE",
        None => "OPENCV",
    };
    if model == "EQUIRECTANGULAR" {
        if coefficients(frame, root)? != [0.0; 6] {
            return Err(at.fail("a panorama has no lens coefficients; remove k1 to k4, p1 and p2"));
        }
        return set_panorama(record).map_err(|message| at.fail(message));
    }
    if model == "FISHEYE624" {
        return fisheye624(record, frame, root);
    }
    let [k1, k2, k3, k4, p1, p2] = coefficients(frame, root)?;
    let made = match model {
        "OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" if k4 == 0.0 => {
            let coefficients = [k1, k2, p1, p2, k3];
            Lens::new(LensModel::OpenCv, if k3 == 0.0 { &coefficients[..4] } else { &coefficients })
        }
        "OPENCV_FISHEYE" | "FISHEYE" if p1 == 0.0 && p2 == 0.0 => Lens::new(LensModel::Fisheye, &[k1, k2, k3, k4]),
        // nerfstudio applies the tangential terms to the equidistant point, like COLMAP's model.
        "OPENCV_FISHEYE" | "FISHEYE" => Lens::new(LensModel::ThinPrismFisheye, &[k1, k2, p1, p2, k3, k4, 0.0, 0.0]),
        _ => {
            return Err(at.fail_as(
                ErrorCode::UnsupportedFeature,
                format_args!(
                    "unsupported {model} with k1 {k1} k2 {k2} k3 {k3} k4 {k4} p1 {p1} p2 \
                 {p2}; expected PINHOLE, OPENCV \
                 without k4, OPENCV_FISHEYE or EQUIRECTANGULAR"
                ),
            ));
        }
    };
    record.lens = made.map_err(|error| at.fail(error))?;
    Ok(())
}

/// Reads Project Aria's fisheye: k0 to k5, p0 p1, s0 to s3, optionally after fx fy cx cy.
fn fisheye624(record: &mut CameraRecord, frame: &Cursor<'_>, root: &Cursor<'_>) -> Result<()> {
    let at = frame.get("distortion_params").or_else(|| root.get("distortion_params"));
    let at = at.ok_or_else(|| root.fail("FISHEYE624 requires distortion_params"))?;
    let values = at.numbers()?;
    let lens = match values.len() {
        12 => &values[..],
        16 => {
            record.k = Some(pinhole_matrix([values[0], values[1], values[2], values[3]]));
            &values[4..]
        }
        count => {
            return Err(
                at.fail(format_args!("{}; FISHEYE624 requires 12, or 16 with fx fy cx cy", counted(count, "number")))
            );
        }
    };
    record.lens = Lens::new(LensModel::RadTanThinPrismFisheye, lens).map_err(|error| at.fail(error))?;
    Ok(())
}

fn is_panorama(record: &CameraRecord) -> bool {
    record.lens.coefficients().is_some_and(|(model, _)| model == LensModel::Equirectangular)
}

/// Returns a notice if the intrinsics of a panorama differ from nerfstudio's, which are w/2, h and the centre for a
/// complete panorama.
fn odd_panorama(root: &Cursor<'_>, record: &CameraRecord) -> Option<Notice> {
    let [width, height] = record.size?.map(f64::from);
    let usual = [
        ("fl_x", vec![0.5 * width]),
        ("fl_y", vec![height, 0.5 * width]),
        ("cx", vec![0.5 * width]),
        ("cy", vec![0.5 * height]),
    ];
    let odd = |(key, values): &(&str, Vec<f64>)| {
        let given = root.get(key)?.number().ok()?;
        (!values.iter().any(|value| (value - given).abs() < 1e-6 * width)).then(|| format!("{key} {given}"))
    };
    let odd: Vec<String> = usual.iter().filter_map(odd).collect();
    (!odd.is_empty()).then(|| {
        let odd = odd.join(", ");
        let message = format!(
            "EQUIRECTANGULAR is read as a panorama of all directions; values that contradict this are ignored: {odd}"
        );
        Notice::new(NoticeCode::IgnoredKey, message)
    })
}

pub(crate) fn write(records: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    let mut text = String::from("{\n");
    let all: Result<Vec<String>, _> = records.iter().map(intrinsics_text).collect();
    let all = all?;
    let shared = all.iter().all(|one| *one == all[0]);
    if shared {
        let _ = writeln!(text, "  {},", all[0]);
    }
    text += "  \"frames\": [";
    for (i, (record, own)) in records.iter().zip(&all).enumerate() {
        let own = if shared { "" } else { &format!(", {own}") };
        text += &frame(record, own, i, true)?;
    }
    text += "\n  ]";
    text += &split_names(records);
    text += "\n}\n";
    Ok(OutputFiles::one(text))
}

/// Formats nerfstudio's lists of the images in each split; empty unless every camera's name begins with the name of a
/// split.
fn split_names(records: &[CameraRecord]) -> String {
    let splits = ["train", "val", "test"];
    if !records.iter().all(|record| splits.iter().any(|split| is_in_split(record, split))) {
        return String::new();
    }
    let mut text = String::new();
    for split in splits {
        let files = records.iter().filter(|record| is_in_split(record, split));
        let names: Vec<String> = files.map(|record| quoted(record.image.as_deref().unwrap_or(&record.name))).collect();
        let _ = write!(text, ",\n  \"{split}_filenames\": [{}]", names.join(", "));
    }
    text
}

/// True if a camera's name begins with the name of the split and a slash.
pub(crate) fn is_in_split(record: &CameraRecord, split: &str) -> bool {
    record.name.strip_prefix(split).is_some_and(|rest| rest.starts_with('/'))
}

/// Formats the keys of a camera's intrinsics.
fn intrinsics_text(record: &CameraRecord) -> Result<String> {
    let format = "NeRF's transforms.json";
    let [width, height] = record.require_size(format)?;
    if is_panorama(record) {
        return panorama_text(record, [width, height], format);
    }
    let [fx, fy, cx, cy] = record.focals_with(PixelCenter::Half, format)?.map(yaml_float);
    let lens = match record.lens.coefficients() {
        None => "\"camera_model\": \"OPENCV\"".to_owned(),
        Some((LensModel::OpenCv, d)) if d.len() <= 5 || d[5..].iter().all(|v| *v == 0.0) => {
            let k3 = d.get(4).filter(|k3| **k3 != 0.0);
            let k3 = k3.map_or(String::new(), |k3| format!(", \"k3\": {}", yaml_float(*k3)));
            let [k1, k2, p1, p2] = [d[0], d[1], d[2], d[3]].map(yaml_float);
            format!("\"camera_model\": \"OPENCV\", \"k1\": {k1}, \"k2\": {k2}{k3}, \"p1\": {p1}, \"p2\": {p2}")
        }
        Some((LensModel::Fisheye, d)) => {
            let [k1, k2, k3, k4] = [d[0], d[1], d[2], d[3]].map(yaml_float);
            format!("\"camera_model\": \"OPENCV_FISHEYE\", \"k1\": {k1}, \"k2\": {k2}, \"k3\": {k3}, \"k4\": {k4}")
        }
        Some((model, d)) => {
            return Err(record.unsupported_error(format, &format!("lens model {} with distortion {d:?}", model.name())));
        }
    };
    Ok(format!("\"w\": {width}, \"h\": {height}, \"fl_x\": {fx}, \"fl_y\": {fy}, \"cx\": {cx}, \"cy\": {cy}, {lens}"))
}

/// Formats the keys of a complete panorama, with the focal lengths of nerfstudio's `cameras.py`: w / 2 and h.
fn panorama_text(record: &CameraRecord, [width, height]: [u32; 2], format: &str) -> Result<String> {
    let whole = record.lens.full_panorama([width, height], record.pixel_center);
    let same = |whole: DMat3, k: DMat3| (whole - k).to_cols_array().iter().all(|v| v.abs() <= 1e-9 * f64::from(width));
    if width != 2 * height {
        let what = format!("a panorama of {width} x {height} pixels; expected a width that is twice the height");
        return Err(record.unsupported_error(format, &what));
    }
    if !record.k.zip(whole).is_some_and(|(k, whole)| same(whole, k)) {
        let what = "a partial panorama; expected a panorama of all directions";
        return Err(record.unsupported_error(format, what));
    }
    let [fx, fy, cx, cy] = [0.5, 1.0, 0.5, 0.5].map(|share| share * f64::from(width));
    let [fx, fy, cx, cy] = [fx, 0.5 * fy, cx, 0.5 * cy].map(yaml_float);
    Ok(format!(
        "\"w\": {width}, \"h\": {height}, \"fl_x\": {fx}, \"fl_y\": {fy}, \"cx\": {cx}, \"cy\": {cy}, \
         \"camera_model\": \"EQUIRECTANGULAR\""
    ))
}

fn frame(record: &CameraRecord, own: &str, i: usize, ending: bool) -> Result<String> {
    let (rotation, c) = record.require_pose()?.world_r_c();
    let rows = matrix_rows34(flip_columns(rotation.matrix()), c).map(|row| format!("[{}]", joined(&row, ", ")));
    let time = record.time.map_or(String::new(), |time| format!(", \"time\": {}", yaml_float(time)));
    let file = record.image.as_deref().unwrap_or(&record.name);
    let stem = file
        .rsplit_once('.')
        .filter(|(_, end)| ["png", "jpg", "jpeg", "exr", "tif", "tiff"].contains(&end.to_lowercase().as_str()));
    let file = quoted(if ending { file } else { stem.map_or(file, |(stem, _)| stem) });
    let between = if i == 0 { "" } else { "," };
    Ok(format!(
        "{between}\n    {{\"file_path\": {file}{own}{time}, \"transform_matrix\": [{}, [0.0, 0.0, 0.0, 1.0]]}}",
        rows.join(", ")
    ))
}

/// Writes the format of Blender's scenes. One angle describes the intrinsics, so pixels must be square, the principal
/// point must be at the centre, and lens models with coefficients are not supported.
pub(crate) fn write_blender(records: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    let format = "Blender-style JSON";
    let mut text = String::from("{\n");
    let mut angles = Vec::new();
    for record in records {
        record.require_pinhole(format)?;
        let [width, height] = record.require_size(format)?.map(f64::from);
        let [fx, fy, cx, cy] = record.focals_with(PixelCenter::Half, format)?;
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
        if !(near(fy, fx) && near(cx, 0.5 * width) && near(cy, 0.5 * height)) {
            let what = format!(
                "fx {fx}, fy {fy}, cx {cx}, cy {cy} (only square pixels with a centred principal \
                point)"
            );
            return Err(record.unsupported_error(format, &what));
        }
        // The chosen angle is read back as this focal length, or as the nearest possible one.
        let angle = 2.0 * (0.5 * width / fx).atan();
        let back = |angle: &f64| (0.5 * width / (0.5 * angle).tan() - fx).abs();
        let near =
            [angle, angle.next_up(), angle.next_down(), angle.next_up().next_up(), angle.next_down().next_down()];
        let best = near.into_iter().min_by(|a, b| back(a).total_cmp(&back(b)));
        angles.push((best.unwrap_or(angle), width, height));
    }
    if let Some(i) = angles.iter().position(|one| *one != angles[0]) {
        return Err(records[i].unsupported_error(format, "intrinsics or sizes that differ between cameras"));
    }
    let (angle, width, height) = angles[0];
    let _ = write!(
        text,
        "  \"camera_angle_x\": {},\n  \"w\": {width}, \"h\": {height},\n  \"frames\": [",
        yaml_float(angle)
    );
    for (i, record) in records.iter().enumerate() {
        // Programs that read this format append the images' extension themselves.
        text += &frame(record, "", i, false)?;
    }
    text += "\n  ]\n}\n";
    Ok(OutputFiles::one(text))
}
