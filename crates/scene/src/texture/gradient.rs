//! Derivatives of textures.

use crate::texture::{Axis, Texture};

impl Texture {
    /// Derivatives of the red channel with respect to the texture coordinates (u right, v down), which increase by 1
    /// across the whole image.
    ///
    /// They are the exact derivatives of the linear interpolation between texels, whatever the filter `magnification`
    /// is. At a texel's centre, where both sides differ, they are the mean of both sides.
    pub fn gradient(&self, uv: [f32; 2]) -> [f32; 2] {
        let image = &*self.image;
        let [columns, rows] = image.size;
        let [u, v] = [0, 1].map(|axis| {
            let wrap = self.sampler.wrap[axis];
            let size = image.size[axis];
            (Axis::new(uv[axis], size, wrap), Axis::around(uv[axis], size, wrap))
        });
        let ((u, (left_right, across)), (v, (above_below, down))) = (u, v);
        let red = |columns_of, rows_of| {
            let quad = image.texels.fetch_quad(columns as usize, columns_of, rows_of);
            quad.map(|row| row.map(|texel| texel[0]))
        };
        let [[a, b], [c, d]] = red(left_right, v.texels);
        let slope_u = (b - a) + ((d - c) - (b - a)) * v.fraction;
        let [[a, b], [c, d]] = red(u.texels, above_below);
        let slope_v = (c - a) + ((d - b) - (c - a)) * u.fraction;
        [slope_u * across * columns as f32, slope_v * down * rows as f32]
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;
    use std::sync::Arc;

    use crate::texture::{Image, Texels, Texture, TextureSampler, Wrap};

    fn texture(size: [u32; 2], wrap: Wrap, of: impl Fn(u32, u32) -> f64) -> Texture {
        let texels = (0..size[0] * size[1]).map(|i| [of(i % size[0], i / size[0]) as f32, 0.0, 0.0, 1.0]).collect();
        let image = Arc::new(Image::new("", size, Texels::Float(texels)));
        Texture { image, sampler: TextureSampler { wrap: [wrap; 2], ..TextureSampler::default() } }
    }

    #[test]
    fn gradient_of_random_texels_equals_the_difference_quotient_of_lookups() {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let waves = texture([7, 5], wrap, |x, y| f64::from((x * 37 + y * 101) % 17) - 8.0);
            for i in 0..200 {
                let at = [0, 1].map(|axis| f64::from(i * (axis * 70 + 61) % 997) / 331.0 - 1.3);
                let [columns, rows] = [7.0, 5.0];
                let fraction = |x: f64, n: f64| (x * n - 0.5).rem_euclid(1.0);
                let is_inside = |x: f64| (0.05..0.95).contains(&x);
                if !is_inside(fraction(at[0], columns)) || !is_inside(fraction(at[1], rows)) {
                    continue;
                }
                let step = 1e-3;
                let value = |du: f64, dv: f64| f64::from(waves.lookup([at[0] + du, at[1] + dv].map(|x| x as f32))[0]);
                let expected = [
                    (value(step, 0.0) - value(-step, 0.0)) / (2.0 * step),
                    (value(0.0, step) - value(0.0, -step)) / (2.0 * step),
                ];
                let found = waves.gradient(at.map(|x| x as f32));
                for (found, expected) in found.into_iter().zip(expected) {
                    assert!((f64::from(found) - expected).abs() < 0.02, "{wrap:?} {at:?}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn gradient_at_a_texel_centre_is_the_mean_of_both_sides() {
        let size = 64;
        let waves = texture([size, 1], Wrap::Repeat, |x, _| (TAU * (f64::from(x) + 0.5) / f64::from(size)).sin());
        for x in 0..size {
            let u = (f64::from(x) + 0.5) / f64::from(size);
            // The central difference of a sine equals its derivative times sin(h) / h.
            let step = TAU / f64::from(size);
            let expected = TAU * (TAU * u).cos() * step.sin() / step;
            let [found, down] = waves.gradient([u as f32, 0.3]);
            assert!((f64::from(found) - expected).abs() < 1e-4, "{found} {expected}");
            assert_eq!(down, 0.0);
        }
    }
}
