#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::image(b"\xabKTX 20\xbb\r\n\x1a\n", bytes));
