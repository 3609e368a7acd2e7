//! Writer for one channel in a few rows of a tile.

use crate::film::channel::Channel;
use crate::film::image_plane::ImagePlane;
use crate::film::output_plane::PlaneData;
use crate::film::tile::TILE_SIZE;

/// Number of rows of a tile that are written together: the data from which they are computed fits the L1
/// cache. A full block's height is a multiple of this number.
pub(crate) const ROWS_PER_WRITE: u32 = 4;
const PIXELS_PER_WRITE: usize = (TILE_SIZE * ROWS_PER_WRITE) as usize;

/// Consecutive pixels in a row: their position in the strip (`to`), and the index of the first pixel within the tile
/// (`from`), which is `None` for background.
pub(crate) struct PixelRun {
    pub to: usize,
    pub from: Option<usize>,
    pub length: usize,
    /// True for the first run of a row.
    pub starts_row: bool,
}

/// A number type that planes may have.
pub(crate) trait PixelValue: Copy + Default + 'static {
    /// The plane's values if the plane has this type; otherwise an empty slice.
    fn slice_of(plane: &ImagePlane) -> &[Self];

    /// The plane's memory if the plane has this type.
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

/// Part of a channel's plane that one row of tiles covers.
pub(crate) struct ChannelStrip<'a> {
    pub channel: Channel,
    pub values: PlaneData<'a>,
    /// True if all values were initially 0.
    pub zero: bool,
}

/// Part of a strip that has not been written yet.
pub(crate) struct StripCursor<'a> {
    pub channel: Channel,
    values: PlaneData<'a>,
    /// Index in the strip of the first remaining pixel.
    position: usize,
    zero: bool,
    /// Background of the channel as a plane of one pixel, if the tile has background.
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

    /// True if the memory already contains the background value, so that untouched memory pages need not be written.
    pub fn is_already_background(&self) -> bool {
        self.zero && self.background.is_some_and(ImagePlane::is_all_zero)
    }
}

/// Writer for one channel in several rows of a tile.
pub(crate) struct RowWriter<'p, 'a> {
    pub cursor: &'p mut StripCursor<'a>,
    pub runs: &'p [PixelRun],
}

impl RowWriter<'_, '_> {
    /// Writes the value of each pixel, by its index in the tile. Values whose type differs from the channel's are not
    /// written.
    #[inline]
    pub fn write<T: PixelValue, const N: usize>(&mut self, mut value: impl FnMut(usize) -> [T; N]) {
        let blank = self.background_value();
        // All values are computed before the first copy: reading memory just written would stall on store forwarding.
        let mut pixels = [[T::default(); N]; PIXELS_PER_WRITE];
        let mut free = pixels.as_mut_slice();
        for run in self.runs {
            let (here, after) = free.split_at_mut(run.length);
            free = after;
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

    /// Writes the background to all pixels of the runs.
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
        let length = rows.next().map_or(0, |row| row.iter().map(|run| run.length).sum());
        let row = pixel.repeat(length);
        self.copy(&row, pixel.len(), true);
    }

    /// Value of the background pixel in this channel.
    fn background_value<T: PixelValue, const N: usize>(&self) -> [T; N] {
        let background = self.cursor.background.map(T::slice_of);
        let pixel = background.and_then(|pixel| pixel.first_chunk());
        pixel.copied().unwrap_or([T::default(); N])
    }

    /// Copies values to the pixels of the runs. If `always` is true, `values` are the values of one row, which is
    /// copied to every row.
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
            here.copy_from_slice(row);
            values = if always { values } else { after };
            (*rest, self.cursor.position) = (behind, to + length);
        }
    }
}
