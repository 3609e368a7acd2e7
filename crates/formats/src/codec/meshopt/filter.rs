//! Filters of decoded attributes: compact, lossy representations of unit vectors, rotations, floats and colours.

use std::f32::consts::FRAC_1_SQRT_2;

/// Transform of decoded attributes: glTF's `filter`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// `NONE`: no transform.
    None,
    /// `OCTAHEDRAL`: unit vectors of four int8 or int16.
    Octahedral,
    /// `QUATERNION`: rotations of four int16.
    Quaternion,
    /// `EXPONENTIAL`: float32.
    Exponential,
    /// `COLOR`: colours of four uint8 or uint16; only in `KHR_meshopt_compression`.
    Color,
}

/// Decodes the elements in place; `filter` and `stride` have been validated.
pub(super) fn apply(filter: Filter, bytes: &mut [u8], stride: usize) -> Result<(), String> {
    match (filter, stride) {
        (Filter::None, _) => Ok(()),
        (Filter::Exponential, _) => {
            for word in bytes.as_chunks_mut::<4>().0 {
                *word = exponential(i32::from_le_bytes(*word)).to_le_bytes();
            }
            Ok(())
        }
        (Filter::Octahedral, 4) => each(bytes, i8::from_le_bytes, i8::to_le_bytes, |v| {
            Some(octahedral(v.map(i32::from), 127.0)?.map(|c| c as i8))
        }),
        (Filter::Octahedral, _) => each(bytes, i16::from_le_bytes, i16::to_le_bytes, |v| {
            Some(octahedral(v.map(i32::from), 32767.0)?.map(|c| c as i16))
        }),
        (Filter::Quaternion, _) => each(bytes, i16::from_le_bytes, i16::to_le_bytes, quaternion),
        (Filter::Color, 4) => each(bytes, u8::from_le_bytes, u8::to_le_bytes, |v| {
            let [y, co, cg, a] = v;
            let chroma = [co, cg].map(|c| i32::from(c.cast_signed()));
            Some(color(y.into(), chroma, a.into(), 255.0)?.map(|c| c as u8))
        }),
        (Filter::Color, _) => each(bytes, u16::from_le_bytes, u16::to_le_bytes, |v| {
            let [y, co, cg, a] = v;
            let chroma = [co, cg].map(|c| i32::from(c.cast_signed()));
            Some(color(y.into(), chroma, a.into(), 65535.0)?.map(|c| c as u16))
        }),
    }
}

/// Replaces each element (four components of `N` bytes) by the result of `decode`.
fn each<T: Copy, const N: usize>(
    bytes: &mut [u8],
    from: impl Fn([u8; N]) -> T,
    to: impl Fn(T) -> [u8; N],
    decode: impl Fn([T; 4]) -> Option<[T; 4]>,
) -> Result<(), String> {
    let components = bytes.as_chunks_mut::<N>().0.as_chunks_mut::<4>().0;
    for (index, element) in components.iter_mut().enumerate() {
        let decoded = decode(element.map(&from));
        let decoded = decoded.ok_or_else(|| format!("element {index} is invalid for its filter"))?;
        *element = decoded.map(&to);
    }
    Ok(())
}

/// True if `value` is 2^k - 1 with k >= 1, which encodes 1.0 as a signed integer of k + 1 bits.
fn is_one(value: i32) -> bool {
    value > 0 && (value + 1).count_ones() == 1
}

/// Converts octahedral coordinates to a unit vector (Cigolle et al., 2014), with `one` as the largest component; the
/// fourth component is unchanged.
fn octahedral([x, y, one, rest]: [i32; 4], scale: f32) -> Option<[f32; 4]> {
    if !is_one(one) {
        return None;
    }
    let [mut x, mut y] = [x, y].map(|c| c as f32 / one as f32);
    let z = 1.0 - x.abs() - y.abs();
    // The lower half of the octahedron is folded over the edges of the upper half.
    let fold = z.min(0.0);
    x -= fold.copysign(x);
    y -= fold.copysign(y);
    let length = (x * x + y * y + z * z).sqrt();
    let [x, y, z] = [x, y, z].map(|c| (c / length * scale).round());
    Some([x, y, z, rest as f32])
}

/// Reconstructs a unit quaternion from its three smaller components; the lowest bits of the fourth component select the
/// missing component.
fn quaternion(v: [i16; 4]) -> Option<[i16; 4]> {
    let one = v[3] | 3;
    if !is_one(one.into()) {
        return None;
    }
    let [x, y, z] = [v[0], v[1], v[2]].map(|c| f32::from(c) / f32::from(one) * FRAC_1_SQRT_2);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let mut out = [0; 4];
    for (i, c) in [w, x, y, z].into_iter().enumerate() {
        out[((v[3] & 3) as usize + i) % 4] = (c * 32767.0).round() as i16;
    }
    Some(out)
}

/// Value m 2^e of an exponent e of 8 bits and a mantissa m of 24 bits, both signed; exact if float32 can represent the
/// result.
fn exponential(value: i32) -> f32 {
    let (exponent, mantissa) = (i64::from(value >> 24), value << 8 >> 8);
    let power = f64::from_bits(((1023 + exponent) as u64) << 52);
    (power * f64::from(mantissa)) as f32
}

/// Converts YCoCg to RGBA; the highest set bit of alpha specifies the number of bits in the components.
fn color(y: i32, [co, cg]: [i32; 2], a: i32, scale: f32) -> Option<[f32; 4]> {
    let bits = a.checked_ilog2()?;
    let most = (2 << bits) - 1;
    let low = a & most >> 1;
    let alpha = low << 1 | low & 1;
    let rgba = [y + co - cg, y + cg, y - co - cg, alpha];
    let factor = scale / most as f32;
    Some(rgba.map(|c| (c as f32 * factor).round()))
}
