//! Formats that are recognised but not supported, each with an alternative.

use std::path::Path;

use crate::document::number_lines::looks_like;

const OCAM_REMEDY: &str = "calibrate as MEI or KANNALA_BRANDT with camodocal, or with cv2.fisheye";

/// Name of a format, markers that every file of this format contains, and the alternative.
const UNREAD: [(&str, &[&str], &str); 15] = [
    ("a ScanNet scene", &["axisAlignment", "colorWidth"], "open the folder with pose/ and intrinsic/"),
    (
        "Azure Kinect's raw calibration",
        &["CalibrationInformation", "ModelParameters"],
        "write K and the eight coefficients of k4a_calibration_t as JSON (K, dist, img_size)",
    ),
    ("OCamCalib (Scaramuzza)", &["#polynomial coefficients"], OCAM_REMEDY),
    ("OCamCalib (Scaramuzza) as JSON", &["\"invpol\"", "\"pol\""], OCAM_REMEDY),
    ("Kimera with the polynomial of OCamCalib (Scaramuzza)", &["omni_pol_inv", "omni_affine"], OCAM_REMEDY),
    ("VisualSFM", &["NVM_V3"], "convert it with COLMAP (model_converter), then load the COLMAP model"),
    ("DSO or TUM-mono", &["\ncrop\n"], "pass fx, fy, cx, cy and the lens coefficients to raycam.Camera"),
    ("NumPy arrays in YAML", &["!!python/object", "numpy"], "write lists (K.tolist()), or save with np.savez"),
    ("the configuration of nerfstudio", &["!!python/object"], "use transforms.json of the data set"),
    (
        "DepthAI (OAK)",
        &["\"cameraData\"", "\"intrinsicMatrix\""],
        "write intrinsicMatrix, distortionCoeff and the size of a socket as JSON (K, dist, image_size)",
    ),
    ("calib.io", &["libCalib::CameraModel"], "write f, cx, cy, k1 ... as JSON (K, dist, image_size)"),
    (
        "Nerfies or HyperNeRF",
        &["\"pixel_aspect_ratio\"", "\"radial_distortion\"", "\"orientation\""],
        "orientation is R, position is the centre C; pass them, K and the lens coefficients to raycam.Camera",
    ),
    (
        "Theia",
        &["CameraIntrinsicsPrior"],
        "write focal_length, principal_point and radial_distortion_coeffs as JSON (K, dist, image_size)",
    ),
    (
        "MVE",
        &["[camera]", "[view]", "focal_length"],
        "export the scene as a Bundler file, or write K (focal_length times the longer side), rotation (as R) and \
         translation (as T) as JSON",
    ),
    ("USD", &["#usda"], "load it as a world: raycam.load(path).cameras"),
];
const PICKLE: &str = "save the numbers with np.savez or as JSON, because loading a pickle may run code";
/// First bytes of binary files that are recognised but not supported, with the alternative.
const UNREAD_BYTES: [(&str, &[u8], &str); 6] = [
    (
        "MATLAB",
        b"MATLAB 5.0 MAT-file",
        "read the values with scipy.io.loadmat, transpose K, subtract 1 from the principal point (MATLAB counts \
         from 1), and pass them to raycam.Camera",
    ),
    ("HDF5 (MATLAB 7.3, Hypersim)", b"\x89HDF", "read the values with h5py, then pass them to raycam.Camera"),
    (
        "Apache Arrow (feather, Argoverse 2)",
        b"ARROW1",
        "convert intrinsics and egovehicle_SE3_sensor with pandas.read_feather(file).to_csv(name, index=False)",
    ),
    ("a Python pickle", b"\x80", PICKLE),
    ("a Python pickle", b"(dp0\n", PICKLE),
    (
        "ROS bags",
        b"#ROSBAG",
        "write a CameraInfo message to a file: rostopic echo -n 1 /camera/camera_info > camera_info.yaml",
    ),
];

/// Name of a file's format and the alternative, if the format is recognised but not supported.
pub(crate) fn name_of(bytes: &[u8], text: &str) -> Option<(&'static str, &'static str)> {
    if let Some((name, _, way)) = UNREAD_BYTES.iter().find(|(_, mark, _)| bytes.starts_with(mark)) {
        return Some((name, way));
    }
    let (name, _, way) = UNREAD.iter().find(|(_, marks, _)| marks.iter().all(|mark| text.contains(mark)))?;
    Some((name, way))
}

/// An unsupported format, whose files are recognised by a function of their text.
struct UnreadFormat {
    name: &'static str,
    detect: fn(&str) -> bool,
    remedy: &'static str,
}

