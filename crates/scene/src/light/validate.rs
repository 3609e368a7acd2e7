//! Validation of a light's values.

use glam::DVec3;

use crate::camera::Center;
use crate::color::Rgb;
use crate::error::{Result, SceneError};
use crate::light::{FileRef, Light};
use crate::up::Up;

type Validated = Result<()>;

impl Light {
    /// Checks that the light's values are valid.
    ///
    /// # Errors
    /// [`SceneError::World`] for values that are negative or not finite, directions of length 0, shapes without area,
    /// angles out of range, both or neither of two alternative keys, and a file that has not been read.
    pub fn validate(&self) -> Validated {
        match self {
            Self::Sun { direction, irradiance, angular_diameter } => {
                check_direction("a sun", *direction, "the direction in which its light travels")?;
                check_rgb("irradiance", *irradiance)?;
                let range = 0.0..180.0;
                check_range("a sun of angular_diameter", *angular_diameter, range, "0 <= degrees < 180")
            }
            Self::Point { position, power, intensity, radius } => {
                check_position("a point light", *position)?;
                if !(radius.is_finite() && *radius >= 0.0) {
                    return invalid(format!("a point light of radius {radius}; expected a finite number >= 0"));
                }
                check_strength("a point light", *power, *intensity, "intensity = power / 4π")
            }
            Self::Spot { .. } => self.validate_spot(),
            Self::Rectangle { .. } | Self::Disk { .. } => self.validate_surface(),
            Self::Ies { .. } => self.validate_ies(),
            Self::Projector { .. } => self.validate_projector(),
            Self::Sky { .. } => self.validate_sky(),
            Self::Preetham { direction, turbidity, scale } => {
                check_direction("daylight", *direction, "the direction in which sunlight travels")?;
                let range = 1.9..10.000_001;
                check_range("daylight of turbidity", *turbidity, range, "1.9 to 10, the model's range")?;
                check_scale("daylight", *scale)
            }
            Self::Environment { image, yaw, scale } => {
                check_loaded("an environment", image)?;
                if !yaw.is_finite() {
                    return invalid(format!("an environment of yaw {yaw}; expected a finite number of degrees"));
                }
                check_scale("an environment", *scale)
            }
        }
    }

    /// Checks that the sun of daylight is above the horizon, as the model requires.
    ///
    /// # Errors
    /// [`SceneError::World`] for a sun below the horizon.
    pub(crate) fn check_sun_height(&self, up: Up) -> Validated {
        let Self::Preetham { direction, .. } = self else { return Ok(()) };
        let sine = -DVec3::from_array(*direction).normalize_or_zero().dot(up.axis());
        if sine < -1e-6 {
            return invalid(format!(
                "daylight with the sun {:.1} degrees below the horizon; expected a sun above the horizon, because the \
                 model has no dusk (use a sky of low radiance instead)",
                -sine.asin().to_degrees()
            ));
        }
        Ok(())
    }

    fn validate_spot(&self) -> Validated {
        let Self::Spot { position, direction, power, intensity, inner, outer, radius } = self else { return Ok(()) };
        check_position("a spot", *position)?;
        check_direction("a spot", *direction, "the direction in which its light travels")?;
        if !(radius.is_finite() && *radius >= 0.0) {
            return invalid(format!("a spot of radius {radius}; expected a finite number >= 0"));
        }
        if !(*inner >= 0.0 && inner <= outer && *outer > 0.0 && *outer <= 90.0) {
            return invalid(format!(
                "a spot with inner {inner} and outer {outer}; expected 0 <= inner <= outer <= 90 degrees from its \
                 axis, and outer > 0"
            ));
        }
        check_strength("a spot", *power, *intensity, "power is all emitted light, intensity is its value on the axis")
    }

    /// Validates a rectangle or a disk.
    fn validate_surface(&self) -> Validated {
        match self {
            Self::Rectangle { position, u, v, radiance, .. } => {
                check_position("an area light", *position)?;
                let [along_u, along_v] = [u, v].map(|edge| DVec3::from_array(*edge).normalize_or_zero());
                if along_u.cross(along_v).length() < 1e-9 {
                    return invalid(format!(
                        "an area light with edges u {u:?} and v {v:?}; expected two finite edges that span an area"
                    ));
                }
                check_rgb("radiance", *radiance)
            }
            Self::Disk { position, direction, radius, radiance, .. } => {
                check_position("a disk light", *position)?;
                check_direction("a disk light", *direction, "the direction in which it shines")?;
                if !(radius.is_finite() && *radius > 0.0) {
                    return invalid(format!("a disk light of radius {radius}; expected a finite number > 0"));
                }
                check_rgb("radiance", *radiance)
            }
            _ => Ok(()),
        }
    }

