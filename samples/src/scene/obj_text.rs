//! Turns OBJ text as found in the wild into OBJ text that the parser reads without loss.
//!
//! tobj reads clean files well, but it stops at Latin-1 comments, continued lines and one-component texture
//! coordinates, mixes up normals when only some corners have them, and may overflow on wild indices. So the
//! text is rewritten first: only `v`, `vt`, `vn`, `f` and `usemtl` are left, all vertices before all faces,
//! every corner has all three indices, positive and checked, concave faces are triangles. Index 1 of `vt` and `vn` is a placeholder (all
//! zero) for corners that have none. Materials are numbered.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

use super::recentre::{self, Extent};
use super::{SceneError, polygon};
use crate::app::progress::Progress;

/// The rewritten file and what was taken out of it.
pub(super) struct CleanObj {
    /// Text for the parser; starts with `mtllib` so that its material loader runs first.
    pub text: String,
    /// Name behind each material number; `None` for faces before the first `usemtl`.
    pub materials: Vec<Option<String>>,
    /// Arguments of the `mtllib` lines, in order.
    pub libraries: Vec<String>,
    /// Number of triangles that the faces make.
    pub triangle_count: usize,
    /// Offset subtracted from every position: the centre of a mesh far from its origin, else 0.
    pub origin: [f64; 3],
    /// Corrections of the file, for the user.
    pub warnings: Vec<String>,
}

/// The material number that the cleaned text gives to faces before the first `usemtl`.
pub(super) const NO_MATERIAL: usize = 0;

/// Rewrites the OBJ file `content`, read from `path` (which errors name).
pub(super) fn clean(path: &Path, content: &[u8], progress: &mut Progress) -> Result<CleanObj, SceneError> {
    if content.contains(&0) {
        return Err(SceneError::NotObj { path: path.into(), why: "it holds binary data" });
    }
    let mut cleaner = Cleaner::new(path, content.len());
    let mut rest = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(content);
    while !rest.is_empty() {
        let (line, line_count, after) = next_logical_line(rest);
        cleaner.line_number += 1;
        cleaner.line(&line)?;
        cleaner.line_number += line_count - 1;
        rest = after;
        if cleaner.line_number.is_multiple_of(65_536) {
            progress.set((content.len() - rest.len()) as u64);
            progress.go_on()?;
        }
    }
    cleaner.finish()
}

/// One line with its continuations (`\` before the line end) joined, how many lines of the file it took, and
/// what follows. Bytes that are no UTF-8 become replacement characters: they only occur in names and comments.
fn next_logical_line(content: &[u8]) -> (Cow<'_, str>, usize, &[u8]) {
    let (first, mut rest) = split_line(content);
    if first.last() != Some(&b'\\') {
        return (String::from_utf8_lossy(first), 1, rest);
    }
    let mut joined = first[..first.len() - 1].to_vec();
    let mut count = 1;
    while !rest.is_empty() {
        let (next, after) = split_line(rest);
        (rest, count) = (after, count + 1);
        joined.push(b' ');
        joined.extend_from_slice(next.strip_suffix(b"\\").unwrap_or(next));
        if next.last() != Some(&b'\\') {
            break;
        }
    }
    (Cow::Owned(String::from_utf8_lossy(&joined).into_owned()), count, rest)
}

fn split_line(content: &[u8]) -> (&[u8], &[u8]) {
    let end = content.iter().position(|&b| b == b'\n').unwrap_or(content.len());
    let line = &content[..end];
    (line.strip_suffix(b"\r").unwrap_or(line), content.get(end + 1..).unwrap_or_default())
}

/// The largest index a kind of element was asked for, and where.
#[derive(Clone, Copy, Default)]
struct Reach {
    highest: usize,
    index: i64,
    line: usize,
}

struct Cleaner<'a> {
    path: &'a Path,
    line_number: usize,
    vertices: String,
    faces: String,
    positions: Vec<[f64; 3]>,
    extent: Extent,
    /// Indices in `faces` of polygons with more than three vertices.
    polygons: Vec<Range<usize>>,
    counts: [usize; 3],
    reach: [Reach; 3],
    materials: Vec<Option<String>>,
    numbers: HashMap<String, usize>,
    libraries: Vec<String>,
    triangle_count: usize,
    mended_attributes: usize,
    short_faces: usize,
}

