//! Normal maps from height maps.

use raycam_scene::{Image, Texels, Texture, Wrap};

use crate::error::Result;

/// Returns the normals of a surface whose height is the brightness of `heights`: white is above black by the width of a
/// texel. Red is to the right, green upwards.
///
/// Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978. The normal is tilted against the slopes, which are
/// differences between the neighbours on both sides, as in other tools that convert heights to normals (DirectXTex,
/// `ComputeNormalMap`, with an amplitude of 1).
pub(crate) fn normals_from_height(heights: &Texture) -> Result<Image> {
    let Image { name, size, .. } = &*heights.image;
    let [columns, rows] = size.map(|side| side as usize);
    let texels = heights.image.texels.in_memory()?;
    let beside = |at: usize, length: usize, wrap| match wrap {
        Wrap::Repeat => [(at + length - 1) % length, (at + 1) % length],
        _ => [at.saturating_sub(1), (at + 1).min(length - 1)],
    };
    let height = |x: usize, y: usize| texels.linear(y * columns + x)[0];
    let to_u16 = |v: f32| (65535.0 * (0.5 * v + 0.5)).round() as u16;
    let mut normals = Vec::with_capacity(columns * rows);
    for y in 0..rows {
        let [above, below] = beside(y, rows, heights.sampler.wrap[1]);
        for x in 0..columns {
            let [left, right] = beside(x, columns, heights.sampler.wrap[0]);
            let across = 0.5 * (height(right, y) - height(left, y));
            let up = 0.5 * (height(x, above) - height(x, below));
            let length = (across * across + up * up + 1.0).sqrt();
            let [x, y, z] = [-across, -up, 1.0].map(|v| to_u16(v / length));
            normals.push([x, y, z, u16::MAX]);
        }
    }
    Ok(Image::new(name.clone(), *size, Texels::Linear16(normals)))
}
