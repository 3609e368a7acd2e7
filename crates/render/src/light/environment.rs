//! An image around the world, or a clear sky.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::Vec3;
use raycam_scene::{Image, Up};

use super::{Around, LightSample};
use crate::light::environment_image::{Backdrop, Spots};
use crate::light::equirect::{Frame, Table};
use crate::light::preetham::Daylight;
use crate::soa::{Three, get, set};

/// A table for drawing directions has at most this many columns, and rows; larger images share its cells.
const MOST_CELLS: usize = 2048;

/// Columns and rows of the table of a clear sky.
const SKY_CELLS: [usize; 2] = [256, 128];

/// How many directions are asked for together: what they read fits into the first cache.
const BLOCK: usize = 64;

#[derive(Debug)]
pub(crate) struct Environment {
    frame: Frame,
    table: Option<Table>,
    behind: Behind,
}

/// What is seen behind everything.
#[derive(Debug)]
enum Behind {
    Image(Backdrop),
    Sky(Daylight),
}

/// Directions that were looked at: for an image what is to be read of it, which is on its way; for a sky, which is
/// computed and not read, the radiance itself.
enum Views<'a, const N: usize> {
    Image(&'a Backdrop, Spots<N>),
    Sky {
        places: [[f32; N]; 2],
        radiances: Three<f32, N>,
    },
}

impl<const N: usize> Views<'_, N> {
    /// Where a lane lies in the picture.
    fn place(&self, lane: usize) -> [f32; 2] {
        match self {
            Views::Image(_, spots) => spots.place(lane),
            Views::Sky { places, .. } => places.map(|values| values[lane]),
        }
    }
}

impl Environment {
    pub fn new(image: Arc<Image>, up: Up, yaw: f64, scale: f32) -> Self {
        let table = table(&image);
        Self {
            frame: Frame::new(up, yaw),
            table: table.filter(|_| scale > 0.0),
            behind: Behind::Image(Backdrop { image, scale }),
        }
    }

    /// A clear sky.
    pub fn of_sky(sky: Daylight, up: Up) -> Self {
        let frame = Frame::new(up, 0.0);
        Self {
            frame,
            table: table_of_sky(&sky, &frame),
            behind: Behind::Sky(sky),
        }
    }

    pub fn sample(&self, random: [f32; 2]) -> Option<LightSample> {
        let direction = self.table.as_ref()?.sample(&self.frame, random);
        let (radiance, pdf) = self.behind(direction);
        let around = Around {
            direction,
            radiance,
            pdf,
        };
        Some(around.sample())
    }

    /// The same of many, unless all is dark.
    pub fn sample_many(&self, random: &[[f32; 2]], out: &mut Vec<Around>) {
        out.clear();
        let Some(table) = &self.table else { return };
        for random in random.chunks(BLOCK) {
            let mut directions = [[0.0; BLOCK]; 3];
            table.sample_many(&self.frame, random, &mut directions);
            let views = self.views(&directions, random.len());
            out.extend((0..random.len()).map(|lane| {
                let (radiance, pdf) = self.at(&views, lane);
                Around {
                    direction: get(&directions, lane).into(),
                    radiance,
                    pdf,
                }
            }));
        }
    }

    /// The radiance out of a direction, and the density of [`Environment::sample`].
    pub fn behind(&self, direction: Vec3) -> (Vec3, f32) {
        let directions = direction.to_array().map(|value| [value]);
        self.at(&self.views(&directions, 1), 0)
    }

    /// The same of many: one after the other, what is read would be waited for.
    pub fn behind_many(&self, directions: impl Iterator<Item = Vec3>, out: &mut Vec<(Vec3, f32)>) {
        out.clear();
        let mut block = [[0.0; BLOCK]; 3];
        let mut count = 0;
        let mut find = |block: &Three<f32, BLOCK>, count| {
            let views = self.views(block, count);
            out.extend((0..count).map(|lane| self.at(&views, lane)));
        };
        for direction in directions {
            set(&mut block, count, direction.to_array());
            count += 1;
            if count == BLOCK {
                find(&block, count);
                count = 0;
            }
        }
        find(&block, count);
    }

    /// Looks at the first directions, and asks for what [`Environment::at`] reads there.
    fn views<const N: usize>(&self, directions: &Three<f32, N>, count: usize) -> Views<'_, N> {
        let mut places = [[0.0; N]; 2];
        self.frame.places(directions, &mut places);
        let views = match &self.behind {
            Behind::Image(backdrop) => Views::Image(backdrop, backdrop.spots(places)),
            Behind::Sky(sky) => Views::Sky {
                places,
                radiances: sky.radiances(directions),
            },
        };
        for lane in 0..if N > 1 { count } else { 0 } {
            if let Views::Image(backdrop, spots) = &views {
                backdrop.prefetch(spots, lane);
            }
            if let Some(table) = &self.table {
                table.prefetch(views.place(lane));
            }
        }
        views
    }

    fn at<const N: usize>(&self, views: &Views<N>, lane: usize) -> (Vec3, f32) {
        let pdf = match &self.table {
            Some(table) => table.pdf(views.place(lane)),
            None => 0.0,
        };
        let radiance = match views {
            Views::Image(backdrop, spots) => backdrop.radiance(spots, lane),
            Views::Sky { radiances, .. } => get(radiances, lane).into(),
        };
        (radiance, pdf)
    }
}

