//! Errors of files that no format recognises.

use std::path::Path;

use crate::document::number_lines::looks_like;
use crate::document::world_file::is_world_file;
use crate::document::{DocumentNode, npy, toml_tree, unread, xml, yaml};
use crate::trajectory::named_columns::remedy_for_other_rotations;
use raycam_formats::io::InputFile;
use raycam_formats::{FormatError, Result};

/// Maximum length of a text of an unknown format in which words are searched for.
const MAX_EXAMINED_BYTES: usize = 1 << 20;

/// Error for a file that no reader recognises; `known` lists the supported formats.
pub(crate) fn unknown_file(source: &InputFile, known: &str) -> FormatError {
    let text = std::str::from_utf8(&source.bytes).unwrap_or("");
    if let Some((name, way)) = unread::named_format(&source.path, text).or_else(|| unread::name_of(&source.bytes, text))
    {
        return FormatError::unsupported(
            &source.path,
            format!("unsupported calibration format: {name}; {way} (supported formats: {known})"),
        );
    }
    if let Some(remedy) = remedy_for_other_rotations(text) {
        return FormatError::unsupported(&source.path, remedy);
    }
    if is_world_file(text) {
        return FormatError::unsupported(
            &source.path,
            "this is a raycam world file, not a calibration; read its cameras with raycam.load(path).cameras",
        );
    }
    let has = |words: &[&str]| words.iter().any(|word| text.contains(word));
    if text.len() < MAX_EXAMINED_BYTES && has(&["fov", "field_of_view"]) && !has(&["fx", "focal", "intrinsic"]) {
        return FormatError::unsupported(
            &source.path,
            "no focal length or camera matrix found, only a field of view; write \
             fx = fy = (width / 2) / tan(horizontal angle / 2), cx = (width - 1) / 2 and cy = (height - 1) / 2, or \
             create a camera with raycam.Camera.from_pose(location, fov=VERTICAL_DEGREES, size=(width, height))",
        );
    }
    if npy::is_npy(&source.bytes)
        && let Ok([_, columns @ (7 | 8)]) = npy::array(&source.bytes).as_ref().map(|array| &array.shape[..])
    {
        return FormatError::unsupported(
            &source.path,
            format!(
                "an array of {columns} columns; if these are poses, write a text whose header names the columns: \
                 np.savetxt(\"poses.txt\", array, header=\"{}tx ty tz qx qy qz qw\")",
                if *columns == 8 { "time " } else { "" }
            ),
        );
    }
    if looks_like(text, 7) {
        return FormatError::unsupported(
            &source.path,
            "each line has 7 numbers, a pose without a time. If the numbers are tx ty tz qx qy qz qw with north, \
             east, down axes, as in TartanAir, pass format=\"tartanair\" (--camera-format tartanair). Otherwise, write a \
             time at the beginning of each line, and load the file as a TUM trajectory",
        );
    }
    if source.path.extension().is_some_and(|ending| ending == "tfrecord") {
        return FormatError::unsupported(
            &source.path,
            "TFRecord files, such as Waymo's, are not supported; write camera_calibrations of a frame's context as \
             JSON (google.protobuf.json_format.MessageToJson)",
        );
    }
    if let Some(error) = error_of_document(&source.path, text) {
        return error;
    }
    FormatError::unsupported(
        &source.path,
        format!(
            "unknown calibration format; supported: {known}. If you specify the format (format=\"NAME\", \
             --camera-format NAME), the error message contains the line that cannot be read"
        ),
    )
}

/// Error of a text that is not valid in its language: XML, TOML, YAML or JSON; `None` for a valid text and for a text in
/// another language. Readers recognise a document only if it can be parsed.
fn error_of_document(path: &Path, text: &str) -> Option<FormatError> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let start = text.trim_start_matches('\u{feff}').trim_start();
    let (language, parse): (_, fn(&str, &Path) -> Result<DocumentNode>) = match &ending[..] {
        _ if start.starts_with('<') => ("XML", xml::parse),
        _ if toml_tree::is_toml(text) => ("TOML", toml_tree::parse),
        "yaml" | "yml" | "json" => ("YAML or JSON", yaml::parse),
        _ if start.starts_with('{') => ("YAML or JSON", yaml::parse),
        _ => return None,
    };
    match parse(text, path).err()? {
        FormatError::Syntax { path, location, message } => {
            let text = format!("{message} (read as {language})");
            Some(FormatError::Syntax { path, location, message: message.with_text(text) })
        }
        error => Some(error),
    }
}
