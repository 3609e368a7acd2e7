//! Common keys of cameras, lenses and poses, compared without case, `_`, `-`, `.` and spaces.

use crate::document::length_unit::LengthUnit;
use crate::document::lens_keys::plain;
use crate::document::{Cursor, check_rotation, number_text, rigid};
use raycam_formats::FormatError;

/// Keys of K, as 9 numbers or as 4: fx, fy, cx, cy.
pub(super) const K: [&str; 28] = [
    "cameramatrix",
    "cameramat",
    "cammatrix",
    "cammat",
    "cammtx",
    "cameramtx",
    "camk",
    "k",
    "m",
    "mtx",
    "matrix",
    "intrinsic",
    "intrinsics",
    "intrinsicmatrix",
    "intrinsicsmatrix",
    "cameraintrinsic",
    "cameraintrinsics",
    "intrinsicmat",
    "intrinsicparameters",
    "intrinsicparams",
    "intrinsicsettings",
    "intrinsicssettings",
    "calibrationmatrix",
    "cameraintrinsicmatrix",
    "cameraintrinsicsmatrix",
    "kmatrix",
    "kmat",
    "kmtx",
];
/// Keys of a list of lens coefficients.
pub(super) const LENS: [&str; 37] = [
    "distortionvec",
    "distortioncoefficients",
    "distortioncoefficient",
    "distortioncoeffs",
    "distortioncoeff",
    "distortioncoefs",
    "distortioncoef",
    "distcoefficients",
    "distcoeffs",
    "distcoeff",
    "distcoefs",
    "distcoef",
    "distortion",
    "distortions",
    "distortionparameters",
    "distortionparams",
    "distortionvector",
    "lensdistortion",
    "dist",
    "dcoeffs",
    "dcoefs",
    "dmtx",
    "dmat",
    "dvec",
    "distvec",
    "distvector",
    "distparams",
    "distparameters",
    "coeffs",
    "coefs",
    "coefficients",
    "lenscoeffs",
    "lenscoefficients",
    "radialtangential",
    "distorsion",
    "kc",
    "d",
];
/// Keys of a map that contains coefficients and the lens model.
pub(super) const PARAMETERS: [&str; 6] = ["params", "parameters", "values", "coeff", "coefs", "vector"];
/// Keys of coefficients in two lists, k1 k2 (k3 ...) and p1 p2.
pub(super) const RADIAL: [&str; 5] =
    ["radialdistortion", "radialdistortioncoefficients", "radialcoefficients", "radialcoeffs", "radial"];
pub(super) const TANGENTIAL: [&str; 5] = [
    "tangentialdistortion",
    "tangentialdistortioncoefficients",
    "tangentialcoefficients",
    "tangentialcoeffs",
    "tangential",
];
/// Names of individual coefficients, in OpenCV's order.
pub(super) const COEFFICIENTS: [&str; 12] = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4"];
/// Keys of the focal lengths and of the principal point's coordinates, in pixels: fx, fy, cx, cy.
pub(super) const FOCALS: [&[&str]; 4] = [
    &["fx", "flx", "focalx", "focallengthx", "xfocal", "fu"],
    &["fy", "fly", "focaly", "focallengthy", "yfocal", "fv"],
    &["cx", "u0", "ppx", "principalpointx", "principalx", "opticalcenterx", "cu"],
    &["cy", "v0", "ppy", "principalpointy", "principaly", "opticalcentery", "cv"],
];
/// Keys of one focal length for both axes, or of a list fx, fy.
pub(super) const FOCAL_PAIR: [&str; 5] = ["f", "focal", "focals", "focallength", "focallengths"];
/// Keys of a list cx, cy.
pub(super) const PRINCIPAL_POINT: [&str; 5] =
    ["principalpoint", "principalpoints", "pp", "opticalcenter", "principalpointoffset"];
pub(super) const SKEW: [&str; 1] = ["skew"];
/// Keys of the image size as columns and rows.
pub(super) const SIZE: [&str; 20] = [
    "imagesize",
    "imgsize",
    "imsize",
    "imgsz",
    "wh",
    "framesize",
    "dim",
    "dims",
    "resolution",
    "imageresolution",
    "size",
    "picturesize",
    "imagedimensions",
    "cameraresolution",
    "videoresolution",
    "videosize",
    "calibdimension",
    "capturedimagesize",
    "resolutionwh",
    "imagesizewh",
];
/// Keys of the image size as rows and columns, as in NumPy's `shape`.
pub(super) const SHAPE: [&str; 8] =
    ["shape", "imageshape", "imgshape", "hw", "resolutionhw", "imagesizehw", "imghw", "sizehw"];
