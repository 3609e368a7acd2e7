//! COLMAP's models, as text and as binary files. Source: COLMAP's documentation, "Output Format", and
//! `scene/reconstruction_io_text.cc`; the centre of the first pixel is (0.5, 0.5), poses are camera from world.
//!
//! [`reconstruction`] is the model, [`records`] describes its records once, and [`text`] and [`binary`] read and write
//! the fields of the records.

pub(crate) mod binary;
pub(crate) mod reconstruction;
pub(crate) mod records;
pub(crate) mod text;