    fn validate_ies(&self) -> Validated {
        let Self::Ies { profile, position, direction, front, power } = self else { return Ok(()) };
        check_position("an IES light", *position)?;
        check_direction("an IES light", *direction, "its nadir")?;
        if let Some(front) = front {
            check_direction("an IES light's front", *front, "its horizontal angle 0")?;
            let (nadir, ahead) = (DVec3::from_array(*direction), DVec3::from_array(*front));
            if nadir.normalize().cross(ahead.normalize()).length() < 1e-9 {
                return invalid(format!(
                    "an IES light with front {front:?} parallel to its direction; expected a \
                    different front"
                ));
            }
        }
        check_loaded("an IES light", profile)?.validate()?;
        power.map_or(Ok(()), |power| check_rgb("power", power))
    }

    fn validate_projector(&self) -> Validated {
        let Self::Projector { image, camera, power, irradiance } = self else { return Ok(()) };
        check_loaded("a projector", image)?;
        let Some(camera) = camera else {
            return invalid(
                "a projector without camera; specify its size, intrinsics and pose with the keys of a camera".into(),
            );
        };
        if camera.center() != Center::Point || camera.aperture().is_some() || camera.motion().is_some() {
            return invalid(
                "a projector whose camera is orthographic, or has an aperture or a shutter; expected a camera whose rays \
                 start at one point"
                    .into(),
            );
        }
        match (power, irradiance) {
            (Some(power), None) => check_rgb("power", *power),
            (None, Some(irradiance)) => check_rgb("irradiance", *irradiance),
            (None, None) => invalid(
                "a projector without power or irradiance; use one of them: power in W of a white image, or its \
                 irradiance in W/m² at a distance of 1 m"
                    .into(),
            ),
            _ => invalid("a projector with both power and irradiance; use only one of them".into()),
        }
    }

    fn validate_sky(&self) -> Validated {
        let Self::Sky { radiance, zenith, horizon, ground } = self else { return Ok(()) };
        match (radiance, zenith, horizon, ground) {
            (Some(radiance), None, None, None) => check_rgb("radiance", *radiance),
            (None, Some(zenith), Some(horizon), _) => {
                check_rgb("zenith", *zenith)?;
                check_rgb("horizon", *horizon)?;
                ground.map_or(Ok(()), |ground| check_rgb("ground", ground))
            }
            (None, None, None, None) => {
                invalid("a sky without radiance; use radiance, or zenith and horizon, in W/(m² sr)".into())
            }
            (Some(_), ..) => invalid(
                "a sky with both radiance and zenith, horizon or ground; use radiance for a uniform sky, or only the \
                 others"
                    .into(),
            ),
            _ => invalid("a sky with only one of zenith and horizon; use both, in W/(m² sr)".into()),
        }
    }
}

fn invalid(message: String) -> Validated {
    Err(SceneError::light(message))
}

fn check_direction(what: &str, direction: [f64; 3], meaning: &str) -> Validated {
    match DVec3::from_array(direction).try_normalize() {
        Some(_) => Ok(()),
        None => {
            invalid(format!("{what} of direction {direction:?}; expected three finite numbers, not all 0 ({meaning})"))
        }
    }
}

fn check_position(what: &str, position: [f64; 3]) -> Validated {
    if DVec3::from_array(position).is_finite() {
        return Ok(());
    }
    invalid(format!("{what} at {position:?}; expected a finite position"))
}

fn check_range(what: &str, value: f64, range: std::ops::Range<f64>, expected: &str) -> Validated {
    if range.contains(&value) {
        return Ok(());
    }
    invalid(format!("{what} {value}; expected {expected}"))
}

fn check_scale(what: &str, scale: f32) -> Validated {
    if scale.is_finite() && scale >= 0.0 {
        return Ok(());
    }
    invalid(format!("{what} of scale {scale}; expected a finite number >= 0"))
}

fn check_strength(what: &str, power: Option<Rgb>, intensity: Option<Rgb>, relation: &str) -> Validated {
    match (power, intensity) {
        (Some(power), None) => check_rgb("power", power),
        (None, Some(intensity)) => check_rgb("intensity", intensity),
        (None, None) => invalid(format!(
            "{what} without power or intensity; use one of them: power in W over all directions, or intensity in W/sr"
        )),
        (Some(_), Some(_)) => invalid(format!(
            "{what} with both power and intensity; use only one of them \
            ({relation})"
        )),
    }
}

fn check_loaded<'a, T>(what: &str, file: &'a FileRef<T>) -> Result<&'a T> {
    file.content
        .as_deref()
        .ok_or_else(|| SceneError::light(format!("{what} of {:?}: the file has not been read", file.file)))
}

fn check_rgb(name: &str, rgb: Rgb) -> Validated {
    if rgb.iter().all(|v| v.is_finite() && *v >= 0.0) {
        return Ok(());
    }
    invalid(format!("{name} is {rgb:?}; expected finite red, green and blue >= 0"))
}