pub(super) const WIDTH: [&str; 13] = [
    "imagewidth",
    "imgwidth",
    "width",
    "w",
    "imagew",
    "imgw",
    "imwidth",
    "framewidth",
    "camerawidth",
    "camwidth",
    "widthpx",
    "imgdistw",
    "resx",
];
pub(super) const HEIGHT: [&str; 13] = [
    "imageheight",
    "imgheight",
    "height",
    "h",
    "imageh",
    "imgh",
    "imheight",
    "frameheight",
    "cameraheight",
    "camheight",
    "heightpx",
    "imgdisth",
    "resy",
];
pub(super) const MODEL: [&str; 17] = [
    "distortionmodel",
    "distmodel",
    "lensmodel",
    "cameramodel",
    "cameratype",
    "model",
    "projectionmodel",
    "distortiontype",
    "disttype",
    "lenstype",
    "lens",
    "projection",
    "projectiontype",
    "cameraprojection",
    "modeltype",
    "calibrationmodel",
    "type",
];
/// Keys of [`MODEL`] whose value must be a lens model; the value of other keys may be a product name.
pub(super) const STRICT_MODEL: [&str; 9] = [
    "distortionmodel",
    "distmodel",
    "lensmodel",
    "projectionmodel",
    "distortiontype",
    "disttype",
    "projection",
    "projectiontype",
    "modeltype",
];
pub(super) const FISHEYE: [&str; 5] = ["fisheyemodel", "fisheye", "isfisheye", "usefisheye", "fisheyelens"];
pub(super) const XI: [&str; 1] = ["xi"];
/// Keys of R and T of one camera: camera from world.
pub(super) const R: [&str; 7] = ["r", "rot", "rotation", "rotationmatrix", "rotmat", "rmat", "rstereo"];
pub(super) const T: [&str; 7] = ["t", "trans", "trns", "translation", "translationvector", "transmat", "tstereo"];
pub(super) const RVEC: [&str; 2] = ["rvec", "rotationvector"];
pub(super) const TVEC: [&str; 2] = ["tvec", "tvector"];
/// Keys of a camera's centre in the world; a rotation R next to them is camera_from_world.
pub(super) const CENTER: [&str; 8] =
    ["c", "center", "centre", "cameracenter", "cameracentre", "camcenter", "opticalcenter", "projectioncenter"];
/// Keys of a position that do not specify the direction of a neighbouring rotation.
pub(super) const POSITION: [&str; 9] =
    ["eye", "position", "pos", "campos", "camposition", "camerapos", "cameraposition", "location", "cameralocation"];
/// Keys of a mount whose names mean body_from_camera.
pub(super) const BODY_FROM_CAMERA: [&str; 10] =
    ["tbs", "tbc", "tsc", "tbodycam", "tbodycamera", "bodytcam", "imutcam", "timucam", "tic", "timucamera"];
/// Keys of a mount whose names mean camera_from_body.
pub(super) const CAMERA_FROM_BODY: [&str; 5] = ["tcamimu", "tcamerabody", "tcambody", "tcb", "tcameraimu"];
/// Keys of the poses of a board's views: six numbers per view, or three per view in each of two lists.
pub(super) const VIEWS: [&str; 1] = ["extrinsicparameters"];
pub(super) const RVECS: [&str; 3] = ["rvecs", "rotationvectors", "rotationvec"];
pub(super) const TVECS: [&str; 3] = ["tvecs", "translationvectors", "translationvec"];
/// Keys of a rectified pair's matrices, which follow from the raw cameras.
pub(super) const RECTIFIED: [&str; 5] = ["r1", "r2", "p1", "p2", "q"];
/// Further known keys: they are read elsewhere, or do not affect the image.
pub(super) const OTHER: [&str; 43] = [
    "newcameramtx",
    "newcameramatrix",
    "optimalcameramatrix",
    "roi",
    "map1",
    "map2",
    "mapx",
    "mapy",
    "name",
    "cameraname",
    "tbs",
    "time",
    "calibrationtime",
    "nframes",
    "nrofframes",
    "boardwidth",
    "boardheight",
    "boardsize",
    "squaresize",
    "aspectratio",
    "flags",
    "rms",
    "ret",
    "error",
    "reproerror",
    "reprojectionerror",
    "avgreprojectionerror",
    "meanreprojectionerror",
    "perviewreprojectionerrors",
    "imagepoints",
    "gridpoints",
    "objectpoints",
    "images",
    "e",
    "f",
    "essentialmatrix",
    "fundamentalmatrix",
    "comment",
    "nbcamera",
    "sensortype",
    "ratehz",
    "rate",
    "date",
];

