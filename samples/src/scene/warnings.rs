//! Collects what was mended without drowning the user: of each kind a few lines, then a count.

/// Lines kept of each kind.
const MOST_LINES: usize = 20;

/// Warnings in order, and how many of each kind there were.
#[derive(Default)]
pub(super) struct Warnings {
    lines: Vec<String>,
    counts: Vec<(&'static str, usize)>,
}

impl Warnings {
    /// Adds a warning; `kind` is what such warnings are about, in the plural (`"textures"`).
    pub(super) fn push(&mut self, kind: &'static str, line: String) {
        let position = self.counts.iter().position(|(known, _)| *known == kind).unwrap_or_else(|| {
            self.counts.push((kind, 0));
            self.counts.len() - 1
        });
        let count = &mut self.counts[position].1;
        *count += 1;
        if *count <= MOST_LINES {
            self.lines.push(line);
        }
    }

    /// The warnings as lines for the user.
    pub(super) fn into_lines(mut self) -> Vec<String> {
        for (kind, count) in self.counts {
            if count > MOST_LINES {
                self.lines.push(format!("{kind}: and {} more warnings like these", count - MOST_LINES));
            }
        }
        self.lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_each_kind_the_first_lines_are_kept_and_the_rest_counted() {
        let mut warnings = Warnings::default();
        for i in 0..MOST_LINES + 5 {
            warnings.push("textures", format!("texture {i}"));
        }
        (0..MOST_LINES).for_each(|i| warnings.push("materials", format!("material {i}")));
        let lines = warnings.into_lines();
        assert_eq!(lines.len(), 2 * MOST_LINES + 1);
        assert_eq!(lines[MOST_LINES - 1], format!("texture {}", MOST_LINES - 1));
        assert_eq!(lines[2 * MOST_LINES], "textures: and 5 more warnings like these");
    }
}
