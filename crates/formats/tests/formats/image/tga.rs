use std::io::Cursor;

use ::image::codecs::tga::TgaDecoder;

use crate::image::damage_is_found_before;

#[test]
fn damage_is_found_before_the_picture_is_kept() {
    let message = "ends early, or has an index outside its colour map";
    damage_is_found_before(".tga", message, |bytes| Ok(Box::new(TgaDecoder::new(Cursor::new(bytes))?)));
}
