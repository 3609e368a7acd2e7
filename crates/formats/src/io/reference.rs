//! File names as written by other files: bytes that need not be UTF-8.

use std::borrow::Cow;
use std::path::{Component, Path, PathBuf};

/// Converts a name to a path.
#[cfg(unix)]
pub(crate) fn path_of(name: &[u8]) -> &Path {
    use std::os::unix::ffi::OsStrExt;

    Path::new(std::ffi::OsStr::from_bytes(name))
}

/// Converts a name to a path; on this system, a name with invalid UTF-8 matches no file.
#[cfg(not(unix))]
pub(crate) fn path_of(name: &[u8]) -> &Path {
    Path::new(std::str::from_utf8(name).unwrap_or("\u{fffd}"))
}

/// Name as text, with replacements for invalid UTF-8.
pub(crate) fn shown(name: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(name)
}

/// Checks the form of a name; the error is the reason why the name is rejected.
pub(crate) fn check(name: &[u8]) -> Result<(), &'static str> {
    if name.is_empty() || name.contains(&0) {
        return Err("expected a file name");
    }
    if name.contains(&b'\\') {
        return Err("expected / between folders instead of \\");
    }
    let first = name.split(|&byte| byte == b'/').next().unwrap_or_default();
    if first.contains(&b':') || name.starts_with(b"//") {
        return Err("expected a path relative to the file that contains it, without a scheme or a drive");
    }
    Ok(())
}

/// Name in which each `\`, the separator on Windows, is replaced by `/`. A `\` before a space is a shell escape
/// and is removed.
pub(crate) fn with_slashes(name: &[u8]) -> Vec<u8> {
    let mut changed = Vec::with_capacity(name.len());
    for (i, &byte) in name.iter().enumerate() {
        match (byte, name.get(i + 1)) {
            (b'\\', Some(b' ')) => {}
            (b'\\', _) => changed.push(b'/'),
            _ => changed.push(byte),
        }
    }
    changed
}

/// Name without a following comment (white space and `#`); `None` if no comment follows.
pub(crate) fn without_comment(name: &[u8]) -> Option<&[u8]> {
    let at = name.windows(2).position(|pair| matches!(pair, [b' ' | b'\t', b'#']))?;
    Some(name[..at].trim_ascii_end()).filter(|name| !name.is_empty())
}

/// The name without text that some programs add: a following comment, quotes, the scheme `file:`, and percent encoding,
/// such as `%20` for a space. `None` if there is nothing to remove.
pub(crate) fn bare(name: &[u8]) -> Option<Vec<u8>> {
    let mut inner = without_comment(name).unwrap_or(name);
    for quote in [b'"', b'\''] {
        if let [first, middle @ .., last] = inner
            && *first == quote
            && *last == quote
        {
            inner = middle;
        }
    }
    let inner = inner.strip_prefix(b"file://").or_else(|| inner.strip_prefix(b"file:")).unwrap_or(inner);
    let mut found = Vec::with_capacity(inner.len());
    let mut rest = inner;
    while let [first, after @ ..] = rest {
        let digits = after.get(..2).filter(|two| *first == b'%' && two.iter().all(u8::is_ascii_hexdigit));
        let byte = digits.and_then(|two| u8::from_str_radix(std::str::from_utf8(two).ok()?, 16).ok());
        found.push(byte.unwrap_or(*first));
        rest = if byte.is_some() { &after[2..] } else { after };
    }
    Some(found).filter(|found| !found.is_empty() && found != name)
}

/// Trailing parts of a name with several folders, longest part first: for `C:/a/b/c.png` these are `a/b/c.png`,
/// `b/c.png` and `c.png`.
pub(crate) fn tails(name: &[u8]) -> Vec<Vec<u8>> {
    /// Maximum number of folders in the longest part.
    const MAX_PARTS: usize = 8;
    let plain = |part: &&[u8]| !part.is_empty() && *part != b"." && *part != b".." && !part.ends_with(b":");
    let parts: Vec<&[u8]> = name.split(|&byte| byte == b'/').filter(plain).collect();
    let first = parts.len().saturating_sub(MAX_PARTS);
    (first..parts.len()).map(|start| parts[start..].join(&b'/')).filter(|tail| tail != name).collect()
}

/// Path without `.` and `..`, computed only from its text.
pub(crate) fn normalize(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for component in path.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir => {
                normal.pop();
            }
            other => normal.push(other),
        }
    }
    normal
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_of_every_operating_system_are_split_into_parts() {
        let ends = |name: &[u8]| tails(name).into_iter().map(|t| String::from_utf8(t).unwrap()).collect::<Vec<_>>();
        assert_eq!(ends(b"C:/a/b.png"), ["a/b.png", "b.png"]);
        assert_eq!(ends(b"../m/./b.png"), ["m/b.png", "b.png"]);
        assert_eq!(ends(b"//server/b.png"), ["server/b.png", "b.png"]);
        assert_eq!(ends(b"b.png"), [""; 0]);
        assert_eq!(with_slashes(b"a\\my\\ b.png"), b"a/my b.png");
        let bare = |name: &[u8]| bare(name).map(|found| String::from_utf8(found).unwrap());
        assert_eq!(bare(b"a#1.png # wood").as_deref(), Some("a#1.png"));
        assert_eq!(bare(b"\"my tile.png\" # wood").as_deref(), Some("my tile.png"));
        assert_eq!(bare(b"'a.png'").as_deref(), Some("a.png"));
        assert_eq!(bare(b"file:///home/me/a.png").as_deref(), Some("/home/me/a.png"));
        assert_eq!(bare(b"my%20tile%2f.png").as_deref(), Some("my tile/.png"));
        for plain in ["a#1.png", "100%.png", "5%2", "%zz.png", "it's.png", "\"", "# wood"] {
            assert_eq!(bare(plain.as_bytes()), None, "{plain}");
        }
        assert_eq!(normalize(Path::new("/a/./b/../../../c")), Path::new("/c"));
    }
}
