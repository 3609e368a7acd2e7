//! Whether the values of a light make sense.

use glam::DVec3;

use crate::color::Rgb;
use crate::error::SceneError;
use crate::light::{FromFile, Light};

type Checked = Result<(), SceneError>;

pub(crate) fn check(light: &Light) -> Checked {
    match light {
        Light::Sun {
            direction,
            irradiance,
            angular_diameter,
        } => {
            axis("a sun", *direction, "the way its light travels")?;
            rgb("irradiance", *irradiance)?;
            within("a sun of angular_diameter", *angular_diameter, 0.0..180.0, "0 <= degrees < 180")
        }
        Light::Bulb {
            position,
            power,
            intensity,
            radius,
        } => {
            place("a bulb", *position)?;
            if !(radius.is_finite() && *radius >= 0.0) {
                return fail(format!(
                    "a bulb of radius {radius}: expected a finite number >= 0"
                ));
            }
            strength("a bulb", *power, *intensity, "intensity = power / 4π")
        }
        Light::Spot {
            position,
            direction,
            power,
            intensity,
            inner,
            outer,
        } => {
            place("a spot", *position)?;
            axis("a spot", *direction, "the way its light travels")?;
            if !(*inner >= 0.0 && inner <= outer && *outer > 0.0 && *outer <= 90.0) {
                return fail(format!(
                    "a spot with inner {inner} and outer {outer}: expected 0 <= inner <= outer <= 90, degrees from \
                     its axis, and outer > 0"
                ));
            }
            strength("a spot", *power, *intensity, "power is all that leaves it, intensity that on its axis")
        }
        Light::Area {
            position,
            u,
            v,
            radiance,
            ..
        } => {
            place("an area light", *position)?;
            let normal = DVec3::from_array(*u).normalize_or_zero().cross(DVec3::from_array(*v).normalize_or_zero());
            if normal.length() < 1e-9 {
                return fail(format!(
                    "an area light with edges u {u:?} and v {v:?}: expected two finite edges that span an area"
                ));
            }
            rgb("radiance", *radiance)
        }
        Light::Disk {
            position,
            direction,
            radius,
            radiance,
            ..
        } => {
            place("a disk light", *position)?;
            axis("a disk light", *direction, "where it shines to")?;
            if !(radius.is_finite() && *radius > 0.0) {
                return fail(format!(
                    "a disk light of radius {radius}: expected a finite number > 0"
                ));
            }
            rgb("radiance", *radiance)
        }
        Light::Ies {
            profile,
            position,
            direction,
            front,
            power,
        } => {
            place("an IES light", *position)?;
            axis("an IES light", *direction, "its nadir")?;
            if let Some(front) = front {
                axis("an IES light's front", *front, "its horizontal angle 0")?;
                let (nadir, ahead) = (DVec3::from_array(*direction), DVec3::from_array(*front));
                if nadir.normalize().cross(ahead.normalize()).length() < 1e-9 {
                    return fail(format!(
                        "an IES light with front {front:?} along its direction: expected another one"
                    ));
                }
            }
            there("an IES light", profile)?.validate()?;
            power.map_or(Ok(()), |power| rgb("power", power))
        }
        Light::Sky {
            radiance,
            zenith,
            horizon,
            ground,
        } => match (radiance, zenith, horizon, ground) {
            (Some(radiance), None, None, None) => rgb("radiance", *radiance),
            (None, Some(zenith), Some(horizon), _) => {
                rgb("zenith", *zenith)?;
                rgb("horizon", *horizon)?;
                ground.map_or(Ok(()), |ground| rgb("ground", ground))
            }
            (None, None, None, None) => fail(
                "a sky without radiance: give radiance, or zenith and horizon, in W/(m² sr)".into(),
            ),
            (Some(_), ..) => fail(
                "a sky with both radiance and zenith, horizon or ground: give radiance for an even sky, or the others"
                    .into(),
            ),
            _ => fail("a sky from zenith to horizon: give both, in W/(m² sr)".into()),
        },
        Light::Daylight {
            direction,
            turbidity,
            scale,
        } => {
            axis("daylight", *direction, "the way sunlight travels")?;
            within("daylight of turbidity", *turbidity, 1.9..10.000_001, "1.9 to 10, the model's range")?;
            positive("daylight", *scale)
        }
        Light::Environment { image, yaw, scale } => {
            there("an environment", image)?;
            if !yaw.is_finite() {
                return fail(format!("an environment of yaw {yaw}: expected finite degrees"));
            }
            positive("an environment", *scale)
        }
    }
}

fn fail(message: String) -> Checked {
    Err(SceneError::World(message))
}

fn axis(what: &str, direction: [f64; 3], meaning: &str) -> Checked {
    match DVec3::from_array(direction).try_normalize() {
        Some(_) => Ok(()),
        None => fail(format!(
            "{what} of direction {direction:?}: expected three finite numbers, not all 0: {meaning}"
        )),
    }
}

fn place(what: &str, position: [f64; 3]) -> Checked {
    if DVec3::from_array(position).is_finite() {
        return Ok(());
    }
    fail(format!(
        "{what} at {position:?}: its position must be finite"
    ))
}

fn within(what: &str, value: f64, range: std::ops::Range<f64>, expected: &str) -> Checked {
    if range.contains(&value) {
        return Ok(());
    }
    fail(format!("{what} {value}: expected {expected}"))
}

fn positive(what: &str, scale: f32) -> Checked {
    if scale.is_finite() && scale >= 0.0 {
        return Ok(());
    }
    fail(format!(
        "{what} of scale {scale}: expected a finite number >= 0"
    ))
}

fn strength(what: &str, power: Option<Rgb>, intensity: Option<Rgb>, relation: &str) -> Checked {
    match (power, intensity) {
        (Some(power), None) => rgb("power", power),
        (None, Some(intensity)) => rgb("intensity", intensity),
        (None, None) => fail(format!(
            "{what} without power or intensity: give one of them, power in W over all directions or intensity in W/sr"
        )),
        (Some(_), Some(_)) => fail(format!(
            "{what} with both power and intensity: give one of them ({relation})"
        )),
    }
}

fn there<'a, T>(what: &str, file: &'a FromFile<T>) -> Result<&'a T, SceneError> {
    file.content.as_deref().ok_or_else(|| {
        SceneError::World(format!("{what} of {:?}: the file is not read", file.file))
    })
}

fn rgb(name: &str, rgb: Rgb) -> Checked {
    if rgb.iter().all(|v| v.is_finite() && *v >= 0.0) {
        return Ok(());
    }
    fail(format!(
        "{name} {rgb:?}: expected red, green, blue that are finite and >= 0"
    ))
}
