//! Pixels of one channel.

/// Pixels of one channel, row by row, `components` values each.
#[derive(Clone, Debug, PartialEq)]
pub enum ImagePlane {
    /// float32.
    F32 {
        /// Values per pixel.
        components: usize,
        /// `height * width * components` values.
        data: Vec<f32>,
    },
    /// float64.
    F64 {
        /// Values per pixel.
        components: usize,
        /// `height * width * components` values.
        data: Vec<f64>,
    },
    /// int32.
    I32 {
        /// Values per pixel.
        components: usize,
        /// `height * width * components` values.
        data: Vec<i32>,
    },
}

impl ImagePlane {
    /// True if every bit of every value is zero.
    pub(crate) fn is_all_zero(&self) -> bool {
        match self {
            ImagePlane::F32 { data, .. } => data.iter().all(|value| value.to_bits() == 0),
            ImagePlane::F64 { data, .. } => data.iter().all(|value| value.to_bits() == 0),
            ImagePlane::I32 { data, .. } => data.iter().all(|&value| value == 0),
        }
    }

    /// Copies the pixels of a region into this plane; false if `part` does not have the region's size and type.
    pub fn paste(&mut self, whole: [u32; 4], part: &ImagePlane, region: [u32; 4]) -> bool {
        match (self, part) {
            (ImagePlane::F32 { data, components }, ImagePlane::F32 { data: part, .. }) => {
                copy_rows(data, whole, part, region, *components)
            }
            (ImagePlane::F64 { data, components }, ImagePlane::F64 { data: part, .. }) => {
                copy_rows(data, whole, part, region, *components)
            }
            (ImagePlane::I32 { data, components }, ImagePlane::I32 { data: part, .. }) => {
                copy_rows(data, whole, part, region, *components)
            }
            _ => false,
        }
    }
}

/// Copies a region's rows into an enclosing region; false if the number of values does not match the region.
fn copy_rows<T: Copy>(to: &mut [T], whole: [u32; 4], from: &[T], region: [u32; 4], components: usize) -> bool {
    let [x, y, width, height] = region.map(|edge| edge as usize);
    let [left, top, stride, _] = whole.map(|edge| edge as usize);
    if from.len() != width * height * components {
        return false;
    }
    for (row, from) in from.chunks_exact(width * components).enumerate() {
        let start = ((y - top + row) * stride + x - left) * components;
        to[start..start + from.len()].copy_from_slice(from);
    }
    true
}
