//! TODO: what is here.

#[cfg(test)]
pub(crate) mod chi_squared;
pub(crate) mod dimension;
pub(crate) mod direction_cone;
pub(crate) mod filter;
pub(crate) mod sampler;
#[cfg(test)]
pub(crate) mod tests;
