//! Media along rays: the medium between surfaces, the fraction of light that passes, and the points at which light is
//! scattered.
//!
//! * [`nested_dielectrics`]: the media that a path is in, selected by priority.
//! * [`map`]: the medium at each part of a ray.
//! * [`interior`]: the bodies that contain a point.
//! * [`free_flight`]: the distance after which a medium scatters a path, by transmittance.
//! * [`equiangular`]: a distance near to a light, for light that arrives directly.
//!
//! Media are homogeneous, with a coefficient for each colour. The distances of the two strategies are combined by
//! multiple importance sampling, and so are the colours: a distance is drawn for one colour channel and used for all
//! channels.

pub(crate) mod equiangular;
pub(crate) mod free_flight;
pub(crate) mod interior;
pub(crate) mod map;
pub(crate) mod nested_dielectrics;
