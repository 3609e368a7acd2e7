//! Formats that are recognised and not read, each with the way on.

/// The name of a format, marks of which all are in its files, and the way on.
const UNREAD: [(&str, &[&str], &str); 11] = [
    ("a ScanNet scene", &["axisAlignment", "colorWidth"], "open the folder with pose/ and intrinsic/"),
    (
        "Azure Kinect's raw calibration",
        &["CalibrationInformation", "ModelParameters"],
        "write K and the eight coefficients of k4a_calibration_t as JSON (K, dist, img_size)",
    ),
    ("OCamCalib (Scaramuzza)", &["#polynomial coefficients"], "calibrate as MEI or KANNALA_BRANDT with camodocal"),
    ("VisualSFM", &["NVM_V3"], "import it in COLMAP (model_converter), then read that"),
    ("DSO or TUM-mono", &["\ncrop\n"], "copy fx fy cx cy and the lens into Camera"),
    ("NumPy's arrays in YAML", &["!!python/object", "numpy"], "write lists (K.tolist()), or save with np.savez"),
    ("the configuration of nerfstudio", &["!!python/object"], "give transforms.json of its data"),
    (
        "DepthAI (OAK)",
        &["\"cameraData\"", "\"intrinsicMatrix\""],
        "write intrinsicMatrix, distortionCoeff and the size of a socket as JSON (K, dist, image_size)",
    ),
    ("calib.io", &["libCalib::CameraModel"], "write f, cx, cy, k1 ... as JSON (K, dist, image_size)"),
    (
        "Nerfies or HyperNeRF",
        &["\"pixel_aspect_ratio\"", "\"radial_distortion\"", "\"orientation\""],
        "orientation is R, position the centre: give them, K and the lens to Camera",
    ),
    ("USD", &["#usda"], "load it as a world: raycam.load(path).cameras"),
];
const PICKLE: &str = "it is never opened, because it may run code: save with np.savez, or as JSON";
/// First bytes of binary files that are known and not read, with the way on.
const UNREAD_BYTES: [(&str, &[u8], &str); 6] = [
    (
        "MATLAB",
        b"MATLAB 5.0 MAT-file",
        "scipy.io.loadmat, then Camera; its principal point counts from 1, K is transposed",
    ),
    ("HDF5 (MATLAB 7.3, Hypersim)", b"\x89HDF", "open it with h5py, then Camera"),
    (
        "Apache Arrow (feather, Argoverse 2)",
        b"ARROW1",
        "pandas.read_feather(file).to_csv(name, index=False) of intrinsics and egovehicle_SE3_sensor",
    ),
    ("Python's pickle", b"\x80", PICKLE),
    ("Python's pickle", b"(dp0\n", PICKLE),
    ("ROS bags", b"#ROSBAG", "rostopic echo -n 1 /camera/camera_info > camera_info.yaml"),
];

/// The name of the format of a file and the way on, if it is one of those that are known and not read.
pub(crate) fn name_of(bytes: &[u8], text: &str) -> Option<(&'static str, &'static str)> {
    if let Some((name, _, way)) = UNREAD_BYTES.iter().find(|(_, mark, _)| bytes.starts_with(mark)) {
        return Some((name, way));
    }
    let (name, _, way) = UNREAD.iter().find(|(_, marks, _)| marks.iter().all(|mark| text.contains(mark)))?;
    Some((name, way))
}
