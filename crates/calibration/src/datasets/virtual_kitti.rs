//! Virtual KITTI 2: `extrinsic.txt` (frame, camera, 16 numbers of camera_from_world) and `intrinsic.txt` (frame,
//! camera, fx fy cx cy), each with a header. Source: the data set's page, "Data format".

use std::collections::HashMap;

use raycam_scene::{NoticeCode, PixelCenter};

use crate::document::number_lines::{data_lines, numbers};
use crate::document::{check_rigid, rigid};
use crate::intrinsics::pinhole_matrix;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

const SIZE: [u32; 2] = [1242, 375];

/// A row: frame and camera, line number, and the values of the remaining columns.
type Row<const N: usize> = ((u32, u32), usize, [f64; N]);

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    let header = text.lines().next().unwrap_or_default();
    let starts = header.trim_start().starts_with("frame cameraID");
    starts && (header.contains("K[0,0]") || header.contains("r1,1"))
}

/// Reads the rows of a file, in file order.
fn rows<const N: usize>(source: &InputFile) -> Result<Vec<Row<N>>> {
    let mut found = Vec::new();
    for (line, row) in data_lines(source.text()?).skip(1) {
        let fail = |message: &str| FormatError::line(&source.path, line, message);
        let mut words = row.split_whitespace();
        let mut index = || {
            words
                .next()
                .and_then(|word| word.parse::<u32>().ok())
                .ok_or_else(|| fail("expected a line that begins with a frame number and a camera number"))
        };
        let key = (index()?, index()?);
        let rest: Vec<&str> = words.collect();
        found.push((key, line, numbers(&source.path, line, &rest.join(" "))?));
    }
    Ok(found)
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let has_poses = source.text()?.lines().next().is_some_and(|header| header.contains("r1,1"));
    let other = if has_poses { "intrinsic.txt" } else { "extrinsic.txt" };
    let beside = assets.read_reference(&source.path, other).ok();
    let (poses, focals) = if has_poses { (Some(source), beside.as_ref()) } else { (beside.as_ref(), Some(source)) };
    let mut calibration = Calibration::default();
    let listed = focals.map(rows::<4>).transpose()?.unwrap_or_default();
    let by_key: HashMap<(u32, u32), [f64; 4]> = listed.iter().map(|(key, _, focals)| (*key, *focals)).collect();
    let record = |(frame, camera): (u32, u32)| {
        let mut record = CameraRecord::new(format!("Camera_{camera}/{frame:05}"), PixelCenter::Integer);
        record.image = Some(format!("frames/rgb/Camera_{camera}/rgb_{frame:05}.jpg"));
        record.k = by_key.get(&(frame, camera)).map(|focals| pinhole_matrix(*focals));
        record.size = record.k.and(hints.size.or(Some(SIZE)));
        record
    };
    match poses {
        Some(poses) => {
            for (key, line, matrix) in rows::<16>(poses)? {
                let rows = check_rigid(&matrix).map_err(|message| FormatError::line(&poses.path, line, message))?;
                let (r, t) = rigid(&rows);
                let mut record = record(key);
                record.pose = Some(Pose::camera_from_world(Rotation::Matrix(r), t));
                calibration.records.push(record);
            }
        }
        None => calibration.records.extend(listed.iter().map(|(key, ..)| record(*key))),
    }
    if beside.is_none() {
        calibration.note(
            NoticeCode::MissingFile,
            format!(
                "{other} is missing in the file's folder, so the cameras have no {}",
                if has_poses { "K" } else { "pose" }
            ),
        );
    }
    Ok(calibration)
}
