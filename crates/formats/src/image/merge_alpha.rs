//! Merging of an opacity image into the alpha channel of a colour image.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use raycam_scene::{Image, Texels, Texture};

use crate::budget::Budget;
use crate::error::Result;

/// Returns an image with these colours, or white, and the opacity of another image: its alpha if it has any, otherwise
/// its luminance. The smaller image is resampled to the size of the larger image.
pub(crate) fn merge_alpha(color: Option<&Texture>, opacity: &Texture, budget: &mut Budget) -> Result<Image> {
    let sizes = [Some(opacity), color].into_iter().flatten();
    let sizes = sizes.map(|texture| texture.image.size);
    let pixels = |[columns, rows]: [u32; 2]| u64::from(columns) * u64::from(rows);
    let size = sizes.max_by_key(|size| pixels(*size)).unwrap_or_default();
    budget.take_pixels(Path::new(&opacity.image.name), pixels(size))?;
    let opacity = loaded(opacity)?;
    let color = color.map(loaded).transpose()?;
    let texels = &opacity.image.texels;
    let by_alpha = (0..texels.len()).any(|i| texels.linear(i)[3] != 1.0);
    let alphas = texel_centers(size).map(|uv| {
        let [r, g, b, a] = opacity.lookup(uv);
        if by_alpha {
            a
        } else {
            0.2126 * r + 0.7152 * g + 0.0722 * b // Rec. 709
        }
    });
    let (name, mut texels) = match color {
        Some(color) => (color.image.name.clone(), resized(&color, size)),
        None => {
            let white = vec![[255; 4]; size[0] as usize * size[1] as usize];
            (opacity.image.name.clone(), Texels::Srgb8(white))
        }
    };
    match &mut texels {
        Texels::Srgb8(texels) | Texels::Linear8(texels) => {
            let alphas = alphas.map(|a| (255.0 * a).round() as u8);
            texels.iter_mut().zip(alphas).for_each(|(t, a)| t[3] = a);
        }
        Texels::Linear16(texels) => {
            let alphas = alphas.map(|a| (65535.0 * a).round() as u16);
            texels.iter_mut().zip(alphas).for_each(|(t, a)| t[3] = a);
        }
        Texels::Float(texels) => texels.iter_mut().zip(alphas).for_each(|(t, a)| t[3] = a),
        Texels::Paged(_) => {} // not reached: the texels are in memory
    }
    Ok(Image::new(name, size, texels))
}

/// Returns the same texture with its texels in memory.
fn loaded(texture: &Texture) -> Result<Texture> {
    let Texture { image, sampler } = texture;
    let image = match image.texels.in_memory()? {
        Cow::Borrowed(_) => image.clone(),
        Cow::Owned(texels) => Arc::new(Image::new(image.name.clone(), image.size, texels)),
    };
    Ok(Texture { image, sampler: *sampler })
}

/// Returns the texture's texels in an image of this size.
fn resized(texture: &Texture, size: [u32; 2]) -> Texels {
    let Image { size: own, texels, .. } = &*texture.image;
    if *own == size {
        return texels.clone();
    }
    let texels = texel_centers(size).map(|uv| texture.lookup(uv));
    match texture.image.texels {
        Texels::Float(_) => Texels::Float(texels.collect()),
        _ => Texels::Linear16(texels.map(|t| t.map(|v| (65535.0 * v).round() as u16)).collect()),
    }
}

/// Texture coordinates of the texel centres of an image of this size, row by row.
fn texel_centers([columns, rows]: [u32; 2]) -> impl Iterator<Item = [f32; 2]> {
    let centre = |i: u32, length: u32| ((f64::from(i) + 0.5) / f64::from(length)) as f32;
    (0..rows).flat_map(move |y| (0..columns).map(move |x| [centre(x, columns), centre(y, rows)]))
}
