//! Lexing of bytes: lines, words and numbers, without copying.

use std::borrow::Cow;

/// Lines of a text with their numbers from 1; lines end with `\n`, `\r\n` or `\r`.
#[derive(Clone)]
pub(crate) struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
    ended: bool,
}

impl<'a> Lines<'a> {
    pub(crate) fn new(text: &'a [u8]) -> Self {
        Self { rest: text, number: 0, ended: true }
    }

    /// True if the last line read had a line end; a file without a final line end may be truncated.
    pub(crate) fn ended_with_newline(&self) -> bool {
        self.ended
    }

    /// Number of unread bytes.
    pub(crate) fn remaining(&self) -> usize {
        self.rest.len()
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&b| b == b'\n' || b == b'\r');
        self.ended = end.is_some();
        let end = end.unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        let skip = match &self.rest[end..] {
            [b'\r', b'\n', ..] => 2,
            [] => 0,
            _ => 1,
        };
        self.rest = &self.rest[end + skip..];
        self.number += 1;
        Some((self.number, line))
    }
}

/// Number of line ends.
pub(crate) fn line_ends(text: &[u8]) -> usize {
    let feeds = text.iter().filter(|&&b| b == b'\n').count();
    let returns = text.iter().filter(|&&b| b == b'\r').count();
    if returns == 0 {
        return feeds;
    }
    let pairs = text.windows(2).filter(|pair| pair == b"\r\n").count();
    feeds + returns - pairs
}

/// Text of a file without its byte order mark; UTF-16 is converted to UTF-8.
pub(crate) fn plain_text(bytes: &[u8]) -> Cow<'_, [u8]> {
    let big = match bytes {
        [0xfe, 0xff, ..] => true,
        [0xff, 0xfe, ..] => false,
        // Text without a mark counts as UTF-16 if one of its first two bytes is zero, because text with one byte per
        // character contains no zeros.
        [0, second, ..] if *second != 0 => true,
        [first, 0, ..] if *first != 0 => false,
        _ => return Cow::Borrowed(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)),
    };
    let unit = |pair: &[u8; 2]| if big { u16::from_be_bytes(*pair) } else { u16::from_le_bytes(*pair) };
    let units = bytes.as_chunks::<2>().0.iter().map(unit);
    let character = |found: Result<char, _>| found.unwrap_or(char::REPLACEMENT_CHARACTER);
    let text: String = char::decode_utf16(units).map(character).collect();
    Cow::Owned(text.strip_prefix('\u{feff}').unwrap_or(&text).as_bytes().to_vec())
}

/// Converts the text of a file with a UTF-16 mark to UTF-8; other bytes are unchanged.
pub fn without_utf16(bytes: Vec<u8>) -> Vec<u8> {
    match bytes[..] {
        // Only a mark that is followed by a letter counts, because numbers may begin with the same bytes as a mark.
        [0xff, 0xfe, letter, 0, ..] | [0xfe, 0xff, 0, letter, ..] if letter != 0 => plain_text(&bytes).into_owned(),
        _ => bytes,
    }
}

fn is_space(b: u8) -> bool {
    matches!(b, b' ' | b'\t' | 0x0b | 0x0c)
}

/// Text without the white space at both ends.
pub(crate) fn trim(mut text: &[u8]) -> &[u8] {
    while let [first, rest @ ..] = text
        && is_space(*first)
    {
        text = rest;
    }
    while let [rest @ .., last] = text
        && is_space(*last)
    {
        text = rest;
    }
    text
}

/// The first word and the rest of the line.
pub(crate) fn split_word(text: &[u8]) -> (&[u8], &[u8]) {
    let start = text.iter().position(|&b| !is_space(b)).unwrap_or(text.len());
    let text = &text[start..];
    let end = text.iter().position(|&b| is_space(b)).unwrap_or(text.len());
    (&text[..end], &text[end..])
}

/// Words of a line up to a comment, which starts with `#`.
#[derive(Clone)]
pub(crate) struct Words<'a>(pub(crate) &'a [u8]);

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let (word, rest) = split_word(self.0);
        self.0 = rest;
        (!word.is_empty() && word[0] != b'#').then_some(word)
    }
}

/// Word for a message: at most 40 characters, for any bytes.
pub(crate) fn for_message(word: &[u8]) -> String {
    let text = String::from_utf8_lossy(word);
    let mut short: String = text.chars().take(40).collect();
    if short.len() < text.len() {
        short.push_str("...");
    }
    format!("{short:?}")
}

/// Message that a word is not a number. If the word has a decimal comma, which some programs write if the system's
/// language uses it, the message mentions the comma.
pub(crate) fn not_a_number(word: &[u8]) -> String {
    let shown = for_message(word);
    let point: Vec<u8> = word.iter().map(|&byte| if byte == b',' { b'.' } else { byte }).collect();
    match number(&point) {
        Some(_) => format!("{shown} is not a number; use a decimal point instead of a comma"),
        None => format!("{shown} is not a number"),
    }
}