/// Markers at the end or at the beginning of a key that identify its camera: a single camera, or one camera of a pair.
const MARKS: [&str; 12] = ["", "0", "1", "2", "left", "right", "l", "r", "cam0", "cam1", "cam2", "camera1"];

/// True if a key belongs to the calibration of one camera or of either camera of a pair.
pub(super) fn is_known(key: &str) -> bool {
    let key = plain(key);
    MARKS.iter().any(|end| {
        let bases = [key.strip_suffix(end), key.strip_prefix(end)];
        bases.into_iter().flatten().any(|base| is_base(base) && !OTHER.contains(&base) || RECTIFIED.contains(&base))
    })
}

/// True if a key means K, of one camera or of either camera of a pair.
pub(super) fn is_camera_matrix(key: &str) -> bool {
    let key = plain(key);
    MARKS
        .iter()
        .any(|end| [key.strip_suffix(end), key.strip_prefix(end)].into_iter().flatten().any(|base| K.contains(&base)))
}

/// True if the reader recognises a key without a marker.
pub(super) fn is_base(base: &str) -> bool {
    let groups: [&[&str]; 27] = [
        &K,
        &LENS,
        &COEFFICIENTS,
        FOCALS[0],
        FOCALS[1],
        FOCALS[2],
        FOCALS[3],
        &SKEW,
        &RADIAL,
        &TANGENTIAL,
        &SIZE,
        &SHAPE,
        &WIDTH,
        &HEIGHT,
        &MODEL,
        &FISHEYE,
        &XI,
        &R,
        &T,
        &RVEC,
        &TVEC,
        &VIEWS,
        &RVECS,
        &TVECS,
        &OTHER,
        &BODY_FROM_CAMERA,
        &CAMERA_FROM_BODY,
    ];
    groups.iter().any(|group| group.contains(&base)) || is_deviation(base)
}

/// True for the name of a standard deviation, which OpenCV's programs write next to the estimated parameters.
fn is_deviation(base: &str) -> bool {
    ["stddev", "stdev", "std", "stddeviation", "stddeviations"].iter().any(|end| base.ends_with(end))
        || base.starts_with("stddev")
}

/// Words in the keys of other sensors and bodies than cameras.
const OTHER_SENSORS: [&str; 20] = [
    "lidar",
    "velodyne",
    "velo",
    "livox",
    "laser",
    "radar",
    "sonar",
    "ultrasonic",
    "imu",
    "gps",
    "gnss",
    "odometry",
    "body",
    "base",
    "vehicle",
    "robot",
    "ego",
    "marker",
    "board",
    "chessboard",
];

/// True for the map of another sensor or body than a camera, by its key or by the name or type in it.
pub(super) fn is_other_sensor(key: &str, at: &Cursor<'_>) -> bool {
    let names = ["name", "id", "type", "sensor", "sensor_type", "sensor_name", "label"];
    let stated = names.iter().filter_map(|name| at.get(name)?.word().ok());
    stated
        .chain([key])
        .flat_map(words_of_key)
        .any(|word| OTHER_SENSORS.contains(&word.trim_end_matches(|c: char| c.is_ascii_digit())))
}

/// Words in the keys of bodies that carry cameras.
const BODIES: [&str; 5] = ["body", "base", "vehicle", "robot", "ego"];

/// True for the key of a body that carries cameras.
pub(super) fn is_body(key: &str) -> bool {
    words_of_key(key).iter().any(|word| BODIES.contains(&&word[..]))
}

/// True for a map that is not a matrix in OpenCV's notation.
pub(super) fn is_keyed(at: &Cursor<'_>) -> bool {
    at.is_map() && at.get("data").is_none() && at.get("rows").is_none()
}

