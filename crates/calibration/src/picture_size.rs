//! Size of an image next to a calibration, from its PNG or JPEG header. Source: PNG specification, section 11.2.2; ITU
//! T.81, annex B.2.2.

use std::path::Path;

use raycam_formats::io::AssetRoot;
use raycam_scene::{Notice, NoticeCode, counted};

/// Numbers of bytes at the start of an image file in which the size is searched for: first a few, then many, because
/// thumbnails and colour profiles may precede the size.
const HEADERS: [u64; 2] = [1 << 12, 1 << 20];

/// Returns the numbers of columns and rows of the first existing image; names are relative to the file `from`.
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

/// Sizes of the cameras of a file without image sizes: the size of each camera's own image, otherwise the caller's
/// size, otherwise the size of the first existing image.
pub(crate) struct PictureSizes {
    known: Option<[u32; 2]>,
    first: Option<[u32; 2]>,
    measured: usize,
    lent: usize,
}

impl PictureSizes {
    /// Creates the sizes for images whose names are relative to the file `from`; `known` is the size specified by the
    /// caller.
    pub(crate) fn new<S: AsRef<str>>(
        assets: &mut AssetRoot,
        from: &Path,
        names: impl IntoIterator<Item = S>,
        known: Option<[u32; 2]>,
    ) -> Self {
        let first = if known.is_none() { size_of_picture(assets, from, names) } else { None };
        Self { known, first, measured: 0, lent: 0 }
    }

    /// Returns the size of a camera whose image has one of several names.
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

    /// Returns notices that state where the sizes come from.
    pub(crate) fn notices(&self) -> impl Iterator<Item = Notice> {
        let own = format!(
            "the file has no image sizes; they are read from the images ({})",
            counted(self.measured, "camera")
        );
        let lent = format!(
            "cameras without an image file get the size of the first existing image ({}; set another with size= or \
             --size)",
            counted(self.lent, "camera")
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
            // These markers start a frame; the excluded ones are Huffman tables, extensions and arithmetic
            // conditioning.
            0xc0..=0xcf if !matches!(marker, 0xc4 | 0xc8 | 0xcc) => return Some([side(at + 7)?, side(at + 5)?]),
            _ => at += 2 + side(at + 2)? as usize,
        }
    }
}
