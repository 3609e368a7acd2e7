//! One ray of a packet, for the triangle tests of single rays.

use crate::traverse::packet::Packet;
use crate::traverse::packet::soa::PACKET_SIZE;
use crate::traverse::triangle::single::RayView;

/// A ray of a packet. The fields are the packet and the ray's index in it.
#[derive(Clone, Copy)]
pub struct PacketRay<'a>(pub &'a Packet, pub usize);

impl RayView for PacketRay<'_> {
    #[inline(always)]
    fn axes(&self) -> [usize; 3] {
        self.0.axes
    }
    #[inline(always)]
    fn origin(&self, axis: usize) -> f32 {
        self.0.origin[axis][self.1 & (PACKET_SIZE - 1)]
    }
    #[inline(always)]
    fn shear(&self, k: usize) -> f32 {
        self.0.shear[k][self.1 & (PACKET_SIZE - 1)]
    }
    #[inline(always)]
    fn reciprocal(&self, axis: usize) -> f32 {
        self.0.reciprocal[axis][self.1 & (PACKET_SIZE - 1)]
    }
    #[inline(always)]
    fn t_near(&self, axis: usize, bound: f32) -> f32 {
        self.0.near.t_at(axis, self.1 & (PACKET_SIZE - 1), bound)
    }
    #[inline(always)]
    fn t_far(&self, axis: usize, bound: f32) -> f32 {
        self.0.far.t_at(axis, self.1 & (PACKET_SIZE - 1), bound)
    }
}
