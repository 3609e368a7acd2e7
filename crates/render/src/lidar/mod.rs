//! Lidars: the rays of a beam ([`beam`]), the energy that surfaces return ([`energy`]), and the echoes in the received
//! light ([`echoes`]).

pub mod beam;
pub mod echoes;
pub mod energy;
