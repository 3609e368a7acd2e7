//! Triangles against rays: the watertight test of Woop, Benthin and Wald 2013, sixteen at a time.
//!
//! The ray is sheared to the axis along which it runs most; the triangle is hit where its three edge functions do not
//! differ in sign. Each is a difference of two rounded products, never fused: two triangles that share an edge compute
//! the same value with opposite sign, so no ray passes between them, and where a value is 0 float64 decides exactly.
//! Front and back are both hit. The edges count as inside.
//!
//! One ray meets sixteen triangles in two steps: all edges at once ([`super::line::within`]), then the few triangles that remain one
//! by one ([`super::line::meet_one`]). Sixteen rays meet one triangle at once ([`test_rays`]). Each computes every value by the same
//! operations in the same order, so a ray and a triangle have the same answer in either.

use super::line::{Member, Met, depth_in_float64};
use super::packet::Packet;
use super::rows::SideLanes;
use crate::block::Leaf;
use crate::simd::{Isa, Vector, packed_index};

/// Where rays meet triangles; only the lanes that the test names are written.
#[repr(C, align(64))]
pub struct Found {
    pub t: [f32; 16],
    pub u: [f32; 16],
    pub v: [f32; 16],
}

impl Found {
    pub const NOTHING: Found = Found {
        t: [0.0; 16],
        u: [0.0; 16],
        v: [0.0; 16],
    };

    /// What a lane holds.
    #[inline(always)]
    pub fn at(&self, lane: usize) -> Met {
        let lane = lane & 15;
        Met {
            t: self.t[lane],
            u: self.u[lane],
            v: self.v[lane],
        }
    }
}

/// The corners of the triangles of a leaf.
#[inline(always)]
pub fn corners<I: Isa>(v: I::F16, index: &[I::Index; 3]) -> [I::F16; 3] {
    [
        I::lookup(v, index[0]),
        I::lookup(v, index[1]),
        I::lookup(v, index[2]),
    ]
}

/// The indices that [`corners`] takes.
#[inline(always)]
pub fn indices<I: Isa>(leaf: &Leaf) -> [I::Index; 3] {
    [
        I::index(leaf.corner[0]),
        I::index(leaf.corner[1]),
        I::index(leaf.corner[2]),
    ]
}

/// The vertices of a leaf along an axis, less an origin.
#[inline(always)]
pub fn relative<I: Isa>(leaf: &Leaf, axis: usize, origin: f32) -> I::F16 {
    // SAFETY: each row of `vertex` holds 16 floats.
    let row = unsafe { I::F16::load(leaf.vertex[axis].as_ptr()) };
    row.sub(I::F16::splat(origin))
}

/// One triangle and sixteen rays.
struct OneTriangle<'a> {
    leaf: &'a Leaf,
    k: usize,
    /// The lanes of its corners.
    corner: [usize; 3],
    packet: &'a Packet,
    group: usize,
}

/// The lanes of the corners of triangle `k`.
#[inline(always)]
pub fn corner_lanes(leaf: &Leaf, k: usize) -> [usize; 3] {
    leaf.corner
        .map(|packed| usize::from(packed_index(packed, k)))
}

/// Bit i: ray `16 * group + i` of the packet, one of `active`, meets triangle `k` of the leaf.
#[inline(always)]
pub fn test_rays<I: Isa>(
    leaf: &Leaf,
    k: usize,
    packet: &Packet,
    group: usize,
    active: u32,
    found: &mut Found,
) -> u32 {
    let [kx, ky, kz] = packet.axes;
    let lanes = OneTriangle {
        leaf,
        k,
        corner: corner_lanes(leaf, k),
        packet,
        group,
    };
    let (rx, ry, rz) = (
        lanes.relative::<I>(kx),
        lanes.relative::<I>(ky),
        lanes.relative::<I>(kz),
    );
    let sx = packet.lanes::<I>(&packet.shear[0], group);
    let sy = packet.lanes::<I>(&packet.shear[1], group);
    let x = [
        rx[0].sub(sx.mul(rz[0])),
        rx[1].sub(sx.mul(rz[1])),
        rx[2].sub(sx.mul(rz[2])),
    ];
    let y = [
        ry[0].sub(sy.mul(rz[0])),
        ry[1].sub(sy.mul(rz[1])),
        ry[2].sub(sy.mul(rz[2])),
    ];
    meet::<I>(x, y, active, found, lanes)
}

