//! Echoes: the local maxima of the light that a lidar receives from each pulse.
//!
//! The waveform of a pulse is the sum of energy * g(r - length) over the surfaces that return light, where g is a
//! Gaussian of the pulse's length.

use std::cmp::Ordering;
use std::ops::Range;

use rayon::prelude::*;

use crate::error::RenderError;
use crate::thread_pool::with_pool;

/// Minimum gap, in standard deviations of the pulse, across which surfaces do not change each other's maxima.
const APART: f64 = 8.0;
/// Surfaces within this many standard deviations have a single maximum.
const MERGED: f64 = 2.0;
/// Difference of two maxima, in standard deviations, up to which they are the same.
const SAME: f64 = 1e-3;
/// Number of surfaces processed by a task, unless a pulse has more.
const PER_TASK: usize = 4096;

/// Surfaces that return light, sorted by pulse; one value per surface in each array.
#[derive(Clone, Copy, Debug)]
pub struct Returns<'a> {
    /// Number of the pulse.
    pub pulses: &'a [i64],
    /// Half the optical length of the path out and back, in metres.
    pub lengths: &'a [f64],
    /// Returned energy.
    pub energies: &'a [f64],
    /// Index of the surface's object.
    pub instances: &'a [i32],
    /// Number of mirrors and glass faces on the path.
    pub bounces: &'a [i32],
}

/// Echoes of all pulses, ordered by pulse and distance; one value per echo in each array.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Echoes {
    /// Number of the pulse.
    pub pulses: Vec<i64>,
    /// Position of the maximum: half the optical length, in metres.
    pub lengths: Vec<f64>,
    /// Sum of the energies of the echo's surfaces.
    pub energies: Vec<f64>,
    /// For the surface that contributes the most energy to the echo: row of its largest return in the list of returns.
    pub mains: Vec<i64>,
    /// Share of the energy that comes from this surface; an object is a separate surface for each number of bounces.
    pub purities: Vec<f32>,
}

impl Echoes {
    fn append(&mut self, mut more: Echoes) {
        self.pulses.append(&mut more.pulses);
        self.lengths.append(&mut more.lengths);
        self.energies.append(&mut more.energies);
        self.mains.append(&mut more.mains);
        self.purities.append(&mut more.purities);
    }

    fn push(&mut self, pulse: i64, (length, energy, main, purity): Echo) {
        self.pulses.push(pulse);
        self.lengths.push(length);
        self.energies.push(energy);
        self.mains.push(main as i64);
        self.purities.push(purity);
    }
}

/// Length, energy, main row and purity of an echo.
type Echo = (f64, f64, usize, f32);

/// Echoes of all pulses. `sigma` is the standard deviation of a pulse in metres; if it is 0, each distinct
/// length is an echo.
///
/// # Errors
/// [`RenderError::Settings`] if the arrays differ in length or are not sorted by pulse, and errors of `with_pool`.
pub fn find_echoes(returns: &Returns, sigma: f64, threads: Option<usize>) -> Result<Echoes, RenderError> {
    let n = returns.pulses.len();
    let others = [returns.lengths.len(), returns.energies.len(), returns.instances.len(), returns.bounces.len()];
    if others != [n; 4] || !returns.pulses.is_sorted() {
        return Err(RenderError::settings(format!(
            "returns: lengths, energies, instances and bounces have {others:?} entries; expected {n}, one per pulse \
             number, and pulse numbers in ascending order"
        )));
    }
    let starts_pulse = |row: &usize| *row == n || *row == 0 || returns.pulses[*row] != returns.pulses[row - 1];
    let border = |task: usize| (task * PER_TASK..).find(|row| *row >= n || starts_pulse(row)).unwrap_or(n).min(n);
    let tasks: Vec<Range<usize>> = (0..n.div_ceil(PER_TASK)).map(|task| border(task)..border(task + 1)).collect();
    let parts: Vec<Echoes> =
        with_pool(threads, || tasks.into_par_iter().map(|rows| echoes_of_range(returns, rows, sigma)).collect())?;
    let mut found = Echoes::default();
    parts.into_iter().for_each(|part| found.append(part));
    Ok(found)
}