/// True for a list of values that may be K, or fx, fy, cx and cy. If some values are not numbers, the reader reports
/// this later.
pub(super) fn is_matrix(at: &Cursor<'_>) -> bool {
    let data = at.get("data").unwrap_or_else(|| at.clone());
    let rows = data.list().unwrap_or_default();
    let rows = if rows.is_empty() { vec![data] } else { rows };
    let cells = rows.into_iter().flat_map(|row| row.list().unwrap_or_else(|_| vec![row]));
    let is_number = |word: &str| word.trim_start_matches('.').parse::<f64>().is_ok();
    let words = cells.flat_map(|cell| match cell.word() {
        Ok(word) => number_text::words(word).map(is_number).collect(),
        Err(_) => vec![false],
    });
    let found: Vec<bool> = words.collect();
    (3..=16).contains(&found.len()) && 2 * found.iter().filter(|number| **number).count() > found.len()
}

/// The parts of a key that remain without a marker at its beginning or end. A number is a marker only if no other digit
/// is next to it.
pub(super) fn without_mark<'k>(key: &'k str, mark: &str) -> impl Iterator<Item = &'k str> {
    let number = mark.bytes().all(|c| c.is_ascii_digit());
    let before = key.strip_suffix(mark).filter(|rest| !(number && rest.ends_with(|c: char| c.is_ascii_digit())));
    let after = key.strip_prefix(mark).filter(|rest| !(number && rest.starts_with(|c: char| c.is_ascii_digit())));
    [before, after].into_iter().flatten()
}

/// Words in the keys of 3x3 matrices that are not K.
const OTHER_MATRICES: [&str; 13] = [
    "rot",
    "essential",
    "fundamental",
    "homog",
    "proj",
    "extrin",
    "new",
    "optimal",
    "rect",
    "transf",
    "covar",
    "pose",
    "inv",
];

/// The markers of the cameras in a map, in file order. A marker is the name or number in a key of K, such as `K_event`
/// or `camera_matrix_2`. A single marker counts only if the key of the camera's lens has the same marker.
pub(super) fn marks(root: &Cursor<'_>) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    let entries = root.entries().unwrap_or_default();
    for (key, at) in &entries {
        let name = plain(key);
        let other = is_base(&name) && !COEFFICIENTS.contains(&&name[..])
            || OTHER_MATRICES.iter().any(|word| name.contains(word));
        if let Some(mark) = mark_of(key, &K).filter(|_| !other && looks_like_k(at))
            && !found.contains(&mark)
        {
            found.push(mark);
        }
    }
    if let [mark] = &found[..]
        && !entries.iter().any(|(key, _)| mark_of(key, &LENS).as_ref() == Some(mark))
    {
        return vec![];
    }
    found
}

/// The marker in a key: the rest of a key that begins or ends with one of `words`, separated by `_`, `-`, `.`, a digit
/// or a capital letter.
fn mark_of(key: &str, words: &[&str]) -> Option<String> {
    // The positions in the key at which a word can end or begin.
    let chars: Vec<(usize, char)> = key.char_indices().collect();
    let breaks = chars.windows(2).filter(|pair| {
        let (before, after) = (pair[0].1, pair[1].1);
        let set_off = |c: char| matches!(c, '_' | '-' | '.' | ' ');
        set_off(before)
            || set_off(after)
            || before.is_ascii_digit() != after.is_ascii_digit()
            || before.is_lowercase() && after.is_uppercase()
    });
    let parts = breaks.map(|pair| (plain(&key[..pair[1].0]), plain(&key[pair[1].0..])));
    let marks = parts.filter(|(first, last)| !first.is_empty() && !last.is_empty()).filter_map(|(first, last)| {
        let known =
            |word: &str| words.contains(&word) || word.strip_prefix("camera").is_some_and(|w| words.contains(&w));
        match (known(&first), known(&last)) {
            (true, _) => Some((first.len(), last)),
            (_, true) => Some((last.len(), first)),
            _ => None,
        }
    });
    // The longest matching word counts: otherwise, `camera_matrix_0` would be read as the `matrix` of a camera named
    // "camera".
    marks.max_by_key(|(length, _)| *length).map(|(_, mark)| mark)
}

/// True for a 3x4 or 4x4 matrix [R | t].
pub(super) fn is_rigid_transform(at: &Cursor<'_>) -> bool {
    let numbers = at.numbers().unwrap_or_default();
    matches!(numbers.len(), 12 | 16)
        && numbers.first_chunk::<12>().is_some_and(|rows| {
            let (r, t) = rigid(rows);
            (t != glam::DVec3::ZERO || r != glam::DMat3::IDENTITY) && check_rotation(r).is_ok()
        })
}

