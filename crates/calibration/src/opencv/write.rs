//! Writing of cameras as OpenCV's FileStorage: YAML, or JSON or XML according to the file's extension.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DMat3, DVec3};
use raycam_scene::{LensModel, PixelCenter};

use crate::document::number_format::{joined, matrix_rows3, quoted, yaml_float};
use crate::{CameraRecord, OutputFiles};
use raycam_formats::Result;

enum StorageNode {
    Word(String),
    Text(String),
    Matrix(usize, usize, Vec<f64>),
    Map(Vec<(String, StorageNode)>),
}

pub(crate) fn write(records: &[CameraRecord], path: &Path) -> Result<OutputFiles> {
    let items: Result<Vec<_>, _> = records.iter().map(camera).collect();
    let mut items = items?;
    let mut root = Vec::new();
    if let [_] = records {
        root = items.remove(0);
    } else {
        for (i, (record, item)) in records.iter().zip(items).enumerate() {
            // FileStorage requires names that begin with a letter.
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
            let name = &record.name;
            let is_key = name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(plain);
            let key = if is_key { name.clone() } else { format!("camera{i}") };
            root.push((key, StorageNode::Map(item)));
        }
    }
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    Ok(OutputFiles::one(match extension.as_deref() {
        Some("json") => format!("{}\n", json(&StorageNode::Map(root), 0)),
        Some("xml") => format!("<?xml version=\"1.0\"?>\n<opencv_storage>\n{}</opencv_storage>\n", xml(&root)),
        _ => format!("%YAML:1.0\n---\n{}", yaml(&root, 0)),
    }))
}

fn camera(record: &CameraRecord) -> Result<Vec<(String, StorageNode)>> {
    let format = "OpenCV's FileStorage";
    let k = record.k_with(PixelCenter::Integer, format)?;
    let mut items = vec![("name".to_owned(), StorageNode::Text(record.name.clone()))];
    if let Some([width, height]) = record.size {
        items.push(("image_width".into(), StorageNode::Word(width.to_string())));
        items.push(("image_height".into(), StorageNode::Word(height.to_string())));
    }
    items.push(("camera_matrix".into(), StorageNode::Matrix(3, 3, matrix_rows3(k).to_vec())));
    let (d, name) = match record.lens.coefficients() {
        None => (vec![0.0; 5], None),
        Some((LensModel::OpenCv, d)) => (d.to_vec(), None),
        Some((LensModel::Fisheye, d)) => {
            items.push(("fisheye_model".into(), StorageNode::Word("1".into())));
            (d.to_vec(), None)
        }
        Some((model, d)) => (d.to_vec(), Some(model.name())),
    };
    if let Some(name) = name {
        return Err(record
            .unsupported_error(format, &format!("lens model {name} with distortion {d:?}; OpenCV has no such model")));
    }
    items.push(("distortion_coefficients".into(), StorageNode::Matrix(d.len(), 1, d)));
    if let Some(time) = record.time {
        items.push(("time".into(), StorageNode::Word(yaml_float(time))));
    }
    let pose = record.require_pose()?;
    if pose.r_c() != (DMat3::IDENTITY, DVec3::ZERO) {
        let (rotation, t) = pose.r_t();
        items.push(("R".into(), StorageNode::Matrix(3, 3, matrix_rows3(rotation.matrix()).to_vec())));
        items.push(("T".into(), StorageNode::Matrix(3, 1, t.to_array().to_vec())));
    }
    Ok(items)
}

fn yaml(items: &[(String, StorageNode)], depth: usize) -> String {
    let indent = "   ".repeat(depth);
    let mut text = String::new();
    for (key, item) in items {
        let _ = match item {
            StorageNode::Word(word) => writeln!(text, "{indent}{key}: {word}"),
            StorageNode::Text(word) => writeln!(text, "{indent}{key}: {}", quoted(word)),
            StorageNode::Matrix(rows, cols, values) => {
                let (inner, data) = (format!("{indent}   "), joined(values, ", "));
                writeln!(
                    text,
                    "{indent}{key}: !!opencv-matrix\n{inner}rows: {rows}\n{inner}cols: {cols}\n{inner}dt: d\n\
                     {inner}data: [ {data} ]"
                )
            }
            StorageNode::Map(items) => writeln!(text, "{indent}{key}:\n{}", yaml(items, depth + 1).trim_end()),
        };
    }
    text
}

fn json(item: &StorageNode, depth: usize) -> String {
    let indent = "    ".repeat(depth + 1);
    match item {
        StorageNode::Word(word) => word.clone(),
        StorageNode::Text(word) => quoted(word),
        StorageNode::Matrix(rows, cols, values) => format!(
            "{{\n{indent}\"type_id\": \"opencv-matrix\",\n{indent}\"rows\": {rows},\n{indent}\"cols\": {cols},\n\
             {indent}\"dt\": \"d\",\n{indent}\"data\": [ {} ]\n{}}}",
            joined(values, ", "),
            "    ".repeat(depth)
        ),
        StorageNode::Map(items) => {
            let entry = |(key, item): &(String, StorageNode)| format!("{indent}\"{key}\": {}", json(item, depth + 1));
            let entries: Vec<String> = items.iter().map(entry).collect();
            format!("{{\n{}\n{}}}", entries.join(",\n"), "    ".repeat(depth))
        }
    }
}

fn xml(items: &[(String, StorageNode)]) -> String {
    let mut text = String::new();
    let escaped = |word: &str| word.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    for (key, item) in items {
        let _ = match item {
            StorageNode::Word(word) => writeln!(text, "<{key}>{word}</{key}>"),
            StorageNode::Text(word) => writeln!(text, "<{key}>\"{}\"</{key}>", escaped(word)),
            StorageNode::Matrix(rows, cols, values) => writeln!(
                text,
                "<{key} type_id=\"opencv-matrix\">\n<rows>{rows}</rows>\n<cols>{cols}</cols>\n<dt>d</dt>\n<data>{}\
                 </data></{key}>",
                joined(values, " ")
            ),
            StorageNode::Map(items) => writeln!(text, "<{key}>\n{}</{key}>", xml(items)),
        };
    }
    text
}
