//! Weights of texels in means.

/// Weight of a texel's colour in a mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TexelWeight {
    /// The texel's area.
    Area,
    /// The texel's area times its alpha, which is the opacity.
    Alpha,
}

/// Mean of texels whose colours are weighted by their alpha.
#[derive(Clone, Copy, Debug, Default)]
pub struct AlphaMean {
    /// Sum of the weighted texels.
    plain: [f32; 4],
    /// Sum of the weighted colours times their alpha.
    colored: [f32; 3],
}

impl AlphaMean {
    /// Adds a texel; the weights of all texels add up to 1.
    pub fn add(&mut self, texel: [f32; 4], weight: f32) {
        for (sum, value) in self.plain.iter_mut().zip(texel) {
            *sum += value * weight;
        }
        for (sum, value) in self.colored.iter_mut().zip(texel) {
            *sum += value * texel[3] * weight;
        }
    }

    /// The mean; its colour is not multiplied by alpha. If all texels are transparent, the result is the plain mean.
    pub fn texel(&self) -> [f32; 4] {
        let [.., alpha] = self.plain;
        let [r, g, b] = self.colored.map(|sum| sum / alpha);
        if alpha > 0.0 { [r, g, b, alpha] } else { self.plain }
    }
}
