//! Ground truth: the channels of the exact ray through the pixel's centre, in float64.

use glam::{DMat3, DVec3};
use raycam_bvh::{ExactHit, Hit, NOTHING};

use crate::channel::Channel;
use crate::film::Strip;
use crate::prepare::PreparedWorld;
use crate::surface::facing_normal;

/// A pixel-centre ray and what it met.
pub(crate) struct Truth<'a> {
    pub world: &'a PreparedWorld,
    pub camera_from_world: DMat3,
    pub origin: DVec3,
    /// Unit length.
    pub direction: DVec3,
    pub hit: ExactHit,
}

/// Puts a channel's value of each pixel of a tile in its place in the strip; false where the channel is none of these.
pub(crate) fn write<'a>(
    channel: Channel,
    strip: &mut Strip,
    places: &[usize],
    truth: impl Fn(usize) -> Truth<'a>,
) -> bool {
    use Channel as C;
    match (channel, strip) {
        (C::Albedo, Strip::F32(strip)) => put(strip, places, |i| truth(i).albedo()),
        (C::Depth, Strip::F32(strip)) => put(strip, places, |i| [truth(i).depth()]),
        (C::Distance, Strip::F32(strip)) => put(strip, places, |i| [truth(i).distance()]),
        (C::Position, Strip::F64(strip)) => put(strip, places, |i| truth(i).position()),
        (C::Normal, Strip::F32(strip)) => put(strip, places, |i| in_world(truth(i).normal())),
        (C::NormalCamera, Strip::F32(strip)) => {
            put(strip, places, |i| truth(i).in_camera(Truth::normal))
        }
        (C::ShadingNormal, Strip::F32(strip)) => {
            put(strip, places, |i| in_world(truth(i).shading_normal()))
        }
        (C::ShadingNormalCamera, Strip::F32(strip)) => {
            put(strip, places, |i| truth(i).in_camera(Truth::shading_normal))
        }
        (C::Instance, Strip::I32(strip)) => put(strip, places, |i| [id(truth(i).hit.instance)]),
        (C::Category, Strip::I32(strip)) => put(strip, places, |i| [truth(i).category()]),
        (C::Triangle, Strip::I32(strip)) => put(strip, places, |i| [id(truth(i).hit.triangle)]),
        (C::Barycentric, Strip::F32(strip)) => put(strip, places, |i| truth(i).barycentric()),
        (C::Uv, Strip::F32(strip)) => put(strip, places, |i| truth(i).uv()),
        (C::Material, Strip::I32(strip)) => put(strip, places, |i| [truth(i).material()]),
        _ => return false,
    }
    true
}

/// Puts the value of each pixel of a tile in its place.
pub(crate) fn put<T: Copy, const N: usize>(
    strip: &mut [T],
    places: &[usize],
    value: impl Fn(usize) -> [T; N],
) {
    for (i, &place) in places.iter().enumerate() {
        strip[place * N..(place + 1) * N].copy_from_slice(&value(i));
    }
}

impl Truth<'_> {
    fn missed(&self) -> bool {
        self.hit.instance == NOTHING
    }

    /// The hit as the float32 kernel would tell it.
    fn rounded(&self) -> Hit {
        rounded(&self.hit)
    }

    fn albedo(&self) -> [f32; 3] {
        if self.missed() {
            return [0.0; 3];
        }
        self.world.base_color(&self.rounded()).to_array()
    }

    fn depth(&self) -> f32 {
        if self.missed() {
            return f32::INFINITY;
        }
        (self.hit.t * self.direction.dot(self.camera_from_world.row(2))) as f32
    }

    fn distance(&self) -> f32 {
        if self.missed() {
            f32::INFINITY
        } else {
            self.hit.t as f32
        }
    }

    fn position(&self) -> [f64; 3] {
        let point = if self.missed() {
            DVec3::NAN
        } else {
            self.origin + self.hit.t * self.direction
        };
        point.to_array()
    }

    fn normal(&self) -> DVec3 {
        if self.missed() {
            return DVec3::ZERO;
        }
        let corners = self.world.corners(self.hit.instance, self.hit.triangle);
        facing_normal(corners, self.direction)
    }

    fn shading_normal(&self) -> DVec3 {
        let geometric = self.normal();
        if self.missed() {
            return geometric;
        }
        let ExactHit {
            instance,
            triangle,
            u,
            v,
            ..
        } = self.hit;
        match self.world.corner_normals(instance, triangle, geometric) {
            Some([a, b, c]) => (a * (1.0 - u - v) + b * u + c * v).normalize_or(geometric),
            None => geometric,
        }
    }

    /// A normal in the camera's axes.
    fn in_camera(&self, normal: impl Fn(&Self) -> DVec3) -> [f32; 3] {
        in_world(self.camera_from_world * normal(self))
    }

    fn barycentric(&self) -> [f32; 3] {
        if self.missed() {
            return [0.0; 3];
        }
        let ExactHit { u, v, .. } = self.hit;
        [1.0 - u - v, u, v].map(|weight| weight as f32)
    }

    fn uv(&self) -> [f32; 2] {
        if self.missed() {
            return [f32::NAN; 2];
        }
        let ExactHit { u, v, .. } = self.hit;
        self.world
            .uv(self.hit.instance, self.hit.triangle, 0, [u, v])
            .unwrap_or([f32::NAN; 2])
    }

    fn category(&self) -> i32 {
        if self.missed() {
            return -1;
        }
        self.world.objects[self.hit.instance as usize].category
    }

    fn material(&self) -> i32 {
        if self.missed() {
            return -1;
        }
        let index = self
            .world
            .material_index(self.hit.instance, self.hit.triangle);
        i32::try_from(index).unwrap_or(-1)
    }
}

/// A normal as it is stored; 0 stays 0 whatever its sign.
fn in_world(normal: DVec3) -> [f32; 3] {
    (normal + 0.0).as_vec3().to_array()
}

/// An exact hit as the float32 kernel would tell it.
pub(crate) fn rounded(
    &ExactHit {
        t,
        u,
        v,
        instance,
        triangle,
    }: &ExactHit,
) -> Hit {
    Hit {
        t: t as f32,
        u: u as f32,
        v: v as f32,
        instance,
        triangle,
    }
}

/// An id as it is stored: -1 for nothing.
pub(crate) fn id(id: u32) -> i32 {
    i32::try_from(id).unwrap_or(-1)
}