/// Echoes of the pulses in a range of rows, which starts and ends at a border between pulses.
fn echoes_of_range(returns: &Returns, rows: Range<usize>, sigma: f64) -> Echoes {
    let mut found = Echoes::default();
    let mut waveform = Waveform::default();
    let mut first = rows.start;
    while first < rows.end {
        let pulse = returns.pulses[first];
        let count = returns.pulses[first..rows.end].iter().take_while(|other| **other == pulse).count();
        if count == 1 {
            found.push(pulse, (returns.lengths[first], returns.energies[first], first, 1.0));
        } else {
            waveform.load(returns, first..first + count);
            waveform.find_modes(sigma);
            waveform.echoes(returns, sigma).into_iter().for_each(|echo| found.push(pulse, echo));
        }
        first += count;
    }
    found
}

/// The returns of one pulse, by length.
#[derive(Default)]
struct Waveform {
    /// Rows of the returns.
    rows: Vec<usize>,
    lengths: Vec<f64>,
    energies: Vec<f64>,
    /// The waveform's maximum that is reached by climbing from each return.
    modes: Vec<f64>,
    /// For each return: the number of its cluster. The returns of a cluster are close enough to change each
    /// other's maxima; clusters are numbered by length.
    clusters: Vec<usize>,
}

impl Waveform {
    fn load(&mut self, returns: &Returns, rows: Range<usize>) {
        self.rows.clear();
        self.rows.extend(rows);
        self.rows.sort_by(|&a, &b| returns.lengths[a].total_cmp(&returns.lengths[b]));
        self.lengths.clear();
        self.lengths.extend(self.rows.iter().map(|&row| returns.lengths[row]));
        self.energies.clear();
        self.energies.extend(self.rows.iter().map(|&row| returns.energies[row]));
    }

    fn find_modes(&mut self, sigma: f64) {
        self.modes.clone_from(&self.lengths);
        self.clusters.clear();
        let n = self.lengths.len();
        let (mut first, mut cluster) = (0, 0);
        while first < n {
            let mut end = first + 1;
            while end < n && self.lengths[end] - self.lengths[end - 1] <= APART * sigma {
                end += 1;
            }
            self.clusters.resize(end, cluster);
            if end - first > 1 && sigma > 0.0 {
                let largest = self.energies[first..end].iter().copied().fold(1e-300, f64::max);
                let shares: Vec<f64> =
                    self.energies[first..end].iter().map(|energy| energy.max(1e-300) / largest).collect();
                let sum = GaussianSum { places: &self.lengths[first..end], shares: &shares, sigma };
                sum.find_modes(&mut self.modes[first..end]);
            }
            (first, cluster) = (end, cluster + 1);
        }
    }

    /// Echoes by length: one for each group of returns with the same maximum.
    fn echoes(&self, returns: &Returns, sigma: f64) -> Vec<Echo> {
        let mut order: Vec<usize> = (0..self.rows.len()).collect();
        // Maxima that are equal except for rounding keep the order of the returns.
        let key = |at: usize| (self.modes[at] / (sigma * SAME).max(1e-9)).round_ties_even();
        order.sort_by(|&a, &b| self.clusters[a].cmp(&self.clusters[b]).then(key(a).total_cmp(&key(b))));
        let is_same = |a: usize, b: usize| {
            self.clusters[a] == self.clusters[b] && (self.modes[b] - self.modes[a]).abs() <= SAME * sigma
        };
        let mut echoes: Vec<Echo> = vec![];
        for group in order.chunk_by(|&a, &b| is_same(a, b)) {
            let mut members = group.to_vec();
            members.sort_unstable();
            echoes.push(self.echo(returns, &members));
        }
        echoes.sort_by(|a, b| a.0.total_cmp(&b.0));
        echoes
    }

