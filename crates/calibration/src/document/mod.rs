//! YAML, JSON and XML documents as a tree of maps, lists and scalars, each with its line number.

pub(crate) mod csv_tree;
pub(crate) mod ini;
pub(crate) mod length_unit;
pub(crate) mod lens_keys;
pub(crate) mod npy;
pub(crate) mod number_format;
pub(crate) mod number_lines;
pub(crate) mod number_text;
pub(crate) mod toml_tree;
pub(crate) mod unread;
pub(crate) mod world_file;
pub(crate) mod xml;
pub(crate) mod xml_element;
pub(crate) mod yaml;
pub(crate) mod zip_members;
use std::path::Path;

use glam::{DMat3, DVec3};
use raycam_scene::camera::nearest_rotation;
use raycam_scene::{ErrorCode, Lens, LensModel, Notice, NoticeCode, counted, suggestion};

use crate::document::length_unit::LengthUnit;
use raycam_formats::{FormatError, Result};

/// Maximum nesting depth of a tree; deeper documents are rejected.
pub(crate) const MAX_DEPTH: usize = 32;

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    /// A word, a number, or an empty text.
    Scalar(String),
    List(Vec<DocumentNode>),
    Map(Vec<(String, DocumentNode)>),
}

impl Value {
    /// The kind of the value, for messages.
    fn kind(&self) -> &'static str {
        match self {
            Self::Scalar(_) => "a single value",
            Self::List(_) => "a list",
            Self::Map(_) => "a map",
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DocumentNode {
    pub(crate) value: Value,
    pub(crate) line: usize,
}

impl DocumentNode {
    /// True if two trees are equal, apart from line numbers and from `stamp` and `seq` in the header of a ROS message.
    pub(crate) fn same_as(&self, other: &DocumentNode) -> bool {
        match (&self.value, &other.value) {
            (Value::Scalar(a), Value::Scalar(b)) => a == b,
            (Value::List(a), Value::List(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.same_as(b)),
            (Value::Map(a), Value::Map(b)) => {
                let same = |((k, a), (l, b)): (&(String, DocumentNode), &(String, DocumentNode))| {
                    k == l && (matches!(k.as_str(), "stamp" | "seq") || a.same_as(b))
                };
                a.len() == b.len() && a.iter().zip(b).all(same)
            }
            _ => false,
        }
    }
}

/// A node, with its path from the root for error messages.
#[derive(Clone, Debug)]
pub(crate) struct Cursor<'a> {
    pub(crate) node: &'a DocumentNode,
    path: &'a Path,
    pub(crate) key: String,
}

impl<'a> Cursor<'a> {
    pub(crate) fn root(node: &'a DocumentNode, path: &'a Path) -> Self {
        Self { node, path, key: String::new() }
    }

    /// Returns an error about this node, with the code `syntax`.
    pub(crate) fn fail(&self, message: impl std::fmt::Display) -> FormatError {
        self.fail_as(ErrorCode::Syntax, message)
    }

    /// Returns an error about this node, with the given code.
    pub(crate) fn fail_as(&self, code: ErrorCode, message: impl std::fmt::Display) -> FormatError {
        let key = if self.key.is_empty() { "the file" } else { &self.key };
        FormatError::line(self.path, self.node.line, code.message(format!("{key}: {message}")))
    }

    /// The path of the file.
    pub(crate) fn file(&self) -> &'a Path {
        self.path
    }

    /// The name of the file.
    pub(crate) fn file_name(&self) -> Option<String> {
        Some(self.path.file_name()?.to_string_lossy().into_owned())
    }

    /// The last part of the node's key, after the last point.
    pub(crate) fn name(&self) -> &str {
        self.key.rsplit('.').next().unwrap_or_default()
    }

    pub(crate) fn child(&self, key: &str, node: &'a DocumentNode) -> Self {
        let joint = if self.key.is_empty() { "" } else { "." };
        Self { node, path: self.path, key: format!("{}{joint}{key}", self.key) }
    }

    /// Entries of a map; an error for any other node.
    pub(crate) fn entries(&self) -> Result<Vec<(&'a str, Cursor<'a>)>> {
        match &self.node.value {
            Value::Map(entries) => {
                Ok(entries.iter().map(|(key, node)| (key.as_str(), self.child(key, node))).collect())
            }
            _ => Err(self.fail(format_args!("{}; expected a map of keys and values", self.node.value.kind()))),
        }
    }

    pub(crate) fn is_map(&self) -> bool {
        matches!(self.node.value, Value::Map(_))
    }

    /// Value of a key, if the key exists and is not null.
    pub(crate) fn get(&self, key: &str) -> Option<Cursor<'a>> {
        let Value::Map(entries) = &self.node.value else { return None };
        let (_, node) = entries.iter().find(|(name, _)| name == key)?;
        let child = self.child(key, node);
        (!child.is_null()).then_some(child)
    }

