#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::image(b"\x76\x2f\x31\x01", bytes));
