//! Cameras of head-mounted devices: `cam_model` of BOP 24, `cameras.json` and `camera_models.json` of HOT3D. Sources:
//! hot3d, data_loaders; hand_tracking_toolkit, camera.py and camera_distortion.py.

use glam::DVec3;
use raycam_scene::{ErrorCode, Lens, LensModel, PixelCenter, counted};

use crate::document::{Cursor, yaml};
use crate::intrinsics::{brown_lens, lens_of, pinhole_matrix, refuse_terms};
use crate::rig::on_a_body;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    text.contains("\"projectionModelType\"")
        || text.contains("\"projection_model_type\"") && !text.contains("\"cam_model\"")
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    let single = root.any(&["projectionModelType", "projection_model_type"]).is_some();
    let entries = if single {
        vec![(source.stem().unwrap_or_else(|| "camera".into()), root.clone())]
    } else if root.is_map() {
        root.entries()?.into_iter().map(|(name, at)| (name.to_owned(), at)).collect()
    } else {
        root.list()?.into_iter().enumerate().map(|(i, at)| (i.to_string(), at)).collect()
    };
    for (name, at) in entries {
        if !at.is_map() {
            continue;
        }
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        let model = at.get("calibration").unwrap_or_else(|| at.clone());
        camera_model(&model, &mut record)?;
        let mount = model.any(&["T_device_from_camera", "T_Device_Camera"]);
        if let Some(pose) = at.get("T_world_from_camera") {
            record.pose = Some(self::pose(&pose)?);
        } else if let Some(pose) = mount {
            record.pose = Some(self::pose(&pose)?);
            on_a_body(&mut record, "rig");
        }
        calibration.records.push(record);
    }
    Ok(calibration)
}

/// Reads a pose from a quaternion and a translation.
fn pose(at: &Cursor<'_>) -> Result<Pose> {
    let first_of = |keys: &[&str]| at.any(keys).ok_or_else(|| at.fail(format_args!("{} is missing", keys[0])));
    let turn = first_of(&["quaternion_wxyz", "quaternionWxyz", "qvec"])?;
    let rotation = Rotation::unit_quaternion(turn.array()?).map_err(|message| turn.fail(message))?;
    let t = first_of(&["translation_xyz", "translationXyz", "translation"])?.array()?;
    Ok(Pose::world_from_camera(rotation, DVec3::from_array(t)))
}

/// Reads the size, K and lens of a camera model of hand_tracking_toolkit.
pub(crate) fn camera_model(at: &Cursor<'_>, record: &mut CameraRecord) -> Result<()> {
    let first_of = |keys: &[&str]| at.any(keys).ok_or_else(|| at.fail(format_args!("{} is missing", keys[0])));
    record.size = Some([
        first_of(&["image_width", "imageWidth"])?.count()?,
        first_of(&["image_height", "imageHeight"])?.count()?,
    ]);
    let kind = first_of(&["projection_model_type", "projectionModelType"])?;
    let word = kind.word()?;
    let params = first_of(&["projection_params", "projectionParams"])?;
    let values = params.numbers()?;
    let count =
        |expected: &[usize]| match expected.contains(&values.len()) {
            true => Ok(()),
            false => Err(params
                .fail(format_args!("{}; supported counts for {word}: {expected:?}", counted(values.len(), "number")))),
        };
    let name = word.rsplit('.').next().unwrap_or(word).to_lowercase();
    let (focals, lens) = match &name[..] {
        "fisheye624" | "oculusvisionfisheye624" => {
            count(&[15, 16])?;
            let one = values.len() == 15;
            let focals = if one { [values[0], values[0], values[1], values[2]] } else { first_four(&values) };
            (focals, lens_of(LensModel::RadTanThinPrismFisheye, &values[if one { 3 } else { 4 }..]))
        }
        "fisheye62" | "oculusvisionfisheye62" => {
            count(&[11, 12])?;
            let one = values.len() == 11;
            let focals = if one { [values[0], values[0], values[1], values[2]] } else { first_four(&values) };
            let d = &values[if one { 3 } else { 4 }..];
            // The file's order is k0 k1 k2 k3 p0 p1 k4 k5.
            let d = [d[0], d[1], d[2], d[3], d[6], d[7], d[4], d[5], 0.0, 0.0, 0.0, 0.0];
            (focals, lens_of(LensModel::RadTanThinPrismFisheye, &d))
        }
        "oculusvisionfisheye" | "fisheye" => {
            count(&[8, 12])?;
            let d = &values[4..];
            let p = d.iter().skip(4).copied();
            let made = refuse_terms(["p1", "p2", "p3", "p4"].into_iter().zip(p));
            (first_four(&values), made.and_then(|()| lens_of(LensModel::Fisheye, &d[..4])))
        }
        "pinholeplane" | "pinhole" => {
            count(&[4])?;
            (first_four(&values), Ok(Lens::Pinhole))
        }
        "opencv" => {
            count(&[9])?;
            let d = &values[4..];
            (first_four(&values), brown_lens(d[0], d[1], d[3], d[4], d[2]))
        }
        "rational" => {
            count(&[12])?;
            let d = &values[4..];
            let d = [d[0], d[1], d[3], d[4], d[2], d[5], d[6], d[7]];
            (first_four(&values), lens_of(LensModel::OpenCv, &d))
        }
        _ => {
            return Err(kind.fail_as(
                ErrorCode::UnsupportedFeature,
                format_args!(
                    "unsupported model {word:?}; expected FISHEYE624, OculusVisionFishEye62, PinholePlane, OpenCV or \
                 Rational"
                ),
            ));
        }
    };
    record.k = Some(pinhole_matrix(focals));
    record.lens = lens.map_err(|message| params.fail(message))?;
    Ok(())
}

fn first_four(values: &[f64]) -> [f64; 4] {
    [values[0], values[1], values[2], values[3]]
}
