//! Memory of a world on the device, and the origin of its acceleration structures.

use std::fmt;

/// Memory of a world on the device, and the origin of its acceleration structures.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Figures {
    /// Each bottom-level structure.
    pub structures: Vec<StructureFigures>,
    /// Triangles that lie in memory.
    pub triangles: u64,
    /// Triangles of all instances.
    pub shown_triangles: u64,
    /// Instances in the top-level structure, before parts of split structures are counted.
    pub instances: usize,
    /// Bytes of vertices, indices and materials.
    pub scene_bytes: u64,
    /// Bytes of the top-level structure.
    pub top_level_bytes: u64,
    /// Bytes of scratch memory that the context holds.
    pub scratch_bytes: u64,
}

/// A bottom-level structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StructureFigures {
    /// The scene it is of.
    pub name: String,
    /// Number of triangles.
    pub triangles: u64,
    /// Parts that the library made of it; 1 if it was not split.
    pub parts: u32,
    /// Bytes after the build, tables included; for a structure from a file, those of the original build.
    pub built_bytes: u64,
    /// Bytes now, tables included.
    pub bytes: u64,
    /// Origin of the structure.
    pub origin: Origin,
}

/// The origin of an acceleration structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// A file of an earlier start.
    Loaded,
    /// Built, because no file existed.
    Built,
    /// Built, because the file was damaged or did not match.
    Rebuilt,
}

impl Figures {
    /// Number of acceleration structures of that origin.
    #[must_use]
    pub fn count(&self, origin: Origin) -> usize {
        self.structures.iter().filter(|structure| structure.origin == origin).count()
    }

    /// Parts of all structures.
    #[must_use]
    pub fn parts(&self) -> u32 {
        self.structures.iter().map(|structure| structure.parts).sum()
    }

    /// Bytes of all bottom-level structures: when they were built, and now.
    #[must_use]
    pub fn structure_bytes(&self) -> [u64; 2] {
        let sum = |of: fn(&StructureFigures) -> u64| self.structures.iter().map(of).sum();
        [sum(|structure| structure.built_bytes), sum(|structure| structure.bytes)]
    }

    /// Names and values, a line each.
    #[must_use]
    pub fn entries(&self) -> Vec<(&'static str, String)> {
        let [built, now] = self.structure_bytes();
        let (structures, parts) = (self.structures.len(), self.parts());
        let saved = 100.0 * (1.0 - now as f64 / built.max(1) as f64);
        vec![
            (
                "triangles",
                format!("{}, with all instances {}", number(self.triangles), number(self.shown_triangles)),
            ),
            ("instances", self.instances.to_string()),
            ("structures", format!("{structures} in {parts} parts")),
            (
                "origin",
                format!(
                    "{} from files, {} built, {} built anew in place of damaged files",
                    self.count(Origin::Loaded),
                    self.count(Origin::Built),
                    self.count(Origin::Rebuilt)
                ),
            ),
            (
                "memory",
                format!("structures {}, compacted from {} ({saved:.0} % less)", bytes(now), bytes(built)),
            ),
            ("", format!("top level {}, scratch {}", bytes(self.top_level_bytes), bytes(self.scratch_bytes))),
            ("", format!("vertices, indices and materials {}", bytes(self.scene_bytes))),
        ]
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows = self.entries();
        for (index, (name, value)) in rows.iter().enumerate() {
            let end = if index + 1 < rows.len() { "\n" } else { "" };
            write!(f, "{name:<9} {value}{end}")?;
        }
        Ok(())
    }
}

/// Bytes in a unit that suits.
pub(super) fn bytes(count: u64) -> String {
    match count {
        0..0x10_0000 => format!("{:.1} KiB", count as f64 / 1024.0),
        0x10_0000..0x4000_0000 => format!("{:.1} MiB", count as f64 / f64::from(1 << 20)),
        _ => format!("{:.2} GiB", count as f64 / f64::from(1 << 30)),
    }
}

/// A count with its thousands apart.
pub(super) fn number(count: u64) -> String {
    let digits = count.to_string();
    let place = |(index, digit): (usize, char)| {
        let is_group = index > 0 && (digits.len() - index).is_multiple_of(3);
        [is_group.then_some(','), Some(digit)]
    };
    digits.chars().enumerate().flat_map(place).flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_bytes_are_read_easily() {
        assert_eq!([0, 999, 1_000, 1_234_567].map(number), ["0", "999", "1,000", "1,234,567"]);
        assert_eq!(
            [512, 3 << 20, 5 << 30, (1 << 20) - 1].map(bytes),
            ["0.5 KiB", "3.0 MiB", "5.00 GiB", "1024.0 KiB"]
        );
    }

    #[test]
    fn sums_count_every_structure() {
        let of = |origin, parts, built_bytes, bytes| StructureFigures {
            name: "fir".to_owned(),
            triangles: 5,
            parts,
            built_bytes,
            bytes,
            origin,
        };
        let structures =
            vec![of(Origin::Loaded, 1, 100, 100), of(Origin::Built, 3, 300, 200), of(Origin::Built, 1, 0, 0)];
        let figures = Figures { structures, ..Figures::default() };
        assert_eq!(
            [Origin::Loaded, Origin::Built, Origin::Rebuilt].map(|origin| figures.count(origin)),
            [1, 2, 0]
        );
        assert_eq!((figures.parts(), figures.structure_bytes()), (5, [400, 300]));
        let text = figures.to_string();
        assert!(
            text.contains("3 in 5 parts")
                && text.contains("25 % less")
                && text.contains("1 from files, 2 built"),
            "{text}"
        );
    }
}
