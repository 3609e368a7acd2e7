//! Materials defined by the libraries of an OBJ file, found by the names that faces use.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use raycam_scene::{Notice, NoticeCode};

use crate::error::{Location, Result};
use crate::io::{AssetRoot, Diagnostics, companion, reference};
use crate::obj::mtl::{self, MtlMaterial};
use crate::obj::parse::Obj;

/// Materials of all libraries. Names are compared as bytes, which need not be UTF-8.
#[derive(Default)]
pub(crate) struct Library {
    /// Materials, each with its file.
    materials: Vec<(PathBuf, MtlMaterial)>,
    /// Index into `materials` by name; if several materials have the name, the last index.
    exact: HashMap<Vec<u8>, usize>,
    /// Index by the name in lower case and without a comment; `None` if several names differ only in upper and lower
    /// case.
    similar: HashMap<Vec<u8>, Option<usize>>,
}

/// Name without a comment, in lower case.
fn similar_name(name: &[u8]) -> Vec<u8> {
    reference::without_comment(name).unwrap_or(name).to_ascii_lowercase()
}

impl Library {
    /// Reads the libraries that an OBJ file refers to; without such references, reads the library with the file's name
    /// in the same folder.
    pub(crate) fn read(obj: &Obj, path: &Path, assets: &mut AssetRoot, notices: &mut Vec<Notice>) -> Result<Self> {
        let mut library = Self::default();
        let mut count = 0;
        for name in &obj.libraries {
            if let Some(source) = companion::optional_file(path, name, assets, notices)? {
                count += 1;
                library.add(&source.path, &source.bytes, notices)?;
            }
        }
        if count > 0 {
            return Ok(library);
        }
        let names = [path.file_stem(), path.file_stem(), path.file_name()];
        let names = names.into_iter().zip([b".mtl", b".MTL", b".mtl"]);
        let names: Vec<_> = names.filter_map(|(name, end)| Some([name?.as_encoded_bytes(), end].concat())).collect();
        let there = names.iter().find(|own| assets.is_file(path, own)).cloned();
        if let Some(own) = there.or_else(|| assets.in_other_case(path, names.first()?))
            && let Some(source) = companion::optional_file(path, &own, assets, notices)?
        {
            let named =
                if obj.libraries.is_empty() { "the file has no mtllib" } else { "the file named in mtllib is missing" };
            let (path, own) = (path.display(), source.path.display());
            notices.push(Notice::new(
                NoticeCode::SubstitutedFile,
                format!("{path}: {named}; {own} in the same folder is used"),
            ));
            library.add(&source.path, &source.bytes, notices)?;
        }
        Ok(library)
    }

    /// Adds the materials of a file; a file that cannot be read is omitted with a notice.
    fn add(&mut self, path: &Path, bytes: &[u8], notices: &mut Vec<Notice>) -> Result<()> {
        let materials = match mtl::parse(path, bytes, notices) {
            Err(error) if companion::can_be_left_out(&error) => {
                notices.push(Notice::new(NoticeCode::UnreadableFile, format!("{}: omitted: {error}", path.display())));
                return Ok(());
            }
            materials => materials?,
        };
        let mut twice = Diagnostics::default();
        for material in materials {
            let index = self.materials.len();
            let known = self.exact.insert(material.name.clone(), index);
            if known.is_some() {
                let message = format!(
                    "material {:?} is defined more than once; the last definition is used",
                    reference::shown(&material.name)
                );
                twice.note_kind(NoticeCode::DuplicateName, "twice", Location::Line(material.line), message);
            }
            let similar = self.similar.entry(similar_name(&material.name)).or_insert(Some(index));
            if *similar != Some(index) {
                *similar = known.filter(|known| *similar == Some(*known)).map(|_| index);
            }
            self.materials.push((path.into(), material));
        }
        notices.extend(twice.into_notices(path));
        Ok(())
    }

    /// Material to which a face's name refers, and true if the name differs in upper and lower case.
    pub(crate) fn find_material(&self, name: &[u8]) -> Option<(&(PathBuf, MtlMaterial), bool)> {
        if let Some(&index) = self.exact.get(name) {
            return Some((&self.materials[index], false));
        }
        let bare = reference::without_comment(name).unwrap_or(name);
        let index = self.exact.get(bare).copied().or_else(|| *self.similar.get(&similar_name(name))?)?;
        let found = &self.materials[index];
        let own = reference::without_comment(&found.1.name).unwrap_or(&found.1.name);
        Some((found, own != bare))
    }

    /// Material for the faces of a file without any `usemtl`, if the library has only one material; a notice reports
    /// the choice.
    pub(crate) fn only(&self, path: &Path, notices: &mut Vec<Notice>) -> Option<&(PathBuf, MtlMaterial)> {
        let path = path.display();
        match &self.materials[..] {
            [] => None,
            [only] => {
                let name = reference::shown(&only.1.name);
                notices.push(Notice::new(
                    NoticeCode::AssumedConvention,
                    format!("{path}: no usemtl; the only material of its library, {name:?}, is used"),
                ));
                Some(only)
            }
            more => {
                let count = more.len();
                notices.push(Notice::new(
                    NoticeCode::IgnoredElement,
                    format!("{path}: the file has no usemtl, so none of the {count} materials of its library is used"),
                ));
                None
            }
        }
    }
}
