//! The size of a picture beside a calibration, of its PNG or JPEG header. Source: PNG specification, section 11.2.2;
//! ITU T.81, annex B.2.2.

use std::path::Path;

use raycam_formats::io::AssetRoot;
use raycam_scene::{Notice, NoticeCode};

/// Bytes in which the header of a picture is searched: as a rule the first, else all, because thumbnails and colour
/// profiles may stand before it.
const HEADERS: [u64; 2] = [1 << 12, 1 << 20];

/// Columns and rows of the first of some pictures that is there; names are relative to the file `from`.
pub(crate) fn size_of_picture<S: AsRef<str>>(
    assets: &mut AssetRoot,
    from: &Path,
    names: impl IntoIterator<Item = S>,
) -> Option<[u32; 2]> {
    names.into_iter().find_map(|name| {
        HEADERS.into_iter().find_map(|length| {
            let bytes = assets.read_reference_head(from, name.as_ref(), length).ok()?;
            png(&bytes).or_else(|| jpeg(&bytes))
        })
    })
}

/// The sizes of the cameras of a file that has none: each of its own picture, else that of the caller, else that of the
/// first picture that is there.
pub(crate) struct PictureSizes {
    known: Option<[u32; 2]>,
    first: Option<[u32; 2]>,
    measured: usize,
    lent: usize,
}

impl PictureSizes {
    /// The sizes of pictures whose names are relative to the file `from`; `known` is the size that the caller gives.
    pub(crate) fn new<S: AsRef<str>>(
        assets: &mut AssetRoot,
        from: &Path,
        names: impl IntoIterator<Item = S>,
        known: Option<[u32; 2]>,
    ) -> Self {
        let first = if known.is_none() { size_of_picture(assets, from, names) } else { None };
        Self { known, first, measured: 0, lent: 0 }
    }

    /// The size of a camera whose picture has one of some names.
    pub(crate) fn size<S: AsRef<str>>(
        &mut self,
        assets: &mut AssetRoot,
        from: &Path,
        names: impl IntoIterator<Item = S>,
    ) -> Option<[u32; 2]> {
        let own = size_of_picture(assets, from, names);
        self.measured += usize::from(own.is_some());
        self.lent += usize::from(own.is_none() && self.known.is_none() && self.first.is_some());
        own.or(self.known).or(self.first)
    }

    /// The notices of where the sizes are from.
    pub(crate) fn notices(&self) -> impl Iterator<Item = Notice> {
        let own = format!("the file has no sizes: {} cameras have those of their pictures", self.measured);
        let lent = format!(
            "{} cameras whose picture is not there have the size of the first picture that is (size= says another)",
            self.lent
        );
        let sources =
            [(self.measured, NoticeCode::UsedOtherFile, own), (self.lent, NoticeCode::AssumedConvention, lent)];
        sources.into_iter().filter(|(count, ..)| *count > 0).map(|(_, code, text)| Notice::new(code, text))
    }
}

fn png(bytes: &[u8]) -> Option<[u32; 2]> {
    let side = |at: usize| Some(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    bytes.starts_with(b"\x89PNG\r\n\x1a\n").then_some(())?;
    Some([side(16)?, side(20)?])
}

fn jpeg(bytes: &[u8]) -> Option<[u32; 2]> {
    bytes.starts_with(b"\xff\xd8").then_some(())?;
    let side = |at: usize| Some(u32::from(u16::from_be_bytes(bytes.get(at..at + 2)?.try_into().ok()?)));
    let mut at = 2;
    loop {
        let marker = *bytes.get(at + 1).filter(|_| bytes[at] == 0xff)?;
        match marker {
            0xff => at += 1,
            0x01 | 0xd0..=0xd7 => at += 2,
            // Frames, but for Huffman tables, extensions and arithmetic conditioning.
            0xc0..=0xcf if !matches!(marker, 0xc4 | 0xc8 | 0xcc) => return Some([side(at + 7)?, side(at + 5)?]),
            _ => at += 2 + side(at + 2)? as usize,
        }
    }
}
