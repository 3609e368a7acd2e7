//! The views of texels with the largest weights, collected photograph by photograph.

use crate::error::RenderError;

/// Number of views that are kept per texel.
pub const MAX_VIEWS: usize = 8;

/// The kept views of a set of texels. Empty entries have the weight 0.
#[derive(Clone, Debug)]
pub struct TexelViews {
    /// Weights of the kept views.
    pub weights: Vec<[f32; MAX_VIEWS]>,
    /// Linear colours of the kept views.
    pub colors: Vec<[[f32; 3]; MAX_VIEWS]>,
    /// Photographs of the kept views.
    pub cameras: Vec<[i32; MAX_VIEWS]>,
    /// Number of photographs that show each texel.
    pub counts: Vec<i32>,
}

/// The texels that a photograph shows.
#[derive(Clone, Copy, Debug)]
pub struct PhotoTexels<'a> {
    /// The photograph's number.
    pub camera: i32,
    /// Indices of the texels, each at most once.
    pub index: &'a [i64],
    /// Weights of the views, more than 0.
    pub weights: &'a [f32],
    /// Linear colours.
    pub colors: &'a [[f32; 3]],
}

impl TexelViews {
    /// Bytes for each texel.
    pub const TEXEL_BYTES: usize = MAX_VIEWS * 20 + 4;

    /// Views of `count` texels, which no photograph shows yet.
    pub fn new(count: usize) -> Self {
        Self {
            weights: vec![[0.0; MAX_VIEWS]; count],
            colors: vec![[[0.0; 3]; MAX_VIEWS]; count],
            cameras: vec![[0; MAX_VIEWS]; count],
            counts: vec![0; count],
        }
    }

    /// Counts the views in a photograph. A view replaces the texel's kept view with the smallest weight if it has a
    /// larger weight.
    ///
    /// # Errors
    /// [`RenderError::Settings`] if the arrays differ in length, or an index is out of range.
    pub fn add(&mut self, photo: &PhotoTexels) -> Result<(), RenderError> {
        let (n, texels) = (photo.index.len(), self.counts.len());
        if [photo.weights.len(), photo.colors.len()] != [n; 2] {
            let (weights, colors) = (photo.weights.len(), photo.colors.len());
            let message = format!("{n} texels, {weights} weights and {colors} colors; expected equal numbers");
            return Err(RenderError::settings(message));
        }
        for ((&index, &weight), &color) in photo.index.iter().zip(photo.weights).zip(photo.colors) {
            let Some(texel) = usize::try_from(index).ok().filter(|&texel| texel < texels) else {
                return Err(RenderError::settings(format!("texel index {index}: expected 0 or more, below {texels}")));
            };
            self.counts[texel] += 1;
            let weights = &mut self.weights[texel];
            let slot = (1..MAX_VIEWS).fold(0, |low, other| if weights[other] < weights[low] { other } else { low });
            if weight > weights[slot] {
                weights[slot] = weight;
                self.colors[texel][slot] = color;
                self.cameras[texel][slot] = photo.camera;
            }
        }
        Ok(())
    }
}
