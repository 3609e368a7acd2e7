//! Textures at work: what a pixel sees of them, by mip maps and ray cones.
//!
//! T. Akenine-Möller et al., "Improved Shader and Texture Level of Detail Using Ray Cones", JCGT 10(1), 2021. A cone is as
//! wide as the pixel's part that a sample stands for; where it meets a triangle it is an ellipse, whose short axis chooses
//! the level of the mip map and whose long axis is covered by several lookups. Rays that surfaces have scattered look at the
//! image itself: their many samples average it without bias.

use std::sync::{Arc, OnceLock};

use glam::{DVec2, DVec3, Vec2, Vec3};
use raycam_scene::{Camera, Image, Interpolation, Texels, Texture, TextureSampler};

/// Lookups along the long axis, at most.
const MOST: f32 = 16.0;

/// A texture, and its mip map once it is asked for.
#[derive(Debug)]
pub(crate) struct PreparedTexture {
    texture: Arc<Texture>,
    /// Each half as large as the one before, beginning with the image itself, between whose texels all is linear.
    levels: OnceLock<Vec<Texture>>,
}

/// How wide a ray is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Cone {
    /// Where it starts.
    pub width: f32,
    /// How much wider it is a metre on.
    pub spread: f32,
}

/// The part of a triangle that a cone covers, by its axes, from side to side, in weights of the second and third corner.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Footprint {
    axes: [Vec2; 2],
}

impl Cone {
    /// A pixel's share of each of its samples, measured in the middle of the picture; many samples see a texture as sharp
    /// as a quarter of a pixel.
    pub fn of_pixel(camera: &Camera, samples: u32) -> Self {
        let middle = DVec2::from(camera.size().map(f64::from)) / 2.0;
        let [(o, d), (o1, d1)] = [0.0, 1.0].map(|x| camera.ray(middle + DVec2::new(x, 0.0)));
        let share = (1.0 / f64::from(samples).sqrt()).max(0.25);
        let finite = |v: f64| {
            if v.is_finite() {
                (v * share) as f32
            } else {
                0.0
            }
        };
        Self {
            width: finite((o1 - o).length()),
            spread: finite((d1 - d).length()),
        }
    }

    /// The same ray after a distance.
    pub fn after(&self, distance: f32) -> Self {
        Self {
            width: self.width + self.spread * distance,
            ..*self
        }
    }

    /// What leaves a surface: mirrors keep it together, anything else ends it.
    pub fn scattered(&self, mirrored: bool) -> Self {
        if mirrored { *self } else { Self::default() }
    }
}

impl Footprint {
    /// Of a cone that has this width where its axis, `direction`, meets a triangle.
    pub fn new([a, b, c]: [DVec3; 3], direction: Vec3, width: f32) -> Self {
        if width <= 0.0 {
            return Self::default();
        }
        let (e1, e2) = ((b - a).as_vec3(), (c - a).as_vec3());
        let cross = e1.cross(e2);
        let (area2, normal) = (cross.length_squared(), cross.normalize_or_zero());
        if area2 <= 0.0 || normal == Vec3::ZERO {
            return Self::default();
        }
        let cosine = normal.dot(direction).abs();
        // At grazing angles the ellipse is no longer one; the triangle ends it.
        let long = width / cosine.max(1e-3);
        let along = (direction - normal * normal.dot(direction))
            .try_normalize()
            .unwrap_or_else(|| normal.any_orthonormal_vector());
        let weights = |v: Vec3| Vec2::new(v.cross(e2).dot(cross), e1.cross(v).dot(cross)) / area2;
        Self {
            axes: [weights(along * long), weights(normal.cross(along) * width)],
        }
    }

    /// Its axes in an image, in units of the whole image, by the corners' coordinates there.
    pub fn in_image(&self, [a, b, c]: [Vec2; 3]) -> [Vec2; 2] {
        self.axes.map(|axis| (b - a) * axis.x + (c - a) * axis.y)
    }

    /// Whether it is a point.
    pub fn is_point(&self) -> bool {
        self.axes == [Vec2::ZERO; 2]
    }
}

impl PreparedTexture {
    pub fn new(texture: Arc<Texture>) -> Self {
        Self {
            texture,
            levels: OnceLock::new(),
        }
    }

    /// The value at a point.
    pub fn lookup(&self, uv: [f32; 2]) -> [f32; 4] {
        self.texture.lookup(uv)
    }

    /// The mean over a footprint around a point, by its axes.
    pub fn mean(&self, uv: [f32; 2], axes: [Vec2; 2]) -> [f32; 4] {
        let size = Vec2::from(self.texture.image.size.map(|n| n as f32));
        let [p, q] = axes.map(|axis| (axis * size).length());
        let (long, major, minor) = if p >= q {
            (axes[0], p, q)
        } else {
            (axes[1], q, p)
        };
        // Coordinates that are not finite are the texture's to judge.
        if self.texture.sampler.mip.is_none() || !(major > 1.0 && major.is_finite()) {
            return self.lookup(uv);
        }
        let count = (major / minor.max(1.0)).ceil().clamp(1.0, MOST);
        let level = minor.max(major / count).max(1.0).log2();
        let mut sum = [0.0; 4];
        for i in 0..count as u32 {
            let at = Vec2::from(uv) + long * ((i as f32 + 0.5) / count - 0.5);
            let texel = self.at_level(at.to_array(), level);
            for (sum, value) in sum.iter_mut().zip(texel) {
                *sum += value / count;
            }
        }
        sum
    }

