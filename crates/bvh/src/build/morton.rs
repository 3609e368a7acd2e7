//! Splits along a space-filling curve: Lauterbach, Garland, Sengupta, Luebke and Manocha 2009, "Fast BVH construction
//! on GPUs". The boxes are sorted once; a split is then a binary search.

use rayon::prelude::*;

use super::item::{Item, Range};

/// Bits per axis.
const BITS: u32 = 21;

/// A Morton curve through the centres of some boxes. Its cells are cubes: a long scene is cut across first.
pub struct Curve {
    offset: [f32; 3],
    scale: f32,
}

impl Curve {
    /// The curve through a range.
    pub fn of(range: &Range) -> Curve {
        let (lower, upper) = range.centres();
        let extent = (0..3).fold(0.0f32, |e, a| e.max(upper[a] - lower[a]));
        let scale = ((1 << BITS) - 1) as f32 / extent;
        Curve {
            offset: lower,
            scale: if scale.is_finite() { scale } else { 0.0 },
        }
    }

    fn code(&self, item: &Item) -> u64 {
        let centre = item.centre().array();
        (0..3).fold(0, |code, axis| {
            let cell = (centre[axis] - self.offset[axis]) * self.scale;
            code | spread(cell as u64) << axis
        })
    }

    /// Brings boxes into the order of the curve; those of one cell stay in theirs.
    pub fn sort(&self, items: Vec<Item>) -> Vec<Item> {
        let mut order: Vec<_> = items
            .par_iter()
            .zip(0u32..items.len() as u32)
            .map(|(item, index)| (self.code(item), index))
            .collect();
        order.par_sort_unstable();
        order
            .into_par_iter()
            .map(|(_, index)| items[index as usize])
            .collect()
    }

    /// Where the right half of sorted boxes starts: at the highest bit in which they differ. `None` if they are all in
    /// one cell.
    pub fn split(&self, items: &[Item]) -> Option<usize> {
        let (first, last) = (self.code(&items[0]), self.code(items.last()?));
        let bit = 63u32.checked_sub((first ^ last).leading_zeros())?;
        let right = last >> bit << bit;
        Some(items.partition_point(|item| self.code(item) < right))
    }
}

/// The lowest 21 bits, two apart.
fn spread(x: u64) -> u64 {
    let x = x & ((1 << BITS) - 1);
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread() {
        for bit in 0..BITS {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(spread(u64::MAX).count_ones(), BITS);
    }

    #[test]
    fn halves_differ_in_the_highest_bit() {
        let point = |x: f32, id| Item::new([x, 0.0, 0.0], [x, 0.0, 0.0], id);
        let items: Vec<_> = [3.0, 0.0, 7.0, 4.5, 1.0]
            .into_iter()
            .zip(0..)
            .map(|(x, id)| point(x, id))
            .collect();
        let curve = Curve::of(&Range::of::<crate::simd::Portable>(&items));
        let sorted = curve.sort(items);
        let xs: Vec<_> = sorted.iter().map(|item| item.lower()[0]).collect();
        assert_eq!(xs, [0.0, 1.0, 3.0, 4.5, 7.0]);
        assert_eq!(curve.split(&sorted), Some(3));
        let same = [point(2.0, 0), point(2.0, 1)];
        assert_eq!(
            Curve::of(&Range::of::<crate::simd::Portable>(&same)).split(&same),
            None
        );
    }
}
