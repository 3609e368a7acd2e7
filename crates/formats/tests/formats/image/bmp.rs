use std::io::Cursor;

use ::image::codecs::bmp::BmpDecoder;

use crate::image::damage_is_found_before;

#[test]
fn damaged_bmp_is_refused_before_pixels_are_stored() {
    let message = "truncated, or its runs extend beyond the image";
    damage_is_found_before(".bmp", message, |bytes| Ok(Box::new(BmpDecoder::new(Cursor::new(bytes))?)));
}