    /// True for an empty value, `null` and `~`.
    pub(crate) fn is_null(&self) -> bool {
        matches!(&self.node.value, Value::Scalar(word) if matches!(word.as_str(), "" | "null" | "~"))
    }

    /// Value of the first of several equivalent keys.
    pub(crate) fn any(&self, keys: &[&str]) -> Option<Cursor<'a>> {
        keys.iter().find_map(|key| self.get(key))
    }

    /// Value of a required key.
    pub(crate) fn require(&self, key: &str) -> Result<Cursor<'a>> {
        self.get(key).ok_or_else(|| self.fail_as(ErrorCode::MissingValue, format_args!("{key} is missing")))
    }

    pub(crate) fn word(&self) -> Result<&'a str> {
        match &self.node.value {
            Value::Scalar(word) => Ok(word),
            _ => {
                Err(self
                    .fail_as(ErrorCode::WrongType, format_args!("{}; expected a single value", self.node.value.kind())))
            }
        }
    }

    pub(crate) fn number(&self) -> Result<f64> {
        let Value::Scalar(word) = &self.node.value else {
            let message = format!("{}; expected a number", self.node.value.kind());
            return Err(self.fail_as(ErrorCode::WrongType, message));
        };
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.fail_as(ErrorCode::WrongType, format_args!("{word:?}; expected a finite number"))),
        }
    }

    /// Number of a key, or a default if the key is missing.
    pub(crate) fn number_or(&self, key: &str, otherwise: f64) -> Result<f64> {
        self.get(key).map_or(Ok(otherwise), |at| at.number())
    }

    /// Reads a whole number >= 0, such as a number of pixels.
    pub(crate) fn count(&self) -> Result<u32> {
        let number = self.number()?;
        if number.fract() != 0.0 || !(0.0..=4294967295.0).contains(&number) {
            return Err(self.fail_as(ErrorCode::OutOfRange, format_args!("{number}; expected a whole number >= 0")));
        }
        Ok(number as u32)
    }

    /// Elements of a list; an error for any other node.
    pub(crate) fn list(&self) -> Result<Vec<Cursor<'a>>> {
        let Value::List(items) = &self.node.value else {
            let message = format!("{}; expected a list", self.node.value.kind());
            return Err(self.fail_as(ErrorCode::WrongType, message));
        };
        let item = |(i, node)| Self { node, path: self.path, key: format!("{}[{i}]", self.key) };
        Ok(items.iter().enumerate().map(item).collect())
    }

    /// Numbers of a list, of nested lists, of a text with several numbers, or of the `data` of a matrix whose size
    /// matches.
    pub(crate) fn numbers(&self) -> Result<Vec<f64>> {
        if self.is_map() {
            let numbers = self.require("data")?.numbers()?;
            // This is a matrix of OpenCV 5 (opencv-nd-matrix).
            if let Some(sizes) = self.get("sizes") {
                // In XML, a single size is not a list.
                let count = match sizes.numbers() {
                    Ok(sizes) => sizes.iter().product(),
                    Err(_) => f64::from(sizes.count()?),
                };
                if count != numbers.len() as f64 {
                    return Err(sizes.fail_as(
                        ErrorCode::WrongShape,
                        format_args!(
                            "data has {}; expected {count}, the product of sizes",
                            counted(numbers.len(), "number")
                        ),
                    ));
                }
                return Ok(numbers);
            }
            let (rows, cols) = (self.require("rows")?.count()?, self.require("cols")?.count()?);
            if u64::from(rows) * u64::from(cols) != numbers.len() as u64 {
                return Err(self.fail_as(
                    ErrorCode::WrongShape,
                    format_args!(
                        "rows is {rows} and cols is {cols}, but data has {}",
                        counted(numbers.len(), "number")
                    ),
                ));
            }
            return Ok(numbers);
        }
        if let Some(numbers) = self.numbers_of_text() {
            return Ok(numbers);
        }
        if let Value::Scalar(word) = &self.node.value
            && number_text::has_decimal_commas(word)
        {
            let message = format!("{word:?}: numbers with decimal commas; expected decimal points");
            return Err(self.fail_as(ErrorCode::WrongType, message));
        }
        let mut numbers = Vec::new();
        for item in self.list()? {
            match (&item.node.value, item.numbers_of_text()) {
                (_, Some(row)) => numbers.extend(row),
                (Value::Scalar(_), None) => numbers.push(item.number()?),
                _ => numbers.extend(item.numbers()?),
            }
        }
        Ok(numbers)
    }

    /// The numbers of a text, as in `K: 500 0 320` and `K: "[500, 0, 320]"`.
    fn numbers_of_text(&self) -> Option<Vec<f64>> {
        let Value::Scalar(word) = &self.node.value else { return None };
        number_text::numbers(word)
    }

    /// The numbers of the node; an error unless there are exactly `N`.
    pub(crate) fn array<const N: usize>(&self) -> Result<[f64; N]> {
        let numbers = self.numbers()?;
        let count = counted(numbers.len(), "number");
        numbers.try_into().map_err(|_| self.fail_as(ErrorCode::WrongShape, format_args!("{count}; expected {N}")))
    }

    /// Reads a 3x3 matrix, row by row.
    pub(crate) fn matrix3(&self) -> Result<DMat3> {
        Ok(DMat3::from_cols_array(&self.array::<9>()?).transpose())
    }

    /// Reads R and t from a 4x4 or 3x4 matrix, row by row.
    pub(crate) fn matrix4(&self) -> Result<(DMat3, DVec3)> {
        let numbers = self.numbers()?;
        let m: [f64; 12] = match numbers.len() {
            16 => check_rigid(&std::array::from_fn(|i| numbers[i]))
                .map_err(|message| self.fail_as(ErrorCode::InvalidMatrix, message))?,
            12 => std::array::from_fn(|i| numbers[i]),
            count => {
                let message = format!("{}; expected a 4x4 or 3x4 matrix", counted(count, "number"));
                return Err(self.fail_as(ErrorCode::WrongShape, message));
            }
        };
        Ok(rigid(&m))
    }

    /// Returns the lens for a model name that calibration tools use, and its coefficients.
    pub(crate) fn lens(&self, name: &str, coefficients: &[f64]) -> Result<Lens> {
        lens_named(name, coefficients).map_err(|message| self.fail_as(ErrorCode::InvalidLens, message))
    }

    /// Returns a notice for every key that is not in `known`; a key that looks like a lens is an error.
    pub(crate) fn unknown_keys(&self, known: &[&str]) -> Result<Vec<Notice>> {
        self.unread_keys(|key| known.contains(&key))
    }

    /// Same as [`Cursor::unknown_keys`], with a function that returns true for known keys.
    pub(crate) fn unread_keys(&self, is_known: impl Fn(&str) -> bool) -> Result<Vec<Notice>> {
        let Value::Map(entries) = &self.node.value else { return Ok(vec![]) };
        let place = if self.key.is_empty() { String::new() } else { format!("{}: ", self.key) };
        let mut notices = Vec::new();
        for (key, node) in entries.iter().filter(|(key, _)| !is_known(key)) {
            let at = self.child(key, node);
            at.refuse_lens(key)?;
            notices.extend(at.notice_of_unread_key(key, format!("{place}{key} (line {})", node.line)));
        }
        Ok(notices)
    }

    /// The unit of length that this value specifies for other values, if its key is `units`, `length_unit` or similar.
    fn stated_unit(&self, key: &str) -> Option<LengthUnit> {
        let key = key.to_lowercase();
        let is_unit = key.ends_with("unit") || key.ends_with("units");
        LengthUnit::from_name(&self.word().ok().filter(|_| is_unit)?.trim().to_lowercase())
    }

    /// Returns the notice about a value that is not read, which `subject` names; `None` if the value specifies metres,
    /// which are raycam's unit.
    pub(crate) fn notice_of_unread_key(&self, key: &str, subject: String) -> Option<Notice> {
        let Some(unit) = self.stated_unit(key) else {
            return Some(Notice::about(NoticeCode::IgnoredKey, subject, "ignored"));
        };
        let unit = unit.other_than_metres()?;
        let message = format!("the key specifies lengths in {unit}; they are not converted to metres");
        Some(Notice::about(NoticeCode::PlacedCameras, subject, message))
    }
}

