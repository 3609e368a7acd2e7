//! Screen mask: blocks of the image that any object can project to. All other blocks show the background and are not
//! traced.
//!
//! For a camera without distortion, a box projects into the rectangle around the projections of its corners. The boxes
//! are the instances' boxes, padded by the float32 errors of rays and triangles, so that no hit is lost and an image
//! is bit-identical with and without the mask.

use glam::{DVec2, DVec3};
use raycam_scene::Camera;
use raycam_scene::camera::{Center, Lens};

use crate::film::tile::{RAY_BLOCK, Tile};

/// Margin in pixels: samples are up to 1.5 pixels from a centre, with any filter.
const PIXEL_MARGIN: f64 = 2.0;
/// Relative error of a few float64 operations.
const EPS64: f64 = 1e-12;
/// Minimum number of pixels per box for which the mask is faster: a box takes eight projections, and a pixel saves at
/// most one ray.
const PIXELS_PER_BOX: u64 = 8;
/// Ratio of depth to distance below which a box may project anywhere.
const MIN_DEPTH_RATIO: f64 = 1e-6;

/// Blocks of a region that any object can project to.
pub(crate) struct ScreenMask {
    /// Column and row of the region's first pixel.
    first_pixel: [u32; 2],
    /// Number of blocks in a row of the region.
    blocks_per_row: usize,
    covered: Vec<bool>,
}

impl ScreenMask {
    /// Mask of a region; `None` if the mask is unknown, covers every block or saves no time.
    pub fn new(boxes: &[[DVec3; 2]], camera: &Camera, region: [u32; 4]) -> Option<Self> {
        let straight = matches!(camera.lens(), Lens::Pinhole) && camera.center() != Center::Infinity;
        if !straight || camera.aperture().is_some() || camera.motion().is_some() {
            return None;
        }
        let [x, y, width, height] = region;
        if u64::from(width) * u64::from(height) < PIXELS_PER_BOX * boxes.len() as u64 {
            return None;
        }
        let across = width.div_ceil(RAY_BLOCK) as usize;
        let mut mask = Self {
            first_pixel: [x, y],
            blocks_per_row: across,
            covered: vec![false; across * height.div_ceil(RAY_BLOCK) as usize],
        };
        for &bounds in boxes {
            let [lower, upper] = match project_bounds(camera, bounds)? {
                ScreenBounds::Behind => continue,
                // Rectangle relative to the centre of the first pixel.
                ScreenBounds::Rect(ends) => ends,
            };
            // Casts saturate at the region's edges.
            let first = (lower.floor() - DVec2::new(x.into(), y.into())).max(DVec2::ZERO);
            let end = upper.ceil() + 1.0 - DVec2::new(x.into(), y.into());
            let (width, height) = (width.min(end.x as u32), height.min(end.y as u32));
            let columns = first.x as usize / RAY_BLOCK as usize..width.div_ceil(RAY_BLOCK) as usize;
            for row in first.y as usize / RAY_BLOCK as usize..height.div_ceil(RAY_BLOCK) as usize {
                if let Some(seen) = mask.covered[row * across..][..across].get_mut(columns.clone()) {
                    seen.fill(true);
                }
            }
        }
        mask.covered.contains(&false).then_some(mask)
    }

    /// True if any object can project to a block of [`Tile::blocks`].
    pub fn covers(&self, block: &Tile) -> bool {
        let [column, row] = [block.x - self.first_pixel[0], block.y - self.first_pixel[1]].map(|at| at / RAY_BLOCK);
        self.covered[row as usize * self.blocks_per_row + column as usize]
    }
}

/// Bounds of a box's projection.
enum ScreenBounds {
    /// The box is behind the camera.
    Behind,
    /// Rectangle given by its lower and upper corner, in pixels from the centre of the first pixel.
    Rect([DVec2; 2]),
}

