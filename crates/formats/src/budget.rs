//! Budgets: limits on the data that raycam reads and stores for a file.

use std::path::Path;

use crate::error::{FormatError, Result};

/// Limits on reading one world with every file that it refers to.
///
/// In addition to these limits, every reader checks each declared count against the remaining bytes of the file before
/// it allocates. Memory therefore stays proportional to the file size: a few hundred bytes never allocate gigabytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Bytes of all files together.
    pub bytes: u64,
    /// Vertices, face corners and other elements of all meshes, models and light profiles together.
    pub elements: u64,
    /// Pixels of all images together.
    pub pixels: u64,
    /// Pixels of one image.
    pub image_pixels: u64,
    /// Bytes of memory for textures and their mip maps; textures that do not fit are moved to a temporary file: see
    /// [`TextureCache`](raycam_scene::TextureCache). `None` keeps all textures in memory.
    pub texture_memory: Option<u64>,
    /// Steps for cutting polygons with reflex corners into triangles: several hundred per corner, and many more if a
    /// contour intersects itself.
    pub steps: u64,
}

impl Default for Budget {
    /// 4 GiB of files, 2³⁰ elements, 2²⁷ pixels (two textures of 8192 x 8192) in memory, 2²⁹ steps (about five seconds,
    /// usually sufficient for contours of a million corners).
    fn default() -> Self {
        Self {
            bytes: 4 << 30,
            elements: 1 << 30,
            pixels: 1 << 27,
            image_pixels: 1 << 27,
            texture_memory: None,
            steps: 1 << 29,
        }
    }
}

impl Budget {
    /// Returns the budget of a world whose textures may take `bytes` of memory: 64 GiB of files and 2³³ pixels (128
    /// textures of 8192 x 8192), which are stored on disk.
    pub fn with_texture_memory(bytes: u64) -> Self {
        Self { bytes: 64 << 30, pixels: 1 << 33, texture_memory: Some(bytes), ..Self::default() }
    }

    /// Returns the budget of a browser page, which has half a GiB of memory: 128 MiB of files, 2²² elements, 2²⁴ pixels
    /// (a texture of 4096 x 4096), 2²⁶ steps.
    pub fn of_page() -> Self {
        let (pixels, elements) = (1 << 24, 1 << 22);
        Self { bytes: 128 << 20, elements, pixels, image_pixels: pixels, texture_memory: None, steps: 1 << 26 }
    }

    /// Charges `amount` bytes of `path`.
    ///
    /// # Errors
    /// [`FormatError::Budget`] if the remaining budget is smaller.
    pub fn take_bytes(&mut self, path: &Path, amount: u64) -> Result<()> {
        charge(&mut self.bytes, path, "bytes", amount)
    }

    /// Charges `amount` vertices, corners or other elements of `path`.
    ///
    /// # Errors
    /// [`FormatError::Budget`] if the remaining budget is smaller.
    pub fn take_elements(&mut self, path: &Path, amount: u64) -> Result<()> {
        charge(&mut self.elements, path, "vertices and face corners", amount)
    }

    /// Charges `amount` pixels of `path`.
    ///
    /// # Errors
    /// [`FormatError::Budget`] if the remaining budget is smaller.
    pub fn take_pixels(&mut self, path: &Path, amount: u64) -> Result<()> {
        charge(&mut { self.image_pixels }, path, "pixels", amount)?;
        charge(&mut self.pixels, path, "pixels", amount)
    }
}

fn charge(left: &mut u64, path: &Path, what: &'static str, amount: u64) -> Result<()> {
    match left.checked_sub(amount) {
        Some(rest) => *left = rest,
        None => return Err(FormatError::Budget { path: path.into(), what, amount, left: *left }),
    }
    Ok(())
}
