use std::io::Cursor;

use ::image::codecs::webp::WebPDecoder;

use crate::image::{cases, damage_is_found_before, read};
use raycam_formats::ColorUse;

#[test]
fn damaged_webp_is_refused_before_pixels_are_stored() {
    let message = "the image is truncated or damaged";
    damage_is_found_before("lossless.webp", message, |bytes| Ok(Box::new(WebPDecoder::new(Cursor::new(bytes))?)));
}

#[test]
fn truncated_alpha_channels_are_refused_before_pixels_are_stored() {
    let case = cases().into_iter().find(|case| case.name == "lossy.webp");
    let mut file = case.unwrap().file;
    let at = file.windows(4).position(|w| w == b"ALPH").unwrap() + 4;
    // The alpha chunk keeps only two bytes; its other bytes become a chunk with another name.
    let length = u32::from_le_bytes(*file[at..].first_chunk().unwrap());
    let mut rest = (length - 10).next_multiple_of(2).to_le_bytes().to_vec();
    rest.splice(0..0, *b"rest");
    file[at..at + 4].copy_from_slice(&2_u32.to_le_bytes());
    file[at + 6..at + 14].copy_from_slice(&rest);
    let error = read("a.webp", &file, ColorUse::Color).unwrap_err();
    assert_eq!(error.to_string(), "a.webp: the image is truncated or damaged");
}
