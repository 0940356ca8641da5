//! The report of objects that were alive when their context ended.

use std::fmt::Write;

use crate::error::readable::readable_name;
use crate::store::LiveObject;

/// Most names listed of each kind; the report has only the number of others.
const MAX_NAMES: usize = 20;

/// Returns a report with one line a kind: the names in order, each with how often it occurs. `None` if no object is
/// alive.
pub(crate) fn leak_report(live: &[LiveObject]) -> Option<String> {
    if live.is_empty() {
        return None;
    }
    let mut text = match live.len() {
        1 => "1 object was alive when its context ended; drop its holder or destroy it:".to_owned(),
        count => format!(
            "{count} objects were alive when their context ended; drop their holders or destroy them:"
        ),
    };
    for of_kind in live.chunk_by(|a, b| a.kind == b.kind) {
        let mut names: Vec<&str> = of_kind.iter().map(|object| object.name.as_str()).collect();
        names.sort_unstable();
        let names: Vec<String> = names.chunk_by(|a, b| a == b).map(count_by_kind).collect();
        let (said, rest) = names.split_at(names.len().min(MAX_NAMES));
        // Writing to a String cannot fail.
        let _ = write!(text, "\n  {} {}: {}", of_kind.len(), of_kind[0].kind, said.join(", "));
        if !rest.is_empty() {
            let names = if rest.len() == 1 { "name" } else { "names" };
            let _ = write!(text, " and {} other {names}", rest.len());
        }
    }
    Some(text)
}

fn count_by_kind(same: &[&str]) -> String {
    let name = readable_name(same[0]);
    match same.len() {
        1 => format!("'{name}'"),
        count => format!("{count} x '{name}'"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn live_object(kind: &'static str, name: &str) -> LiveObject {
        LiveObject { kind, name: name.to_owned() }
    }

    #[test]
    fn kinds_and_names_are_gathered_and_counted() {
        assert_eq!(leak_report(&[]), None);
        let objects = [
            live_object("buffer", "b"),
            live_object("buffer", "a"),
            live_object("buffer", "b"),
            live_object("sampler", "s"),
        ];
        let text = leak_report(&objects).unwrap();
        let lines: Vec<_> = text.lines().collect();
        assert!(lines[0].starts_with("4 objects were alive when their context ended"), "{text}");
        assert_eq!(lines[1..], ["  3 buffer: 'a', 2 x 'b'", "  1 sampler: 's'"]);
    }

    #[test]
    fn one_object_is_told_in_the_singular() {
        let text = leak_report(&[live_object("buffer", "a\u{1b}[2J")]).unwrap();
        assert!(text.starts_with("1 object was alive when its context ended; drop its holder"), "{text}");
        assert!(text.ends_with("1 buffer: 'a\\u{1b}[2J'"), "{text}");
    }

    #[test]
    fn a_list_of_many_names_ends_early() {
        let objects: Vec<_> = (0..25).map(|number| live_object("texture", &format!("{number:02}"))).collect();
        let text = leak_report(&objects).unwrap();
        assert!(
            text.contains("25 texture: '00', '01'") && text.ends_with("'19' and 5 other names"),
            "{text}"
        );
    }
}
