//! One camera of an OpenCV file: its size, K and pose.

use glam::{DMat3, DQuat, DVec3};
use raycam_scene::PixelCenter;

use crate::document::Cursor;
use crate::opencv::keys::{self, KeyView};
use crate::opencv::lens;
use crate::rig::on_a_body;
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::{FormatError, Result};

/// K, if the camera has one.
pub(super) fn k(view: &KeyView<'_>) -> Result<Option<DMat3>> {
    let skew = view.find_value(&keys::SKEW)?.map(|at| Ok::<_, FormatError>((at.number()?, at))).transpose()?;
    if let Some(at) = view.find_value(&keys::K)? {
        let k = matrix(&at)?;
        return match skew {
            Some((skew, at)) if skew != 0.0 && skew != k.y_axis.x => {
                Err(at.fail(format_args!("{skew}, and K[0, 1] is {}: expected the same", k.y_axis.x)))
            }
            _ => Ok(Some(k)),
        };
    }
    let focals = keys::FOCALS.map(|key| view.find_value(&[key]));
    let [Some(fx), Some(fy), Some(cx), Some(cy)] = focals.map(|at| at.ok().flatten()) else { return Ok(None) };
    let mut k = upper([fx.number()?, fy.number()?, cx.number()?, cy.number()?]);
    k.y_axis.x = skew.map_or(0.0, |(skew, _)| skew);
    Ok(Some(k))
}

fn upper([fx, fy, cx, cy]: [f64; 4]) -> DMat3 {
    DMat3::from_cols(DVec3::new(fx, 0.0, 0.0), DVec3::new(0.0, fy, 0.0), DVec3::new(cx, cy, 1.0))
}

fn matrix(at: &Cursor<'_>) -> Result<DMat3> {
    if let Ok(four) = at.array::<4>() {
        return Ok(upper(four));
    }
    let k = at.matrix3()?;
    if k.z_axis.truncate() == glam::DVec2::ZERO && k.row(2).truncate() != glam::DVec2::ZERO && k.z_axis.z == 1.0 {
        return Err(at.fail("cx and cy are in the last row: the matrix is transposed, as MATLAB has it; expected K"));
    }
    if k.z_axis.z == 1.0 && k.x_axis.x.abs() < 10.0 && k.z_axis.x.abs() < 2.0 && k.z_axis.y.abs() < 2.0 {
        return Err(at.fail(
            "K is in units of the picture's size: expected pixels; multiply the first row by the width and the second \
             by the height",
        ));
    }
    Ok(k)
}

/// Columns and rows by their names, in a map.
fn sides(at: &Cursor<'_>) -> Result<Vec<f64>> {
    let view = KeyView { at: at.clone(), side: &[] };
    match (view.find_value(&keys::WIDTH)?, view.find_value(&keys::HEIGHT)?) {
        (Some(width), Some(height)) => Ok(vec![width.number()?, height.number()?]),
        _ => Err(at.fail("expected width and height")),
    }
}

/// Columns and rows.
pub(super) fn size(view: &KeyView<'_>) -> Result<Option<[u32; 2]>> {
    let (pair, shape) = (view.find_value(&keys::SIZE)?, view.find_value(&keys::SHAPE)?);
    if let Some(at) = pair.as_ref().or(shape.as_ref()) {
        let mut numbers = match keys::is_keyed(at) {
            true => sides(at)?,
            false => match at.word() {
                // As one word, 640x480.
                Ok(word) => {
                    let parts = word.split(['x', 'X', '*', ',', ' ']).filter(|part| !part.is_empty());
                    let numbers: Option<Vec<f64>> = parts.map(|part| part.parse().ok()).collect();
                    numbers.ok_or_else(|| at.fail(format_args!("{word:?}: expected columns and rows")))?
                }
                Err(_) => at.numbers()?,
            },
        };
        if pair.is_none() && !keys::is_keyed(at) {
            // The third number of a shape is that of the colours.
            numbers.truncate(2);
            numbers.reverse();
        }
        let whole = |v: &f64| v.fract() == 0.0 && (1.0..65537.0).contains(v);
        let [width, height] = numbers[..] else {
            return Err(at.fail(format_args!("{} numbers, expected columns and rows", numbers.len())));
        };
        if !(whole(&width) && whole(&height)) {
            return Err(at.fail("expected columns and rows"));
        }
        if let Ok(Some(k)) = k(view) {
            let middle = |width: f64, height: f64| {
                let near = |c: f64, side: f64| (c / side - 0.5).abs() < 0.15;
                near(k.z_axis.x, width) && near(k.z_axis.y, height)
            };
            if !middle(width, height) && middle(height, width) {
                return Err(at.fail(format_args!(
                    "{width} x {height} with the principal point ({}, {}): are they rows and columns? Expected width, \
                     then height",
                    k.z_axis.x, k.z_axis.y
                )));
            }
        }
        return Ok(Some([width as u32, height as u32]));
    }
    match (view.find_value(&keys::WIDTH)?, view.find_value(&keys::HEIGHT)?) {
        (Some(width), Some(height)) => Ok(Some([width.count()?, height.count()?])),
        _ => Ok(None),
    }
}

