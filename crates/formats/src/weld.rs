//! Corners at exactly the same place made one vertex.

use std::hash::{BuildHasher, RandomState};

use glam::DVec3;

/// Places, each once, in the order in which they came first.
#[derive(Default)]
pub(crate) struct Weld {
    /// The places.
    pub(crate) places: Vec<DVec3>,
    /// One more than an index into `places`, or 0; searched from where the hash says. At least twice as long as `places`.
    table: Vec<u32>,
    /// Drawn, so that no file can be made of which all places have the same hash.
    secret: [u64; 3],
}

impl Weld {
    /// The index of a place.
    pub(crate) fn index(&mut self, place: DVec3) -> u32 {
        if 2 * self.places.len() >= self.table.len() {
            self.grow();
        }
        let key = bits(place);
        let last = self.table.len() - 1;
        let mut at = self.hash(key) as usize & last;
        loop {
            match self.table[at] {
                0 => {
                    self.places.push(place);
                    let found = self.places.len() as u32;
                    self.table[at] = found;
                    return found - 1;
                }
                found if bits(self.places[found as usize - 1]) == key => return found - 1,
                _ => at = (at + 1) & last,
            }
        }
    }

    fn grow(&mut self) {
        if self.table.is_empty() {
            let drawn = RandomState::new();
            self.secret = [1_u8, 2, 3].map(|i| drawn.hash_one(i));
        }
        let length = (2 * self.table.len()).max(1 << 10);
        self.table.clear();
        self.table.resize(length, 0);
        for (i, &place) in self.places.iter().enumerate() {
            let mut at = self.hash(bits(place)) as usize & (length - 1);
            while self.table[at] != 0 {
                at = (at + 1) & (length - 1);
            }
            self.table[at] = i as u32 + 1;
        }
    }

    /// Source: the folded multiplication of wyhash (Wang Yi, 2019).
    fn hash(&self, [x, y, z]: [u64; 3]) -> u64 {
        let fold = |a: u64, b: u64| {
            let wide = u128::from(a) * u128::from(b);
            wide as u64 ^ (wide >> 64) as u64
        };
        let [a, b, c] = self.secret;
        fold(fold(x ^ a, y ^ b) ^ c, z ^ a)
    }
}

/// Equal where the places are: adding 0 makes -0 and 0 the same.
fn bits(place: DVec3) -> [u64; 3] {
    (place + DVec3::ZERO).to_array().map(f64::to_bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_place_has_one_index_in_order() {
        let mut weld = Weld::default();
        let place =
            |i: u32| DVec3::new(f64::from(i % 7), f64::from(i % 11), f64::from(i % 13) - 6.0);
        let mut expected: Vec<DVec3> = Vec::new();
        for i in 0..30_000 {
            let known = expected.iter().position(|&known| known == place(i));
            let index = known.unwrap_or_else(|| {
                expected.push(place(i));
                expected.len() - 1
            });
            assert_eq!(weld.index(place(i)) as usize, index);
        }
        assert_eq!(weld.places, expected);
        assert_eq!(expected.len(), 7 * 11 * 13);
    }

    #[test]
    fn zeros_are_one_place_and_neighbours_are_not() {
        let mut weld = Weld::default();
        assert_eq!(weld.index(DVec3::new(0.0, -0.0, 1.0)), 0);
        assert_eq!(weld.index(DVec3::new(-0.0, 0.0, 1.0)), 0);
        assert_eq!(weld.index(DVec3::new(0.0, f64::MIN_POSITIVE, 1.0)), 1);
        assert_eq!(weld.index(DVec3::new(0.0, 0.0, 1.0_f64.next_up())), 2);
    }
}
