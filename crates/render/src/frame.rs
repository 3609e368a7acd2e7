//! What comes out: planes of pixels, and the merging of disjoint parts.

use crate::channel::Channel;
use crate::error::RenderError;

/// The pixels of one channel, row by row, `components` values each.
#[derive(Clone, Debug, PartialEq)]
pub enum Plane {
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
    pub planes: Vec<(Channel, Plane)>,
    /// What the one who looks at the picture should know.
    pub notices: Vec<String>,
}

impl Frame {
    /// The plane of a channel, if the frame has it.
    pub fn plane(&self, channel: Channel) -> Option<&Plane> {
        self.planes.iter().find(|(c, _)| *c == channel).map(|(_, plane)| plane)
    }

    /// Joins disjoint parts of one picture to their bounding rectangle, which they must fill. The result is, bit for
    /// bit, what one call would have rendered.
    pub fn merge(_parts: Vec<Frame>) -> Result<Frame, RenderError> {
        Err(RenderError::Settings("merge is not built yet".into()))
    }
}