impl OneTriangle<'_> {
    #[inline(always)]
    fn corners<I: Isa>(&self, axis: usize) -> [I::F16; 3] {
        let row = &self.leaf.vertex[axis];
        [
            I::F16::splat(row[self.corner[0]]),
            I::F16::splat(row[self.corner[1]]),
            I::F16::splat(row[self.corner[2]]),
        ]
    }

    #[inline(always)]
    fn relative<I: Isa>(&self, axis: usize) -> [I::F16; 3] {
        let origin = self
            .packet
            .lanes::<I>(&self.packet.origin[axis], self.group);
        let [a, b, c] = self.corners::<I>(axis);
        [a.sub(origin), b.sub(origin), c.sub(origin)]
    }

    /// The corners; along the main axis relative to the origin.
    #[inline(always)]
    fn along<I: Isa>(&self, axis: usize) -> [I::F16; 3] {
        if axis == self.packet.axes[2] {
            self.relative::<I>(axis)
        } else {
            self.corners::<I>(axis)
        }
    }
}

impl OneTriangle<'_> {
    #[inline(always)]
    fn rest<I: Isa>(&self) -> Rest<I::F16> {
        let packet = self.packet;
        Rest {
            axes: packet.axes,
            scale: packet.lanes::<I>(&packet.shear[2], self.group),
            corners: [self.along::<I>(0), self.along::<I>(1), self.along::<I>(2)],
            backwards: [
                packet.entry[0] & 1 != 0,
                packet.entry[1] & 1 != 0,
                packet.entry[2] & 1 != 0,
            ],
            reciprocal: packet.lanes::<I>(&packet.reciprocal[packet.axes[2]], self.group),
            near: packet.near.lanes::<I>(self.group),
            far: packet.far.lanes::<I>(self.group),
            t_max: packet.lanes::<I>(&packet.t_max, self.group),
        }
    }
}

/// What is needed once a lane has passed the edges.
struct Rest<V> {
    /// See [`LocalRay::axes`].
    axes: [usize; 3],
    /// One over the direction along the main axis.
    scale: V,
    /// The corners by axis; along the main axis relative to the origin.
    corners: [[V; 3]; 3],
    backwards: [bool; 3],
    /// Along the main axis.
    reciprocal: V,
    near: SideLanes<V>,
    far: SideLanes<V>,
    t_max: V,
}