/// Name as text; invalid UTF-8 is replaced.
pub(crate) fn name(bytes: &[u8]) -> String {
    String::from_utf8_lossy(trim(bytes)).into_owned()
}

/// Name as bytes, by which names are compared.
pub(crate) fn name_bytes(bytes: &[u8]) -> Vec<u8> {
    trim(bytes).into()
}

/// Nearest float64 to a decimal number; also accepts `inf` and `nan`, which the caller checks.
pub(crate) fn number(word: &[u8]) -> Option<f64> {
    exact_number(word)
        .or_else(|| exact_scientific_number(word))
        .or_else(|| std::str::from_utf8(word).ok()?.parse().ok())
        .or_else(|| not_finite(word))
        .or_else(|| fortran_number(word))
}

/// Reads a number whose exponent is written as in Fortran's double precision: `1.0D+00`.
fn fortran_number(word: &[u8]) -> Option<f64> {
    let is_part = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'.' | b'd' | b'D');
    let text = std::str::from_utf8(word).ok().filter(|_| word.iter().all(is_part))?;
    text.replace(['d', 'D'], "e").parse().ok()
}

/// Reads three numbers that are written with commas or semicolons: as separators (`0, 0, 1`), or as decimal commas
/// (`0,0 0,5 1,0`). The second value of the result names the assumed notation. The result is `None` for anything else,
/// such as `1,5,2,5`.
pub(crate) fn three_numbers_with_commas(text: &[u8]) -> Option<([f64; 3], &'static str)> {
    let text = std::str::from_utf8(trim(text)).ok()?;
    let three = |words: Vec<String>| {
        let numbers: Option<Vec<f64>> = words.iter().map(|word| number(word.as_bytes())).collect();
        <[f64; 3]>::try_from(numbers?).ok()
    };
    let words: Vec<&str> = text.split([';', ' ', '\t']).filter(|word| !word.is_empty()).collect();
    let decimal = |word: &&str| {
        let commas = word.matches(',').count();
        commas == 0 || commas == 1 && !word.ends_with(',') && !word.contains('.')
    };
    if words.iter().all(decimal) {
        let found = three(words.iter().map(|word| word.replace(',', ".")).collect())?;
        let has_commas = text.contains(',');
        return Some((found, if has_commas { "decimal commas" } else { "semicolons as separators" }));
    }
    let parts: Vec<String> = text.split([',', ';']).map(|part| part.trim().to_owned()).collect();
    Some((three(parts)?, "commas as separators"))
}

/// Reads infinity and NaN as printed by the C libraries of Microsoft and others: `-1.#IND`, `1.#QNAN`, `1.#INF00`,
/// `-nan(ind)`.
fn not_finite(word: &[u8]) -> Option<f64> {
    let lower = word.to_ascii_lowercase();
    let (sign, rest) = match lower.strip_prefix(b"-") {
        Some(rest) => (-1.0, rest),
        None => (1.0, lower.strip_prefix(b"+").unwrap_or(&lower)),
    };
    if rest.starts_with(b"1.#inf") {
        return Some(sign * f64::INFINITY);
    }
    let starts = [&b"1.#ind"[..], b"1.#qnan", b"1.#snan", b"nan(", b"1.$"];
    starts.iter().any(|start| rest.starts_with(start)).then_some(f64::NAN)
}

/// Powers of ten that are exact in float64.
const POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// Reads a number in the most common case: at most 15 digits and a power of ten up to 22. Both are exact in float64, so
/// rounding their product once gives the nearest number (Clinger 1990).
fn exact_number(word: &[u8]) -> Option<f64> {
    let (negative, mantissa, after_point) = decimal(word)?;
    let value = mantissa as f64 / POWERS_OF_TEN[after_point];
    Some(if negative { -value } else { value })
}

/// Same as [`exact_number`], for numbers with an exponent of at most three digits, such as `1.5e+002`.
fn exact_scientific_number(word: &[u8]) -> Option<f64> {
    let at = word.iter().position(|b| matches!(b, b'e' | b'E'))?;
    let (negative, mantissa, after_point) = decimal(&word[..at])?;
    let (sign, digits) = match &word[at + 1..] {
        [b'-', digits @ ..] => (-1, digits),
        [b'+', digits @ ..] | digits => (1, digits),
    };
    if !(1..=3).contains(&digits.len()) || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let exponent = digits.iter().fold(0, |value, digit| 10 * value + i32::from(digit - b'0'));
    let power = sign * exponent - after_point as i32;
    let scale = *POWERS_OF_TEN.get(power.unsigned_abs() as usize)?;
    let value = if power > 0 { mantissa as f64 * scale } else { mantissa as f64 / scale };
    Some(if negative { -value } else { value })
}

