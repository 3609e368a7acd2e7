//! Errors as JSON: `{"text": ..., "code": ..., "line": ..., "file": ...}`. The line (from 1), its file and the code are
//! optional.

use std::path::Path;

use raycam_formats::{FormatError, Location};
use raycam_scene::ErrorCode;
use serde_json::json;

/// Error without a position.
pub fn failure(text: impl ToString) -> String {
    json!({ "text": text.to_string() }).to_string()
}

/// A bug in raycam, after which the instance cannot be used.
pub fn internal_failure(text: impl ToString) -> String {
    json!({ "text": text.to_string(), "code": ErrorCode::Internal.name() }).to_string()
}

/// Error of a file, with its code and position.
pub fn format_failure(error: &FormatError) -> String {
    let mut found = json!({ "text": error.to_string(), "code": error.code().name() });
    if let Some((file, line)) = place_of(error) {
        found["file"] = json!(file.display().to_string());
        found["line"] = json!(line);
    }
    found.to_string()
}

fn place_of(error: &FormatError) -> Option<(&Path, usize)> {
    match error {
        FormatError::Syntax { path, location: Location::Line(line), .. } => Some((path, *line)),
        FormatError::Schema { path, line, .. } => Some((path, *line)),
        FormatError::Named { place: Some((path, line)), .. } => Some((path, *line)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use raycam_formats::{Budget, MemoryFiles, load_from_memory};

    use super::*;

    #[test]
    fn world_file_errors_contain_their_line() {
        for (text, line) in [
            ("[[object]]\nname = 'a'\ncolour = 3\n", 3),
            ("[[object]]\n\nmesh = 'none.obj'\n", 3),
            ("[[object]\n", 1),
            ("[render]\nsamples = 0\n", 2),
        ] {
            let mut files = MemoryFiles::default();
            files.insert("w.toml", text.into());
            let error = load_from_memory(Path::new("w.toml"), files, &Budget::of_page()).unwrap_err();
            let told: serde_json::Value = serde_json::from_str(&format_failure(&error)).unwrap();
            assert_eq!((&told["line"], &told["file"]), (&json!(line), &json!("w.toml")), "{error}");
            assert_eq!((&told["text"], &told["code"]), (&json!(error.to_string()), &json!(error.code().name())));
        }
        assert_eq!(failure("a \"b\""), r#"{"text":"a \"b\""}"#);
    }
}
