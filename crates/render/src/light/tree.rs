//! Which of many lights matters to a point: a tree over their places, directions and powers.
//!
//! A. Conty Estevez and C. Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018, one light
//! at a time; the bounds on angles are those of M. Pharr, W. Jakob and G. Humphreys, "Physically Based Rendering",
//! 4th edition, section 12.6.3.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::Reference;

/// Where lights are, where they shine and how much.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    /// Scene-local.
    pub lower: Vec3,
    pub upper: Vec3,
    /// Of a cone that holds all their normals; the cosine of its half angle.
    pub axis: Vec3,
    pub cos_normals: f32,
    /// The cosine of how far from its normal a light shines.
    pub cos_emission: f32,
    /// Whether they shine to the other side as well.
    pub two_sided: bool,
    /// The largest intensity of all together, in W/sr.
    pub intensity: f32,
}

impl Default for Bounds {
    fn default() -> Self {
        Self::around(DVec3::ZERO, DVec3::ZERO, Vec3::ZERO)
    }
}

impl Bounds {
    /// Of a light that shines everywhere.
    pub fn around(lower: DVec3, upper: DVec3, intensity: Vec3) -> Self {
        Self {
            lower: lower.as_vec3(),
            upper: upper.as_vec3(),
            axis: Vec3::Z,
            cos_normals: -1.0,
            cos_emission: 0.0,
            two_sided: false,
            intensity: intensity.element_sum(),
        }
    }

    /// Of one that shines from a plane.
    pub fn flat(corners: &[DVec3], normal: DVec3, intensity: Vec3, two_sided: bool) -> Self {
        let lower = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let upper = corners
            .iter()
            .copied()
            .fold(DVec3::NEG_INFINITY, DVec3::max);
        Self {
            axis: normal.as_vec3(),
            cos_normals: 1.0,
            two_sided,
            ..Self::around(lower, upper, intensity)
        }
    }

    fn center(&self) -> Vec3 {
        self.lower + (self.upper - self.lower) / 2.0
    }

    fn union(&self, other: &Self) -> Self {
        // What is dark has no say.
        if other.intensity <= 0.0 {
            return *self;
        }
        if self.intensity <= 0.0 {
            return *other;
        }
        let (axis, cos_normals) = cone_union(
            (self.axis, self.cos_normals),
            (other.axis, other.cos_normals),
        );
        Self {
            lower: self.lower.min(other.lower),
            upper: self.upper.max(other.upper),
            axis,
            cos_normals,
            cos_emission: self.cos_emission.min(other.cos_emission),
            two_sided: self.two_sided || other.two_sided,
            intensity: self.intensity + other.intensity,
        }
    }

    /// A bound on what arrives at a point, up to a factor: intensity over squared distance, by the smallest angles that
    /// the bounds leave. 0 only where nothing arrives.
    fn importance(&self, position: Vec3, normal: Vec3) -> f32 {
        self.weigh(position, normal).0
    }

    /// [`Bounds::importance`], and whether it is certain that each light inside has one.
    fn weigh(&self, position: Vec3, normal: Vec3) -> (f32, bool) {
        const NONE: (f32, bool) = (0.0, false);
        let away = position - self.center();
        let half = (self.upper - self.lower) / 2.0;
        let radius2 = half.length_squared();
        // From inside, every distance is possible: that of the rim stands for them.
        let distance2 = away.length_squared();
        let direction = away / distance2.sqrt().max(f32::MIN_POSITIVE);
        let by_distance = self.intensity / distance2.max(radius2).max(1e-30);
        // The corner that stands highest above the point's horizon, a bit more against rounding.
        let highest = half.dot(normal.abs()) - away.dot(normal);
        if normal != Vec3::ZERO && highest <= -1e-5 * away.abs().element_sum() {
            return NONE;
        }
        if distance2 <= radius2 {
            return (by_distance, false);
        }
        // The half angle that the box fills, at most; a bit more against rounding.
        let half_box = Angle::of_sine(((radius2 / distance2).sqrt() + 1e-3).min(1.0));
        let cos_axis = self.axis.dot(direction).clamp(-1.0, 1.0);
        let normals = Angle::of_cosine(self.cos_normals.clamp(-1.0, 1.0));
        let most = Angle::of_cosine(cos_axis).more(normals).more(half_box);
        let mut certain = most.cos > self.cos_emission + 1e-3;
        let cos_axis = if self.two_sided {
            cos_axis.abs()
        } else {
            cos_axis
        };
        let off = Angle::of_cosine(cos_axis).less(normals).less(half_box);
        if off.cos <= self.cos_emission - 1e-3 {
            return NONE;
        }
        let mut importance = by_distance * off.cos.max(1e-3);
        if normal != Vec3::ZERO {
            let height = Angle::of_cosine((-normal.dot(direction)).clamp(-1.0, 1.0));
            let cos = height.less(half_box).cos;
            if cos <= 0.0 {
                return NONE;
            }
            certain &= height.more(half_box).cos > 0.0;
            importance *= cos;
        }
        (importance, certain)
    }

