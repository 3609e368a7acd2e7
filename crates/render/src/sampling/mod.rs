//! Sampling: random numbers, pixel filters, cones and piecewise constant distributions. Uses only the lobes.

#[cfg(test)]
pub(crate) mod chi_squared;
pub(crate) mod dimension;
pub(crate) mod direction_cone;
pub(crate) mod filter;
pub(crate) mod piecewise_constant_2d;
pub(crate) mod sampler;
#[cfg(test)]
pub(crate) mod tests;
