//! Textures: images that colour surfaces.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::color::{Rgb, linear_from_srgb8};
use crate::error::SceneError;

/// What a texture does beyond 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Wrap {
    /// Starts again.
    #[default]
    Repeat,
    /// Keeps its border.
    Clamp,
    /// Turns back.
    Mirror,
}

/// An sRGB image of 8 bits a channel, row 0 at the top, and how it is looked up.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The file it came from, or empty.
    pub name: String,
    /// Columns and rows.
    pub size: [u32; 2],
    /// Row-major sRGB texels.
    pub texels: Vec<[u8; 3]>,
    /// Wrap modes of u and v.
    pub wrap: [Wrap; 2],
}

impl Texture {
    /// Whether it has the texels that its size says.
    ///
    /// # Errors
    /// [`SceneError::World`] where it has not, or has none.
    pub fn validate(&self) -> Result<(), SceneError> {
        let [width, height] = self.size;
        if width == 0
            || height == 0
            || self.texels.len() as u64 != u64::from(width) * u64::from(height)
        {
            return Err(SceneError::World(format!(
                "texture {:?} has {} texels, expected {width} x {height}, and at least one",
                self.name,
                self.texels.len()
            )));
        }
        Ok(())
    }

    /// The bilinear colour at texture coordinates (u right, v down), linear; texel centres lie at half integers, and
    /// a texel at its centre comes back exactly. Interpolation is of linear values.
    pub fn lookup(&self, uv: [f32; 2]) -> Rgb {
        let [u, v] = [0, 1].map(|axis| Axis::new(uv[axis], self.size[axis], self.wrap[axis]));
        let texel =
            |x: usize, y: usize| linear_from_srgb8(self.texels[y * self.size[0] as usize + x]);
        let row = |y: usize| mix(texel(u.texels[0], y), texel(u.texels[1], y), u.fraction);
        mix(row(v.texels[0]), row(v.texels[1]), v.fraction)
    }
}

/// Between which two texels a coordinate lies along one axis, and how far from the first towards the second.
struct Axis {
    texels: [usize; 2],
    fraction: f32,
}

impl Axis {
    fn new(coordinate: f32, size: u32, wrap: Wrap) -> Self {
        let length = f64::from(size);
        let position = f64::from(coordinate) * length - 0.5;
        // Float32 coordinates of a texel's centre miss it by their rounding error, which a large image magnifies to a
        // visible share of the neighbour: that close to a centre is at it.
        let rounding =
            (4.0 * f64::from(f32::EPSILON) * length * f64::from(coordinate.abs())).min(1.0 / 256.0);
        let nearest = position.round();
        let position = if (position - nearest).abs() <= rounding {
            nearest
        } else {
            position
        };
        // Beyond 2^52 there are no fractions; the cast is then exact and takes NaN to 0.
        let first = position.floor().clamp(-4.5e15, 4.5e15) as i64;
        Self {
            texels: [first, first + 1].map(|i| wrap.index(i, i64::from(size))),
            fraction: (position - position.floor()) as f32,
        }
    }
}

impl Wrap {
    /// The texel that stands at position `i` of an axis of `size` texels.
    fn index(self, i: i64, size: i64) -> usize {
        (match self {
            Wrap::Repeat => i.rem_euclid(size),
            Wrap::Clamp => i.clamp(0, size - 1),
            Wrap::Mirror => {
                let i = i.rem_euclid(2 * size);
                i.min(2 * size - 1 - i)
            }
        }) as usize
    }
}

fn mix(a: Rgb, b: Rgb, t: f32) -> Rgb {
    [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * t)
}
