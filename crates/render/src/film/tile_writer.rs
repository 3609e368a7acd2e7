//! Some rows of one channel of a tile, which are written at once.

use raycam_bvh::{Pod, StreamingWriter};

use crate::film::channel::Channel;
use crate::film::image_plane::ImagePlane;
use crate::film::output_plane::PlaneData;
use crate::film::tile::TILE_SIZE;

/// Rows of a tile that are written together, and their pixels: what is known of these fits the nearest cache. Rows of a block
/// are a multiple.
pub(crate) const ROWS_PER_WRITE: u32 = 4;
const PIXELS_PER_WRITE: usize = (TILE_SIZE * ROWS_PER_WRITE) as usize;

/// Pixels in a row: where they lie in a strip, and which of the tile's they are, unless they are background.
pub(crate) struct PixelRun {
    pub to: usize,
    pub from: Option<usize>,
    pub length: usize,
    /// Whether it is the first of a row.
    pub starts_row: bool,
}

/// What planes are of.
pub(crate) trait PixelValue: Pod + 'static {
    /// The values of a plane of this kind; none of another.
    fn slice_of(plane: &ImagePlane) -> &[Self];

    /// What is to be written, if it is of this kind.
    fn slice_mut_of<'r, 'a>(values: &'r mut PlaneData<'a>) -> Option<&'r mut &'a mut [Self]>;
}

macro_rules! stored {
    ($($kind:ty: $plane:ident),*) => {$(
        impl PixelValue for $kind {
            fn slice_of(plane: &ImagePlane) -> &[Self] {
                match plane {
                    ImagePlane::$plane { data, .. } => data,
                    _ => &[],
                }
            }

            fn slice_mut_of<'r, 'a>(values: &'r mut PlaneData<'a>) -> Option<&'r mut &'a mut [Self]> {
                match values {
                    PlaneData::$plane(to) => Some(to),
                    _ => None,
                }
            }
        }
    )*};
}
stored!(f32: F32, f64: F64, i32: I32);

/// The rows of one channel that a row of tiles covers.
pub(crate) struct ChannelStrip<'a> {
    pub channel: Channel,
    pub values: PlaneData<'a>,
    /// Whether all of them were 0 at first.
    pub zero: bool,
}

/// What lies in a strip behind the pixels that are written.
pub(crate) struct StripCursor<'a> {
    pub channel: Channel,
    values: PlaneData<'a>,
    /// The number of its first pixel in the strip.
    position: usize,
    zero: bool,
    /// What is seen where nothing is.
    background: Option<&'a ImagePlane>,
}

impl<'a> StripCursor<'a> {
    pub fn new(strip: &'a mut ChannelStrip<'_>, background: Option<&'a ImagePlane>) -> Self {
        Self {
            channel: strip.channel,
            values: match &mut strip.values {
                PlaneData::F32(to) => PlaneData::F32(to),
                PlaneData::F64(to) => PlaneData::F64(to),
                PlaneData::I32(to) => PlaneData::I32(to),
            },
            position: 0,
            zero: strip.zero,
            background,
        }
    }

    /// Memory that nobody writes to costs nothing.
    pub fn is_already_background(&self) -> bool {
        self.zero && self.background.is_some_and(ImagePlane::is_all_zero)
    }
}

/// One channel of some pixels of a tile.
pub(crate) struct RowWriter<'p, 'a> {
    pub cursor: &'p mut StripCursor<'a>,
    pub runs: &'p [PixelRun],
    pub streaming: Option<&'p mut StreamingWriter<'a>>,
}

impl RowWriter<'_, '_> {
    /// Puts the value of each pixel in its place, by its number in the tile. Values are of the kind that the channel is of;
    /// others are not put.
    #[inline]
    pub fn write<T: PixelValue, const N: usize>(&mut self, mut value: impl FnMut(usize) -> [T; N]) {
        let blank = self.background_value();
        // All of them before the first is copied: what was written a moment ago is slow to be read.
        let mut pixels = [[T::default(); N]; PIXELS_PER_WRITE];
        let mut room = pixels.as_mut_slice();
        for run in self.runs {
            let (here, after) = room.split_at_mut(run.length);
            room = after;
            match run.from {
                Some(from) => {
                    for (i, pixel) in here.iter_mut().enumerate() {
                        *pixel = value(from + i);
                    }
                }
                None => here.fill(blank),
            }
        }
        self.copy(pixels.as_flattened(), N, false);
    }

    /// Puts the background.
    pub fn write_background(&mut self) {
        match self.cursor.background {
            Some(ImagePlane::F32 { data, .. }) => self.fill(data),
            Some(ImagePlane::F64 { data, .. }) => self.fill(data),
            Some(ImagePlane::I32 { data, .. }) => self.fill(data),
            None => {}
        }
    }

    fn fill<T: PixelValue>(&mut self, pixel: &[T]) {
        let mut rows = self.runs.chunk_by(|_, run| !run.starts_row);
        let length = rows
            .next()
            .map_or(0, |row| row.iter().map(|run| run.length).sum());
        let row = pixel.repeat(length);
        self.copy(&row, pixel.len(), true);
    }

    /// What the background has.
    fn background_value<T: PixelValue, const N: usize>(&self) -> [T; N] {
        let background = self.cursor.background.map(T::slice_of);
        let pixel = background.and_then(|pixel| pixel.first_chunk());
        pixel.copied().unwrap_or([T::default(); N])
    }

    /// Puts the values of the runs' pixels, those of one row after those of another, or the same `always`.
    fn copy<T: PixelValue>(&mut self, mut values: &[T], components: usize, always: bool) {
        let Some(rest) = T::slice_mut_of(&mut self.cursor.values) else {
            return;
        };
        for row in self.runs.chunk_by(|_, run| !run.starts_row) {
            let to = row.first().map_or(self.cursor.position, |run| run.to);
            let length = row.iter().map(|run| run.length).sum::<usize>();
            let before = (to - self.cursor.position) * components;
            let (_, behind) = std::mem::take(rest).split_at_mut(before);
            let (here, behind) = behind.split_at_mut(length * components);
            let (row, after) = values.split_at(here.len());
            match &mut self.streaming {
                Some(past) => past.copy(here, row),
                None => here.copy_from_slice(row),
            }
            values = if always { values } else { after };
            (*rest, self.cursor.position) = (behind, to + length);
        }
    }
}
