//! Folder that is opened as a whole, and the order of its files.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use crate::document::zip_members;
use raycam_formats::Result;
use raycam_formats::io::{AssetRoot, InputFile};

/// A folder and the names in it, sorted by the numbers in the names: 2 before 10.
pub(crate) struct Folder {
    pub(crate) path: PathBuf,
    pub(crate) names: Vec<String>,
}

impl Folder {
    /// Opens the folder at a path; a folder that does not exist has no names.
    pub(crate) fn open(path: &Path, assets: &AssetRoot) -> Self {
        let mut names = assets.folder_names(path);
        names.sort_by(|a, b| by_numbers(a, b));
        Self { path: path.into(), names }
    }

    /// Opens a subfolder, or another folder by a path with `..`.
    pub(crate) fn inner(&self, name: &str, assets: &AssetRoot) -> Self {
        Self::open(&self.path.join(name), assets)
    }

    /// True if the folder contains a file or folder with this name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.names.iter().any(|known| known == name)
    }

    /// Name of the folder itself.
    pub(crate) fn name(&self) -> String {
        let full = std::path::absolute(&self.path).unwrap_or_default();
        full.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
    }

    /// Names in the folder that end with `ending`.
    pub(crate) fn ending<'a>(&'a self, ending: &'a str) -> impl Iterator<Item = &'a String> {
        self.names.iter().filter(move |name| name.ends_with(ending) && !name.starts_with('.'))
    }

    /// Reads a file in the folder, and decompresses it if it is a gzip file.
    pub(crate) fn read(&self, name: &str, assets: &mut AssetRoot) -> Result<InputFile> {
        let packed = assets.read_reference(&self.path.join("any"), name)?;
        zip_members::unpacked(packed, &mut assets.budget)
    }

    /// Path of the file with this name in the folder.
    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }
}

/// Order of names: compares the numbers in the names as numbers, and the text between the numbers as text.
pub(crate) fn by_numbers(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    while !left.is_empty() && !right.is_empty() {
        let digits = |text: &str| text.len() - text.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let (m, n) = (digits(left), digits(right));
        if m > 0 && n > 0 {
            let (x, y) = (left[..m].trim_start_matches('0'), right[..n].trim_start_matches('0'));
            let order = x.len().cmp(&y.len()).then_with(|| x.cmp(y));
            if order != Ordering::Equal {
                return order;
            }
            (left, right) = (&left[m..], &right[n..]);
            continue;
        }
        let (c, d) = (left.chars().next().unwrap_or_default(), right.chars().next().unwrap_or_default());
        if c != d {
            return c.cmp(&d);
        }
        (left, right) = (&left[c.len_utf8()..], &right[d.len_utf8()..]);
    }
    left.len().cmp(&right.len()).then_with(|| a.cmp(b))
}
