//! The words that people use for the parts of a calibration, compared without case, `_`, `-`, `.` and spaces.

use crate::calibration::document::Cursor;
use crate::calibration::document::lens_keys::plain;
use crate::error::FormatError;

/// K, of 9 numbers or of 4: fx, fy, cx, cy.
pub(super) const K: [&str; 18] = [
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
];
/// The coefficients of the lens.
pub(super) const LENS: [&str; 20] = [
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
    "d",
];
/// The coefficients by names of their own, in OpenCV's order.
pub(super) const COEFFICIENTS: [&str; 12] = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4"];
pub(super) const FOCALS: [&str; 4] = ["fx", "fy", "cx", "cy"];
/// Columns and rows.
pub(super) const SIZE: [&str; 10] = [
    "imagesize",
    "imgsize",
    "framesize",
    "dim",
    "dims",
    "resolution",
    "imageresolution",
    "size",
    "picturesize",
    "imagedimensions",
];
/// Rows and columns, as NumPy's `shape` has them.
pub(super) const SHAPE: [&str; 3] = ["shape", "imageshape", "imgshape"];
pub(super) const WIDTH: [&str; 4] = ["imagewidth", "imgwidth", "width", "w"];
pub(super) const HEIGHT: [&str; 4] = ["imageheight", "imgheight", "height", "h"];
pub(super) const MODEL: [&str; 7] =
    ["distortionmodel", "distmodel", "lensmodel", "cameramodel", "cameratype", "model", "projectionmodel"];
pub(super) const FISHEYE: [&str; 3] = ["fisheyemodel", "fisheye", "isfisheye"];
pub(super) const XI: [&str; 1] = ["xi"];
/// The pose of one camera, camera from world.
pub(super) const R: [&str; 5] = ["r", "rot", "rotation", "rotationmatrix", "rstereo"];
pub(super) const T: [&str; 5] = ["t", "trans", "translation", "translationvector", "tstereo"];
pub(super) const RVEC: [&str; 2] = ["rvec", "rotationvector"];
pub(super) const TVEC: [&str; 2] = ["tvec", "tvector"];
/// The poses of the views of a board: of six numbers each, or of three in two lists.
pub(super) const VIEWS: [&str; 1] = ["extrinsicparameters"];
pub(super) const RVECS: [&str; 2] = ["rvecs", "rotationvectors"];
pub(super) const TVECS: [&str; 2] = ["tvecs", "translationvectors"];
/// The parts of a rectified pair, which follow from the raw cameras.
pub(super) const RECTIFIED: [&str; 5] = ["r1", "r2", "p1", "p2", "q"];
/// Further keys that are known: they are read elsewhere, or do not change the picture.
const OTHER: [&str; 42] = [
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
    "sensortype",
    "ratehz",
    "rate",
    "date",
];

/// True if a key is one of a calibration, of one camera or of either of a pair.
pub(super) fn is_known(key: &str) -> bool {
    let ends = ["", "1", "2", "left", "right", "l", "r"];
    let key = plain(key);
    ends.iter().any(|end| {
        let bases = [key.strip_suffix(end), key.strip_prefix(end)];
        bases.into_iter().flatten().any(|base| is_base(base) && !OTHER.contains(&base) || RECTIFIED.contains(&base))
    })
}

/// True if a key is that of K, of one camera or of either of a pair.
pub(super) fn is_camera_matrix(key: &str) -> bool {
    let key = plain(key);
    ["", "1", "2", "left", "right", "l", "r"]
        .iter()
        .any(|end| [key.strip_suffix(end), key.strip_prefix(end)].into_iter().flatten().any(|base| K.contains(&base)))
}

/// True if a key without a mark is one that the reader knows.
fn is_base(base: &str) -> bool {
    let groups: [&[&str]; 19] = [
        &K,
        &LENS,
        &COEFFICIENTS,
        &FOCALS,
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
    ];
    groups.iter().any(|group| group.contains(&base))
}

/// The keys of one camera: those without a mark, or those that end or begin with the mark of its side.
#[derive(Clone)]
pub(super) struct KeyView<'a> {
    pub(super) at: Cursor<'a>,
    /// The marks of the side, as `1` and `left`; empty for keys without a mark.
    pub(super) side: &'static [&'static str],
}

impl<'a> KeyView<'a> {
    /// The key without the mark of the side; None for keys of another side.
    fn base(&self, key: &str) -> Vec<String> {
        let key = plain(key);
        if self.side.is_empty() {
            return vec![key];
        }
        let stripped = |mark: &&str| [key.strip_suffix(*mark), key.strip_prefix(*mark)];
        self.side.iter().flat_map(stripped).flatten().map(str::to_owned).collect()
    }

    /// The values of all keys of some names.
    pub(super) fn all(&self, names: &[&str]) -> Vec<Cursor<'a>> {
        let entries = self.at.entries().unwrap_or_default();
        let has_name = |key: &str| self.base(key).iter().any(|base| names.contains(&base.as_str()));
        entries.into_iter().filter(|(key, at)| has_name(key) && !at.is_null()).map(|(_, at)| at).collect()
    }

    /// The value of the names, of which several keys have to say the same.
    pub(super) fn find_value(&self, names: &[&str]) -> Result<Option<Cursor<'a>>, FormatError> {
        let found = self.all(names);
        let words = |at: &Cursor<'_>| match at.numbers() {
            Ok(numbers) => format!("{numbers:?}"),
            Err(_) => format!("{:?}", at.node.value),
        };
        if let Some(other) = found.iter().skip(1).find(|other| words(other) != words(&found[0])) {
            return Err(other.fail(format_args!(
                "{} (line {}) is another value of the same thing: expected one of them",
                found[0].key, found[0].node.line
            )));
        }
        Ok(found.into_iter().next())
    }

    /// True if the key is of a rectified pair.
    pub(super) fn is_rectified(&self, key: &str) -> bool {
        self.base(key).iter().any(|base| RECTIFIED.contains(&base.as_str()))
    }

    /// True if the key is one of those that the reader knows.
    pub(super) fn knows(&self, key: &str) -> bool {
        self.base(key).iter().any(|base| is_base(base))
    }
}
