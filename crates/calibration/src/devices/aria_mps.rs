//! Aria's machine perception services: `closed_loop_trajectory.csv`, `open_loop_trajectory.csv` (world_from_device) and
//! `online_calibration.jsonl` (cameras in the axes of the device). Source: Project Aria's documentation, "MPS data
//! formats".

use glam::DVec3;
use raycam_scene::{LensModel, NoticeCode, PixelCenter, counted};

use crate::document::{Cursor, yaml};
use crate::intrinsics::{lens_of, pinhole_matrix};
use crate::rig::on_a_body;
use crate::trajectory::body::place_on_body;
use crate::trajectory::named_columns::{self, columns_of};
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    let header = text.lines().next().unwrap_or_default();
    header.contains("tracking_timestamp_us") && header.contains("_device")
        || text.contains("\"CameraCalibrations\"") && text.contains("\"T_Device_Camera\"")
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    let text = source.text()?;
    if text.trim_start().starts_with('{') {
        return calibrations(source, text);
    }
    let columns = columns_of(text).ok_or_else(|| {
        FormatError::line(&source.path, 1, "expected a header with the columns tx_world_device, qx_world_device, ...")
    })?;
    let mut columns = columns.map_err(|message| FormatError::line(&source.path, 1, message))?;
    columns.unread.clear();
    let mut calibration = named_columns::read(text, &source.path, &columns)?;
    place_on_body(&mut calibration, hints, "the device");
    Ok(calibration)
}

/// Reads the cameras of the first line, which are mounted on the device.
fn calibrations(source: &InputFile, text: &str) -> Result<Calibration> {
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let first = lines.next().unwrap_or_default();
    // If the first line is not complete JSON, the file contains a single value on several lines.
    let (body, further) = if first.trim_end().ends_with('}') { (first, lines.count()) } else { (text, 0) };
    let node = yaml::parse(body, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    for at in root.require("CameraCalibrations")?.list()? {
        let mut record = CameraRecord::new(at.require("Label")?.word()?, PixelCenter::Integer);
        let projection = at.require("Projection")?;
        let name = projection.require("Name")?;
        let params = projection.require("Params")?;
        let values = params.numbers()?;
        let (focals, lens) = match (name.word()?, &values[..]) {
            ("FisheyeRadTanThinPrism", [f, cx, cy, rest @ ..]) if rest.len() == 12 => {
                ([*f, *f, *cx, *cy], lens_of(LensModel::RadTanThinPrismFisheye, rest))
            }
            ("FisheyeRadTanThinPrism", [fx, fy, cx, cy, rest @ ..]) if rest.len() == 12 => {
                ([*fx, *fy, *cx, *cy], lens_of(LensModel::RadTanThinPrismFisheye, rest))
            }
            ("KannalaBrandtK3" | "KannalaBrandt", [fx, fy, cx, cy, rest @ ..]) if rest.len() == 4 => {
                ([*fx, *fy, *cx, *cy], lens_of(LensModel::Fisheye, rest))
            }
            ("Linear", [fx, fy, cx, cy]) => ([*fx, *fy, *cx, *cy], Ok(raycam_scene::Lens::Pinhole)),
            ("Linear", [f, cx, cy]) => ([*f, *f, *cx, *cy], Ok(raycam_scene::Lens::Pinhole)),
            (word, _) => {
                return Err(name.fail(format_args!(
                    "{word:?} with {}; expected FisheyeRadTanThinPrism (15), KannalaBrandtK3 (8) or Linear (3)",
                    counted(values.len(), "parameter")
                )));
            }
        };
        record.k = Some(pinhole_matrix(focals));
        record.lens = lens.map_err(|message| params.fail(message))?;
        if let Some(size) = at.any(&["ImageSize", "Resolution"]) {
            record.size = Some(size.array::<2>()?.map(|side| side as u32));
        }
        let mount = at.require("T_Device_Camera")?;
        let (turn, t) = (mount.require("UnitQuaternion")?, mount.require("Translation")?);
        // The quaternion is stored as w and a list of x, y, z.
        let rotation = Rotation::unit_quaternion(turn.array()?).map_err(|message| turn.fail(message))?;
        record.pose = Some(Pose::world_from_camera(rotation, DVec3::from_array(t.array()?)));
        on_a_body(&mut record, "device");
        calibration.records.push(record);
    }
    if further > 0 {
        calibration.note(
            NoticeCode::FirstOnly,
            format!("only the calibration of the first line is used; {} ignored", counted(further, "further line")),
        );
    }
    calibration.note(NoticeCode::PlacedCameras, "camera poses are relative to the device");
    Ok(calibration)
}
