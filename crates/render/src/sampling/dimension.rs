//! Dimensions of the sample space and the groups that are stratified jointly.

/// Purpose of a two-dimensional sample. Each purpose has its own index.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Dimension {
    /// Position in the pixel.
    PixelFilter,
    /// Direction of the ambient occlusion ray.
    AmbientOcclusion,
    /// Choice of the colour channel that a path transports after dispersion.
    Wavelength,
    /// Position on the aperture.
    Lens,
    /// Time in the exposure.
    Time,
    /// Choice of the lobe that scatters and of the light that is sampled, at a path vertex counted from 0.
    LobeAndLight(u32),
    /// Direction of the BSDF sample, at a path vertex counted from 0.
    Bsdf(u32),
    /// Opacity test and Russian roulette, at a path vertex counted from 0.
    OpacityAndRoulette(u32),
    /// Position on a light that is sampled at a path vertex, for each light sample of the vertex.
    Light(u32, usize),
    /// Colour and distance of a free flight through the first medium of a ray.
    FreeFlight(u32),
    /// Choice of a light along a ray through a medium, distance near to this light, and position on it.
    NearLight(u32, usize),
}

/// Upper bound on the dimensions of one path vertex.
const DIMENSIONS_PER_BOUNCE: u32 = 128;

/// Number of path vertices whose dimensions are stratified jointly.
const GROUPED_BOUNCES: u32 = 4;

/// Number of lowest bits of a point's index to which [`MIXING_MATRICES`] apply.
pub(crate) const MIXING_BITS: u32 = 10;

/// Mixing matrices of a group's dimensions, in the order of [`Dimension::group`]. The low bits of a point's index are
/// multiplied by a matrix with these columns above a unit diagonal (the first column is omitted). The matrices are
/// upper triangular, so that every dimension remains a (0, 2)-sequence.
///
/// A column-by-column search over many candidates minimised the boxes of volume 2^-q, in the four dimensions of two
/// pairs and for q up to k, that do not hold exactly 2^(k - q) of the first 2^k points. Large boxes have more weight,
/// as do pairs whose combination matters: pixel position with the first vertex, the directions at consecutive vertices,
/// and their lights.
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

/// Dimensions stratified jointly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DimensionGroup {
    /// Hash key shared by the group.
    pub key: u32,
    /// Row of [`MIXING_MATRICES`]. It is looked up before the loop over samples, because a table lookup inside would
    /// prevent vectorisation.
    pub mixing_row: [u32; 9],
    /// Mask of the index bits into which the higher bits are hashed, differently for each dimension. Without this hash,
    /// the dimensions of a group would repeat their combinations after this number of samples.
    pub low_bits: u32,
}

impl Dimension {
    /// Index of the dimension, unique within a path for up to 2^25 vertices.
    #[inline(always)]
    pub(crate) fn index(self) -> u32 {
        let at = |bounce: u32, pair: u32| DIMENSIONS_PER_BOUNCE.wrapping_mul(bounce.wrapping_add(1)).wrapping_add(pair);
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
            Dimension::FreeFlight(bounce) => at(bounce, 120),
            Dimension::NearLight(bounce, i) => at(bounce, 121 + i as u32),
        }
    }

    /// Group of the dimension; most dimensions have a group of their own.
    #[inline(always)]
    pub(crate) fn group(self) -> DimensionGroup {
        let of = |bounce: u32, which: u32| {
            let first = bounce - bounce % GROUPED_BOUNCES;
            // The first group includes the pixel position.
            let key = match first {
                0 => Dimension::PixelFilter.index(),
                _ => DIMENSIONS_PER_BOUNCE.wrapping_mul(first).wrapping_add(DIMENSIONS_PER_BOUNCE - 1),
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
            _ => DimensionGroup { key: self.index(), mixing_row: MIXING_MATRICES[0], low_bits: 0 },
        }
    }
}
