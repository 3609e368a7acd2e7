use std::path::Path;

use glam::{DMat3, DVec3};
use raycam_calibration::{
    CameraRecord, Pose, PoseHints, ReadHints, RigMount, Rotation, decode, read, write, written_formats,
};
use raycam_formats::{Budget, FormatError};
use raycam_scene::{Lens, LensModel, PixelCenter};

use crate::support::folder;

/// A camera that every format can store: its name is valid as a number of seconds, an image id and a file name.
fn record() -> CameraRecord {
    let k = DMat3::from_cols(DVec3::new(500.1, 0.0, 0.0), DVec3::new(0.0, 500.1, 0.0), DVec3::new(319.5, 239.5, 1.0));
    let mut record = CameraRecord::new("7", PixelCenter::Integer);
    (record.size, record.k) = (Some([640, 480]), Some(k));
    let rotation = Rotation::Quaternion([0.5, 0.1, -0.7, 0.2]);
    let t = DVec3::new(0.1, -2.3, 4.7);
    record.pose = Some(Pose::camera_from_world(rotation, t));
    record
}

/// Writes the records to a new folder and reads them back; values that the format does not store are passed to the
/// reader.
fn again(records: &[CameraRecord], format: &str) -> Vec<CameraRecord> {
    let path = folder().join("out");
    let written = write(records, &path, format).unwrap_or_else(|error| panic!("{format}: {error}"));
    for (name, bytes) in &written.files {
        if name.is_empty() {
            std::fs::write(&path, bytes).unwrap();
        } else {
            std::fs::create_dir_all(&path).unwrap();
            std::fs::write(path.join(name), bytes).unwrap();
        }
    }
    // The intrinsics have no pose, because their pose would be interpreted as the camera's mount on a body.
    let mut intrinsics = record();
    intrinsics.pose = None;
    let known =
        ReadHints { size: Some([640, 480]), intrinsics: Some(intrinsics), lens: None, poses: PoseHints::default() };
    let back = read(&path, Some(format), &known, &Budget::default());
    back.unwrap_or_else(|error| panic!("{format}: {error}")).records
}

#[test]
fn every_format_reads_back_its_cameras_and_keeps_every_bit_on_rewriting() {
    for format in written_formats() {
        let once = again(&[record()], format);
        let (camera, expected) = (once[0].camera().unwrap(), record().camera().unwrap());
        let shift = camera.pixel_center().offset() - expected.pixel_center().offset();
        let point = DVec3::new(0.3, 1.2, 3.4);
        // Poses are not compared for these formats, because they store no pose.
        if !["ros", "orb-slam", "camodocal", "tum-intrinsics"].contains(&format) {
            let off = camera.project(point).0 - shift - expected.project(point).0;
            assert!(off.length() < 1e-9, "{format}: {off}");
        }
        let twice = again(&once, format);
        let (a, b) = (twice[0].camera().unwrap(), camera);
        assert_eq!((a.k(), a.r(), a.c()), (b.k(), b.r(), b.c()), "{format}");
    }
}

#[test]
fn errors_name_the_lens_model_that_a_format_cannot_store() {
    let mut bent = record();
    bent.lens = Lens::new(LensModel::DoubleSphere, &[0.1, 0.6]).unwrap();
    for format in ["colmap", "colmap-binary", "ros", "nerf", "blender", "bop", "opencv", "kitti"] {
        let error = write(&[bent.clone()], Path::new("out"), format).unwrap_err();
        assert!(matches!(error, FormatError::Encode(_)), "{format}: {error}");
        assert!(error.to_string().contains("ds") || error.to_string().contains("lens"), "{error}");
    }
    assert_eq!(again(&[bent.clone()], "kalibr")[0].lens, bent.lens);
}

#[test]
fn damaged_files_are_refused_without_a_panic() {
    for format in written_formats().filter(|format| !format.starts_with("colmap")) {
        let written = write(&[record()], Path::new("out"), format).unwrap();
        let bytes = &written.files[0].1;
        let known =
            ReadHints { size: Some([640, 480]), intrinsics: Some(record()), lens: None, poses: PoseHints::default() };
        let name = Path::new("out");
        let read = |bytes: Vec<u8>| decode(bytes, name, Some(format), &known, &Budget::default());
        read(bytes.clone()).unwrap();
        for length in 0..bytes.len() {
            let _ = read(bytes[..length].to_vec());
        }
        for at in 0..bytes.len() {
            for bit in [0, 3, 6] {
                let mut damaged = bytes.clone();
                damaged[at] ^= 1 << bit;
                let _ = read(damaged);
            }
        }
        assert!(read(vec![]).is_err(), "{format}");
    }
}

