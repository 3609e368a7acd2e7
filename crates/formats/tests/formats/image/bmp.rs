use std::io::Cursor;

use ::image::codecs::bmp::BmpDecoder;

use crate::image::damage_is_found_before;

#[test]
fn damage_is_found_before_the_picture_is_kept() {
    let message = "ends early, or has runs that lead out of the picture";
    damage_is_found_before(".bmp", message, |bytes| Ok(Box::new(BmpDecoder::new(Cursor::new(bytes))?)));
}