/// Sign, digits and number of digits after the point of a decimal number with at most 15 digits.
#[inline]
fn decimal(word: &[u8]) -> Option<(bool, u64, usize)> {
    let (negative, digits) = match word {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, word),
    };
    if digits.len() > 16 {
        return None;
    }
    let (mut mantissa, mut after_point, mut point) = (0_u64, 0, false);
    for &b in digits {
        match b {
            b'0'..=b'9' => {
                mantissa = mantissa * 10 + u64::from(b - b'0');
                after_point += usize::from(point);
            }
            b'.' if !point => point = true,
            _ => return None,
        }
    }
    if digits.len() == usize::from(point) || (digits.len() == 16 && !point) {
        return None;
    }
    Some((negative, mantissa, after_point))
}

/// Parses a decimal integer.
pub(crate) fn integer(word: &[u8]) -> Option<i64> {
    if word.len() > 18 {
        return std::str::from_utf8(word).ok()?.parse().ok();
    }
    let (negative, digits) = match word {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, word),
    };
    if digits.is_empty() {
        return None;
    }
    let mut value = 0_i64;
    for &b in digits {
        if !b.is_ascii_digit() {
            return None;
        }
        value = value * 10 + i64::from(b - b'0');
    }
    Some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_with_lf_crlf_or_cr() {
        let lines: Vec<_> = Lines::new(b"a\nb\r\n\rc\n\n").map(|(n, l)| (n, l.to_vec())).collect();
        let expected: [(usize, &[u8]); 5] = [(1, b"a"), (2, b"b"), (3, b""), (4, b"c"), (5, b"")];
        assert_eq!(lines, expected.map(|(n, l)| (n, l.to_vec())));
        assert_eq!(line_ends(b"a\nb\r\n\rc\n\n"), 5);
    }

    #[test]
    fn numbers_are_parsed_to_the_nearest_float64() {
        let words = "0 -0 1 +1 .5 5. -1.25 0.1 0.30000001192092896 123456789012345 1234567890123456 \
                     9007199254740993 12345678.9012345 1e3 1E-7 2.2250738585072014e-308 \
                     0.000000000000001 -.0000000001 999999999999999 0.999999999999999 4.35 inf -INF nan \
                     1.018757e+002 -1.43e-001 5E22 1e-22 1e23 7e-24 1.5e+0007 12345678901e22 .1e1 1.e-3 0e9";
        for word in words.split_whitespace() {
            let (ours, std) = (number(word.as_bytes()).unwrap(), word.parse::<f64>().unwrap());
            assert_eq!(ours.to_bits(), std.to_bits(), "{word}");
        }
        // The test compares pseudo-random numbers of up to 16 digits with the standard library.
        let mut state = 1_u64;
        for _ in 0..200_000 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let digits = 1 + (state >> 60) as i32;
            let integer = (state >> 8) % 10_u64.pow(digits as u32);
            let places = ((state >> 4) % 16) as i32;
            let word = format!("{:.*}", places as usize, integer as f64 / 10_f64.powi(places));
            let (ours, std) = (number(word.as_bytes()).unwrap(), word.parse::<f64>().unwrap());
            assert_eq!(ours.to_bits(), std.to_bits(), "{word}");
            let word = format!("{word}e{:+04}", places - 8);
            let (ours, std) = (number(word.as_bytes()).unwrap(), word.parse::<f64>().unwrap());
            assert_eq!(ours.to_bits(), std.to_bits(), "{word}");
        }
    }

    #[test]
    fn utf_16_text_is_converted_to_utf_8() {
        let units: Vec<u16> = "v 1\u{e9}\n".encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        for bytes in [&little, &big, &[&[0xff, 0xfe], &little[..]].concat(), &[&[0xfe, 0xff], &big[..]].concat()] {
            assert_eq!(&*plain_text(bytes), "v 1\u{e9}\n".as_bytes());
        }
        assert_eq!(&*plain_text(b"\xef\xbb\xbfv"), b"v");
        assert_eq!(without_utf16(b"\xff\xfev\0 \x001\0".to_vec()), b"v 1");
        assert_eq!(without_utf16(b"\xff\xfe\0\0\0\0\0\0".to_vec()), b"\xff\xfe\0\0\0\0\0\0");
    }

    #[test]
    fn words_that_are_not_numbers_are_refused() {
        for word in
            ["", "+", "-", ".", "1.2.3", "1,5", "0x10", "1/2", "--1", "1-", "e", "1e", "1e+", "1e5.0", ".e5", "\u{661}"]
        {
            assert_eq!(number(word.as_bytes()), None, "{word}");
        }
        for word in ["", "+", "1.0", "99999999999999999999", "0x1", " 1"] {
            assert_eq!(integer(word.as_bytes()), None, "{word}");
        }
        for word in ["-1.#IND", "1.#QNAN", "-nan(ind)", "NaN"] {
            assert!(number(word.as_bytes()).is_some_and(f64::is_nan), "{word}");
        }
        assert_eq!((number(b"-1.#INF"), number(b"1.#INF00")), (Some(f64::NEG_INFINITY), Some(f64::INFINITY)));
        assert_eq!(integer(b"-9223372036854775808"), Some(i64::MIN));
        assert_eq!(integer(b"+012"), Some(12));
    }
}
