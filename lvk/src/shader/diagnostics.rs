//! Converts the compiler's log to messages with line numbers of the caller's text.

/// The message that glslang prints for a failed `#include`; the library supplies the reason.
const INCLUDE_FAILED: &str = "Could not process include directive";

/// Returns the errors of `log`, one a line: `line 3: ..` for the shader's text, `file.glsl:3: ..` for an included file.
///
/// `include_failures` are the reasons for the failed `#include`s, in the order of the log.
pub(super) fn errors(log: &str, include_failures: Vec<String>) -> String {
    let mut reasons = include_failures.into_iter();
    let mut lines: Vec<String> = Vec::new();
    for line in log.lines() {
        let Some(message) = line.strip_prefix("ERROR: ") else { continue };
        if is_noise(message) {
            continue;
        }
        let (place, text) = split_place(message);
        let text = match text.contains(INCLUDE_FAILED) {
            true => reasons.next().unwrap_or_else(|| text.to_owned()),
            false => text.to_owned(),
        };
        lines.push(format!("{place}{text}"));
    }
    lines.dedup();
    if lines.is_empty() {
        return format!("the compiler failed: {}", log.trim());
    }
    lines.join("\n")
}

/// Returns the warnings of `log`, in the form of [`errors`].
pub(super) fn warnings(log: &str) -> Vec<String> {
    let warnings = log.lines().filter_map(|line| line.strip_prefix("WARNING: "));
    warnings.map(split_place).map(|(place, text)| format!("{place}{text}")).collect()
}

fn is_noise(message: &str) -> bool {
    message.contains("compilation terminated")
        || message.ends_with("compilation errors.  No code generated.")
        || message.trim().is_empty()
}

/// Splits `0:12: text` into `line 12: ` and `text`. Keeps `name:12: ` unchanged.
fn split_place(message: &str) -> (String, &str) {
    let message = message.trim_end();
    for (at, _) in message.match_indices(": ") {
        let Some((file, line)) = message[..at].rsplit_once(':') else { continue };
        if line.parse::<u32>().is_ok() {
            let place = if file == "0" { format!("line {line}: ") } else { format!("{file}:{line}: ") };
            return (place, message[at + 2..].trim_start());
        }
    }
    (String::new(), message)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test")]
    use super::*;

    #[test]
    fn names_lines_and_drops_noise() {
        let log = "ERROR: 0:12: 'foo' : undeclared identifier \nERROR: a b.glsl:3: '' :  syntax error\n\
                   ERROR: 0:12: '' : compilation terminated \nERROR: 2 compilation errors.  No code generated.\n\n";
        let text = errors(log, Vec::new());
        assert_eq!(text, "line 12: 'foo' : undeclared identifier\na b.glsl:3: '' :  syntax error");
    }

    #[test]
    fn include_failures_take_their_reasons_in_order() {
        let log = "ERROR: 0:2: '#include' : Could not process include directive for header name: a\n\
                   ERROR: b.glsl:4: '#include' : Could not process include directive for header name: c\n";
        let text = errors(log, vec!["first".to_owned(), "second".to_owned()]);
        assert_eq!(text, "line 2: first\nb.glsl:4: second");
    }

    #[test]
    fn a_log_without_errors_is_printed_whole() {
        assert_eq!(errors("odd\n", Vec::new()), "the compiler failed: odd");
    }
}
