//! INI files of ROS's `camera_calibration` (`ost.txt`, `camera.ini`): a section `[image]` with the size, and one
//! section per camera, in which the name of each matrix is followed by lines with its elements. Source: ROS,
//! `camera_calibration_parsers`, parse_ini.cpp.

use std::path::Path;

use crate::document::{DocumentNode, Value};
use raycam_formats::{FormatError, Result};

/// Names in a camera's section, with the equivalent keys of ROS's YAML file.
const NAMES: [(&str, &str); 4] = [
    ("camera matrix", "camera_matrix"),
    ("distortion", "distortion_coefficients"),
    ("rectification", "rectification_matrix"),
    ("projection", "projection_matrix"),
];

/// True for a text with the sections of such an INI file.
pub(crate) fn detect(text: &str) -> bool {
    text.contains("[image]") && text.lines().any(|line| line.trim() == "camera matrix")
}

/// Reads the cameras of a file, each as the document of the equivalent YAML file.
pub(crate) fn cameras(text: &str, path: &Path) -> Result<Vec<DocumentNode>> {
    let mut size: Vec<(String, DocumentNode)> = Vec::new();
    let mut cameras: Vec<Vec<(String, DocumentNode)>> = Vec::new();
    let mut section = "";
    let mut key = None;
    for (i, line) in text.lines().enumerate() {
        let (line, number) = (line.trim(), i + 1);
        let fail = |message: String| FormatError::line(path, number, message);
        if line.is_empty() || line.starts_with(['#', ';']) {
            continue;
        }
        if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            (section, key) = (name, None);
            match name {
                "image" => size.clear(),
                _ => cameras.push([size.clone(), vec![("camera_name".into(), scalar(name, number))]].concat()),
            }
            continue;
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let entries = match cameras.last_mut() {
            _ if section == "image" => &mut size,
            Some(camera) if !section.is_empty() => camera,
            _ => return Err(fail(format!("{line:?} before the first section; expected [image]"))),
        };
        if words.iter().any(|word| word.parse::<f64>().is_err()) {
            let name = match (section, line) {
                ("image", "width" | "height") => Some(format!("image_{line}")),
                ("image", _) => None,
                _ => NAMES.iter().find(|(name, _)| *name == line).map(|(_, key)| (*key).to_owned()),
            };
            key = Some(name.ok_or_else(|| {
                fail(format!(
                    "{line:?} in [{section}] is neither a known name nor a row of \
                    numbers"
                ))
            })?);
            continue;
        }
        let key = key.clone().ok_or_else(|| fail(format!("numbers without a name in [{section}]")))?;
        let row = words.iter().map(|word| scalar(word, number));
        match entries.iter_mut().find(|(name, _)| *name == key) {
            _ if section == "image" => entries.extend(row.map(|node| (key.clone(), node))),
            Some((_, DocumentNode { value: Value::List(items), .. })) => items.extend(row),
            _ => entries.push((key, DocumentNode { value: Value::List(row.collect()), line: number })),
        }
    }
    match cameras.is_empty() {
        true => Err(FormatError::whole(path, "no camera section found; expected a section such as [narrow_stereo]")),
        false => Ok(cameras.into_iter().map(|entries| DocumentNode { value: Value::Map(entries), line: 1 }).collect()),
    }
}

fn scalar(word: &str, line: usize) -> DocumentNode {
    DocumentNode { value: Value::Scalar(word.into()), line }
}
