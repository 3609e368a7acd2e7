//! ARKitScenes: `.traj` has lines `seconds rx ry rz tx ty tz` with camera_from_world; `.pincam` has `width height fx fy
//! cx cy` of an image and is matched by its time. Source: ARKitScenes, DATA.md.

use std::path::Path;

use glam::DVec3;
use raycam_scene::{NoticeCode, PixelCenter, counted};

use crate::document::number_lines::{data_lines, numbers};
use crate::intrinsics::pinhole_matrix;
use crate::{Calibration, CameraRecord, Folder, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// Maximum difference in seconds between the times of a pose and of its intrinsics.
const TOLERANCE: f64 = 0.001 + 1e-9;

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending))
}

pub(crate) fn detect(source: &InputFile, text: &str) -> bool {
    let count = data_lines(text).next().map_or(0, |(_, line)| line.split_whitespace().count());
    has_ending(&source.path, "traj") && count == 7 || has_ending(&source.path, "pincam") && count == 6
}

/// Returns the name of the only trajectory in a folder.
fn trajectory(folder: &Folder) -> Option<&String> {
    let mut found = folder.ending(".traj");
    found.next().filter(|_| found.next().is_none())
}

pub(crate) fn detect_folder(folder: &Folder, _: &mut AssetRoot) -> bool {
    trajectory(folder).is_some()
}

pub(crate) fn read_folder(folder: &Folder, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let fail = || FormatError::unsupported(&folder.path, "expected exactly one .traj file");
    read(&folder.read(trajectory(folder).ok_or_else(fail)?, assets)?, assets, hints)
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let stem = source.stem().unwrap_or_else(|| "camera".into());
    let mut calibration = Calibration::default();
    if has_ending(&source.path, "pincam") {
        let mut record = CameraRecord::new(stem, PixelCenter::Integer);
        pincam(source, &mut record)?;
        calibration.records.push(record);
        return Ok(calibration);
    }
    let cameras = if hints.intrinsics.is_none() { pincams(source, assets) } else { vec![] };
    let mut left_out = 0;
    for (line, row) in data_lines(source.text()?) {
        let [time, rx, ry, rz, tx, ty, tz] = numbers(&source.path, line, row)?;
        let name = row.split_whitespace().next().unwrap_or_default();
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        record.time = Some(time);
        let rotation = Rotation::from_vector([rx, ry, rz])
            .map_err(|message| FormatError::line(&source.path, line, format!("columns 2 to 4: {message}")))?;
        record.pose = Some(Pose::camera_from_world(rotation, DVec3::new(tx, ty, tz)));
        let near = |camera: &&(f64, String)| (camera.0 - time).abs() <= TOLERANCE;
        match cameras.iter().find(near) {
            Some((_, file)) => {
                let own = assets.read_reference(&source.path, file)?;
                pincam(&own, &mut record)?;
                record.name = own.stem().unwrap_or(record.name);
            }
            None if !cameras.is_empty() => {
                left_out += 1;
                continue;
            }
            None => {}
        }
        calibration.records.push(record);
    }
    if left_out > 0 {
        calibration.note(
            NoticeCode::IgnoredElement,
            format!(
                "{} omitted: no .pincam file within 0.001 s of the pose's time (apply one K to all with intrinsics= or --intrinsics)",
                counted(left_out, "pose")
            ),
        );
    }
    Ok(calibration)
}

/// Returns the times and names of the `.pincam` files next to a trajectory, or in a folder next to the trajectory.
fn pincams(source: &InputFile, assets: &AssetRoot) -> Vec<(f64, String)> {
    let here = Folder::open(source.path.parent().unwrap_or(Path::new("")), assets);
    let inner = here.names.iter().filter(|name| name.contains("intrinsics"));
    let mut found = Vec::new();
    for place in std::iter::once("").chain(inner.map(String::as_str)) {
        let folder = if place.is_empty() { Folder::open(&here.path, assets) } else { here.inner(place, assets) };
        for name in folder.ending(".pincam") {
            let time = name.trim_end_matches(".pincam").rsplit('_').next().and_then(|time| time.parse().ok());
            let file = if place.is_empty() { name.clone() } else { format!("{place}/{name}") };
            found.extend(time.map(|time: f64| (time, file)));
        }
    }
    found
}

fn pincam(source: &InputFile, record: &mut CameraRecord) -> Result<()> {
    let Some((line, row)) = data_lines(source.text()?).next() else {
        return Err(FormatError::whole(&source.path, "the file is empty; expected width height fx fy cx cy"));
    };
    let [width, height, fx, fy, cx, cy] = numbers(&source.path, line, row)?;
    if [width, height].iter().any(|side| side.fract() != 0.0 || !(1.0..65537.0).contains(side)) {
        let message = format!(
            "{width} x {height}; expected a line that begins with width and height, whole numbers from 1 to 65536"
        );
        return Err(FormatError::line(&source.path, line, message));
    }
    record.size = Some([width as u32, height as u32]);
    record.k = Some(pinhole_matrix([fx, fy, cx, cy]));
    Ok(())
}
