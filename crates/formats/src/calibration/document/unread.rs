//! Formats that are recognised and not read, each with the way on.

/// The name of a format, marks of which all are in its files, and the way on.
const UNREAD: [(&str, &[&str], &str); 12] = [
    ("Metashape", &["<document", "<chunk"], "export COLMAP from it (File, Export, Export Cameras)"),
    ("ORB-SLAM", &["Camera.fx"], "copy fx fy cx cy k1 k2 p1 p2 into Camera.from_opencv"),
    ("ORB-SLAM", &["Camera1.fx"], "copy fx fy cx cy k1 k2 p1 p2 into Camera.from_opencv"),
    ("camodocal (VINS, KITTI-360)", &["model_type"], "copy its parameters into Camera, PINHOLE as opencv, MEI as omni"),
    ("VINS", &["body_T_cam0"], "read the file of each camera, and give the mounts with Rig"),
    ("Basalt", &["value0", "T_imu_cam"], "copy ds, eucm or kb4 into Camera with model ds, eucm or fisheye"),
    ("mrcal", &["lensmodel", "imagersize"], "write it with mrcal-to-kalibr, or copy OPENCV4 to OPENCV12 into Camera"),
    ("OpenSfM", &["\"shots\"", "\"cameras\""], "export COLMAP from it (bin/opensfm export_colmap)"),
    ("openMVG", &["sfm_data_version"], "export COLMAP from it (openMVG_main_openMVG2Colmap)"),
    (
        "Meshroom (AliceVision)",
        &["\"intrinsics\"", "\"views\"", "\"version\""],
        "export COLMAP from it (aliceVision_exportColmap)",
    ),
    ("Open3D", &["PinholeCamera"], "give intrinsic_matrix, by columns, and extrinsic to Camera.from_transform"),
    ("Bundler", &["# Bundle file"], "import it in COLMAP or convert it, then read that"),
];

/// The name of the format of a text and the way on, if it is one of those that are known and not read.
pub(crate) fn name_of(text: &str) -> Option<(&'static str, &'static str)> {
    let (name, _, way) = UNREAD.iter().find(|(_, marks, _)| marks.iter().all(|mark| text.contains(mark)))?;
    Some((name, way))
}