/// The test, given the sheared corners: the lanes of `active` that are hit.
#[inline(always)]
fn meet<I: Isa>(
    [ax, bx, cx]: [I::F16; 3],
    [ay, by, cy]: [I::F16; 3],
    active: u32,
    found: &mut Found,
    lanes: OneTriangle,
) -> u32 {
    let mut u = cx.mul(by).sub(cy.mul(bx));
    let mut v = ax.mul(cy).sub(ay.mul(cx));
    let mut w = bx.mul(ay).sub(by.mul(ax));
    let zero = I::F16::splat(0.0);
    let inside = <I::F16 as Vector>::or(zero.le(u.min(v).min(w)), u.max(v).max(w).le(zero));
    let mut hit = <I::F16 as Vector>::bits(inside) & active;
    if hit == 0 {
        return 0;
    }
    let rest = lanes.rest::<I>();
    let smallest = u.abs().min(v.abs()).min(w.abs());
    let unsure = <I::F16 as Vector>::bits(smallest.eq(zero)) & hit;
    if unsure != 0 {
        let mut edges = [[0.0; 16]; 3];
        let mut corners = [[0.0; 16]; 6];
        for (array, vector) in corners.iter_mut().zip([ax, ay, bx, by, cx, cy]) {
            // SAFETY: each array holds 16 floats.
            unsafe { vector.store(array.as_mut_ptr()) };
        }
        for (array, vector) in edges.iter_mut().zip([u, v, w]) {
            // SAFETY: each array holds 16 floats.
            unsafe { vector.store(array.as_mut_ptr()) };
        }
        hit = decide_lanes(&corners, unsure, hit, &mut edges);
        // SAFETY: each array holds 16 floats.
        unsafe {
            u = I::F16::load(edges[0].as_ptr());
            v = I::F16::load(edges[1].as_ptr());
            w = I::F16::load(edges[2].as_ptr());
        }
    }
    let det = u.add(v).add(w);
    let (wa, wb, wc) = (u.div(det), v.div(det), w.div(det));
    let [za, zb, zc] = rest.corners[rest.axes[2]];
    let mut depth = wa.mul(za).add(wb.mul(zb)).add(wc.mul(zc));
    // Into the triangle's own box: see END_PAD.
    let mut enter = I::F16::splat(f32::NEG_INFINITY);
    let mut leave = I::F16::splat(f32::INFINITY);
    for axis in rest.axes {
        let [a, b, c] = rest.corners[axis];
        let (lower, upper) = (a.min(b).min(c), a.max(b).max(c));
        let (first, last) = if rest.backwards[axis] {
            (upper, lower)
        } else {
            (lower, upper)
        };
        let (first, last) = if axis == rest.axes[2] {
            let r = rest.reciprocal;
            (first.mul(r), last.mul(r))
        } else {
            (rest.near.passes(axis, first), rest.far.passes(axis, last))
        };
        enter = enter.max(first);
        leave = leave.min(last);
    }
    if lanes.leaf.is_thin(lanes.k) {
        let behind = hit & !<I::F16 as Vector>::bits(zero.le(enter));
        let mut depths = [0.0; 16];
        // SAFETY: the array holds 16 floats.
        unsafe { depth.store(depths.as_mut_ptr()) };
        for lane in (0..16).filter(|lane| behind >> lane & 1 != 0) {
            let ray = Member(lanes.packet, 16 * lanes.group + lane);
            depths[lane] = depth_in_float64(lanes.leaf, lanes.k, ray, depths[lane]);
        }
        // SAFETY: as above.
        depth = unsafe { I::F16::load(depths.as_ptr()) };
    }
    let t = depth.mul(rest.scale).min(leave).max(enter);
    let counts = <I::F16 as Vector>::and(zero.le(t), t.le(rest.t_max));
    hit &= <I::F16 as Vector>::bits(counts);
    if hit != 0 {
        // SAFETY: each array holds 16 floats.
        unsafe {
            t.store(found.t.as_mut_ptr());
            wb.store(found.u.as_mut_ptr());
            wc.store(found.v.as_mut_ptr());
        }
    }
    hit
}

/// Decides the lanes of `unsure`; returns the lanes of `hit` that stay.
#[cold]
#[inline(never)]
fn decide_lanes(
    corners: &[[f32; 16]; 6],
    unsure: u32,
    mut hit: u32,
    edges: &mut [[f32; 16]; 3],
) -> u32 {
    for lane in (0..16).filter(|lane| unsure >> lane & 1 != 0) {
        match decide(corners.map(|row| row[lane])) {
            Some(decided) => {
                for (edge, value) in edges.iter_mut().zip(decided) {
                    edge[lane] = value;
                }
            }
            None => hit &= !(1 << lane),
        }
    }
    hit
}

/// The edge functions by float64, in which the products are exact; `None` outside.
#[cold]
#[inline(never)]
pub fn decide(corners: [f32; 6]) -> Option<[f32; 3]> {
    let [ax, ay, bx, by, cx, cy] = corners.map(f64::from);
    let (u, v, w) = (cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
    let det = u + v + w;
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    (inside && det != 0.0).then(|| [u, v, w].map(|value| (value / det) as f32))
}
