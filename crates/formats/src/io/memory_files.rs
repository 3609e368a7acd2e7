//! Files in memory, for programs without a file system, such as browser pages.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::io::reference;

/// Files by their paths below one folder, with `/` between folders.
#[derive(Clone, Debug, Default)]
pub struct MemoryFiles {
    files: BTreeMap<PathBuf, Vec<u8>>,
}

impl MemoryFiles {
    /// Adds a file; replaces a file with the same path.
    pub fn insert(&mut self, path: impl AsRef<Path>, bytes: Vec<u8>) {
        self.files.insert(reference::normalize(path.as_ref()), bytes);
    }

    /// Bytes of a file.
    pub(crate) fn bytes_of(&self, path: &Path) -> Option<&[u8]> {
        self.files.get(path).map(Vec::as_slice)
    }

    /// Sorted names of files and folders in a folder.
    pub(crate) fn folder_names(&self, folder: &Path) -> Vec<OsString> {
        let inside = self.files.keys().filter_map(|path| path.strip_prefix(folder).ok()?.components().next());
        inside.map(|name| name.as_os_str().to_owned()).collect::<BTreeSet<_>>().into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_list_their_files_and_subfolders() {
        let mut files = MemoryFiles::default();
        for (path, bytes) in [("a.obj", "1"), ("./m/b.png", "2"), ("m/c/d.png", "3"), ("a.obj", "4")] {
            files.insert(path, bytes.into());
        }
        assert_eq!(files.folder_names(Path::new("")), ["a.obj", "m"]);
        assert_eq!(files.folder_names(Path::new("m")), ["b.png", "c"]);
        assert_eq!(files.bytes_of(Path::new("a.obj")), Some(&b"4"[..]));
        assert_eq!(files.bytes_of(Path::new("m")), None);
    }
}