const fn unread_format(name: &'static str, detect: fn(&str) -> bool, remedy: &'static str) -> UnreadFormat {
    UnreadFormat { name, detect, remedy }
}

const AS_JSON: &str = "write K, dist, img_size and R, T (camera_from_world) of each camera as JSON";

/// Unsupported formats that readers of other formats would accept by mistake; they are checked before those readers.
const UNREAD_FORMATS: [UnreadFormat; 31] = [
    unread_format(
        "BAL (bundle adjustment in the large)",
        is_bal,
        "export the problem as a Bundler file (bundle.out), or write fx, k1, k2, R and t as JSON",
    ),
    unread_format(
        "Qualisys Track Manager",
        |text| {
            has_all(text, &["<calibration", "<camera", "fov_video"])
                || has_all(text, &["<calibration", "focallength", "sensorMinU"])
        },
        "convert it with Pose2Sim (calib_type = 'convert', 'qualisys') to calibration.toml, which raycam reads",
    ),
    unread_format(
        "Kubric",
        |text| has_all(text, &["\"sensor_width\"", "\"quaternions\"", "\"positions\""]),
        "fx is focal_length / sensor_width times the image width; positions and quaternions (w first) are \
         world_from_camera with OpenGL axes: save 4x4 matrices, then load them with axes=\"opengl\" (--axes opengl)",
    ),
    unread_format(
        "SceneFlow (FlyingThings3D, Driving, Monkaa)",
        is_scene_flow,
        "each L and R line is world_from_camera with OpenGL axes: save one as a 4x4 matrix, then load it with axes=\"opengl\" (--axes opengl); K is in the data set's page (fx 1050, cx 479.5, cy 269.5)",
    ),
    unread_format(
        "EasyMocap",
        |text| text.contains("names:") && (text.contains("\nK_") || text.contains("\nRot_")),
        "write K_NAME and dist_NAME of intri.yml, Rot_NAME (as R) and T_NAME of extri.yml into a map for each camera in one file",
    ),
    unread_format(
        "OKVIS",
        |text| has_all(text, &["T_SC", "image_dimension", "focal_length"]),
        "write intrinsics, distortion_coeffs and T_SC as T_BS into a sensor.yaml of EuRoC for each camera",
    ),
    unread_format(
        "hloc's list of query images",
        is_hloc,
        "write the cameras to cameras.txt of a COLMAP model (id, model, width, height, parameters), which has the \
         same lens models",
    ),
    unread_format(
        "Pix4D",
        |text| {
            text.starts_with("fileName imageWidth imageHeight")
                || text.starts_with("imageName X Y Z Omega Phi Kappa")
                || text.contains("Pix4D camera calibration file")
        },
        "export the project as Bundler (bundle.out) or OPF, or write K, dist, R and T as JSON",
    ),
    unread_format(
        "DSEC",
        |text| text.contains("camRect0:"),
        "write a camera's camera_matrix, distortion_coeffs and resolution as JSON (keys K, dist and img_size); extrinsics T_10 go into T_cn_cnm1 of a Kalibr camchain",
    ),
    unread_format(
        "Virtual KITTI 1",
        |text| text.starts_with("frame r1,1 r1,2 r1,3 t1"),
        "remove the first line, then load the rest as poses (format=\"poses\", direction=\"camera_from_world\"; --camera-format poses --direction camera_from_world); for 1242 x 375 pixels, fx = fy = 725, cx = 620.5, cy = 187",
    ),
    unread_format(
        "KITTI's GPS and IMU (oxts)",
        |text| matches!(&first_numbers(text, 2)[..], [Some(only)] if only.len() == 30),
        "convert the folder to poses.txt (pykitti's oxts.T_w_imu), then load poses.txt",
    ),
    unread_format(
        "EuRoC's IMU (imu0/data.csv)",
        |text| {
            text.lines().next().is_some_and(|line| has_all(line, &["w_RS_S_x", "a_RS_S_x"]) && !line.contains("q_RS"))
        },
        "load data.csv of state_groundtruth_estimate0 or mocap0, which contain poses",
    ),
    unread_format(
        "WoodScape",
        |text| has_all(text, &["\"cx_offset\"", "\"poly_order\""]),
        "raycam has no lens model for WoodScape's polynomial; fit cv2.fisheye to the polynomial, then write K and \
         D with \"fisheye\": 1",
    ),
    unread_format(
        "Unity Perception",
        |text| has_all(text, &["\"captures\"", "\"camera_intrinsic\""]) || text.contains("type.unity.com/unity.solo"),
        "camera_intrinsic is in units of half the image: multiply it by half the size, mirror y (Unity is left-handed), and write K, R and T as JSON",
    ),
    unread_format(
        "InfiniTAM",
        is_infinitam,
        "lines 2 and 3 are fx fy and cx cy of the colour camera: write them with the size as JSON (K, img_size)",
    ),
    unread_format("iKalibr", |text| text.contains("CalibParam") && text.contains("INTRI"), AS_JSON),
    unread_format(
        "FAST-LIVO",
        |text| has_all(text, &["Rcl:", "Pcl:"]),
        "load the camera from its camera_pinhole.yaml; Rcl and Pcl (camera_from_lidar) are R and T",
    ),
    unread_format(
        "DexYCB",
        |text| text.contains("ppx") && text.contains("color:") && text.contains("depth:") && !text.contains('{'),
        "color contains fx fy ppx ppy of 640 x 480 images; write them as JSON (K, img_size)",
    ),
    unread_format(
        "DSO's camera.txt",
        is_dso,
        "for RadTan or EquiDistant, write K, dist and the size as JSON. For the FOV model, multiply fx and cx by the width, and fy and cy by the height, subtract 0.5 from cx and cy, and use Camera(..., distortion=[omega]) with the lens model \"fov\"",
    ),
    unread_format(
        "a rational polynomial camera (RPC)",
        |text| {
            (text.contains("LINE_OFF") || text.contains("lineOffset"))
                && (text.contains("SAMP_OFF") || text.contains("sampOffset"))
        },
        "an RPC is not a central projection; fit a local pinhole or affine camera to it, then use Camera.from_matrix",
    ),
    unread_format(
        "Gyroflow without fisheye_params",
        |text| has_all(text, &["\"calibrator_version\"", "\"calib_dimension\""]) && !text.contains("\"camera_matrix\""),
        "load a lens profile with fisheye_params (camera_matrix and distortion_coeffs)",
    ),
    unread_format(
        "DexYCB's extrinsics",
        |text| text.contains("extrinsics:") && text.contains("apriltag:"),
        "each list contains the 3x4 numbers of world_from_camera; save them as 4x4 matrices \
         (direction=\"world_from_camera\", --direction world_from_camera)",
    ),
    unread_format(
        "CHI3D, FIT3D or HumanSC3D",
        |text| has_all(text, &["\"intrinsics_w_distortion\"", "\"extrinsics\""]),
        "write a JSON file with fx and fy (from f), cx and cy (from c), dist: [k[0], k[1], p[0], p[1], k[2]], R (unchanged) and camera_center (T, which is the camera's centre in this format)",
    ),
    unread_format(
        "InterHand2.6M",
        |text| has_all(text, &["\"campos\"", "\"camrot\"", "\"princpt\""]),
        "write each camera as JSON: K (from focal and princpt), img_size, R (camrot) and camera_center (campos divided by 1000, because it is in millimetres)",
    ),
    unread_format(
        "BundleFusion or ScanNet's sensor information",
        |text| has_all(text, &["m_calibrationColorIntrinsic", "m_colorWidth"]),
        "write the first three columns of the first three rows of m_calibrationColorIntrinsic as K, with img_size, as JSON",
    ),
    unread_format(
        "Matterport3D",
        |text| text.starts_with("dataset ") && text.contains("\nn_images ") && text.contains("\nintrinsics_matrix "),
        "write the nine numbers of intrinsics_matrix as K; the 16 numbers of each scan line are world_from_camera with OpenGL axes: save them as one matrix per line, and load them with axes=\"opengl\" (--axes opengl)",
    ),
    unread_format(
        "Ego-Exo4D's gopro_calibs.csv",
        |text| text.lines().next().is_some_and(|line| has_all(line, &["tx_world_cam", "intrinsics_0"])),
        "write each camera as JSON: fx fy cx cy (intrinsics_0 to 3), dist_coeffs (intrinsics_4 to 7) with model \"fisheye\", img_size, and the pose of the columns t*_world_cam and q*_world_cam as position and c2w_quaternion_xyzw",
    ),
    unread_format(
        "Kalibr's report (results-cam.txt)",
        |text| has_all(text, &["Camera-system parameters:", "projection: ["]),
        "load the file camchain.yaml, which Kalibr writes at the same time",
    ),
    unread_format(
        "NVIDIA DRIVE's rig",
        |text| has_all(text, &["\"nominalSensor2Rig_FLU\"", "\"sensors\""]),
        "raycam has no lens model for the f-theta polynomial; fit cv2.fisheye to the polynomial, then write K, D and the size with \"fisheye\": 1 as JSON",
    ),
    unread_format(
        "RobotCar's intrinsics",
        is_robot_car,
        "the first line is fx fy cx cy: write it with the size as JSON (intrinsics, img_size)",
    ),
    unread_format(
        "Kubric's scene",
        |text| has_all(text, &["\"kubasic\"", "\"instances\""]),
        "load the metadata.json of the scene",
    ),
];