    /// Echo of the returns `members`, in ascending order.
    fn echo(&self, returns: &Returns, members: &[usize]) -> Echo {
        let surface = |at: usize| (returns.instances[self.rows[at]], returns.bounces[self.rows[at]]);
        let mut shares: Vec<((i32, i32), f64)> = vec![];
        let mut total = 0.0;
        for &at in members {
            total += self.energies[at];
            match shares.iter_mut().find(|(known, _)| *known == surface(at)) {
                Some((_, share)) => *share += self.energies[at],
                None => shares.push((surface(at), self.energies[at])),
            }
        }
        let share_of =
            |at: usize| shares.iter().find(|(known, _)| *known == surface(at)).map_or(0.0, |(_, share)| *share);
        let rank = |a: usize, b: usize| -> Ordering {
            let by_energy = self.energies[a].total_cmp(&self.energies[b]);
            share_of(a).total_cmp(&share_of(b)).then(by_energy).then(self.rows[b].cmp(&self.rows[a]))
        };
        let main = members.iter().copied().max_by(|&a, &b| rank(a, b)).unwrap_or(members[0]);
        let purity = if total > 0.0 { share_of(main) / total } else { 1.0 };
        (self.modes[main], total, self.rows[main], purity as f32)
    }
}

/// Sum of Gaussians of the same width. `places` are their centres, in ascending order; `shares` are their
/// heights, of which the largest is 1.
struct GaussianSum<'a> {
    places: &'a [f64],
    shares: &'a [f64],
    sigma: f64,
}

impl GaussianSum<'_> {
    /// Finds the maximum reached by climbing the sum from each Gaussian's centre.
    fn find_modes(&self, modes: &mut [f64]) {
        let last = self.places.len() - 1;
        if self.places[last] - self.places[0] <= MERGED * self.sigma {
            modes.fill(self.single_maximum());
            return;
        }
        modes[0] = self.climb(self.places[0]);
        modes[last] = self.climb(self.places[last]);
        self.fill_modes(modes, 0..last);
    }

    /// Finds the maxima for the centres between two centres whose maxima are known. A centre between two
    /// centres with the same maximum has this maximum too, because climbing never changes the order of the
    /// positions.
    fn fill_modes(&self, modes: &mut [f64], between: Range<usize>) {
        let Range { start, end } = between;
        if end - start < 2 {
            return;
        }
        if (modes[end] - modes[start]).abs() <= SAME * self.sigma {
            let mode = modes[start];
            modes[start + 1..end].fill(mode);
            return;
        }
        let middle = start.midpoint(end);
        modes[middle] = self.climb(self.places[middle]);
        self.fill_modes(modes, start..middle);
        self.fill_modes(modes, middle..end);
    }

    /// Maximum of a sum that has a single maximum: Newton's method for the zero of the mean shift, with steps of at
    /// most half a standard deviation.
    fn single_maximum(&self) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for (place, share) in self.places.iter().zip(self.shares) {
            sum += place * share;
            total += share;
        }
        let mut at = sum / total;
        for _ in 0..100 {
            let (step, variance) = self.shift(at);
            let slope = (1.0 - variance / (self.sigma * self.sigma)).max(0.05);
            let step = (step / slope).clamp(-0.5 * self.sigma, 0.5 * self.sigma);
            at += step;
            if step.abs() <= 1e-8 * self.sigma {
                break;
            }
        }
        at
    }

    /// Maximum reached by climbing from `at`.
    ///
    /// The method is mean shift, which never descends, until a step is below sigma / 1000 and the sum curves downwards;
    /// then Newton's method. On a slope without a maximum, steps become small, but the sum curves upwards around them.
    fn climb(&self, mut at: f64) -> f64 {
        let square = self.sigma * self.sigma;
        for _ in 0..5000 {
            let (step, variance) = self.shift(at);
            at += step;
            let is_flat = variance > 0.95 * square;
            if step.abs() <= if is_flat { 1e-7 * self.sigma } else { SAME * self.sigma } {
                break;
            }
        }
        for _ in 0..8 {
            let (step, variance) = self.shift(at);
            let slope = 1.0 - variance / square;
            let step = if slope > 0.05 { step / slope } else { step };
            at += step;
            if step.abs() <= 1e-9 * self.sigma {
                break;
            }
        }
        at
    }

    /// Weighted mean of the Gaussians' centres, relative to `at`, and their variance. The weight of a centre
    /// is its share times the Gaussian of its distance from `at`.
    fn shift(&self, at: f64) -> (f64, f64) {
        let (mut total, mut first, mut second) = (0.0, 0.0, 0.0);
        for (place, share) in self.places.iter().zip(self.shares) {
            let apart = place - at;
            let scaled = apart / self.sigma;
            let weight = share * exp_negative(-0.5 * scaled * scaled);
            total += weight;
            first += weight * apart;
            second += weight * apart * apart;
        }
        let total = total.max(1e-300);
        let mean = first / total;
        (mean, (second / total - mean * mean).max(0.0))
    }
}

