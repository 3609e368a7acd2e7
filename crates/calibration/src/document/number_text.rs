//! Numbers in one text, as in `[500 0 320; 0 500 240; 0 0 1]`, `500, 0, 320` and `array([[500., 0.], [0., 500.]])`.

/// Words of a text, which may be separated by spaces, commas, semicolons and brackets.
pub(crate) fn words(text: &str) -> impl Iterator<Item = &str> + Clone {
    let is_separator = |c: char| c.is_whitespace() || matches!(c, ',' | ';' | '[' | ']' | '(' | ')');
    text.split(is_separator).filter(|word| !word.is_empty())
}

/// The finite numbers of a text that contains at least two numbers and no other words; `None` for other texts and for
/// numbers with decimal commas, as in `0,5 1,25`.
pub(crate) fn numbers(text: &str) -> Option<Vec<f64>> {
    let text = without_constructor(text.trim());
    if has_decimal_commas(text) {
        return None;
    }
    let numbers = words(text).map(|word| word.parse().ok().filter(|value: &f64| value.is_finite()));
    numbers.collect::<Option<Vec<f64>>>().filter(|numbers| numbers.len() > 1)
}

/// The list in NumPy's notation, without its type: `[[1., 2.]], ` for `np.array([[1., 2.]], dtype = float)`; other texts are
/// returned unchanged.
fn without_constructor(text: &str) -> &str {
    let Some((name, list)) = text.split_once('(') else { return text };
    let is_constructor =
        ["array", "asarray", "matrix", "tensor", "Matrix"].contains(&name.rsplit('.').next().unwrap_or(name));
    let own = if is_constructor { list } else { text };
    own.split("dtype").next().unwrap_or(own)
}

/// True for a text without brackets in which each word has one comma between digits.
pub(crate) fn has_decimal_commas(text: &str) -> bool {
    let is_decimal = |word: &str| {
        let ends = |part: &str, digit: fn(&str) -> Option<char>| digit(part).is_some_and(|c| c.is_ascii_digit());
        word.split_once(',').is_some_and(|(whole, fraction)| {
            !fraction.contains(',')
                && ends(whole, |part| part.chars().next_back())
                && ends(fraction, |part| part.chars().next())
        })
    };
    let mut words = text.split(|c: char| c.is_whitespace() || c == ';').filter(|word| !word.is_empty());
    !text.contains(['[', '(']) && text.contains(',') && words.all(is_decimal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_text_may_have_any_separators_and_brackets() {
        let expected = Some(vec![500.0, 0.0, 320.5, 0.0]);
        for text in [
            "500 0 320.5 0",
            "[500 0; 320.5 0]",
            "500,0,320.5,0",
            "[[500., 0.], [320.5, 0.]]",
            "(500, 0, 320.5, 0)",
            "[[500 0]\n [320.5 0]]",
            "500;0;320.5;0",
            "np.array([[500., 0.], [320.5, 0.]], dtype = float32)",
            "tensor([500., 0., 320.5, 0.])",
        ] {
            assert_eq!(numbers(text), expected, "{text}");
        }
    }

    #[test]
    fn texts_with_words_decimal_commas_or_one_number_are_not_numbers() {
        for text in ["500", "fx 500", "0,5 1,25", "320,5", "0,5;1,25", "640x480", "", "nan 1", "f(1, 2)"] {
            assert_eq!(numbers(text), None, "{text}");
        }
    }
}