/// Bounds of the projection of a box; `None` if they are unknown.
fn project_bounds(camera: &Camera, bounds: [DVec3; 2]) -> Option<ScreenBounds> {
    let k = camera.k();
    let focal = DVec3::new(k.x_axis.x, k.y_axis.x, k.y_axis.y).abs().max_element();
    let (mut lower, mut upper) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let mut behind = 0;
    for corner in 0..8 {
        let pick = |axis: usize| bounds[corner >> axis & 1][axis];
        let point = DVec3::new(pick(0), pick(1), pick(2));
        let mut depth = 1.0;
        if camera.center() == Center::Point {
            let way = point - camera.c();
            depth = camera.r().row(2).dot(way);
            let grazing = MIN_DEPTH_RATIO * way.length() + EPS64 * (point.length() + camera.c().length());
            if depth < -grazing {
                behind += 1;
                continue;
            }
            if depth <= grazing {
                return None;
            }
        }
        let (pixel, _) = camera.project(point);
        let rounding = EPS64 * focal * (point.length() + camera.c().length()) / depth;
        if !(pixel + rounding).is_finite() {
            return None;
        }
        lower = lower.min(pixel - rounding);
        upper = upper.max(pixel + rounding);
    }
    let first = camera.pixel_center_of(0, 0);
    match behind {
        0 => Some(ScreenBounds::Rect([lower - first - PIXEL_MARGIN, upper - first + PIXEL_MARGIN])),
        8 => Some(ScreenBounds::Behind),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DMat3, DQuat};
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Light, Material, Object, PixelCenter, World};

    use super::*;
    use crate::control::Control;
    use crate::film::channel::Channel;
    use crate::film::frame::Frame;
    use crate::film::image_plane::ImagePlane;
    use crate::prepare::world::PreparedWorld;
    use crate::settings::{Filter, Integrator, Settings, TruthSurface};

    /// Pseudo-random numbers from -1 to 1.
    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }

        fn point(&mut self) -> DVec3 {
            DVec3::new(self.next(), self.next(), self.next())
        }
    }

    /// A few objects of any size and shape, `far` away from the world's origin.
    fn world(random: &mut Random, far: f64) -> World {
        let mut world = World::default();
        let away = far * random.point();
        for i in 0..1 + (3.0 * random.next().abs()) as usize {
            let mesh = match i % 3 {
                0 => primitive::torus(1.0, 0.1, 24).unwrap(),
                1 => primitive::plane([1.0, 2.0]).unwrap(),
                _ => primitive::sphere(1.0, 2).unwrap(),
            };
            let scale = DVec3::splat(10f64.powf(2.0 * random.next()));
            let turn = DQuat::from_scaled_axis(3.0 * random.point());
            let place = away + 8.0 * random.point();
            let place = DAffine3::from_scale_rotation_translation(scale, turn, place);
            let mesh = world.add_mesh(mesh);
            let material = world.add_material(Material::default()).unwrap();
            let object = Object::new("", mesh, vec![material], place);
            world.add_object(object).unwrap();
        }
        world
    }

    /// Camera that looks past the objects, at them or from inside them, near or far.
    fn camera(random: &mut Random, prepared: &PreparedWorld) -> Camera {
        let size = [83, 61];
        let distance = prepared.geometry.radius * 10f64.powf(1.5 * random.next());
        let from = prepared.geometry.origin + distance * random.point();
        let target = prepared.geometry.origin + prepared.geometry.radius * random.point();
        let [forward, side] = [(target - from).normalize(), random.point()];
        let right = forward.cross(side).normalize();
        let r = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        let focal = 80.0 * (distance / prepared.geometry.radius).max(0.3) * 10f64.powf(random.next());
        let mut k = DMat3::from_diagonal(DVec3::new(focal, 1.3 * focal, 1.0));
        k.y_axis.x = 0.2 * focal * random.next();
        (k.z_axis.x, k.z_axis.y) = (41.0 + 30.0 * random.next(), 30.0);
        if random.next() > 0.5 {
            let scale = 30.0 / prepared.geometry.radius * 10f64.powf(random.next());
            let k = DMat3::from_diagonal(DVec3::new(scale, scale, 1.0));
            return Camera::orthographic(k, r, from, size, PixelCenter::Half).unwrap();
        }
        Camera::new(k, r, from, size, PixelCenter::Integer).unwrap()
    }

    fn bits(frame: &Frame) -> Vec<Vec<u64>> {
        let of = |plane: &ImagePlane| match plane {
            ImagePlane::F32 { data, .. } => data.iter().map(|v| u64::from(v.to_bits())).collect(),
            ImagePlane::F64 { data, .. } => data.iter().map(|v| v.to_bits()).collect(),
            ImagePlane::I32 { data, .. } => data.iter().map(|&v| v as u64).collect(),
        };
        frame.planes.iter().map(|(_, plane)| of(plane)).collect()
    }

    #[test]
    fn masked_images_equal_fully_traced_images() {
        let random = &mut Random(5);
        let (mut left_out, mut shown, mut mixed) = (0, 0, 0);
        for round in 0..240 {
            let mut world = world(random, [0.0, 1e4][round / 2 % 2]);
            if round % 3 == 0 {
                world.add_light(Light::uniform_sky([0.3, 0.2, 0.1])).unwrap();
            }
            let mut prepared = PreparedWorld::new(&world, None, None, &Control::new()).unwrap();
            let camera = camera(random, &prepared);
            let error = |channel: &Channel| *channel == Channel::Error;
            let settings = Settings {
                integrator: [Integrator::Flat, Integrator::Ao][round % 2],
                samples: [1, 1, 3][round % 3],
                filter: [Filter::Box, Filter::BlackmanHarris][round / 3 % 2],
                channels: Channel::all().filter(|channel| !error(channel)).collect(),
                surface: [TruthSurface::First, TruthSurface::Solid][round / 5 % 2],
                transparent_background: round % 7 == 0,
                region: (round % 4 == 0).then_some([5, 3, 70, 50]),
                ..Settings::default()
            };
            let render =
                |world: &PreparedWorld| bits(&crate::render(world, &camera, &settings, &Control::new()).unwrap());
            let region = settings.region.unwrap_or([0, 0, 83, 61]);
            let mask =
                ScreenMask::new(&prepared.geometry.object_bounds, &prepared.geometry.camera_outside(&camera), region);
            let quick = render(&prepared);
            prepared.geometry.object_bounds.push([DVec3::NEG_INFINITY, DVec3::INFINITY]);
            assert!(ScreenMask::new(&prepared.geometry.object_bounds, &camera, region).is_none());
            assert!(quick == render(&prepared), "round {round}");
            let seen = mask.map_or(vec![true], |mask| mask.covered);
            left_out += usize::from(!seen.contains(&true));
            shown += usize::from(!seen.contains(&false));
            mixed += usize::from(seen.contains(&true) && seen.contains(&false));
        }
        assert!(left_out > 10 && shown > 10 && mixed > 100, "{left_out} {shown} {mixed}");
    }

    #[test]
    fn an_object_in_a_corner_masks_most_of_the_image() {
        let mut world = World::default();
        let mesh = world.add_mesh(primitive::sphere(0.1, 2).unwrap());
        let material = world.add_material(Material::default()).unwrap();
        let place = DAffine3::from_translation(DVec3::new(-1.5, -1.0, 4.0));
        let object = Object::new("", mesh, vec![material], place);
        world.add_object(object).unwrap();
        let prepared = PreparedWorld::new(&world, None, None, &Control::new()).unwrap();
        let k = DMat3::from_cols_array(&[100.0, 0.0, 0.0, 0.0, 100.0, 0.0, 40.0, 30.0, 1.0]);
        let size = [80, 60];
        let camera = Camera::new(k, DMat3::IDENTITY, DVec3::ZERO, size, PixelCenter::Integer);
        let mask = ScreenMask::new(&prepared.geometry.object_bounds, &camera.unwrap(), [0, 0, 80, 60]).unwrap();
        // The object's image is around (2.5, 5) with a radius of 2.5 pixels: 2 x 2 blocks with the margin.
        let seen: Vec<_> = (0..mask.covered.len()).filter(|&i| mask.covered[i]).collect();
        assert_eq!(seen, [0, 1, 10, 11]);
    }
}