/// Exponential function of x <= 0, with the same bits on every processor; 0 below -700.
fn exp_negative(x: f64) -> f64 {
    if x < -700.0 {
        return 0.0;
    }
    // Adding and subtracting 1.5 * 2^52 rounds to an integer.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    let power = (x * std::f64::consts::LOG2_E + ROUND) - ROUND;
    let r = (x - power * LN2_HIGH) - power * LN2_LOW;
    // 1 / 2!, 1 / 3!, ... 1 / 13!, added in pairs (Estrin's scheme); the error is below 1e-16 for |r| <= ln(2) / 2.
    let (r2, one) = (r * r, 1.0 + r);
    let c2 = 1.0 / 2.0 + r / 6.0;
    let c4 = 1.0 / 24.0 + r / 120.0;
    let c6 = 1.0 / 720.0 + r / 5040.0;
    let c8 = 1.0 / 40320.0 + r / 362_880.0;
    let c10 = 1.0 / 3_628_800.0 + r / 39_916_800.0;
    let c12 = 1.0 / 479_001_600.0 + r / 6_227_020_800.0;
    let r4 = r2 * r2;
    let value = (one + c2 * r2) + (c4 + c6 * r2) * r4 + ((c8 + c10 * r2) + c12 * r4) * (r4 * r4);
    f64::from_bits(((power as i64 + 1023) as u64) << 52) * value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_of_negative_numbers_is_accurate() {
        for i in 0..70_000 {
            let x = -f64::from(i) / 100.0;
            assert!((exp_negative(x) / x.exp() - 1.0).abs() <= 3.0 * f64::EPSILON, "{x}");
        }
        assert_eq!(exp_negative(0.0), 1.0);
        assert_eq!(exp_negative(-701.0), 0.0);
    }

    #[test]
    fn echoes_do_not_depend_on_tasks() {
        let pulses: Vec<i64> = (0..20_000).map(|i| i / 5).collect();
        let lengths: Vec<f64> = (0..20_000).map(|i| 10.0 + f64::from(i * 7919 % 97) / 50.0).collect();
        let energies: Vec<f64> = (0..20_000).map(|i| 1.0 + f64::from(i % 11)).collect();
        let instances: Vec<i32> = (0..20_000).map(|i| i % 3).collect();
        let returns = |rows: Range<usize>| -> (Vec<i64>, Vec<f64>, Vec<f64>, Vec<i32>) {
            (
                pulses[rows.clone()].to_vec(),
                lengths[rows.clone()].to_vec(),
                energies[rows.clone()].to_vec(),
                instances[rows].to_vec(),
            )
        };
        let echoes = |(pulses, lengths, energies, instances): (Vec<i64>, Vec<f64>, Vec<f64>, Vec<i32>)| {
            let bounces = vec![0; pulses.len()];
            let returns = Returns {
                pulses: &pulses,
                lengths: &lengths,
                energies: &energies,
                instances: &instances,
                bounces: &bounces,
            };
            find_echoes(&returns, 0.25, Some(2)).unwrap()
        };
        let all = echoes(returns(0..20_000));
        let mut joined = echoes(returns(0..12_345));
        let mut rest = echoes(returns(12_345..20_000));
        rest.mains.iter_mut().for_each(|row| *row += 12_345);
        joined.append(rest);
        assert_eq!(all, joined);
        assert_eq!(all.energies.iter().sum::<f64>(), energies.iter().sum::<f64>());
    }

    #[test]
    fn returns_that_are_not_sorted_by_pulse_are_refused() {
        let returns =
            Returns { pulses: &[1, 0], lengths: &[1.0; 2], energies: &[1.0; 2], instances: &[0; 2], bounces: &[0; 2] };
        assert!(find_echoes(&returns, 0.25, Some(1)).is_err());
    }
}