/// Returns the first three rows of a 4x4 matrix that consists of a rotation and a translation, or the reason why the
/// matrix has another form.
pub(crate) fn check_rigid(m: &[f64; 16]) -> Result<[f64; 12], String> {
    let last = [m[12], m[13], m[14], m[15]];
    // Programs that multiply or invert matrices leave rounding errors in the last row.
    if last.iter().zip([0.0, 0.0, 0.0, 1.0]).any(|(value, exact)| (value - exact).abs() > LAST_ROW_TOLERANCE) {
        let reason = match last {
            _ if [m[3], m[7], m[11], m[15]] == [0.0, 0.0, 0.0, 1.0] => {
                "the matrix is transposed (stored by columns); write it by rows"
            }
            [0.0, 0.0, 0.0, 0.0] => "write 0 0 0 1",
            [0.0, 0.0, 0.0, _] => {
                "the matrix is scaled by its last number: divide the whole matrix by this number, or only R if the \
                 translation already has the desired unit"
            }
            _ => "is the matrix transposed?",
        };
        return Err(format!(
            "the last row is {} {} {} {}; expected 0 0 0 1 ({reason})",
            last[0], last[1], last[2], last[3]
        ));
    }
    let rows = std::array::from_fn(|i| m[i]);
    check_rotation(rigid(&rows).0)?;
    Ok(rows)
}