    /// The cost of a group in the surface area orientation heuristic: intensity, area and the measure of its directions.
    fn cost(&self) -> f32 {
        let size = self.upper - self.lower;
        let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
        let (normals, emission) = (
            self.cos_normals.clamp(-1.0, 1.0).acos(),
            self.cos_emission.acos(),
        );
        let edge = (normals + emission).min(PI);
        let directions = 2.0 * PI * (1.0 - self.cos_normals)
            + PI / 2.0
                * (2.0 * edge * normals.sin()
                    - (normals - 2.0 * edge).cos()
                    - 2.0 * normals * normals.sin()
                    + self.cos_normals);
        // Lights in one point or line still cost more apart.
        self.intensity * directions * (area + size.max_element().powi(2))
    }
}

/// An angle in 0..=180 degrees.
#[derive(Clone, Copy)]
struct Angle {
    sin: f32,
    cos: f32,
}

impl Angle {
    fn of_cosine(cos: f32) -> Self {
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        Self { sin, cos }
    }

    /// Of at most 90 degrees.
    fn of_sine(sin: f32) -> Self {
        let cos = (1.0 - sin * sin).max(0.0).sqrt();
        Self { sin, cos }
    }

    /// The sum, at most 180 degrees.
    fn more(self, other: Self) -> Self {
        // a + b >= 180 degrees where a >= 180 degrees - b.
        if self.cos <= -other.cos {
            return Self {
                sin: 0.0,
                cos: -1.0,
            };
        }
        Self {
            sin: self.sin * other.cos + self.cos * other.sin,
            cos: self.cos * other.cos - self.sin * other.sin,
        }
    }

    /// The difference, at least 0.
    fn less(self, other: Self) -> Self {
        if self.cos >= other.cos {
            return Self { sin: 0.0, cos: 1.0 };
        }
        Self {
            sin: self.sin * other.cos - self.cos * other.sin,
            cos: self.cos * other.cos + self.sin * other.sin,
        }
    }
}

/// The smallest cone that holds two, as axis and cosine of the half angle.
fn cone_union(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let [ta, tb] = [a.1, b.1].map(|cos| cos.clamp(-1.0, 1.0).acos());
    let between = a.0.dot(b.0).clamp(-1.0, 1.0).acos();
    if (between + tb).min(PI) <= ta {
        return a;
    }
    if (between + ta).min(PI) <= tb {
        return b;
    }
    let half = (ta + tb + between) / 2.0;
    let turn = a.0.cross(b.0);
    if half >= PI || turn.length_squared() < 1e-12 {
        return (Vec3::Z, -1.0);
    }
    let axis = glam::Quat::from_axis_angle(turn.normalize(), half - ta) * a.0;
    // A little wider against rounding.
    (axis.normalize(), (half + 1e-4).min(PI).cos())
}

/// A node: of two children, the first is the next node; or of one light.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Where the second child is.
    Inner(u32),
    Leaf(u32),
}

/// Which light to choose for a point. Lights keep their numbers.
#[derive(Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    /// The way from the root to each light, from the lowest bit up: 0 for the first child. Dark lights have none.
    ways: Vec<Option<u64>>,
}

/// Deeper nodes are halved by number, so that a way fits into 64 bits.
const DEEP: u32 = 30;

impl Tree {
    pub fn new(lights: &[Bounds]) -> Self {
        let mut tree = Self {
            nodes: Vec::with_capacity(2 * lights.len()),
            ways: vec![None; lights.len()],
        };
        let mut shining: Vec<u32> = (0..lights.len() as u32)
            .filter(|&i| lights[i as usize].intensity > 0.0)
            .collect();
        if !shining.is_empty() {
            tree.build(lights, &mut shining, 0, 0);
        }
        tree
    }

    fn build(&mut self, lights: &[Bounds], group: &mut [u32], depth: u32, way: u64) {
        let bounds = group
            .iter()
            .map(|&i| lights[i as usize])
            .reduce(|a, b| a.union(&b))
            .unwrap_or_default();
        let at = self.nodes.len();
        if let [only] = *group {
            self.ways[only as usize] = Some(way);
            self.nodes.push(Node {
                bounds,
                kind: Kind::Leaf(only),
            });
            return;
        }
        let middle = split(lights, group, depth);
        self.nodes.push(Node {
            bounds,
            kind: Kind::Inner(0),
        });
        let (first, second) = group.split_at_mut(middle);
        self.build(lights, first, depth + 1, way);
        self.nodes[at].kind = Kind::Inner(self.nodes.len() as u32);
        self.build(lights, second, depth + 1, way | 1 << depth);
    }