/// By the mean brightness of each cell as it is seen: linear between texels, which spreads every texel over its
/// neighbours by 1/8, 3/4, 1/8 both ways. So no direction that shines has the density 0.
fn table(image: &Image) -> Option<Table> {
    let [width, height] = image.size.map(|n| n as usize);
    let bright = |x: usize, y: usize| {
        let [r, g, b, _] = image
            .texels
            .linear(y * width + x)
            .map(|v| f64::from(v.max(0.0)));
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let share = width.max(height).div_ceil(MOST_CELLS).max(1);
    let [columns, rows] = [width.div_ceil(share), height.div_ceil(share)];
    let mut texels: Vec<f64> = vec![0.0; width * height];
    for y in 0..height {
        for x in 0..width {
            texels[y * width + x] = bright(x, y);
        }
    }
    let spread = |a: f64, b: f64, c: f64| (a + 6.0 * b + c) / 8.0;
    let seen = |x: usize, y: usize| {
        let row = |y: usize| {
            let at = |x: usize| texels[y * width + x];
            spread(at((x + width - 1) % width), at(x), at((x + 1) % width))
        };
        spread(
            row(y.saturating_sub(1)),
            row(y),
            row((y + 1).min(height - 1)),
        )
    };
    // A cell of the table may cover parts of texels: all that it touches count.
    let range = |cell: usize, cells: usize, texels: usize| {
        cell * texels / cells..((cell + 1) * texels).div_ceil(cells)
    };
    Table::new([columns, rows], |column, row| {
        let mut sum = 0.0;
        let (ys, xs) = (range(row, rows, height), range(column, columns, width));
        let count = (ys.len() * xs.len()) as f64;
        for y in ys {
            for x in xs.clone() {
                sum += seen(x, y);
            }
        }
        sum / count
    })
}

/// By the brightest of each cell's corners and its middle, so that the glow around the sun is not missed.
fn table_of_sky(sky: &Daylight, frame: &Frame) -> Option<Table> {
    let [columns, rows] = SKY_CELLS.map(|n| n as f64);
    Table::new(SKY_CELLS, |column, row| {
        let bright = |(dx, dy): (f64, f64)| {
            let (u, v) = ((column as f64 + dx) / columns, (row as f64 + dy) / rows);
            let [r, g, b] = sky.radiance(frame.direction(u, (PI * v).cos())).to_array();
            f64::from(r + g + b)
        };
        let places = [(0.5, 0.5), (0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)];
        places.map(bright).into_iter().fold(0.0, f64::max)
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use raycam_scene::{Texels, Texture, TextureSampler, Wrap};

    use super::*;

    /// Of an image whose every texel is another.
    fn made(size: [u32; 2]) -> (Environment, Texture) {
        let texel = |i: u32| [1, 3, 5, 7].map(|k| (1 + i * k * 503 % 1009) as f32 / 100.0);
        let image = Arc::new(Image {
            name: String::new(),
            size,
            texels: Texels::Float((0..size[0] * size[1]).map(texel).collect()),
        });
        let sampler = TextureSampler {
            wrap: [Wrap::Repeat, Wrap::Clamp],
            ..TextureSampler::default()
        };
        let environment = Environment::new(image.clone(), Up::Z, 20.0, 2.0);
        (environment, Texture { image, sampler })
    }

    fn unit(i: usize) -> Vec3 {
        let angle = i as f64 * 2.4;
        let z = 1.0 - 2.0 * ((i * 37) % 401) as f64 / 400.0;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(radius * angle.cos(), radius * angle.sin(), z).as_vec3()
    }

    /// Asks for many directions, and sees that each is what it is alone; the radiance of each.
    fn many(environment: &Environment, count: usize) -> Vec<Vec3> {
        let random = |i: usize| [(i * 53 % 211) as f32 / 210.0, (i % 97) as f32 / 96.0];
        let random: Vec<[f32; 2]> = (0..count).map(random).collect();
        let mut drawn = vec![];
        environment.sample_many(&random, &mut drawn);
        assert_eq!(drawn.len(), count);
        for (random, around) in random.iter().zip(&drawn) {
            let each = environment.sample(*random).unwrap();
            assert_eq!(format!("{:?}", around.sample()), format!("{each:?}"));
        }
        let mut behind = vec![];
        environment.behind_many((0..count).map(unit), &mut behind);
        let each = (0..count).map(|i| environment.behind(unit(i)));
        assert!(behind.iter().copied().eq(each));
        behind.into_iter().map(|(radiance, _)| radiance).collect()
    }

    const COUNTS: [usize; 5] = [0, 1, BLOCK - 1, BLOCK, 3 * BLOCK + 5];

    #[test]
    fn many_of_an_image_are_what_each_is() {
        for size in [[1, 1], [2, 1], [37, 20], [512, 256]] {
            let (environment, texture) = made(size);
            for count in COUNTS {
                for (i, radiance) in many(&environment, count).into_iter().enumerate() {
                    let texel = texture.lookup(environment.frame.place(unit(i)));
                    let off = radiance - Vec3::from_slice(&texel) * 2.0;
                    assert!(off.abs().max_element() < 2e-2, "{size:?}, {i}: {off}");
                }
            }
        }
    }

    #[test]
    fn many_of_a_clear_sky_are_what_each_is() {
        let made = || Daylight::new(Up::Y, DVec3::new(1.0, -0.4, 0.2), 3.0, 1.5).0;
        let (environment, sky) = (Environment::of_sky(made(), Up::Y), made());
        for count in COUNTS {
            for (i, radiance) in many(&environment, count).into_iter().enumerate() {
                assert_eq!(radiance, sky.radiance(unit(i)));
            }
        }
    }
}