/// OpenVINS writes the transform between camera and body in the opposite direction, and no transform from camera to
/// camera.
#[test]
fn camchain_poses_are_read_in_either_direction() {
    let chain = |key: &str, poses: [(DMat3, DVec3); 2]| {
        let cameras = poses.iter().enumerate().map(|(i, (r, t))| {
            let rows: String = (0..3)
                .map(|row| {
                    let [x, y, z] = r.row(row).to_array();
                    format!("  - [{x:?}, {y:?}, {z:?}, {:?}]\n", t[row])
                })
                .collect();
            format!(
                "cam{i}:\n  {key}:\n{rows}  - [0.0, 0.0, 0.0, 1.0]\n  camera_model: pinhole\n  \
                 intrinsics: [500.0, 501.0, 320.5, 240.25]\n  resolution: [640, 480]\n"
            )
        });
        let text: String = cameras.collect();
        let (path, known) = (Path::new("chain.yaml"), ReadHints::default());
        let read = decode(text.into(), path, Some("kalibr"), &known, &Budget::default());
        let records = read.unwrap().records;
        [0, 1].map(|i| records[i].camera().unwrap())
    };
    let r = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
    let (first, second) = (DVec3::new(0.1, -0.2, 0.3), DVec3::new(-0.4, 0.5, 1.0));
    let forth = chain("T_cam_imu", [(r, first), (r.transpose(), second)]);
    let back = chain("T_imu_cam", [(r.transpose(), -(r.transpose() * first)), (r, -(r * second))]);
    let point = DVec3::new(0.3, 1.2, 6.0);
    for (a, b) in forth.iter().zip(&back) {
        assert!((a.project(point).0 - b.project(point).0).length() < 1e-9);
    }
    assert!((forth[0].c() - forth[1].c()).length() > 0.1);
}

#[test]
fn errors_name_file_line_and_key() {
    let text = b"image_width: 640\nimage_height: 480\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, x]\n";
    let error = decode(text.to_vec(), Path::new("a.yaml"), Some("ros"), &ReadHints::default(), &Budget::default());
    let error = error.unwrap_err().to_string();
    assert!(error.starts_with("a.yaml:6: camera_matrix.data[2]: \"x\""), "{error}");
    // If one line is invalid, no format recognises the file; if the format is specified, the error names the line.
    let told = |format| {
        let poses = b"0.0 1 2 3 0 0 0 1\n0.1 1 2 x 0 0 0 1\n".to_vec();
        let (path, known) = (Path::new("a.tum"), ReadHints::default());
        let error = decode(poses, path, format, &known, &Budget::default());
        error.unwrap_err().to_string()
    };
    assert!(told(None).contains("--camera-format"), "{}", told(None));
    assert!(told(Some("tum")).starts_with("a.tum:2: \"x\""));
}

/// Each of many keys is read in constant time; if the reading time grew with the square of their number, this test
/// would take minutes.
#[test]
fn reading_many_keys_is_fast() {
    let keys = |line: &dyn Fn(usize) -> String| (0..100_000).map(line).collect::<String>();
    for (format, text) in [
        ("kitti", keys(&|i| format!("a{i}:\n"))),
        ("bop", keys(&|i| format!("a{i}: 1\n"))),
        ("opencv", format!("<opencv_storage>{}</opencv_storage>", keys(&|i| format!("<a{i}/>")))),
    ] {
        let path = Path::new("many");
        let read = decode(text.into_bytes(), path, Some(format), &ReadHints::default(), &Budget::default());
        assert!(read.is_err(), "{format}");
    }
}

/// The keys of the enclosing map are searched once, not once for each camera, which would take more than two minutes.
#[test]
fn reading_many_cameras_in_maps_is_fast() {
    let camera = |i| format!("cam{i}: {{K: [500, 0, 320, 0, 500, 240, 0, 0, 1], size: [640, 480]}}\n");
    let text = (0..8_000).map(camera).collect::<String>();
    let start = std::time::Instant::now();
    let read = decode(text.into_bytes(), Path::new("a.yaml"), None, &ReadHints::default(), &Budget::default()).unwrap();
    assert_eq!(read.records.len(), 8_000);
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
}

#[test]
fn mounts_written_to_a_camchain_are_read_back() {
    let cameras: Vec<CameraRecord> = [0.0, 0.2]
        .iter()
        .enumerate()
        .map(|(i, x)| {
            let mut camera = record();
            camera.name = format!("cam{i}");
            let pose = Pose::camera_from_world(Rotation::Quaternion([1.0, 0.0, 0.0, 0.0]), DVec3::new(*x, 0.0, 0.0));
            let (name, body) = (camera.name.clone(), Pose::identity());
            camera.pose = Some(pose.clone());
            camera.mount = Some(RigMount { rig: "rig".into(), frame: "rig".into(), name, camera: pose, body });
            camera
        })
        .collect();
    let read = again(&cameras, "kalibr");
    let step = read[1].camera().unwrap().c() - read[0].camera().unwrap().c();
    assert_eq!(step, DVec3::new(-0.2, 0.0, 0.0));
    let rigs: Vec<&str> = read.iter().map(|camera| camera.mount.as_ref().unwrap().rig.as_str()).collect();
    assert_eq!(rigs[0], rigs[1]);
}
