//! Stand-ins: files whose contents do not match their names, because a download or a checkout stored a pointer or an
//! error page instead.

use raycam_scene::ErrorCode;
use std::path::Path;

use crate::error::{FormatError, Result};

/// Number of bytes at the start of a file that are examined.
const HEAD_BYTES: usize = 512;

/// First bytes in lower case, and the corresponding reason.
const FIRST_BYTES: &[(&[u8], &str)] = &[
    (b"version https://git-lfs.github.com", "a Git LFS pointer instead of the file; run git lfs pull"),
    (b"version https://hawser.github.com", "a Git LFS pointer instead of the file; run git lfs pull"),
    (b"/annex/objects/", "a git-annex pointer instead of the file; run git annex get"),
    (b"404: not found", SERVER_ERROR),
    (b"404 not found", SERVER_ERROR),
    (b"{\"error\":\"", SERVER_ERROR),
    (b"<!doctype html", HTML_PAGE),
    (b"<html", HTML_PAGE),
    (b"<head", HTML_PAGE),
    (b"<body", HTML_PAGE),
];

const SERVER_ERROR: &str = "a server's error message instead of the file; download the file itself";
const HTML_PAGE: &str = "an HTML page instead of the file; download the file itself";

/// Rejects empty files and files that contain a pointer or an error page instead of data.
pub fn check(path: &Path, bytes: &[u8]) -> Result<()> {
    if bytes.is_empty() {
        let message = "the file is empty; its download or export may be incomplete";
        return Err(FormatError::whole(path, ErrorCode::EmptyFile.message(message)));
    }
    reason(bytes).map_or(Ok(()), |reason| Err(FormatError::whole(path, ErrorCode::PlaceholderFile.message(reason))))
}

/// The reason why the bytes are not the expected data; `None` if no such reason is found.
fn reason(bytes: &[u8]) -> Option<&'static str> {
    let head = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    // Files with any other first byte, such as most meshes and images, need no further test.
    if !matches!(head.first(), Some(b'<' | b'v' | b'V' | b'/' | b'{' | b'4')) {
        return None;
    }
    let head = head[..head.len().min(HEAD_BYTES)].to_ascii_lowercase();
    if let Some((_, reason)) = FIRST_BYTES.iter().find(|(start, _)| head.starts_with(start)) {
        return Some(reason);
    }
    let has = |word: &[u8]| head.windows(word.len()).any(|window| window == word);
    if (head.starts_with(b"<?xml") || head.starts_with(b"<!--")) && (has(b"<html") || has(b"<!doctype html")) {
        return Some(HTML_PAGE);
    }
    // Storage services return such a text instead of a file.
    let xml = head.starts_with(b"<?xml") && has(b"<error>") && has(b"<code>");
    let json = head.starts_with(b"{") && has(b"\"message\"") && has(b"\"documentation_url\"");
    (xml || json).then_some(SERVER_ERROR)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pointer_files_and_error_pages_are_distinguished_from_data() {
        for (bytes, expected) in [
            ("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n", "git lfs pull"),
            ("/annex/objects/SHA256E-s3--ab.obj\n", "git annex get"),
            ("\u{feff}\r\n  <!DOCTYPE HTML PUBLIC \"-//W3C\">", "HTML page"),
            ("<HTML lang=\"en\">", "HTML page"),
            ("<?xml version=\"1.0\"?>\n<!DOCTYPE html PUBLIC>\n<html>", "HTML page"),
            ("<?xml version=\"1.0\"?>\n<Error><Code>NoSuchKey</Code></Error>", "server's error message"),
            ("404: Not Found", "server's error message"),
            ("{\"message\": \"Not Found\", \"documentation_url\": \"https://docs\"}", "server's error message"),
        ] {
            assert!(reason(bytes.as_bytes()).is_some_and(|reason| reason.contains(expected)), "{bytes:?}");
        }
        for bytes in ["", "v 0 0 0\n", "version: 1\n", "<?xml version=\"1.0\"?><opencv_storage>", "/ a", "ply\n", "<"] {
            assert_eq!(reason(bytes.as_bytes()), None, "{bytes:?}");
        }
    }
}