const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

impl<'a> Cleaner<'a> {
    fn new(path: &'a Path, size: usize) -> Self {
        let mut vertices = String::with_capacity(size / 2);
        vertices.push_str("mtllib materials\nvt 0 0\nvn 0 0 0\n");
        let mut faces = String::with_capacity(size / 2);
        faces.push_str("usemtl 0\n");
        Self {
            path,
            line_number: 0,
            vertices,
            faces,
            positions: Vec::new(),
            extent: Extent::new(),
            polygons: Vec::new(),
            counts: [0; 3],
            reach: [Reach::default(); 3],
            materials: vec![None],
            numbers: HashMap::new(),
            libraries: Vec::new(),
            triangle_count: 0,
            mended_attributes: 0,
            short_faces: 0,
        }
    }

    fn line(&mut self, line: &str) -> Result<(), SceneError> {
        let line = line.trim();
        let (keyword, rest) = line.split_once(|c: char| c.is_whitespace()).unwrap_or((line, ""));
        match keyword {
            "v" => self.position(without_comment(rest)),
            "vt" => {
                self.attribute("vt", 1, 2, without_comment(rest));
                Ok(())
            }
            "vn" => {
                self.attribute("vn", 2, 3, without_comment(rest));
                Ok(())
            }
            "f" | "fo" => self.face(without_comment(rest)),
            "usemtl" => {
                self.use_material(rest.trim());
                Ok(())
            }
            "mtllib" => {
                self.libraries.push(rest.trim().to_owned());
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn position(&mut self, rest: &str) -> Result<(), SceneError> {
        self.vertices.push('v');
        let mut found = 0;
        let mut position = [0.0; 3];
        for word in rest.split_whitespace().take(3) {
            match word.parse::<f32>() {
                Ok(value) if value.is_finite() => {
                    position[found] = word.parse().unwrap_or(f64::from(value));
                    found += 1;
                }
                Ok(_) => {
                    return Err(SceneError::NotFinite { path: self.path.into(), line: self.line_number });
                }
                Err(_) => return Err(self.bad(format!("`{}` is not a number", shortened(word)))),
            }
            self.vertices.push(' ');
            self.vertices.push_str(word);
        }
        if found < 3 {
            return Err(self.bad(format!("a position needs 3 numbers, found {found}")));
        }
        self.vertices.push('\n');
        self.positions.push(position);
        self.extent.add(position);
        self.counts[0] += 1;
        Ok(())
    }

    /// Texture coordinates and normals are mended rather than refused: what is missing or no finite number
    /// becomes 0 (a normal of 0 is computed from the faces later).
    fn attribute(&mut self, keyword: &str, kind: usize, size: usize, rest: &str) {
        self.vertices.push_str(keyword);
        let mut words = rest.split_whitespace();
        for i in 0..size {
            let word = words.next();
            let usable = word.filter(|w| w.parse::<f32>().is_ok_and(f32::is_finite));
            if usable.is_none() && !(kind == 1 && i == 1 && word.is_none()) {
                self.mended_attributes += 1;
            }
            self.vertices.push(' ');
            self.vertices.push_str(usable.unwrap_or("0"));
        }
        self.vertices.push('\n');
        self.counts[kind] += 1;
    }

    fn face(&mut self, rest: &str) -> Result<(), SceneError> {
        let start = self.faces.len();
        self.faces.push('f');
        let mut corner_count = 0;
        for word in rest.split_whitespace() {
            self.corner(word)?;
            corner_count += 1;
        }
        if corner_count < 3 {
            self.faces.truncate(start);
            self.short_faces += 1;
            return Ok(());
        }
        self.faces.push('\n');
        if corner_count > 3 {
            self.polygons.push(start..self.faces.len());
        }
        self.triangle_count += corner_count - 2;
        Ok(())
    }

    fn corner(&mut self, word: &str) -> Result<(), SceneError> {
        let mut parts = word.split('/');
        for kind in 0..3 {
            let text = parts.next().unwrap_or("");
            let number = match text {
                "" if kind > 0 => 1,
                _ => match text.parse::<i64>() {
                    Ok(index) => self.resolve(kind, index)?,
                    Err(_) => return Err(self.bad(format!("`{}` is not a face corner", shortened(word)))),
                },
            };
            self.faces.push(if kind == 0 { ' ' } else { '/' });
            push_number(&mut self.faces, number);
        }
        match parts.next() {
            None => Ok(()),
            Some(_) => Err(self.bad(format!("`{}` is not a face corner", shortened(word)))),
        }
    }

    /// Number of the element in the cleaned text, where texture coordinates and normals stand behind a
    /// placeholder.
    fn resolve(&mut self, kind: usize, index: i64) -> Result<usize, SceneError> {
        let absolute = if index < 0 { self.counts[kind] as i64 + index } else { index - 1 };
        let Ok(position) = usize::try_from(absolute) else {
            return Err(self.out_of_range(kind, index, self.line_number));
        };
        if position >= self.reach[kind].highest {
            self.reach[kind] = Reach { highest: position + 1, index, line: self.line_number };
        }
        Ok(position + 1 + usize::from(kind > 0))
    }

    fn use_material(&mut self, name: &str) {
        let number = match self.numbers.get(name) {
            _ if name.is_empty() => NO_MATERIAL,
            Some(&number) => number,
            None => {
                self.materials.push(Some(name.to_owned()));
                self.numbers.insert(name.to_owned(), self.materials.len() - 1);
                self.materials.len() - 1
            }
        };
        self.faces.push_str("usemtl ");
        push_number(&mut self.faces, number);
        self.faces.push('\n');
    }

    fn finish(mut self) -> Result<CleanObj, SceneError> {
        for kind in 0..3 {
            let Reach { highest, index, line } = self.reach[kind];
            if highest > self.counts[kind] {
                return Err(self.out_of_range(kind, index, line));
            }
        }
        let path = self.path.to_path_buf();
        if self.counts[0] == 0 && self.triangle_count == 0 {
            return Err(SceneError::NotObj { path, why: "it has neither vertices (`v`) nor faces (`f`)" });
        }
        if self.triangle_count == 0 {
            return Err(SceneError::Empty { path, degenerate: 0 });
        }
        let limit = u32::MAX / 4;
        if self.triangle_count.max(self.counts[0]) > limit as usize {
            return Err(SceneError::TooLarge { path, limit });
        }
        let mut warnings = self.warnings();
        let origin = self.recentre(&mut warnings);
        self.append_faces();
        let Self { vertices, materials, libraries, triangle_count, .. } = self;
        Ok(CleanObj { text: vertices, materials, libraries, triangle_count, origin, warnings })
    }

    fn recentre(&mut self, warnings: &mut Vec<String>) -> [f64; 3] {
        let Some(centre) = self.extent.far_centre() else {
            return [0.0; 3];
        };
        self.vertices = recentre::moved(&self.vertices, centre);
        let [x, y, z] = centre;
        warnings.push(format!("the mesh lies far from its origin; ({x}, {y}, {z}) was taken from it"));
        centre
    }

    /// Puts the faces behind the vertices, concave ones as triangles. Fans are left to the parser.
    fn append_faces(&mut self) {
        let mut copied = 0;
        for range in &self.polygons {
            let words: Vec<&str> = self.faces[range.clone()].split_whitespace().skip(1).collect();
            let corners: Vec<[f64; 3]> = words.iter().filter_map(|word| self.position_of(word)).collect();
            let Some(triangles) = polygon::split(&corners).filter(|_| corners.len() == words.len()) else {
                continue;
            };
            self.vertices.push_str(&self.faces[copied..range.start]);
            for [a, b, c] in triangles {
                for part in ["f ", words[a], " ", words[b], " ", words[c], "\n"] {
                    self.vertices.push_str(part);
                }
            }
            copied = range.end;
        }
        self.vertices.push_str(&self.faces[copied..]);
    }

    fn position_of(&self, corner: &str) -> Option<[f64; 3]> {
        let number: usize = corner.split('/').next()?.parse().ok()?;
        self.positions.get(number.checked_sub(1)?).copied()
    }

    fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.short_faces > 0 {
            warnings.push(format!("{} faces with fewer than 3 corners were left out", self.short_faces));
        }
        if self.mended_attributes > 0 {
            let count = self.mended_attributes;
            warnings.push(format!(
                "{count} components of texture coordinates or normals were unusable; taken as 0"
            ));
        }
        warnings
    }

    fn bad(&self, what: String) -> SceneError {
        SceneError::BadLine { path: self.path.into(), line: self.line_number, what }
    }

    fn out_of_range(&self, kind: usize, index: i64, line: usize) -> SceneError {
        let (what, count) = (KINDS[kind], self.counts[kind]);
        SceneError::IndexOutOfRange { path: self.path.into(), line, what, index, count }
    }
}

fn without_comment(rest: &str) -> &str {
    rest.split('#').next().unwrap_or("")
}

fn shortened(word: &str) -> String {
    word.chars().take(24).collect()
}

fn push_number(text: &mut String, mut number: usize) {
    let mut digits = [0u8; 20];
    let mut start = digits.len();
    loop {
        start -= 1;
        digits[start] = b'0' + (number % 10) as u8;
        number /= 10;
        if number == 0 {
            break;
        }
    }
    text.extend(digits[start..].iter().map(|&digit| char::from(digit)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cleaned(text: &[u8]) -> Result<CleanObj, SceneError> {
        clean(Path::new("a.obj"), text, &mut Progress::hidden())
    }

    fn faces(text: &str) -> Vec<String> {
        let clean = cleaned(text.as_bytes()).unwrap();
        clean.text.lines().filter(|line| line.starts_with('f')).map(str::to_owned).collect()
    }

    const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";

    #[test]
    fn corners_become_complete_and_absolute() {
        assert_eq!(faces(&format!("{CORNERS}f 1 2 3\n")), ["f 1/1/1 2/1/1 3/1/1"]);
        assert_eq!(faces(&format!("{CORNERS}f -3/-1/-1 2//1 3/1\n")), ["f 1/2/2 2/1/2 3/2/1"]);
    }

    #[test]
    fn carriage_returns_blanks_comments_and_continuations_are_understood() {
        let text =
            "# caf\u{e9}\r\nv 0 0 0 \r\n\tv 1 0 0 0.5 0.5 0.5\r\nv 0 1 0 # top\r\nf 1 2 \\\r\n 3 # t  \r\n";
        assert_eq!(faces(text), ["f 1/1/1 2/1/1 3/1/1"]);
        let latin = [b"# caf\xe9\n".as_slice(), CORNERS.as_bytes(), b"f 1 2 3"].concat();
        assert!(cleaned(&latin).is_ok());
    }

    #[test]
    fn vertices_may_follow_the_faces_that_use_them() {
        assert_eq!(faces(&format!("f 1 2 3\n{CORNERS}")), ["f 1/1/1 2/1/1 3/1/1"]);
    }

    #[test]
    fn an_index_out_of_range_is_named_with_its_line() {
        for (face, what, index) in [
            ("f 1 2 4", "vertex", 4),
            ("f 0 1 2", "vertex", 0),
            ("f 1 2 -4", "vertex", -4),
            ("f 1/2 2/1 3/1", "texture coordinate", 2),
            ("f 1//1 2//9223372036854775807 3//1", "normal", i64::MAX),
            ("f 1//1 2//-9223372036854775808 3//1", "normal", i64::MIN),
        ] {
            match cleaned(format!("{CORNERS}{face}\n").as_bytes()).err().unwrap() {
                SceneError::IndexOutOfRange { line, what: w, index: i, .. } => {
                    assert_eq!((line, w, i), (6, what, index), "{face}");
                }
                other => panic!("{face}: {other}"),
            }
        }
    }

    #[test]
    fn text_without_a_mesh_is_refused() {
        assert!(matches!(cleaned(b"\x89PNG\r\n\x1a\n\0\0"), Err(SceneError::NotObj { .. })));
        assert!(matches!(cleaned(b"hello world\n"), Err(SceneError::NotObj { .. })));
        assert!(matches!(cleaned(b""), Err(SceneError::NotObj { .. })));
        assert!(matches!(cleaned(CORNERS.as_bytes()), Err(SceneError::Empty { .. })));
        assert!(matches!(cleaned(b"v 0 nan 0\n"), Err(SceneError::NotFinite { line: 1, .. })));
        assert!(matches!(cleaned(b"v 0 1e99 0\n"), Err(SceneError::NotFinite { line: 1, .. })));
        assert!(matches!(cleaned(b"\nv 0 0\n"), Err(SceneError::BadLine { line: 2, .. })));
        assert!(matches!(cleaned(b"v 0 0 x\n"), Err(SceneError::BadLine { line: 1, .. })));
        assert!(matches!(cleaned(b"v 0 0 0\nf 1/1/1/1 1 1\n"), Err(SceneError::BadLine { line: 2, .. })));
    }

    #[test]
    fn materials_are_numbered_by_first_use() {
        let text =
            format!("mtllib my file.mtl\n{CORNERS}f 1 2 3\nusemtl b c\nusemtl a\nusemtl b c\nf 1 2 3\n");
        let clean = cleaned(text.as_bytes()).unwrap();
        assert_eq!(clean.materials, [None, Some("b c".to_owned()), Some("a".to_owned())]);
        assert_eq!(clean.libraries, ["my file.mtl"]);
        assert!(clean.text.ends_with("usemtl 1\nusemtl 2\nusemtl 1\nf 1/1/1 2/1/1 3/1/1\n"));
    }

    #[test]
    fn concave_faces_become_triangles_and_convex_ones_stay() {
        let text = "v 0 0 0\nv 2 0 0\nv 0.5 0.5 0\nv 0 2 0\nv 2 2 0\n";
        assert_eq!(faces(&format!("{text}f 1 2 5 4\n")), ["f 1/1/1 2/1/1 5/1/1 4/1/1"]);
        for face in ["f 1 2 3 4", "f 2 3 4 1", "f 3 4 1 2", "f 4 1 2 3"] {
            let found = faces(&format!("{face}\n{text}f 1 2 5\n"));
            assert_eq!(found.len(), 3, "{face}: {found:?}");
            assert_eq!(found[2], "f 1/1/1 2/1/1 5/1/1");
            let across = |line: &String| !line.contains(" 1/") || !line.contains(" 3/");
            assert!(!found[..2].iter().any(across), "{face}: {found:?}");
        }
    }

    #[test]
    fn a_byte_order_mark_is_skipped() {
        assert_eq!(faces(&format!("\u{feff}{CORNERS}f 1 2 3\n")), ["f 1/1/1 2/1/1 3/1/1"]);
    }

    #[test]
    fn unusable_attributes_become_zero_with_a_warning() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5\nvt nan 1\nvn 0 -nan(ind) 1\nf 1 2 3\n";
        let clean = cleaned(text.as_bytes()).unwrap();
        assert!(clean.text.contains("vt 0.5 0\nvt 0 1\nvn 0 0 1\n"), "{}", clean.text);
        assert_eq!(clean.warnings.len(), 1);
    }

    proptest! {
        #[test]
        fn any_bytes_end_in_a_result(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            let _ = cleaned(&bytes);
        }

        #[test]
        fn the_parser_accepts_checked_text(lines in proptest::collection::vec(
            prop_oneof![
                "v( -?[0-9]{1,3}(\\.[0-9])?){3,5}", "vt( [0-9]){0,3}", "vn( [0-9]){0,3}",
                "f( -?[0-9]{1,2}(/[0-9]?(/-?[0-9]?)?)?){0,5}", "usemtl [a-c]?", "o", "\\PC{0,20}",
            ], 0..40)) {
            if let Ok(clean) = cleaned(lines.join("\n").as_bytes()) {
                let options = tobj::LoadOptions { single_index: true, triangulate: true, ..Default::default() };
                let loaded = tobj::load_obj_buf(&mut clean.text.as_bytes(), &options, |_| {
                    Ok((Vec::new(), Default::default()))
                });
                prop_assert!(loaded.is_ok(), "{:?} from\n{}", loaded.err(), clean.text);
            }
        }
    }
}
