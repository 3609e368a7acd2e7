//! Ground truth of EuRoC and TUM-VI, `data.csv`: nanoseconds, position, and quaternion w x y z of world_from_body,
//! separated by commas. Sources: Burri et al., "The EuRoC micro aerial vehicle datasets", 2016; evo's
//! file_interface.py.

use std::fmt::Write as _;
use std::path::Path;

use glam::DVec3;
use raycam_scene::{Notice, NoticeCode, PixelCenter, counted};

use crate::document::number_format::joined;
use crate::document::number_lines::data_lines;
use crate::document::{check_rotation, rigid};
use crate::pose::normalized;
use crate::trajectory::body::place_on_body;
use crate::trajectory::named_columns::{self, columns_of};
use crate::{Calibration, CameraRecord, OutputFiles, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// True if the header has EuRoC's own column names; the times in such a file are in nanoseconds.
fn has_own_names(text: &str) -> bool {
    text.lines().take(8).any(|line| line.contains("q_RS_w"))
}

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    let first = data_lines(text).next().map(|(_, line)| line.split(',').map(str::trim).collect::<Vec<_>>());
    first.is_some_and(|words| {
        let stamp = (words[0].len() >= 15 || has_own_names(text)) && words[0].bytes().all(|b| b.is_ascii_digit());
        stamp && words.len() >= 4 && words[1..].iter().all(|word| word.is_empty() || word.parse::<f64>().is_ok())
    })
}

/// True for the 12 numbers of a pose's 3x4 matrix.
fn is_matrix_row(words: &[&str]) -> bool {
    let numbers: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
    numbers.is_some_and(|rows| rows.first_chunk::<12>().is_some_and(|rows| check_rotation(rigid(rows).0).is_ok()))
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let path = &source.path;
    let text = source.text()?;
    if let Some(named) = columns_of(text) {
        let mut named = named.map_err(|message| FormatError::whole(path, message))?;
        // The unread columns are the velocities and biases in EuRoC's ground truth, which need no notice.
        if named.unread.first().is_some_and(|column| column.starts_with("v_rs_r_x")) {
            named.unread.clear();
        }
        if has_own_names(text) {
            named = named.with_time_unit(1e-9);
        }
        let mut calibration = named_columns::read(text, path, &named)?;
        place_on_body(&mut calibration, hints, "the body (IMU or markers)");
        return Ok(calibration);
    }
    let own_columns = [8, 17].contains(&data_lines(text).next().map_or(8, |(_, row)| row.split(',').count()));
    // Files of 4Seasons contain frame id, position, quaternion x y z w, scale and quality.
    let four_seasons = source.stem().is_some_and(|stem| stem.starts_with("GNSSPoses"));
    let mut calibration = Calibration::default();
    let mut columns = None;
    for (line, row) in data_lines(text) {
        let fail = |message: String| FormatError::line(path, line, message);
        let words: Vec<&str> = row.split(',').map(str::trim).collect();
        if words.len() < 8 {
            return Err(fail(format!(
                "the row has {}, which is not a pose (leica0 contains positions without orientations); expected \
                 nanoseconds, x y z, and w x y z of a quaternion (state_groundtruth_estimate0, mocap0)",
                counted(words.len(), "column")
            )));
        }
        if words.len() == 13 && is_matrix_row(&words[1..]) {
            return Err(fail(
                "a time and the 12 numbers of a 3x4 matrix; remove the time column, and load the file as a trajectory of \
                 KITTI (format=\"kitti-poses\", --camera-format kitti-poses), or add 0 0 0 1 to each row"
                    .into(),
            ));
        }
        if !own_columns && !four_seasons {
            return Err(fail(format!(
                "{} columns without a header; EuRoC has 8 or 17 columns, with the quaternion's w first. Add a header \
                 that names the columns (#timestamp,tx,ty,tz,qx,qy,qz,qw,...)",
                words.len()
            )));
        }
        let expected = *columns.get_or_insert(words.len());
        if words.len() != expected {
            return Err(fail(format!(
                "{} columns, but the previous rows have {expected}; the file may be truncated",
                words.len()
            )));
        }
        let stamp: u64 = words[0].parse().map_err(|_| fail(format!("{:?}; expected whole nanoseconds", words[0])))?;
        let values: Option<Vec<f64>> =
            words[1..8].iter().map(|word| word.parse().ok().filter(|value: &f64| value.is_finite())).collect();
        let [x, y, z, qw, qx, qy, qz] = values
            .and_then(|values| <[f64; 7]>::try_from(values).ok())
            .ok_or_else(|| fail(format!("{}; expected finite numbers", words[1..8].join(", "))))?;
        let (quaternion, order) = match four_seasons {
            // 4Seasons has the order x y z w.
            true => ([qz, qw, qx, qy], "w last"),
            false => ([qw, qx, qy, qz], "w first"),
        };
        let rotation = Rotation::unit_quaternion(quaternion)
            .map_err(|message| fail(format!("columns 5 to 8, {order}: {message}")))?;
        let mut record = CameraRecord::new(words[0], PixelCenter::Integer);
        // Whole seconds and the fraction are converted separately, so that fewer digits are lost.
        record.time = Some((stamp / 1_000_000_000) as f64 + (stamp % 1_000_000_000) as f64 / 1e9);
        record.pose = Some(Pose::world_from_camera(rotation, DVec3::new(x, y, z)));
        calibration.records.push(record);
    }
    place_on_body(&mut calibration, hints, "the body (IMU or markers)");
    Ok(calibration)
}

pub(crate) fn write(records: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    let mut text = String::from(
        "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n",
    );
    for record in records {
        let whole = record.name.parse::<u64>().ok().filter(|_| record.name.len() >= 15);
        let time = record.time.or_else(|| record.name.parse().ok().filter(|time: &f64| time.is_finite()));
        let stamp = match (whole, time) {
            (Some(stamp), _) => stamp,
            (None, Some(time)) if (0.0..1.8e10).contains(&time) => {
                let seconds = time.floor();
                seconds as u64 * 1_000_000_000 + ((time - seconds) * 1e9).round() as u64
            }
            _ => {
                return Err(FormatError::encode(format!(
                    "camera {:?} has no time, which EuRoC's csv requires; set its time in seconds, from 0",
                    record.name
                )));
            }
        };
        let (rotation, c) = record.require_pose()?.world_r_c();
        let _ = writeln!(
            text,
            "{stamp:019},{},{}",
            joined(&c.to_array(), ","),
            joined(&normalized(rotation.quaternion()), ",")
        );
    }
    let notice = "EuRoC's csv stores times and poses, here those of the cameras; size, K and lens are not written. \
        Readers interpret the poses as those of the body, with an identity T_BS";
    Ok(OutputFiles { notices: vec![Notice::new(NoticeCode::NotWritten, notice)], ..OutputFiles::one(text) })
}
