//! Fog of a prepared world: the part of a ray inside the fog, and the fraction of light that passes.

use glam::{DVec3, Vec3};
use raycam_scene::World;

/// Fog of a world, in scene-local coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PreparedFog {
    /// Extinction of each colour, per metre.
    pub extinction: Vec3,
    pub albedo: Vec3,
    /// Mean cosine of scattering angles.
    pub g: f32,
    /// Unit vector that points upwards.
    pub up: DVec3,
    /// Scene-local height at which the fog ends; `None` for fog without a top.
    top: Option<f64>,
}

impl PreparedFog {
    /// The fog of a world with this scene-local origin; `None` for a world without fog, or with fog whose
    /// extinction is zero.
    pub fn of_world(world: &World, origin: DVec3) -> Option<Self> {
        let fog = world.fog.filter(|fog| fog.extinction != [0.0; 3])?;
        let up = world.up.axis();
        Some(Self {
            extinction: fog.extinction.into(),
            albedo: fog.albedo.into(),
            g: fog.g,
            up,
            top: fog.height.map(|height| height - up.dot(origin)),
        })
    }

    /// True if the fog ends at a height.
    pub fn has_top(&self) -> bool {
        self.top.is_some()
    }

    /// The fog below a scene-local height.
    pub fn below(self, top: f64) -> Self {
        Self { top: Some(top), ..self }
    }

    /// The interval of a ray's first `length` metres that is inside the fog; its end is not before its start.
    /// `direction` has unit length, `length` may be infinite.
    pub fn interval(&self, origin: DVec3, direction: DVec3, length: f64) -> [f64; 2] {
        let length = length.max(0.0);
        let Some(top) = self.top else {
            return [0.0, length];
        };
        let up = self.up;
        let (below, climb) = (top - up.dot(origin), up.dot(direction));
        if climb == 0.0 {
            return [0.0, if below > 0.0 { length } else { 0.0 }];
        }
        let crossing = (below / climb).clamp(0.0, length);
        match (below > 0.0, climb > 0.0) {
            (true, true) => [0.0, crossing],
            (true, false) => [0.0, length],
            (false, true) => [0.0, 0.0],
            (false, false) => [crossing, length],
        }
    }
}

/// The fraction of light that passes matter of this extinction (Beer's law); 1 without extinction, even for an infinite
/// length.
pub(crate) fn transmittance(extinction: Vec3, length: f64) -> Vec3 {
    let part = |extinction: f32| {
        let depth = f64::from(extinction) * length;
        if extinction == 0.0 { 1.0 } else { (-depth).exp() as f32 }
    };
    Vec3::new(part(extinction.x), part(extinction.y), part(extinction.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fog(top: Option<f64>) -> PreparedFog {
        PreparedFog { extinction: Vec3::new(0.1, 0.0, 2.0), albedo: Vec3::ONE, g: 0.0, up: DVec3::Z, top }
    }

    /// Length in metres of the part of a ray's first `length` metres that is inside the fog.
    fn length_inside(fog: &PreparedFog, origin: DVec3, direction: DVec3, length: f64) -> f64 {
        let [begin, end] = fog.interval(origin, direction, length);
        if end > begin { end - begin } else { 0.0 }
    }

    #[test]
    fn ray_length_in_fog_below_a_height_equals_the_plane_formula() {
        let fog = fog(Some(2.0));
        let from = |z: f64| DVec3::new(3.0, -1.0, z);
        let up = DVec3::new(0.6, 0.0, 0.8);
        // From a height 1 below the top, the ray leaves the fog after 1 / 0.8 metres.
        assert_eq!(length_inside(&fog, from(1.0), up, 10.0), 1.25);
        assert_eq!(length_inside(&fog, from(1.0), up, f64::INFINITY), 1.25);
        assert_eq!(length_inside(&fog, from(1.0), up, 0.5), 0.5);
        assert_eq!(length_inside(&fog, from(1.0), -up, 10.0), 10.0);
        assert_eq!(length_inside(&fog, from(3.0), -up, 10.0), 8.75);
        assert_eq!(length_inside(&fog, from(3.0), -up, 1.0), 0.0);
        assert_eq!(length_inside(&fog, from(3.0), up, f64::INFINITY), 0.0);
        assert_eq!(length_inside(&fog, from(3.0), DVec3::X, f64::INFINITY), 0.0);
        assert_eq!(length_inside(&fog, from(1.0), DVec3::X, f64::INFINITY), f64::INFINITY);
    }

    #[test]
    fn transmittance_of_infinite_rays_is_0_or_1() {
        assert_eq!(transmittance(fog(None).extinction, f64::INFINITY), Vec3::new(0.0, 1.0, 0.0));
        let passed = transmittance(fog(None).extinction, 5.0);
        assert!((passed - Vec3::new((-0.5f32).exp(), 1.0, (-10.0f32).exp())).abs().max_element() < 1e-7);
    }
}
