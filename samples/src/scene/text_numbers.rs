//! Words and numbers of OBJ and MTL statements.

/// The value of a word that stands where a number is expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Number {
    /// A finite number.
    Finite(f64),
    /// Infinity or NaN in any spelling, or a number beyond the range of `f64`.
    NotFinite,
    /// The word is no number.
    Unreadable,
}

impl Number {
    /// Reads a word. Old Windows programs write `-1.#IND00`, `1.#QNAN` and `1.#INF`, newer ones `-nan(ind)`.
    pub(super) fn from_word(word: &[u8]) -> Self {
        match std::str::from_utf8(word).map(str::parse::<f64>) {
            Ok(Ok(value)) if value.is_finite() => Self::Finite(value),
            Ok(Ok(_)) => Self::NotFinite,
            _ if is_spelled_out(word) => Self::NotFinite,
            _ => foreign(word).map_or(Self::Unreadable, Self::Finite),
        }
    }

    /// The value as a single, if that is finite too.
    pub(super) fn finite_f32(self) -> Option<f32> {
        match self {
            Self::Finite(value) => Some(value as f32).filter(|value| value.is_finite()),
            _ => None,
        }
    }
}

/// The value of a number with a decimal comma (`0,5`), or with the exponent of Fortran (`1.5D+03`).
fn foreign(word: &[u8]) -> Option<f64> {
    let count = |letter: u8| word.iter().filter(|byte| **byte == letter).count();
    let is_numeric = word.iter().all(|byte| byte.is_ascii_digit() || b"+-.,dD".contains(byte));
    if !is_numeric || count(b',') + count(b'.') > 1 {
        return None;
    }
    let usual = |byte: &u8| match byte {
        b',' => '.',
        b'd' | b'D' => 'e',
        other => char::from(*other),
    };
    word.iter().map(usual).collect::<String>().parse().ok().filter(|value: &f64| value.is_finite())
}

/// True if C libraries write infinity or NaN so.
fn is_spelled_out(word: &[u8]) -> bool {
    let word = word.strip_prefix(b"-").or(word.strip_prefix(b"+")).unwrap_or(word).to_ascii_lowercase();
    is_spelled_by_windows(&word) || word.starts_with(b"nan(") || word.starts_with(b"inf(")
}

/// True if the word without its sign is one of `1.#IND`, `1.#QNAN`, `1.#SNAN`, `1.#NAN`, `1.#INF` and the rounded `1.#J` and
/// `1.#R`, whatever digits and exponent follow.
fn is_spelled_by_windows(word: &[u8]) -> bool {
    let Some(rest) = word.strip_prefix(b"1.#") else { return false };
    ["ind", "qnan", "snan", "nan", "inf", "j", "r"].iter().any(|name| {
        rest.get(..name.len()).is_some_and(|start| start.eq_ignore_ascii_case(name.as_bytes()))
            && is_digits_and_exponent(&rest[name.len()..])
    })
}

/// True for digits, or none, that an exponent may follow: `00`, `0e+000`.
fn is_digits_and_exponent(text: &[u8]) -> bool {
    let is_digits = |text: &[u8]| text.iter().all(u8::is_ascii_digit);
    match text.iter().position(|byte| matches!(byte, b'e' | b'E')) {
        Some(at) => {
            let power = &text[at + 1..];
            let unsigned = power.strip_prefix(b"+").or(power.strip_prefix(b"-")).unwrap_or(power);
            is_digits(&text[..at]) && !unsigned.is_empty() && is_digits(unsigned)
        }
        None => is_digits(text),
    }
}

/// The words in front of a comment. `#` begins one, but for the `#` in `1.#INF`.
pub(super) fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut ended = false;
    text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).map_while(move |word| {
        let unsigned = word.strip_prefix(b"-").or(word.strip_prefix(b"+")).unwrap_or(word);
        match word.iter().position(|byte| *byte == b'#') {
            _ if ended => None,
            Some(at) if !is_spelled_by_windows(unsigned) => {
                ended = true;
                (at > 0).then(|| &word[..at])
            }
            _ => Some(word),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_not_finite_are_known_in_every_spelling() {
        for word in [
            "nan",
            "NaN",
            "-nan",
            "nan(ind)",
            "-nan(ind)",
            "-NAN(IND)",
            "nan(snan)",
            "inf",
            "-inf",
            "Infinity",
            "1e999",
            "-1.#IND00",
            "-1.#IND",
            "1.#QNAN",
            "1.#QNAN0",
            "1.#SNAN",
            "1.#INF",
            "-1.#INF00",
            "1.#inf",
            "-1.#IND00e+000",
            "1.#QNAN0E+00",
            "+1.#J",
        ] {
            assert_eq!(Number::from_word(word.as_bytes()), Number::NotFinite, "{word}");
            assert_eq!(words(word.as_bytes()).collect::<Vec<_>>(), [word.as_bytes()]);
        }
        for word in
            ["x", "", "1,234.5", "1,2,3", ",", "d", "1d", "0x10", "1.#INFO", "1.#INFe", "#", "nano", "1.5mm"]
        {
            assert_eq!(Number::from_word(word.as_bytes()), Number::Unreadable, "{word}");
        }
        assert_eq!(Number::from_word(b"-1.5e3"), Number::Finite(-1500.0));
        for (word, value) in [("0,5", 0.5), ("-1,25", -1.25), ("1,", 1.0), ("1.5D+03", 1500.0), ("2d-1", 0.2)]
        {
            assert_eq!(Number::from_word(word.as_bytes()), Number::Finite(value), "{word}");
        }
        assert_eq!(Number::from_word(b"1e39").finite_f32(), None);
        assert_eq!(Number::from_word(b"1e38").finite_f32(), Some(1e38));
    }

    #[test]
    fn comments_begin_at_a_hash() {
        let found = |text: &str| -> Vec<String> {
            words(text.as_bytes()).map(|word| String::from_utf8_lossy(word).into_owned()).collect()
        };
        assert_eq!(found(" 1  2\t3 # 4"), ["1", "2", "3"]);
        assert_eq!(found("1 2 3#4 5"), ["1", "2", "3"]);
        assert_eq!(found("1 -1.#IND00 1.#QNAN #x"), ["1", "-1.#IND00", "1.#QNAN"]);
        assert_eq!(found("# 1"), [""; 0]);
    }
}
