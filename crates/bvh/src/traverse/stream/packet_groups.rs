//! Rays that do not all run alike, sorted into those that do: one packet each.

use crate::ray::Ray;
use crate::simd::{Isa, Vector};
use crate::traverse::packet::SIZE;
use crate::traverse::trav_ray::STEEPEST;

/// Rays that run alike are traced alone where they are fewer than this...
const ENOUGH: u32 = 12;

/// ... or than this, if they are all there is.
const FEW: usize = 5;

/// How many ways there are to head.
pub const HEADINGS: usize = 32;

/// The heading of a ray that makes no packet.
pub const ODD: u8 = HEADINGS as u8 - 1;

/// The number in the chunk of the ray at each place; `None` where all rays are in their own places.
pub type Who<'a> = Option<&'a [u8; SIZE]>;

/// The number of the ray at a place.
#[inline(always)]
pub fn number(place: u32, who: Who) -> usize {
    let place = place as usize & (SIZE - 1);
    who.map_or(place, |who| usize::from(who[place]) & (SIZE - 1))
}

/// From bits by place to bits by number.
#[inline(always)]
pub fn numbers(mut places: u64, who: Who) -> u64 {
    if who.is_none() {
        return places;
    }
    let mut numbers = 0;
    while places != 0 {
        numbers |= 1 << number(places.trailing_zeros(), who);
        places &= places - 1;
    }
    numbers
}

const NO_RAY: Ray = Ray {
    origin: [0.0; 3],
    direction: [0.0; 3],
    t_max: 0.0,
};

/// Some of a chunk's rays.
pub struct Members {
    pub rays: [Ray; SIZE],
    /// The number that each had.
    pub who: [u8; SIZE],
    pub len: usize,
}

impl Members {
    pub const NONE: Members = Members {
        rays: [NO_RAY; SIZE],
        who: [0; SIZE],
        len: 0,
    };

    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds a ray; there is room.
    #[inline(always)]
    pub fn push(&mut self, ray: Ray, number: usize) {
        self.rays[self.len & (SIZE - 1)] = ray;
        self.who[self.len & (SIZE - 1)] = number as u8;
        self.len += 1;
    }

    /// Takes those of `places`; `who` says what their numbers are.
    #[inline(always)]
    pub fn gather(&mut self, rays: &[Ray], who: Who, mut places: u64) {
        self.clear();
        while places != 0 {
            let place = places.trailing_zeros();
            places &= places - 1;
            self.push(rays[place as usize & (SIZE - 1)], number(place, who));
        }
    }

    #[inline(always)]
    pub fn all(&self) -> (&[Ray], Who<'_>) {
        (&self.rays[..self.len], Some(&self.who))
    }

    /// Those of a part, gathered unless it is the whole.
    #[inline(always)]
    pub fn of_part<'a>(
        &'a mut self,
        rays: &'a [Ray],
        who: Who<'a>,
        part: u64,
        whole: bool,
    ) -> (&'a [Ray], Who<'a>) {
        if whole {
            return (rays, who);
        }
        self.gather(rays, who, part);
        self.all()
    }
}

/// The parts of a chunk: first all of it; then, if that is no packet, those that run alike.
pub struct Parts {
    heading: [u8; SIZE],
    left: u64,
    /// Not sorted yet.
    pub whole: bool,
}

impl Parts {
    #[inline(always)]
    pub fn of(rays: &[Ray]) -> Parts {
        Parts {
            heading: [ODD; SIZE],
            left: u64::MAX >> (SIZE - rays.len()),
            whole: rays.len() >= FEW,
        }
    }

    /// Sorts the rays.
    #[inline(never)]
    pub fn sort(&mut self, rays: &[Ray]) {
        for (to, ray) in self.heading.iter_mut().zip(rays) {
            *to = heading(ray.direction);
        }
        self.left = u64::MAX >> (SIZE - rays.len());
        self.whole = false;
    }

    /// Some rays, as bits, and whether a packet of them may pay.
    #[inline(always)]
    pub fn next(&mut self) -> Option<(u64, bool)> {
        if self.left == 0 {
            return None;
        }
        if self.whole {
            return Some((std::mem::take(&mut self.left), true));
        }
        Some(self.next_alike())
    }

