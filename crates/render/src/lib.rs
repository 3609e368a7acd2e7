//! Renderer: computes a camera's view of a [`World`](raycam_scene::World).
//!
//! ```text
//! World ──prepare──> PreparedWorld = Geometry (BVH, instances, materials, textures) + Lighting + Guiding
//!                          │
//! Camera ── tile_renderer: GenerateCameraRays ──> hits ──┬──> ground_truth ──────────────┐
//!                                                        └──> integrator ──> radiance ──> film ──> Frame
//!                                                             │
//!                       bounce: HandleEscapedRays, SampleLights (TraceShadowRays), EvaluateMaterialsAndBSDFs
//! ```
//!
//! The stages are named as in pbrt-v4's wavefront integrator (M. Pharr, W. Jakob and G. Humphreys, "Physically Based
//! Rendering", 4th edition, 2023, chapter 15). The unit of work is a tile: one thread traces, shades and writes a batch
//! of rays. Results do not depend on tiles, on the number of threads or on their order.
//!
//! | folder | contents |
//! |---|---|
//! | `lobes` | scattering mathematics: GGX, Fresnel, sheen, thin film, albedo tables |
//! | `sampling` | random numbers, pixel filters, cones, piecewise constant distributions |
//! | `film` | channels, planes, tiles, estimators, display encoding |
//! | `prepare` | conversion of the world's description to the form that is traced |
//! | `interaction` | position, normals, textures and vertex attributes at a hit |
//! | `media` | media along rays: nested bodies, fog |
//! | `bsdf` | BSDFs, for one point and for batches |
//! | `light` | lights, light tree, light samples |
//! | `motion` | world states while the shutter is open |
//! | `integrator` | path tracing, ambient occlusion, unlit colours |
//! | `guiding` | path guiding: caustic casters, caustic maps, gaps; selected by `guiding_switch` |
//! | `ground_truth` | exact rays through pixel centres and their channels |
//! | `tile_renderer` | camera rays, shading and resolve of one tile |
//! | `annotations` | flow, keypoints and amodal masks |
//! | `lidar` | beams, returned energy and echoes of lidars |
//! | `queries` | ray and point queries: closest hits, crossings, inside tests, distances |
//!
//! A folder uses only folders above it in this table. `prepare/world.rs`, which composes the prepared world, is placed
//! between `light` and `motion`.
//!
//! Terms:
//!
//! * BSDF, bidirectional scattering distribution function: the ratio of scattered radiance to received irradiance, for
//!   reflection and transmission (F. E. Nicodemus, 1965; F. O. Bartell et al., 1980).
//! * MIS, multiple importance sampling: one estimate from several sampling strategies, here by the balance heuristic
//!   (E. Veach and L. Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995).
//! * Next-event estimation (NEE): a light sample and a shadow ray at every path vertex.
//! * Russian roulette: a path ends at random, and survivors are weighted by the inverse probability (J. Arvo and D.
//!   Kirk, "Particle Transport and Image Synthesis", SIGGRAPH 1990).
//! * Wavefront: all paths of a batch advance by one bounce, stage by stage (S. Laine, T. Karras and T. Aila,
//!   "Megakernels Considered Harmful", HPG 2013).
//! * Caustic: light that a mirror or a lens focuses on another surface.

#![forbid(unsafe_code)]
// These lints are allowed because loops over lanes index several arrays, and frames and batches of lanes are converted
// by reference or in place.
#![allow(clippy::needless_range_loop, clippy::wrong_self_convention)]

pub mod annotations;
mod bsdf;
mod control;
mod error;
pub mod film;
mod ground_truth;
mod guiding;
mod guiding_switch;
mod integrator;
mod interaction;
pub mod lidar;
mod light;
mod lobes;
mod media;
mod memory;
mod motion;
mod path_guiding;
mod prepare;
mod progressive;
pub mod queries;
mod render;
mod render_many;
mod sampling;
mod settings;
mod soa;
mod thread_pool;
mod tile_renderer;

pub use crate::film::channel::{Channel, PixelType};
pub use crate::film::frame::Frame;
pub use crate::film::image_plane::ImagePlane;
pub use crate::film::output_plane::{MAX_FRAME_BYTES, OutputPlane, PlaneData};
pub use control::Control;
pub use error::RenderError;
pub use integrator::bright_path::BrightPath;
pub use memory::check_memory;
pub use prepare::world::{PreparedFamily, PreparedWorld};
pub use progressive::Progressive;
pub use raycam_bvh::{InstructionSet, zeroed_huge};
pub use render::{BrightestSample, brightest_samples, checked_region, is_brief, render, render_into, render_moving};
pub use render_many::PictureSeries;
pub use settings::{Catchers, Filter, Integrator, Settings, TruthSurface};
