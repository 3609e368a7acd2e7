//! Measured light distribution of a luminaire.

use crate::error::{Result, SceneError};

/// Luminous intensity by direction: IES type C photometry. The vertical angle is measured from the nadir. The
/// horizontal angle is measured around the vertical axis, counter-clockwise as seen from above a luminaire that shines
/// down.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct IesProfile {
    /// Vertical angles in degrees from the nadir, increasing, within 0..=180. Outside of these angles, no light is
    /// emitted.
    pub vertical: Vec<f64>,
    /// Horizontal angles in degrees, increasing from 0 to 0 (rotationally symmetric), 90 (four equal quadrants), 180
    /// (two equal halves) or up to 360.
    pub horizontal: Vec<f64>,
    /// Intensities in candela: all vertical angles for the first horizontal angle, then for the next.
    pub candela: Vec<f32>,
}

impl IesProfile {
    /// Checks that the profile's angles and intensities are consistent.
    ///
    /// # Errors
    /// [`SceneError::World`] if they are not.
    pub fn validate(&self) -> Result<()> {
        let fail = |message: String| Err(SceneError::light(message));
        let increases = |angles: &[f64], limit: f64| {
            !angles.is_empty()
                && angles.windows(2).all(|pair| pair[0] < pair[1])
                && angles.iter().all(|angle| (0.0..=limit).contains(angle))
        };
        if !increases(&self.vertical, 180.0) {
            return fail("invalid vertical angles; expected increasing angles from 0 to 180 degrees".into());
        }
        let last = self.horizontal.last().copied().unwrap_or_default();
        if !increases(&self.horizontal, 360.0)
            || self.horizontal[0] != 0.0
            || !(last == 0.0 || last == 90.0 || last >= 180.0)
        {
            return fail(
                "invalid horizontal angles; expected increasing angles that begin with 0 and end with 0, \
                         90 or 180 to 360 degrees"
                    .into(),
            );
        }
        if self.candela.len() != self.vertical.len() * self.horizontal.len() {
            return fail(format!(
                "{} intensities; expected {} x {}",
                self.candela.len(),
                self.horizontal.len(),
                self.vertical.len()
            ));
        }
        match self.candela.iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
            Some(wrong) => fail(format!("an intensity is {wrong} cd; expected finite numbers >= 0")),
            None => Ok(()),
        }
    }

    /// Intensity in candela at angles in degrees, interpolated linearly in both angles; 0 outside the range of vertical
    /// angles.
    pub fn intensity(&self, vertical: f64, horizontal: f64) -> f32 {
        let [first, last] = [self.vertical[0], self.vertical[self.vertical.len() - 1]];
        if !(first..=last).contains(&vertical) {
            return 0.0;
        }
        let (row, down) = bracket(&self.vertical, vertical);
        let full = self.horizontal[self.horizontal.len() - 1];
        let around = horizontal.rem_euclid(360.0);
        let folded = match full {
            full if full <= 90.0 => {
                let half = if around > 180.0 { 360.0 - around } else { around };
                if half > 90.0 { 180.0 - half } else { half }
            }
            180.0 if around > 180.0 => 360.0 - around,
            _ => around,
        };
        let at = |column: usize| {
            let value = |row: usize| self.candela[column * self.vertical.len() + row];
            let next = (row + 1).min(self.vertical.len() - 1);
            f64::from(value(row)) * (1.0 - down) + f64::from(value(next)) * down
        };
        let (column, across) = bracket(&self.horizontal, folded);
        let next = column + 1;
        let value = if next < self.horizontal.len() {
            at(column) * (1.0 - across) + at(next) * across
        } else if full > 180.0 && full < 360.0 {
            // Values between the last angle and a full turn are interpolated towards the first angle.
            let across = (folded - full) / (360.0 - full);
            at(column) * (1.0 - across) + at(0) * across
        } else {
            at(column)
        };
        value as f32
    }
}

/// Index of the last angle that is not greater than `angle`, and the fraction of the way to the next angle.
fn bracket(angles: &[f64], angle: f64) -> (usize, f64) {
    let index = angles.partition_point(|&a| a <= angle).saturating_sub(1);
    match angles.get(index + 1) {
        Some(next) => (index, ((angle - angles[index]) / (next - angles[index])).clamp(0.0, 1.0)),
        None => (index, 0.0),
    }
}