    #[inline(never)]
    fn next_alike(&mut self) -> (u64, bool) {
        let first = self.heading[self.left.trailing_zeros() as usize & (SIZE - 1)];
        let mut same = 0;
        for (i, heading) in self.heading.iter().enumerate() {
            same |= u64::from(*heading == first) << i;
        }
        same &= self.left;
        self.left &= !same;
        (same, first != ODD && same.count_ones() >= ENOUGH)
    }
}

/// As [`crate::traverse::packet::Packet::set`] sees it. Without a branch: nobody can guess where a ray heads.
#[inline(always)]
fn heading([x, y, z]: [f32; 3]) -> u8 {
    const FLATTEST: u32 = (1.0 / STEEPEST).to_bits();
    const INFINITE: u32 = f32::INFINITY.to_bits();
    // Bits of floats that are not negative are ordered as they are.
    let [dx, dy, dz] = [x.to_bits(), y.to_bits(), z.to_bits()];
    let [x, y, z] = [dx << 1 >> 1, dy << 1 >> 1, dz << 1 >> 1];
    let least = x.min(y).min(z);
    let most = x.max(y).max(z);
    let main = if x == most {
        0
    } else if y == most {
        8
    } else {
        16
    };
    let signs = dx >> 31 | dy >> 31 << 1 | dz >> 31 << 2;
    let odd = (least < FLATTEST) | (most > INFINITE);
    (if odd { u32::from(ODD) } else { main | signs }) as u8
}

/// [`heading`] of some of the rays.
#[inline(always)]
pub fn headings<I: Isa>(rays: &[Ray], numbers: &[u32], out: &mut [u8]) {
    const LANES: usize = 16;
    let numbers = numbers.chunks(LANES);
    for (out, numbers) in out.chunks_mut(LANES).zip(numbers) {
        let from: [*const f32; LANES] = std::array::from_fn(|i| {
            let number = numbers.get(i).unwrap_or(&numbers[0]);
            let ray: *const Ray = &rays[*number as usize];
            ray.cast::<f32>().wrapping_add(3)
        });
        let mut lanes = [[0.0f32; LANES]; 3];
        // SAFETY: behind the three floats of a ray's direction lies its t_max; the rows hold sixteen floats.
        unsafe {
            let columns = I::columns(from);
            for (row, column) in lanes.iter_mut().zip(columns) {
                column.store(row.as_mut_ptr());
            }
        }
        let [x, y, z] = lanes;
        let mut found = [0; LANES];
        for lane in 0..LANES {
            found[lane] = heading([x[lane], y[lane], z[lane]]);
        }
        out.copy_from_slice(&found[..out.len()]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(direction: [f32; 3]) -> Ray {
        Ray {
            direction,
            t_max: 1.0,
            ..NO_RAY
        }
    }

    #[test]
    fn every_ray_is_in_one_part_with_its_like() {
        let kinds = [[1.0, 0.5, 0.25], [1.0, -0.5, 0.25], [0.5, 1.0, 0.25]];
        let mut rays: Vec<Ray> = (0..SIZE).map(|i| ray(kinds[i * i % 3])).collect();
        rays[5] = ray([1.0, 0.0, 0.25]);
        rays[6] = ray([1.0, f32::NAN, 0.25]);
        let mut parts = Parts::of(&rays[..60]);
        assert_eq!(parts.next(), Some((u64::MAX >> 4, true)));
        assert_eq!(parts.next(), None);
        parts.sort(&rays[..60]);
        let (mut seen, mut members) = (0, Members::NONE);
        while let Some((part, pays)) = parts.next() {
            assert_eq!(seen & part, 0);
            seen |= part;
            members.gather(&rays, None, part);
            let all = u64::MAX >> (SIZE - members.len);
            let who = members.all().1;
            assert_eq!(numbers(all, who), part);
            assert_eq!(members.len, part.count_ones() as usize);
            for (place, ray) in members.all().0.iter().enumerate() {
                assert!(part >> members.who[place] & 1 != 0);
                let (y, x) = (ray.direction[1], members.rays[0].direction[1]);
                assert!(y == x || !pays, "they run alike");
            }
            let odd = part & 0b110_0000 != 0;
            assert_eq!(pays, !odd && members.len >= ENOUGH as usize);
        }
        assert_eq!(seen, u64::MAX >> 4);
    }
}