/// Name of a format that is recognised but not supported, and the alternative.
pub(crate) fn named_format(path: &Path, text: &str) -> Option<(&'static str, &'static str)> {
    if path.extension().is_some_and(|ending| ending == "chan") && (looks_like(text, 7) || looks_like(text, 8)) {
        return Some((
            "Nuke's .chan (frame, position, rotation in degrees, vertical field of view)",
            "the file contains neither the order of the rotations nor the image size. Write a list of 4x4 matrices \
             with R = scipy.spatial.transform.Rotation.from_euler(\"zxy\", [rz, rx, ry], degrees=True) for Nuke's \
             default order ZXY, load it with axes=\"opengl\" (--axes opengl), and pass intrinsics= with \
             fx = fy = (height / 2) / tan(vertical angle / 2)",
        ));
    }
    let found = UNREAD_FORMATS.iter().find(|format| (format.detect)(text))?;
    Some((found.name, found.remedy))
}

fn has_all(text: &str, marks: &[&str]) -> bool {
    marks.iter().all(|mark| text.contains(mark))
}

/// Numbers of the first `count` data lines; `None` for a line that contains anything else.
fn first_numbers(text: &str, count: usize) -> Vec<Option<Vec<f64>>> {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')).take(count);
    lines.map(|line| line.split_whitespace().map(|word| word.parse().ok()).collect()).collect()
}

