//! IES light: a point light with a measured intensity profile.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use raycam_scene::IesProfile;
use raycam_scene::light::LUMENS_PER_WATT;

use crate::light::bounds::LightBounds;
use crate::light::samples::LightLiSample;

#[derive(Debug)]
pub(crate) struct IesLight {
    /// Scene-local position of the light.
    position: DVec3,
    /// Directions of the horizontal angles 0 and 90 degrees and of the nadir, as matrix rows.
    luminaire_from_world: DMat3,
    profile: Arc<IesProfile>,
    /// Factor from the profile's candelas to W/sr, for each colour.
    scale: Vec3,
}

impl IesLight {
    pub fn new(
        position: DVec3,
        nadir: DVec3,
        front: Option<DVec3>,
        profile: Arc<IesProfile>,
        power: Option<Vec3>,
    ) -> Self {
        let nadir = nadir.normalize_or_zero();
        let front = front.unwrap_or(if nadir.x.abs() > 0.999 { DVec3::Y } else { DVec3::X });
        let front = (front - nadir * front.dot(nadir)).normalize_or_zero();
        // Seen from above (against the nadir), horizontal angles run counter-clockwise.
        let side = front.cross(nadir);
        let scale = match power {
            None => Vec3::splat((1.0 / LUMENS_PER_WATT) as f32),
            Some(power) => (power.as_dvec3() / flux(&profile).max(f64::MIN_POSITIVE)).as_vec3(),
        };
        Self { position, luminaire_from_world: DMat3::from_cols(front, side, nadir).transpose(), profile, scale }
    }

    pub fn bounds(&self) -> LightBounds {
        let brightest = self.profile.candela.iter().copied().fold(0.0, f32::max);
        LightBounds::isotropic(self.position, self.position, self.scale * brightest)
    }

    pub fn sample(&self, point: DVec3) -> Option<LightLiSample> {
        let offset = self.position - point;
        let distance = offset.length();
        if distance == 0.0 {
            return None;
        }
        let direction = offset / distance;
        let out = self.luminaire_from_world * -direction;
        // atan2 keeps precision near the poles, where acos does not.
        let vertical = out.truncate().length().atan2(out.z).to_degrees();
        let horizontal = out.y.atan2(out.x).to_degrees();
        let candela = f64::from(self.profile.intensity(vertical, horizontal));
        let radiance = self.scale.as_dvec3() * (candela / (distance * distance));
        (candela > 0.0).then(|| LightLiSample::from_delta(direction, Some(self.position), radiance))
    }
}

/// Luminous flux of a profile in lumen: the midpoint rule on half degrees.
fn flux(profile: &IesProfile) -> f64 {
    const ROWS: usize = 360;
    const COLUMNS: usize = 720;
    let ring = |row: usize| {
        let vertical = (row as f64 + 0.5) / ROWS as f64 * 180.0;
        let at = |column: usize| {
            let horizontal = (column as f64 + 0.5) / COLUMNS as f64 * 360.0;
            f64::from(profile.intensity(vertical, horizontal))
        };
        let mean = (0..COLUMNS).map(at).sum::<f64>() / COLUMNS as f64;
        let edge = |row: usize| (row as f64 / ROWS as f64 * std::f64::consts::PI).cos();
        mean * TAU * (edge(row) - edge(row + 1))
    };
    (0..ROWS).map(ring).sum()
}