/// Maximum difference between the last row of a pose's 4x4 matrix and 0 0 0 1.
const LAST_ROW_TOLERANCE: f64 = 1e-6;

/// Rejects a matrix that differs too much from a rotation.
pub(crate) fn check_rotation(r: DMat3) -> Result<(), String> {
    nearest_rotation(r).map(|_| ()).map_err(|message| {
        match focal_lengths_of(r).iter().all(|focal| *focal > MIN_FOCAL_IN_PLACE_OF_POSE) {
            true => "expected a pose [R | t], found a camera matrix K [R | t] in pixels; use \
                     raycam.Camera.from_matrix(P, size), or write K and the pose separately"
                .into(),
            false => message,
        }
    })
}

/// If a pose contains a matrix with focal lengths of at least this number of pixels, the matrix is reported as a camera
/// matrix.
const MIN_FOCAL_IN_PLACE_OF_POSE: f64 = 20.0;

/// The rotation in a matrix that is a rotation times a positive factor; `None` for other matrices.
pub(crate) fn rotation_of_any_scale(r: DMat3) -> Option<DMat3> {
    let scale = r.determinant().cbrt();
    let rotation = r * scale.recip();
    (scale > 0.0 && check_rotation(rotation).is_ok()).then_some(rotation)
}

/// The focal lengths [fx, fy] in pixels of a matrix K R of any scale.
pub(crate) fn focal_lengths_of(k_r: DMat3) -> [f64; 2] {
    let [a, b, c] = [0, 1, 2].map(|i| k_r.row(i));
    [a, b].map(|row| row.cross(c).length() / c.length_squared())
}

/// Returns R and t of a 3x4 matrix, given row by row.
pub(crate) fn rigid(m: &[f64; 12]) -> (DMat3, DVec3) {
    let column = |i: usize| DVec3::new(m[i], m[4 + i], m[8 + i]);
    (DMat3::from_cols(column(0), column(1), column(2)), column(3))
}

/// Number of coefficients in a name of OpenCV's lens model, as in `opencv5`, `radtan4` and `rational8`.
fn counted_opencv(name: &str) -> Option<usize> {
    let count = ["opencv", "radtan", "rational", "brown"].iter().find_map(|model| name.strip_prefix(model));
    count?.trim_start_matches('_').parse().ok()
}

/// Returns the lens for a model name that calibration tools use.
pub(crate) fn lens_named(name: &str, given: &[f64]) -> Result<Lens, String> {
    let lower = name.to_lowercase();
    // Python and ROS drivers also write "None" and "NONE".
    let has_none = matches!(
        &lower.replace([' ', '_', '-'], "")[..],
        "none" | "nodistortion" | "null" | "undistorted" | "rectified" | "ideal" | "linear" | "zero"
    );
    let model = match if has_none { "none" } else { name } {
        "plumb_bob" | "rational_polynomial" | "thin_prism" | "radtan" | "radial-tangential" | "opencv" | "brown" => {
            LensModel::OpenCv
        }
        _ if counted_opencv(&lower) == Some(given.len()) => LensModel::OpenCv,
        "equidistant" | "fisheye" | "equi" | "kannala_brandt" => LensModel::Fisheye,
        "fov" => LensModel::Fov,
        "none" | "" => {
            return match given.iter().find(|v| **v != 0.0) {
                None => Ok(Lens::Pinhole),
                Some(value) => Err(format!(
                    "the lens model is {name:?}, but a coefficient is {value}; specify the model of the coefficients, \
                     or remove them"
                )),
            };
        }
        // All other models have raycam's own names.
        _ => LensModel::from_name(name).map_err(|_| {
            let names = ["plumb_bob", "rational_polynomial", "radtan", "equidistant", "fov", "none"];
            format!("unknown distortion model {name:?}{}", suggestion(name, names))
        })?,
    };
    if model == LensModel::OpenCv && given.is_empty() {
        return Ok(Lens::Pinhole);
    }
    Lens::new(model, given).map_err(|error| error.to_string())
}