/// R and t of a pair of keys, camera from world.
pub(super) fn pose(view: &KeyView<'_>) -> Result<Option<Pose>> {
    for (r, t) in [(&keys::R[..], &keys::T[..]), (&keys::RVEC, &keys::TVEC)] {
        let (Some(r), Some(t)) = (view.find_value(r)?, view.find_value(t)?) else { continue };
        let t = DVec3::from_array(t.array::<3>()?);
        let r = match r.numbers()?.len() {
            3 => from_vector(r.array::<3>()?),
            _ => r.matrix3()?,
        };
        return Ok(Some(Pose::camera_from_world(Rotation::Matrix(r), t)));
    }
    Ok(None)
}

fn from_vector(v: [f64; 3]) -> DMat3 {
    DMat3::from_quat(DQuat::from_scaled_axis(DVec3::from_array(v)))
}

/// The poses of the views of a board.
fn views(view: &KeyView<'_>) -> Result<Option<Vec<Pose>>> {
    let pose = |r: &[f64], t: &[f64]| {
        let r = from_vector([r[0], r[1], r[2]]);
        Pose::camera_from_world(Rotation::Matrix(r), DVec3::new(t[0], t[1], t[2]))
    };
    if let Some(at) = view.find_value(&keys::VIEWS)? {
        let numbers = at.numbers()?;
        if numbers.len() % 6 != 0 || numbers.is_empty() {
            return Err(at.fail("expected a rotation vector and a translation for each view, six numbers"));
        }
        return Ok(Some(numbers.chunks_exact(6).map(|six| pose(&six[..3], &six[3..])).collect()));
    }
    let (Some(r), Some(t)) = (view.find_value(&keys::RVECS)?, view.find_value(&keys::TVECS)?) else {
        return Ok(None);
    };
    let (rs, ts) = (r.numbers()?, t.numbers()?);
    if rs.len() != ts.len() || rs.len() % 3 != 0 || rs.is_empty() {
        return Err(t.fail(format_args!(
            "{} numbers, and {} has {}: expected three of each for every view",
            ts.len(),
            r.key,
            rs.len()
        )));
    }
    Ok(Some(rs.chunks_exact(3).zip(ts.chunks_exact(3)).map(|(r, t)| pose(r, t)).collect()))
}

/// The camera of a view; several where it has several poses of the board.
pub(super) fn read(view: &KeyView<'_>, name: String, hints: &ReadHints, calibration: &mut Calibration) -> Result<()> {
    let at = &view.at;
    let mut record = CameraRecord::new(name, PixelCenter::Integer);
    record.k = Some(k(view)?.ok_or_else(|| at.fail("no camera matrix: expected K or camera_matrix"))?);
    record.size = size(view)?;
    record.time = view.find_value(&["time"])?.map(|at| at.number()).transpose()?;
    record.lens = lens::read(view, hints)?;
    record.pose = pose(view)?;
    if record.pose.is_none()
        && let Some(matrix) = view.find_value(&["tbs"])?
    {
        // The body's axes are the world's; the matrix brings points of the sensor to the body.
        let (r, c) = matrix.matrix4()?;
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), c));
        on_a_body(&mut record, "rig");
    }
    if record.pose.is_none()
        && let Some(poses) = views(view)?
    {
        for (i, pose) in poses.into_iter().enumerate() {
            let name = format!("view{i}");
            calibration.records.push(CameraRecord { name, pose: Some(pose), ..record.clone() });
        }
        return Ok(());
    }
    calibration.records.push(record);
    Ok(())
}
