use std::io::Cursor;

use raycam_formats::encode::png::{Samples, encode};

#[test]
fn png_files_round_trip_samples_and_are_marked_as_srgb() {
    let kinds = [
        (1, png::ColorType::Grayscale),
        (2, png::ColorType::GrayscaleAlpha),
        (3, png::ColorType::Rgb),
        (4, png::ColorType::Rgba),
    ];
    for (channels, color) in kinds {
        let bytes: Vec<u8> = (0..5 * 3 * channels).map(|i| (i * 7) as u8).collect();
        let words: Vec<u16> = bytes.iter().map(|&b| u16::from(b) * 251).collect();
        let big: Vec<u8> = words.iter().flat_map(|w| w.to_be_bytes()).collect();
        for (samples, expected) in [(Samples::U8(&bytes), &bytes), (Samples::U16(&words), &big)] {
            let file = encode([5, 3], channels, samples).unwrap();
            let mut reader = png::Decoder::new(Cursor::new(&file)).read_info().unwrap();
            assert_eq!((reader.info().width, reader.info().height, reader.info().color_type), (5, 3, color));
            assert!(reader.info().srgb.is_some());
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            assert_eq!(&pixels, expected);
            assert_eq!(file, encode([5, 3], channels, samples).unwrap());
        }
    }
}

#[test]
fn wrong_numbers_of_samples_are_refused() {
    for (size, channels, count) in [([5, 3], 3, 44), ([5, 3], 5, 75), ([0, 3], 3, 0), ([1 << 31, 1 << 31], 4, 0)] {
        let error = encode(size, channels, Samples::U8(&vec![0; count])).unwrap_err();
        assert!(error.to_string().starts_with("PNG: "), "{error}");
    }
}