fn is_bal(text: &str) -> bool {
    let whole = |values: &[f64]| values.iter().all(|value| value.fract() == 0.0 && *value >= 0.0);
    match &first_numbers(text, 3)[..] {
        [Some(head), Some(second), Some(third)] => {
            let observation = |row: &[f64]| row.len() == 4 && whole(&row[..2]);
            head.len() == 3
                && whole(head)
                && head[0] >= 1.0
                && head[2] >= head[0]
                && observation(second)
                && observation(third)
                && second[0] < head[0]
                && second[1] < head[1]
                && [second, third].iter().any(|row| row[2].abs() > 1.0)
        }
        _ => false,
    }
}

fn is_scene_flow(text: &str) -> bool {
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.next().is_some_and(|line| line.starts_with("Frame "))
        && lines.next().is_some_and(|line| line.starts_with("L ") && line.split_whitespace().count() == 17)
}

fn is_hloc(text: &str) -> bool {
    let first = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'));
    first.is_some_and(|line| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let models =
            ["PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "OPENCV_FISHEYE", "FULL_OPENCV"];
        words.len() >= 7
            && words[0].contains('.')
            && words[0].parse::<f64>().is_err()
            && models.contains(&words[1])
            && words[2..].iter().all(|word| word.parse::<f64>().is_ok())
    })
}

fn is_robot_car(text: &str) -> bool {
    let rows: Vec<Vec<f64>> = first_numbers(text, 6).into_iter().flatten().collect();
    let is_turn = |rows: &[Vec<f64>]| {
        rows[..3].iter().all(|row| row.iter().map(|value| value.abs()).sum::<f64>() == 1.0)
            && rows[3] == [0.0, 0.0, 0.0, 1.0]
    };
    rows.len() == 5
        && rows.iter().all(|row| row.len() == 4)
        && rows[0].iter().all(|value| *value > 8.0)
        && is_turn(&rows[1..])
}

fn is_infinitam(text: &str) -> bool {
    let found = first_numbers(text, 6);
    let pairs = found.iter().take(6).all(|row| row.as_ref().is_some_and(|row| row.len() == 2));
    found.len() == 6
        && pairs
        && found[0].as_ref().is_some_and(|row| row[0] >= 32.0 && row.iter().all(|side| side.fract() == 0.0))
}

fn is_dso(text: &str) -> bool {
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).take(4).collect();
    let [first, second, third, ..] = lines[..] else { return false };
    let words: Vec<&str> = first.split_whitespace().collect();
    let named =
        words.first().is_some_and(|word| ["RadTan", "EquiDistant", "Pinhole", "FOV", "KannalaBrandt"].contains(word));
    let numbers = words.iter().skip(usize::from(named)).all(|word| word.parse::<f64>().is_ok());
    let size: Vec<&str> = second.split_whitespace().collect();
    let is_size = size.len() == 2 && size.iter().all(|word| word.parse::<u32>().is_ok());
    let mode = ["crop", "full", "none", "useK"].contains(&third) || third.split_whitespace().count() == 5;
    (named || words.len() == 5) && numbers && is_size && mode
}
