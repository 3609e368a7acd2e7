use std::io::Cursor;

use ::image::codecs::tga::TgaDecoder;

use crate::image::damage_is_found_before;

#[test]
fn damaged_tga_is_refused_before_pixels_are_stored() {
    let message = "truncated, or contains an index outside its colour map";
    damage_is_found_before(".tga", message, |bytes| Ok(Box::new(TgaDecoder::new(Cursor::new(bytes))?)));
}
