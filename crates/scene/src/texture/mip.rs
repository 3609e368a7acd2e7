//! Mip maps: images of half the size, down to a single texel.

use std::sync::Arc;

use crate::texture::cache::paged::PagedTexels;
use crate::texture::image::{Image, Texels};
use crate::texture::texel::TexelKind;
use crate::texture::texel_weight::{AlphaMean, TexelWeight};

impl Image {
    /// Returns the image's mip map: the image itself, then images that are each half as large as the previous image.
    ///
    /// Images of 8 and 16 bits give linear 16-bit levels; floats give floats. Texels are the means of the texels that
    /// they cover, so that every level has the image's mean up to rounding.
    pub fn mip_map(self: &Arc<Self>) -> Vec<Arc<Image>> {
        self.levels(TexelWeight::Area)
    }

    /// Same as [`Image::mip_map`] for an image whose alpha is the opacity: see
    /// [`Texture::lookup_by_alpha`](crate::Texture::lookup_by_alpha).
    pub fn mip_map_by_alpha(self: &Arc<Self>) -> Vec<Arc<Image>> {
        self.levels(TexelWeight::Alpha)
    }

    /// True if every texel has an alpha of 1.
    pub fn is_opaque(&self) -> bool {
        match &self.texels {
            Texels::Srgb8(texels) | Texels::Linear8(texels) => texels.iter().all(|texel| texel[3] == u8::MAX),
            Texels::Linear16(texels) => texels.iter().all(|texel| texel[3] == u16::MAX),
            Texels::Float(texels) => texels.iter().all(|texel| texel[3] == 1.0),
            Texels::Paged(texels) => texels.is_opaque(),
        }
    }

    fn levels(self: &Arc<Self>, weight: TexelWeight) -> Vec<Arc<Image>> {
        if let Texels::Paged(texels) = &self.texels {
            let level =
                |texels| Arc::new(Image::new(self.name.clone(), PagedTexels::size(&texels), Texels::Paged(texels)));
            return texels.mip_map(weight).map(level).collect();
        }
        let mut levels = vec![self.clone()];
        let mut image = self;
        while let Some(smaller) = image.halved(weight) {
            levels.push(Arc::new(smaller));
            image = &levels[levels.len() - 1];
        }
        levels
    }

    /// Returns an image of half the size; each texel is the mean of the texels that it covers, in linear values. `None`
    /// for an image of a single texel.
    pub(super) fn halved(&self, weight: TexelWeight) -> Option<Image> {
        let [width, height] = self.size;
        if self.size == [1, 1] {
            return None;
        }
        let [w, h] = halved(self.size);
        let mean = |x: u32, y: u32| {
            let (mut sum, mut by_alpha) = ([0.0f32; 4], AlphaMean::default());
            for (row, share) in covered_texels(y, height, h) {
                for (column, part) in covered_texels(x, width, w) {
                    let texel = self.texels.linear(row as usize * width as usize + column as usize);
                    if weight == TexelWeight::Alpha {
                        by_alpha.add(texel, share * part);
                    }
                    for (sum, value) in sum.iter_mut().zip(texel) {
                        *sum += value * share * part;
                    }
                }
            }
            if weight == TexelWeight::Alpha { by_alpha.texel() } else { sum }
        };
        let all = (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
        let texels = match self.texels.kind().halved() {
            TexelKind::Float => Texels::Float(all.map(|(x, y)| mean(x, y)).collect()),
            _ => Texels::Linear16(all.map(|(x, y)| mean(x, y).map(|v| (v * 65535.0 + 0.5) as u16)).collect()),
        };
        Some(Image::new("", [w, h], texels))
    }

    /// Memory of the texels and their mip map, in bytes.
    pub(super) fn bytes(&self) -> u64 {
        let count = |size: [u32; 2]| u64::from(size[0]) * u64::from(size[1]);
        let kind = self.texels.kind();
        let (mut size, mut smaller) = (self.size, 0);
        while size[0] > 1 || size[1] > 1 {
            size = halved(size);
            smaller += count(size);
        }
        count(self.size) * kind.bytes() as u64 + smaller * kind.halved().bytes() as u64
    }
}

fn halved(size: [u32; 2]) -> [u32; 2] {
    size.map(|n| (n / 2).max(1))
}

/// The texels along an axis of `long` texels that texel `i` of an axis of `short` texels covers; each with the fraction
/// of texel `i` that it occupies.
fn covered_texels(i: u32, long: u32, short: u32) -> impl Iterator<Item = (u32, f32)> {
    let ratio = f64::from(long) / f64::from(short);
    let (start, end) = (f64::from(i) * ratio, f64::from(i + 1) * ratio);
    let last = (end.ceil() as u32).min(long);
    (start as u32..last).map(move |texel| {
        let inside = end.min(f64::from(texel + 1)) - start.max(f64::from(texel));
        (texel, (inside / ratio) as f32)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mip_level_has_the_mean_of_the_image() {
        for size in [[8, 8], [7, 5], [1, 13], [64, 3]] {
            let value = |i: u32| (((i % size[0]) * 7 + (i / size[0]) * 13) % 11) as f32;
            let texels = (0..size[0] * size[1]).map(|i| [value(i); 4]).collect();
            let image = Arc::new(Image::new("", size, Texels::Float(texels)));
            let mean = |image: &Image| {
                let count = image.texels.len();
                (0..count).map(|i| f64::from(image.texels.linear(i)[0])).sum::<f64>() / count as f64
            };
            let expected = mean(&image);
            let levels = image.mip_map();
            assert_eq!(levels.last().unwrap().size, [1, 1]);
            let bytes: usize = levels.iter().map(|level| level.texels.len() * 16).sum();
            assert_eq!(image.bytes(), bytes as u64);
            for level in &levels {
                let found = mean(level);
                assert!((found / expected - 1.0).abs() < 1e-5, "{size:?}: {found}");
            }
        }
    }

    #[test]
    fn mip_levels_of_8_bit_images_have_16_bits() {
        let texels = (0..6).map(|i| [i, 2 * i, 3 * i, 255]).collect();
        let image = Arc::new(Image::new("", [3, 2], Texels::Linear8(texels)));
        assert_eq!(image.bytes(), 6 * 4 + 8);
        let [_, last] = &image.mip_map()[..] else {
            panic!("expected two levels");
        };
        // The mean of 0..=5 is 2.5; 8-bit values are multiplied by 257, so that 255 becomes 65535.
        assert_eq!(last.texels, Texels::Linear16(vec![[643, 1285, 1928, 65535]]));
    }
}
