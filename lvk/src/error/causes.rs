//! The text of an error with its causes.

use std::error::Error;

/// Returns the text of an error, then those of its causes ([`Error::source`]), separated by colons. A text that is already
/// there is left out, as many errors print their cause themselves.
///
/// On Windows the reason why a library cannot be opened is in the cause only.
#[must_use]
pub fn with_causes(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let causes = std::iter::successors(error.source(), |cause| (*cause).source());
    for cause in causes.map(ToString::to_string).filter(|cause| !cause.is_empty()) {
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("{text}")]
    struct Toy {
        text: &'static str,
        source: Option<Box<Toy>>,
    }

    /// Returns an error whose causes have these texts, the outermost first.
    fn chain(texts: &[&'static str]) -> Toy {
        let (text, causes) = texts.split_first().unwrap();
        Toy { text, source: (!causes.is_empty()).then(|| Box::new(chain(causes))) }
    }

    #[test]
    fn causes_follow_the_error() {
        for (texts, expected) in [
            (&["it failed"][..], "it failed"),
            (
                &["LoadLibraryExW failed", "module not found (os error 126)"],
                "LoadLibraryExW failed: module not found (os error 126)",
            ),
            (&["a", "b", "c"], "a: b: c"),
        ] {
            assert_eq!(with_causes(&chain(texts)), expected);
        }
    }

    #[test]
    fn texts_do_not_repeat() {
        assert_eq!(with_causes(&chain(&["no such file", "no such file"])), "no such file");
        assert_eq!(with_causes(&chain(&["cannot open x: denied", "denied", ""])), "cannot open x: denied");
    }
}
