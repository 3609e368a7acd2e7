//! Frames: the channels of a rendered region, and merging of disjoint regions.

use raycam_scene::Notice;

use crate::error::RenderError;
use crate::film::channel::Channel;
use crate::film::image_plane::ImagePlane;
use crate::film::output_plane::allocate_planes;
use crate::thread_pool::with_pool;

/// A rendered image, or a rectangular part of an image, with its ground truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Width and height of the whole image.
    pub size: [u32; 2],
    /// x, y, width and height of the part stored in the planes.
    pub region: [u32; 4],
    /// Channels in the requested order.
    pub planes: Vec<(Channel, ImagePlane)>,
    /// Notices for the user about this frame.
    pub notices: Vec<Notice>,
}

impl Frame {
    /// Returns the plane of a channel, or none if the frame does not have the channel.
    pub fn plane(&self, channel: Channel) -> Option<&ImagePlane> {
        self.planes.iter().find(|(c, _)| *c == channel).map(|(_, plane)| plane)
    }

    /// Merges disjoint parts of one image into their bounding rectangle, which they must fill. The result is
    /// bit-identical to a single render of the rectangle.
    ///
    /// # Errors
    /// [`RenderError::Settings`] if there are no parts, if they belong to different images or have different channels,
    /// or if they overlap or leave gaps.
    pub fn merge(parts: Vec<Frame>) -> Result<Frame, RenderError> {
        let fail = |message: &str| Err(RenderError::settings(message));
        let Some(first) = parts.first() else {
            return fail("no frames to merge; expected at least one");
        };
        let size = first.size;
        let channels: Vec<Channel> = first.planes.iter().map(|(channel, _)| *channel).collect();
        if parts.iter().any(|part| part.size != size) {
            return fail("frames to merge belong to images of different sizes; expected parts of one image");
        }
        if parts.iter().any(|part| !part.planes.iter().map(|(channel, _)| channel).eq(&channels)) {
            return fail("frames to merge have different channels; expected the same channels in the same order");
        }
        let Some(region) = covering_rectangle(&parts) else {
            return fail(
                "regions of the frames to merge overlap or leave gaps; expected regions that fill a rectangle",
            );
        };
        let mut planes = with_pool(None, || allocate_planes(region, &channels))??;
        let mut notices: Vec<Notice> = vec![];
        for part in parts {
            for ((_, to), (_, from)) in planes.iter_mut().zip(&part.planes) {
                if !to.paste(region, from, part.region) {
                    return fail("the arrays of a frame to merge do not have the size of its region");
                }
            }
            for notice in part.notices {
                if !notices.contains(&notice) {
                    notices.push(notice);
                }
            }
        }
        Ok(Frame { size, region, planes, notices })
    }
}

/// Rectangle that the regions fill without overlap; `None` if they do not fill a rectangle.
fn covering_rectangle(parts: &[Frame]) -> Option<[u32; 4]> {
    let edges = |part: &Frame| {
        let [x, y, width, height] = part.region.map(u64::from);
        [x, y, x + width, y + height]
    };
    let [left, top, right, bottom] =
        parts.iter().map(edges).reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])])?;
    let overlap = |a: [u64; 4], b: [u64; 4]| a[0].max(b[0]) < a[2].min(b[2]) && a[1].max(b[1]) < a[3].min(b[3]);
    let disjoint = (0..parts.len()).all(|i| (0..i).all(|j| !overlap(edges(&parts[i]), edges(&parts[j]))));
    let area: u64 = parts.iter().map(|part| u64::from(part.region[2]) * u64::from(part.region[3])).sum();
    let inside = right <= u64::from(parts[0].size[0]) && bottom <= u64::from(parts[0].size[1]);
    let filled = disjoint && inside && area == (right - left) * (bottom - top);
    filled.then_some([left, top, right - left, bottom - top].map(|edge| edge as u32))
}
