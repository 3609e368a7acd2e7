//! Powers of the lights of a tree, summed in the order of its leaves.

/// Lights in the order of a tree's leaves, from which ranges are sampled by power.
#[derive(Debug, Default)]
pub(crate) struct PowerTable {
    lights: Vec<u32>,
    /// Sum of the powers up to and including each light.
    sums: Vec<f64>,
    /// Position of each light in the table.
    places: Vec<u32>,
}

impl PowerTable {
    /// Creates an empty table for this many lights.
    pub fn new(lights: usize) -> Self {
        Self { places: vec![0; lights], ..Self::default() }
    }

    /// Number of lights.
    pub fn len(&self) -> u32 {
        self.lights.len() as u32
    }

    /// Appends a light.
    pub fn push(&mut self, light: u32, phi: f32) {
        self.places[light as usize] = self.lights.len() as u32;
        self.lights.push(light);
        self.sums.push(self.sums.last().unwrap_or(&0.0) + f64::from(phi));
    }

    /// Sum of the powers before a position.
    fn before(&self, place: usize) -> f64 {
        if place == 0 { 0.0 } else { self.sums[place - 1] }
    }

    /// Samples a light of a range by a number in 0..1; returns the light and its probability.
    pub fn sample(&self, [start, end]: [u32; 2], number: f64) -> (usize, f64) {
        let [start, end] = [start, end].map(|place| place as usize);
        let (low, high) = (self.before(start), self.sums[end - 1]);
        let target = low + number * (high - low);
        let place = start + self.sums[start..end].partition_point(|&sum| sum <= target);
        let place = place.min(end - 1);
        (self.lights[place] as usize, (self.sums[place] - self.before(place)) / (high - low))
    }

    /// Probability with which [`PowerTable::sample`] selects a light of a range.
    pub fn share(&self, [start, end]: [u32; 2], light: usize) -> f64 {
        let place = self.places[light] as usize;
        let all = self.sums[end as usize - 1] - self.before(start as usize);
        (self.sums[place] - self.before(place)) / all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_of_a_range_are_drawn_in_proportion_to_their_powers() {
        let powers = [3.0_f32, 1e-3, 7.0, 2.0, 1e6, 5.0];
        let order = [4_usize, 0, 2, 5, 1, 3];
        let mut table = PowerTable::new(powers.len());
        order.iter().for_each(|&light| table.push(light as u32, powers[light]));
        for (start, end) in (0..6).flat_map(|start| (start + 1..=6).map(move |end| (start, end))) {
            let own = &order[start..end];
            let total: f64 = own.iter().map(|&light| f64::from(powers[light])).sum();
            let range = [start as u32, end as u32];
            let mut at = 0.0;
            for &light in own {
                let share = f64::from(powers[light]) / total;
                // A sum of a million numbers has rounding errors of 1e-10.
                assert!((table.share(range, light) - share).abs() < 1e-9);
                let (found, probability) = table.sample(range, at + 0.5 * share);
                assert_eq!((found, probability), (light, table.share(range, light)));
                at += share;
            }
            assert_eq!(table.sample(range, 0.0).0, own[0]);
            assert_eq!(table.sample(range, 1.0).0, own[own.len() - 1]);
        }
    }
}