    /// Whether no light shines.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// How many lights shine.
    pub fn count(&self) -> usize {
        self.nodes.len().div_ceil(2)
    }

    /// How much all of it may matter to a point.
    pub fn importance(&self, from: &Reference) -> f64 {
        let position = from.position.as_vec3();
        self.nodes.first().map_or(0.0, |root| {
            f64::from(root.bounds.importance(position, from.normal))
        })
    }

    /// A light by a number in 0..1, and its probability.
    pub fn choose(&self, from: &Reference, mut number: f64) -> Option<(usize, f64)> {
        let mut at = 0;
        let mut probability = 1.0;
        loop {
            match self.nodes.get(at)?.kind {
                Kind::Leaf(light) => return Some((light as usize, probability)),
                Kind::Inner(second) => {
                    let share = self.share(at, second as usize, from)?;
                    if number < share {
                        number /= share;
                        probability *= share;
                        at += 1;
                    } else {
                        number = (number - share) / (1.0 - share);
                        probability *= 1.0 - share;
                        at = second as usize;
                    }
                }
            }
        }
    }

    /// The probability with which [`Tree::choose`] gives this light.
    pub fn probability(&self, from: &Reference, light: usize) -> f64 {
        let Some(mut way) = self.ways[light] else {
            return 0.0;
        };
        let mut at = 0;
        let mut probability = 1.0;
        while let Kind::Inner(second) = self.nodes[at].kind {
            let Some(share) = self.share(at, second as usize, from) else {
                return 0.0;
            };
            if way & 1 == 0 {
                probability *= share;
                at += 1;
            } else {
                probability *= 1.0 - share;
                at = second as usize;
            }
            way >>= 1;
        }
        probability
    }

    /// The first child's share of a node; `None` where neither matters.
    fn share(&self, at: usize, second: usize, from: &Reference) -> Option<f64> {
        let [a, b] = [at + 1, second].map(|node| {
            let mut looks = LOOKS;
            f64::from(self.matters(node, from, &mut looks))
        });
        (a + b > 0.0).then(|| a / (a + b))
    }

    /// The importance of a node, 0 as well where none of its lights has any: its bounds are wider than theirs. After some
    /// looks it is taken to have one.
    fn matters(&self, node: usize, from: &Reference, looks: &mut u32) -> f32 {
        let Node { bounds, kind } = &self.nodes[node];
        let (importance, certain) = bounds.weigh(from.position.as_vec3(), from.normal);
        let Kind::Inner(second) = *kind else {
            return importance;
        };
        if certain || importance == 0.0 || *looks == 0 {
            return importance;
        }
        *looks -= 1;
        let mut child = |child: usize| self.matters(child, from, looks) > 0.0;
        if child(node + 1) || child(second as usize) {
            importance
        } else {
            0.0
        }
    }
}

/// How many nodes are looked at before one of their group is chosen without.
const LOOKS: u32 = 32;

/// Parts a group in two by the cheapest of twelve planes along each axis, and says where the second part begins.
fn split(lights: &[Bounds], group: &mut [u32], depth: u32) -> usize {
    const BINS: usize = 12;
    let half = group.len() / 2;
    let center = |i: u32| lights[i as usize].center();
    let (low, high) = group
        .iter()
        .map(|&i| center(i))
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), c| {
            (low.min(c), high.max(c))
        });
    let size = high - low;
    if depth >= DEEP || size.max_element() <= 0.0 {
        return half;
    }
    let bin = |i: u32, axis: usize| {
        let place = (center(i)[axis] - low[axis]) / size[axis];
        ((place * BINS as f32) as usize).min(BINS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| size[axis] > 0.0) {
        let mut bins: [Option<Bounds>; BINS] = [None; BINS];
        for &i in &*group {
            let light = &lights[i as usize];
            let bin = &mut bins[bin(i, axis)];
            *bin = Some(bin.map_or(*light, |bounds| bounds.union(light)));
        }
        // Thin boxes are cheap to cut along their length alone.
        let stretch = size.max_element() / size[axis];
        let merge = |a: Option<Bounds>, b: &Option<Bounds>| match (a, b) {
            (Some(a), Some(b)) => Some(a.union(b)),
            (a, b) => a.or(*b),
        };
        for plane in 1..BINS {
            let [left, right] =
                [&bins[..plane], &bins[plane..]].map(|part| part.iter().fold(None, merge));
            let (Some(left), Some(right)) = (left, right) else {
                continue;
            };
            let cost = stretch * (left.cost() + right.cost());
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, plane));
            }
        }
    }
    let Some((_, axis, plane)) = best else {
        return half;
    };
    // Stable: the tree depends on the order of the lights alone.
    group.sort_by_key(|&i| bin(i, axis) >= plane);
    group.partition_point(|&i| bin(i, axis) < plane)
}
