//! What comes out: planes of pixels, and the merging of disjoint parts.

use crate::error::RenderError;
use crate::film::channel::Channel;
use crate::film::output_plane;
use crate::thread_pool::with_pool;

/// The pixels of one channel, row by row, `components` values each.
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

/// A picture, or a rectangular part of one, with its ground truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Width and height of the whole picture.
    pub size: [u32; 2],
    /// x, y, width and height of the part that the planes hold.
    pub region: [u32; 4],
    /// The channels in the order they were asked for.
    pub planes: Vec<(Channel, ImagePlane)>,
    /// What the one who looks at the picture should know.
    pub notices: Vec<String>,
}

impl Frame {
    /// The plane of a channel, if the frame has it.
    pub fn plane(&self, channel: Channel) -> Option<&ImagePlane> {
        self.planes
            .iter()
            .find(|(c, _)| *c == channel)
            .map(|(_, plane)| plane)
    }

    /// Joins disjoint parts of one picture to their bounding rectangle, which they must fill. The result is, bit for
    /// bit, what one call would have rendered.
    ///
    /// # Errors
    /// [`RenderError::Settings`] where there are none, where they are of different pictures or channels, overlap, or
    /// leave gaps.
    pub fn merge(parts: Vec<Frame>) -> Result<Frame, RenderError> {
        let fail = |message: &str| Err(RenderError::Settings(message.into()));
        let Some(first) = parts.first() else {
            return fail("no frames to merge");
        };
        let size = first.size;
        let channels: Vec<Channel> = first.planes.iter().map(|(channel, _)| *channel).collect();
        if parts.iter().any(|part| part.size != size) {
            return fail("the frames to merge are parts of pictures of different sizes");
        }
        if parts
            .iter()
            .any(|part| !part.planes.iter().map(|(channel, _)| channel).eq(&channels))
        {
            return fail("the frames to merge have different channels");
        }
        let Some(region) = covering_rectangle(&parts) else {
            return fail("the regions of the frames to merge overlap or leave gaps");
        };
        let mut planes = with_pool(None, || output_plane::allocate_planes(region, &channels))??;
        let mut notices: Vec<String> = vec![];
        for part in parts {
            for ((_, to), (_, from)) in planes.iter_mut().zip(&part.planes) {
                if !to.paste(region, from, part.region) {
                    return fail("a frame to merge has planes that do not fit its region");
                }
            }
            for notice in part.notices {
                if !notices.contains(&notice) {
                    notices.push(notice);
                }
            }
        }
        Ok(Frame {
            size,
            region,
            planes,
            notices,
        })
    }
}

/// The rectangle that regions fill without overlap, if there is one.
fn covering_rectangle(parts: &[Frame]) -> Option<[u32; 4]> {
    let edges = |part: &Frame| {
        let [x, y, width, height] = part.region.map(u64::from);
        [x, y, x + width, y + height]
    };
    let [left, top, right, bottom] = parts.iter().map(edges).reduce(|a, b| {
        [
            a[0].min(b[0]),
            a[1].min(b[1]),
            a[2].max(b[2]),
            a[3].max(b[3]),
        ]
    })?;
    let overlap = |a: [u64; 4], b: [u64; 4]| {
        a[0].max(b[0]) < a[2].min(b[2]) && a[1].max(b[1]) < a[3].min(b[3])
    };
    let disjoint =
        (0..parts.len()).all(|i| (0..i).all(|j| !overlap(edges(&parts[i]), edges(&parts[j]))));
    let area: u64 = parts
        .iter()
        .map(|part| u64::from(part.region[2]) * u64::from(part.region[3]))
        .sum();
    let inside = right <= u64::from(parts[0].size[0]) && bottom <= u64::from(parts[0].size[1]);
    let filled = disjoint && inside && area == (right - left) * (bottom - top);
    filled.then_some([left, top, right - left, bottom - top].map(|edge| edge as u32))
}

impl ImagePlane {
    /// Whether all its bits are zero.
    pub(crate) fn is_all_zero(&self) -> bool {
        match self {
            ImagePlane::F32 { data, .. } => data.iter().all(|value| value.to_bits() == 0),
            ImagePlane::F64 { data, .. } => data.iter().all(|value| value.to_bits() == 0),
            ImagePlane::I32 { data, .. } => data.iter().all(|&value| value == 0),
        }
    }

    /// Copies a part into its place; false where it does not have the values of its region.
    fn paste(&mut self, whole: [u32; 4], part: &ImagePlane, region: [u32; 4]) -> bool {
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

/// Copies the rows of a region into those of a region around it.
fn copy_rows<T: Copy>(
    to: &mut [T],
    whole: [u32; 4],
    from: &[T],
    region: [u32; 4],
    components: usize,
) -> bool {
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
