//! Trajectories of Redwood and Open3D, `.log`: a line of three numbers, then world_from_camera in four lines. Source:
//! Open3D, FileLOG.cpp.

use raycam_scene::{NoticeCode, PixelCenter, counted};

use crate::document::number_lines::data_lines;
use crate::document::number_text::words;
use crate::document::rigid;
use crate::trajectory::matrices::checked;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    let mut lines = data_lines(text).take(5);
    [3, 4, 4, 4, 4].into_iter().all(|count| {
        let line = lines.next().map(|(_, line)| line);
        line.is_some_and(|line| words(line).count() == count && words(line).all(|word| word.parse::<f64>().is_ok()))
    }) && data_lines(text).nth(4).is_some_and(|(_, line)| {
        // The last row distinguishes these files from bundle adjustment problems (BAL), whose lines have as many
        // numbers.
        words(line).filter_map(|word| word.parse::<f64>().ok()).eq([0.0, 0.0, 0.0, 1.0])
    })
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let path = &source.path;
    let lines: Vec<(usize, &str)> = data_lines(source.text()?).collect();
    let mut calibration = Calibration::default();
    let mut lost = 0;
    for (i, block) in lines.chunks(5).enumerate() {
        let (line, head) = block[0];
        let fail = |message: String| FormatError::line(path, line, message);
        if words(head).count() != 3 || block.len() != 5 {
            return Err(fail(format!("{head:?}; expected a line of three numbers, then four lines of four")));
        }
        let values: Option<Vec<f64>> =
            block[1..].iter().flat_map(|(_, row)| words(row)).map(|word| word.parse().ok()).collect();
        let matrix = values.and_then(|values| <[f64; 16]>::try_from(values).ok());
        let matrix = matrix.ok_or_else(|| fail("expected four lines of four numbers after this line".into()))?;
        let Some(rows) = checked(matrix).map_err(fail)? else {
            lost += 1;
            continue;
        };
        let mut record = CameraRecord::new(format!("{i:06}"), PixelCenter::Integer);
        let (r, c) = rigid(&rows);
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), c));
        calibration.records.push(record);
    }
    if lost > 0 {
        calibration.note(
            NoticeCode::IgnoredElement,
            format!("{} omitted: numbers that are not finite (lost frames)", counted(lost, "pose")),
        );
    }
    Ok(calibration)
}