    fn at_level(&self, uv: [f32; 2], level: f32) -> [f32; 4] {
        let levels = self.levels.get_or_init(|| levels(&self.texture));
        let last = levels.len() - 1;
        let first = (level as usize).min(last);
        let fine = levels[first].lookup(uv);
        let between = level - first as f32;
        if first == last || between <= 0.0 {
            return fine;
        }
        let coarse = levels[first + 1].lookup(uv);
        [0, 1, 2, 3].map(|i| fine[i] + (coarse[i] - fine[i]) * between)
    }
}

fn levels(texture: &Texture) -> Vec<Texture> {
    let sampler = TextureSampler {
        magnification: Interpolation::Linear,
        ..texture.sampler
    };
    let of = |image: Arc<Image>| Texture { image, sampler };
    let mut levels = vec![of(texture.image.clone())];
    let mut image = texture.image.clone();
    while image.size != [1, 1] {
        image = Arc::new(halved(&image));
        levels.push(of(image.clone()));
    }
    levels
}

/// An image of half the size, each texel the mean of those that it covers: linear, so that no light is lost.
fn halved(image: &Image) -> Image {
    let [width, height] = image.size;
    let [w, h] = image.size.map(|n| (n / 2).max(1));
    let mean = |x: u32, y: u32| {
        let mut sum = [0.0f32; 4];
        for (row, share) in covered(y, height, h) {
            for (column, part) in covered(x, width, w) {
                let texel = image
                    .texels
                    .linear(row as usize * width as usize + column as usize);
                for (sum, value) in sum.iter_mut().zip(texel) {
                    *sum += value * share * part;
                }
            }
        }
        sum
    };
    let all = (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
    let texels = match image.texels {
        Texels::Float(_) => Texels::Float(all.map(|(x, y)| mean(x, y)).collect()),
        _ => Texels::Linear16(
            all.map(|(x, y)| mean(x, y).map(|v| (v * 65535.0 + 0.5) as u16))
                .collect(),
        ),
    };
    Image {
        name: String::new(),
        size: [w, h],
        texels,
    }
}

/// The texels of an axis that texel `i` of a shorter one covers, and the share of it that each has.
fn covered(i: u32, long: u32, short: u32) -> impl Iterator<Item = (u32, f32)> {
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

    fn gray(size: [u32; 2], of: impl Fn(u32, u32) -> f32) -> Image {
        let texels = (0..size[0] * size[1])
            .map(|i| [of(i % size[0], i / size[0]); 4])
            .collect();
        Image {
            name: String::new(),
            size,
            texels: Texels::Float(texels),
        }
    }

    #[test]
    fn every_level_has_the_mean_of_the_image() {
        for size in [[8, 8], [7, 5], [1, 13], [64, 3]] {
            let image = gray(size, |x, y| ((x * 7 + y * 13) % 11) as f32);
            let mean = |image: &Image| {
                let count = image.texels.len();
                (0..count)
                    .map(|i| f64::from(image.texels.linear(i)[0]))
                    .sum::<f64>()
                    / count as f64
            };
            let expected = mean(&image);
            let texture = Texture {
                image: Arc::new(image),
                sampler: TextureSampler::default(),
            };
            let levels = levels(&texture);
            assert_eq!(levels.last().unwrap().image.size, [1, 1]);
            for level in &levels {
                let found = mean(&level.image);
                assert!((found / expected - 1.0).abs() < 1e-5, "{size:?}: {found}");
            }
        }
    }

    #[test]
    fn a_footprint_is_an_ellipse_on_the_triangle() {
        // A triangle of two by one metres; seen at 60 degrees along x the long axis is twice the width.
        let corners = [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y];
        let direction = Vec3::new(3f32.sqrt() / 2.0, 0.0, -0.5);
        let footprint = Footprint::new(corners, direction, 0.1);
        let [long, short] = footprint.in_image([Vec2::ZERO, Vec2::X, Vec2::Y]);
        assert!((long.abs() - Vec2::new(0.1, 0.0)).length() < 1e-6, "{long}");
        assert!(
            (short.abs() - Vec2::new(0.0, 0.1)).length() < 1e-6,
            "{short}"
        );
        assert!(Footprint::new(corners, direction, 0.0).is_point());
    }

    #[test]
    fn a_wide_footprint_sees_the_mean_and_a_narrow_one_the_texel() {
        let image = gray([64, 64], |x, y| ((x + y) % 2) as f32);
        let texture = PreparedTexture::new(Arc::new(Texture {
            image: Arc::new(image),
            sampler: TextureSampler {
                mip: Some(Interpolation::Linear),
                ..TextureSampler::default()
            },
        }));
        let at = [10.5 / 64.0, 20.5 / 64.0];
        assert_eq!(texture.mean(at, [Vec2::splat(1e-4); 2])[0], 0.0);
        for axes in [
            [Vec2::X * 0.2, Vec2::Y * 0.2],
            [Vec2::X * 0.4, Vec2::Y * 0.03],
        ] {
            let found = texture.mean(at, axes)[0];
            assert!((found - 0.5).abs() < 0.01, "{found}");
        }
    }
}
