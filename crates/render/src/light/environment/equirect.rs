//! Equirectangular mapping between directions and image coordinates.

use glam::{DMat3, DVec3, Mat3, Vec3};
use raycam_bvh::{WithSimd, dispatch_simd};
use raycam_scene::Up;

use crate::lobes::shading_frame::{atan2_turns, sincos_turns};
use crate::sampling::piecewise_constant_2d::PiecewiseConstant2D;
use crate::soa::{Vec3xN, get_lane, set_lane};

/// Orientation of an equirectangular image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EquirectFrame {
    /// Matrix whose rows are the world directions of the image centre, of 90 degrees to its left, and of up.
    panorama_from_world: DMat3,
    /// The same matrix in float32, for computations per ray.
    rounded: Mat3,
}

impl EquirectFrame {
    /// Creates the orientation of an image that is rotated by `yaw`, in degrees as for a camera.
    pub fn new(up: Up, yaw: f64) -> Self {
        let vertical = up.axis();
        let ahead = match up {
            Up::Z => DVec3::X,
            Up::Y => DVec3::NEG_Z,
        };
        let left = vertical.cross(ahead);
        let (sin, cos) = yaw.to_radians().sin_cos();
        let middle = ahead * cos + left * sin;
        let rows = DMat3::from_cols(middle, vertical.cross(middle), vertical);
        Self { panorama_from_world: rows.transpose(), rounded: rows.transpose().as_mat3() }
    }

    /// Image coordinates of a direction: 0..=1 to the right, 0..=1 down.
    #[inline(always)]
    pub fn to_uv(&self, direction: Vec3) -> [f32; 2] {
        let d = self.rounded * direction;
        let around = atan2_turns(d.y, d.x);
        let u = if around <= 0.5 { 0.5 } else { 1.5 } - around;
        [u, 2.0 * atan2_turns(d.truncate().length(), d.z)]
    }

    /// Same as [`EquirectFrame::to_uv`], for many directions.
    pub fn to_uv_many<const N: usize>(&self, directions: &Vec3xN<f32, N>, places: &mut [[f32; N]; 2]) {
        dispatch_simd(ComputeUvs { frame: self, directions, places });
    }

    /// Unit direction at the image coordinate `u` and at the zenith angle whose cosine is `down`.
    #[inline(always)]
    pub fn direction(&self, u: f64, down: f64) -> Vec3 {
        // u begins half a turn from the image centre.
        let (sin, cos) = sincos_turns(u as f32);
        let radius = (1.0 - down * down).max(0.0).sqrt() as f32;
        self.rounded.transpose() * Vec3::new(-cos * radius, sin * radius, down as f32)
    }

    /// World direction of a vector that is given along three axes: to the image centre, to its left, and up.
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        self.panorama_from_world.transpose() * local
    }

    /// Samples a direction from a distribution over the image.
    pub fn sample(&self, distribution: &PiecewiseConstant2D, random: [f32; 2]) -> Vec3 {
        let mut directions = [[0.0]; 3];
        self.sample_many::<1>(distribution, &[random], &mut directions);
        get_lane(&directions, 0).into()
    }

    /// Same as [`EquirectFrame::sample`], for many random numbers; `random` may be shorter than the number of lanes.
    pub fn sample_many<const N: usize>(
        &self,
        distribution: &PiecewiseConstant2D,
        random: &[[f32; 2]],
        directions: &mut Vec3xN<f32, N>,
    ) {
        dispatch_simd(SampleDirections { frame: self, distribution, random, directions });
    }
}

/// Loop over lanes that computes [`EquirectFrame::to_uv_many`].
struct ComputeUvs<'a, const N: usize> {
    frame: &'a EquirectFrame,
    directions: &'a Vec3xN<f32, N>,
    places: &'a mut [[f32; N]; 2],
}

impl<const N: usize> WithSimd for ComputeUvs<'_, N> {
    #[inline(always)]
    fn run(self) {
        for lane in 0..N {
            let [u, v] = self.frame.to_uv(get_lane(self.directions, lane).into());
            self.places[0][lane] = u;
            self.places[1][lane] = v;
        }
    }
}

/// Loop over lanes that computes [`EquirectFrame::sample_many`].
struct SampleDirections<'a, const N: usize> {
    frame: &'a EquirectFrame,
    distribution: &'a PiecewiseConstant2D,
    random: &'a [[f32; 2]],
    directions: &'a mut Vec3xN<f32, N>,
}

impl<const N: usize> WithSimd for SampleDirections<'_, N> {
    #[inline(always)]
    fn run(self) {
        let (mut u, mut cos_theta) = ([0.0; N], [0.0; N]);
        self.distribution.sample_many(self.random, &mut u, &mut cos_theta);
        for lane in 0..N {
            let direction = self.frame.direction(u[lane], cos_theta[lane]);
            set_lane(self.directions, lane, direction.to_array());
        }
    }
}
