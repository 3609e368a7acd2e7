//! Open3D's JSON: a trajectory, one set of parameters (a saved view), K alone, or a pose graph. Matrices are by
//! columns, `extrinsic` is camera_from_world, a node's `pose` world_from_camera. Source: Open3D, IJsonConvertible.cpp,
//! PinholeCameraParameters.cpp, PoseGraph.cpp and the reconstruction system's integrate_scene.py.

use glam::{DMat3, DVec3};
use raycam_scene::{NoticeCode, PixelCenter};

use crate::document::{Cursor, check_rigid, rigid, yaml};
use crate::{Calibration, CameraRecord, Pose, ReadHints, Rotation};
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

pub(crate) fn detect(_: &InputFile, text: &str) -> bool {
    let named = text.contains("\"PinholeCamera") || text.contains("\"PoseGraph\"");
    if named && text.contains("class_name") {
        return true;
    }
    // Intrinsics of the reconstruction system contain the image size, and K as nine consecutive numbers.
    let own = ["\"width\"", "\"height\"", "\"intrinsic_matrix\""];
    // The Azure Kinect's recorder adds keys about the recording.
    let azure = text.contains("\"stream_length_usec\"") || text.contains("\"serial_number");
    own.iter().all(|key| text.contains(key))
        && text.matches('[').count() == 1
        && (azure || text.matches(':').count() == 3)
}

pub(crate) fn read(source: &InputFile, _: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    let node = yaml::parse(source.text()?, &source.path)?;
    let root = Cursor::root(&node, &source.path);
    let mut calibration = Calibration::default();
    let stem = source.stem().unwrap_or_else(|| "camera".into());
    if let Some(nodes) = root.get("nodes") {
        pose_graph(&root, &nodes, &mut calibration)?;
    } else if let Some(all) = root.get("parameters") {
        calibration.notices.extend(root.unknown_keys(&[
            "class_name",
            "parameters",
            "version_major",
            "version_minor",
        ])?);
        for (i, at) in all.list()?.into_iter().enumerate() {
            calibration.records.push(parameters(&at, format!("{i:06}"))?);
        }
    } else if root.get("intrinsic").is_some() {
        calibration.records.push(parameters(&root, stem)?);
    } else {
        let mut record = CameraRecord::new(stem, PixelCenter::Integer);
        intrinsics(&root, &mut record)?;
        calibration.records.push(record);
    }
    Ok(calibration)
}

/// Reads the poses of a graph's nodes.
fn pose_graph(root: &Cursor<'_>, nodes: &Cursor<'_>, calibration: &mut Calibration) -> Result<()> {
    root.unread_keys(|key| matches!(key, "class_name" | "nodes" | "edges" | "version_major" | "version_minor"))?;
    for (i, node) in nodes.list()?.into_iter().enumerate() {
        let mut record = CameraRecord::new(format!("{i:06}"), PixelCenter::Integer);
        let (r, c) = matrix_by_columns(&node.require("pose")?, "world_from_camera")?;
        record.pose = Some(Pose::world_from_camera(Rotation::Matrix(r), c));
        calibration.records.push(record);
    }
    calibration.note(
        NoticeCode::AssumedConvention,
        "the poses of the graph's nodes are interpreted as world_from_camera, as in Open3D's reconstruction system; \
         its edges are ignored",
    );
    Ok(())
}

/// Reads the rotation and the translation of a 4x4 matrix that is stored by columns.
fn matrix_by_columns(at: &Cursor<'_>, direction: &str) -> Result<(DMat3, DVec3)> {
    let columns = at.array::<16>()?;
    let rows = std::array::from_fn(|i| columns[4 * (i % 4) + i / 4]);
    let rows = check_rigid(&rows).map_err(|message| {
        at.fail(format_args!("the matrix, read by columns as in Open3D, is not a valid pose ({direction}): {message}"))
    })?;
    Ok(rigid(&rows))
}

fn parameters(at: &Cursor<'_>, name: String) -> Result<CameraRecord> {
    let mut record = CameraRecord::new(name, PixelCenter::Integer);
    at.unknown_keys(&["class_name", "intrinsic", "extrinsic", "version_major", "version_minor"])?;
    intrinsics(&at.require("intrinsic")?, &mut record)?;
    let (r, t) = matrix_by_columns(&at.require("extrinsic")?, "camera_from_world")?;
    record.pose = Some(Pose::camera_from_world(Rotation::Matrix(r), t));
    Ok(record)
}

fn intrinsics(at: &Cursor<'_>, record: &mut CameraRecord) -> Result<()> {
    at.unknown_keys(&["class_name", "width", "height", "intrinsic_matrix", "version_major", "version_minor"])?;
    let matrix = at.require("intrinsic_matrix")?;
    let k = DMat3::from_cols_array(&matrix.array::<9>()?);
    if k.row(2) != DVec3::Z {
        let given = k.to_cols_array();
        return Err(
            matrix.fail(format_args!("{given:?}; expected K by columns, as in Open3D: fx 0 0 skew fy 0 cx cy 1"))
        );
    }
    record.k = Some(k);
    record.size = Some([at.require("width")?.count()?, at.require("height")?.count()?]);
    Ok(())
}
