//! What random numbers are for, and which of them belong together.

/// What a pair of dimensions is for. Another purpose needs a number of its own.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Dimension {
    /// Where in the pixel the sample lies.
    PixelFilter,
    /// The direction of the ambient occlusion ray.
    AmbientOcclusion,
    /// Which colour a path carries after dispersion.
    Wavelength,
    /// Where in the aperture.
    Lens,
    /// When in the exposure.
    Time,
    /// At the surfaces of a path, which count from 0: which part of the material scatters, and which light shines.
    LobeAndLight(u32),
    /// Where the surface scatters to.
    Bsdf(u32),
    /// Whether the surface is there, and whether the path goes on.
    OpacityAndRoulette(u32),
    /// Where on each of the lights that are sampled there.
    Light(u32, usize),
}

/// More than all pairs of one surface.
const DIMENSIONS_PER_BOUNCE: u32 = 128;

/// Surfaces of a path whose pairs belong together.
const GROUPED_BOUNCES: u32 = 4;

/// The bits of an index that [`MIXING_MATRICES`] is for.
pub(crate) const MIXING_BITS: u32 = 10;

/// By what the pairs of a group differ: the lowest bits of the index of a point are multiplied by a matrix whose columns are
/// these with ones on the diagonal, the first left out, for the pairs in the order of [`Dimension::group`]. The matrices are upper
/// triangular, so that each pair is a (0, 2)-sequence. They are found by trying many, column by column, so that of the
/// boxes of volume 2^-q in the four dimensions of two pairs, for q up to k, few hold another number than 2^(k - q) of the
/// first 2^k points; large boxes count more, and so do pairs that matter much together: where in the pixel and what
/// happens at the first surface, the directions taken at one surface and the next, and the light there.
const MIXING_MATRICES: [[u32; 9]; 1 + 3 * GROUPED_BOUNCES as usize] = [
    [0x0, 0x0, 0x0, 0x0, 0x0, 0x0, 0x0, 0x0, 0x0],
    [0x1, 0x0, 0x0, 0xd, 0x0, 0x17, 0x9, 0xfa, 0x1cc],
    [0x1, 0x0, 0x5, 0xf, 0x19, 0x32, 0x28, 0xc4, 0x5],
    [0x1, 0x0, 0x2, 0x6, 0x11, 0x3e, 0x1f, 0x62, 0x101],
    [0x1, 0x1, 0x6, 0x2, 0x1f, 0x3c, 0x28, 0x88, 0x95],
    [0x0, 0x0, 0x1, 0xf, 0x18, 0x21, 0x7e, 0xae, 0x64],
    [0x0, 0x2, 0x6, 0xf, 0xd, 0x0, 0x4, 0x80, 0x12f],
    [0x1, 0x0, 0x1, 0xe, 0x0, 0x4, 0x2f, 0x0, 0x1dd],
    [0x0, 0x3, 0x0, 0x4, 0xc, 0x6, 0x31, 0x7e, 0xd],
    [0x0, 0x1, 0x7, 0xf, 0x1b, 0x8, 0x6a, 0x2e, 0x13d],
    [0x0, 0x0, 0x0, 0x0, 0x7, 0x21, 0x5a, 0x97, 0xd1],
    [0x1, 0x1, 0x7, 0x5, 0x4, 0x14, 0x75, 0x92, 0x110],
    [0x0, 0x0, 0x1, 0x3, 0x19, 0x1e, 0x77, 0x61, 0x172],
];

/// Pairs that belong together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DimensionGroup {
    /// What these share and no other pair has.
    pub key: u32,
    /// The row of [`MIXING_MATRICES`] that a pair of it has. Looked up in a loop, it would keep that from being made one of vectors.
    pub mixing_row: [u32; 9],
    /// The bits of an index that those above are hashed into, each pair's own way: without, the pairs of a group would
    /// meet in the same combinations again after as many samples as these bits count.
    pub low_bits: u32,
}

impl Dimension {
    /// No two pairs of a path share it, until after 2^25 surfaces.
    #[inline(always)]
    pub(crate) fn index(self) -> u32 {
        let at = |bounce: u32, pair: u32| {
            DIMENSIONS_PER_BOUNCE
                .wrapping_mul(bounce.wrapping_add(1))
                .wrapping_add(pair)
        };
        match self {
            Dimension::PixelFilter => 0,
            Dimension::AmbientOcclusion => 1,
            Dimension::Wavelength => 2,
            Dimension::Lens => 3,
            Dimension::Time => 4,
            Dimension::LobeAndLight(bounce) => at(bounce, 0),
            Dimension::Bsdf(bounce) => at(bounce, 1),
            Dimension::OpacityAndRoulette(bounce) => at(bounce, 2),
            Dimension::Light(bounce, i) => at(bounce, 3 + i as u32),
        }
    }

    /// Which it belongs to; most are alone.
    #[inline(always)]
    pub(crate) fn group(self) -> DimensionGroup {
        let of = |bounce: u32, which: u32| {
            let first = bounce - bounce % GROUPED_BOUNCES;
            // The first group is that of where in the pixel the sample lies.
            let key = match first {
                0 => Dimension::PixelFilter.index(),
                _ => DIMENSIONS_PER_BOUNCE
                    .wrapping_mul(first)
                    .wrapping_add(DIMENSIONS_PER_BOUNCE - 1),
            };
            DimensionGroup {
                key,
                mixing_row: MIXING_MATRICES[(1 + 3 * (bounce % GROUPED_BOUNCES) + which) as usize],
                low_bits: (1 << MIXING_BITS) - 1,
            }
        };
        match self {
            Dimension::Bsdf(bounce) => of(bounce, 0),
            Dimension::Light(bounce, 0) => of(bounce, 1),
            Dimension::LobeAndLight(bounce) => of(bounce, 2),
            _ => DimensionGroup {
                key: self.index(),
                mixing_row: MIXING_MATRICES[0],
                low_bits: 0,
            },
        }
    }
}
