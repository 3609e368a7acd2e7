//! Path guiding for caustics: samples of diffuse surfaces are guided to objects that focus light.
//!
//! [`caustic_casters`] finds the objects, [`caustic_map`] stores where photons left them, [`cones`] is the density of guided
//! samples and [`sample_cones`] draws them. The photons come from the integrator's photon pass. This folder uses
//! `interaction`, `prepare` and `lobes`.

pub(crate) mod caustic_casters;
pub(crate) mod caustic_map;
pub(crate) mod cones;
pub(crate) mod sample_cones;