/// True for coefficients k1 k2 ... under the key `k`, which is otherwise a key of K.
pub(super) fn is_k_of_coefficients(key: &str, at: &Cursor<'_>) -> bool {
    plain(key) == "k" && at.numbers().is_ok_and(|numbers| matches!(numbers.len(), 2 | 3 | 5 | 6 | 8))
}

/// True for 9, 12 or 16 numbers that have the form of K.
fn looks_like_k(at: &Cursor<'_>) -> bool {
    let Ok(m) = at.numbers() else { return false };
    let width = match m.len() {
        9 => 3,
        12 | 16 => 4,
        _ => return false,
    };
    let zeros = m[width] == 0.0 && m[2 * width] == 0.0 && m[2 * width + 1] == 0.0;
    zeros && m[2 * width + 2] == 1.0 && m[0] > 0.0 && m[width + 1] > 0.0
}

/// True for the name of a focal length, possibly with a unit: `fx`, `focal_length`, `fl_x [px]`.
pub(super) fn is_focal_length(key: &str) -> bool {
    let name = plain(key);
    let own = |name: &str| FOCALS[0].contains(&name) || FOCAL_PAIR.contains(&name);
    own(&name) || without_unit(key, &name).is_some_and(|name| own(&name))
}

/// Unit at the end of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum KeyUnit {
    Length(LengthUnit),
    Radians,
    Degrees,
    Pixels,
}

impl KeyUnit {
    fn from_name(name: &str) -> Option<Self> {
        match name {
            "rad" | "radian" | "radians" => Some(Self::Radians),
            "deg" | "degree" | "degrees" => Some(Self::Degrees),
            "px" | "pix" | "pixel" | "pixels" => Some(Self::Pixels),
            _ => LengthUnit::from_name(name).map(Self::Length),
        }
    }

    /// Keys of the quantities to which the unit applies.
    fn quantities(self) -> &'static [&'static [&'static str]] {
        match self {
            Self::Length(_) => &[&T, &TVEC, &CENTER, &POSITION],
            Self::Radians | Self::Degrees => &[&RVEC],
            Self::Pixels => {
                &[FOCALS[0], FOCALS[1], FOCALS[2], FOCALS[3], &FOCAL_PAIR, &PRINCIPAL_POINT, &SIZE, &WIDTH, &HEIGHT]
            }
        }
    }
}

/// The unit that is the last word of a key: millimetres for `t_mm`.
pub(super) fn unit_of(key: &str) -> Option<KeyUnit> {
    KeyUnit::from_name(&last_of_several_words(key)?)
}

/// The last word of a key that consists of several words.
fn last_of_several_words(key: &str) -> Option<String> {
    let mut words = words_of_key(key);
    words.pop().filter(|_| !words.is_empty())
}

/// The key in lower case, split into words at punctuation and at capital letters.
fn words_of_key(key: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_lower = false;
    for c in key.chars() {
        if !c.is_alphanumeric() || c.is_uppercase() && was_lower {
            words.push(String::new());
        }
        was_lower = c.is_lowercase();
        if let Some(word) = words.last_mut().filter(|_| c.is_alphanumeric()) {
            word.extend(c.to_lowercase());
        }
    }
    words.into_iter().filter(|word| !word.is_empty()).collect()
}

/// The key `base` without the unit at its end, if the unit fits the key's quantity: `t` for `t_mm`, `fx` for `fx_px`.
pub(super) fn without_unit(key: &str, base: &str) -> Option<String> {
    let word = last_of_several_words(key)?;
    let unit = KeyUnit::from_name(&word)?;
    let plain_base: String = base.chars().filter(|c| c.is_alphanumeric()).collect();
    let rest = plain_base.strip_suffix(&word)?;
    unit.quantities().iter().any(|names| names.contains(&rest)).then(|| rest.to_owned())
}

/// The error for the value `at`, which differs from that of the key `first`; `values` begins with a comma and shows both
/// values, or is empty.
pub(super) fn contradiction(at: &Cursor<'_>, first: &Cursor<'_>, values: &str) -> FormatError {
    at.fail(format_args!(
        "{} (line {}) has a different value for the same quantity{values}; remove one of the two keys",
        first.key, first.node.line
    ))
}
