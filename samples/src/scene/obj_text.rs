//! Parses OBJ text as found in the wild: `v`, `vt`, `vn`, `f`, `usemtl` and `mtllib`.
//!
//! Names are bytes. Numbers stay as in the file, in double precision, until the extent of the mesh is known. Statements that
//! follow each other in any order are resolved here: relative indices become absolute and are checked.

use std::collections::HashMap;
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use lvk::{readable_bytes, readable_name};

use super::SceneError;
use super::segments::Segments;
use super::text_blocks::TextBlocks;
use super::text_lines::{LogicalLine, is_keyword, next_logical_line, split_word};
use super::text_numbers::{Number, words};
use super::vertex_colors::{self, UNCOLORED};
use super::warnings::Warnings;
use crate::app::progress::Progress;

/// Index of a corner without a texture coordinate or normal.
pub(super) const NONE: u32 = u32::MAX;

/// The content of an OBJ file. All indices of corners are in range.
#[derive(Default)]
pub(super) struct ObjText {
    /// Positions in file units; all NaN where the file has a number that is not finite.
    pub positions: Segments<[f64; 3]>,
    /// Colours as in the file, [`UNCOLORED`] for positions without one; empty, or as many as positions.
    pub colors: Vec<[f32; 3]>,
    /// Texture coordinates, `v` up.
    pub texcoords: Segments<[f32; 2]>,
    /// Unit normals, or zero where the file has no usable one.
    pub normals: Segments<[f32; 3]>,
    /// Faces in the order of the file.
    pub faces: Segments<Face>,
    /// Position, texture coordinate and normal of each corner of the faces; the last two may be [`NONE`].
    pub corners: Segments<[u32; 3]>,
    /// Name behind each material number; `None` for faces before the first `usemtl`.
    pub materials: Vec<Option<Vec<u8>>>,
    /// Arguments of the `mtllib` lines, in order.
    pub libraries: Vec<Vec<u8>>,
    /// Elements with a number that is not finite, or without one that they need.
    pub flaws: Vec<Flaw>,
    /// Number of triangles that the faces make.
    pub triangle_count: usize,
    /// Corrections of the file.
    pub warnings: Warnings,
}

/// A polygon of at least three corners, which end where those of the next face start.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    /// Number of its first corner in [`ObjText::corners`], whose files are too small for more.
    pub start: u32,
    /// Number of its material in [`ObjText::materials`].
    pub material: u32,
    /// Line in the file, from 1.
    pub line: u32,
}

/// An element that cannot be used as it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flaw {
    /// Place of its kind in [`KINDS`].
    pub kind: usize,
    /// Number among the elements of the kind, from 0.
    pub index: usize,
    /// Line in the file, from 1.
    pub line: usize,
}

/// The kinds of elements that corners name.
pub(super) const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

impl ObjText {
    /// Numbers of the corners of a face.
    pub(super) fn corners_of(&self, face: usize) -> Range<usize> {
        let end = self.faces.get(face + 1).map_or(self.corners.len(), |next| next.start as usize);
        self.faces[face].start as usize..end
    }
}

/// Parses an OBJ file while it is read from `path` (which errors name).
pub(super) fn parse(path: &Path, file: impl Read, progress: &mut Progress) -> Result<ObjText, SceneError> {
    let mut blocks = TextBlocks::new(file);
    let mut parser = Parser {
        path,
        line_number: 0,
        obj: ObjText { materials: vec![None], ..ObjText::default() },
        reach: [Reach::default(); 3],
        material: 0,
        numbers: HashMap::new(),
        short_faces: 0,
        weights: 0,
        paint: Vec::new(),
    };
    let mut found = Ok(());
    while !blocks.is_ended() {
        let checked = blocks.text().len();
        blocks.read_on().map_err(|source| SceneError::from_io(path, source))?;
        if blocks.text()[checked..].contains(&0) {
            return Err(SceneError::NotObj { path: path.into(), why: "it holds binary data" });
        }
        // What an error says about a line of binary data would help little: the rest is searched for zeros first.
        let consumed = match found {
            Ok(()) => parser.statements(blocks.text(), blocks.complete_end()),
            Err(_) => Ok(blocks.text().len()),
        };
        match consumed {
            Ok(count) => blocks.consume(count),
            Err(error) => found = Err(error),
        }
        progress.set(blocks.consumed);
        progress.go_on()?;
    }
    found.and_then(|()| parser.finish())
}

/// The largest index a kind of element was asked for, and where.
#[derive(Clone, Copy, Default)]
struct Reach {
    highest: usize,
    index: i64,
    line: usize,
}

struct Parser<'a> {
    path: &'a Path,
    line_number: usize,
    obj: ObjText,
    reach: [Reach; 3],
    /// Number of the material of the faces that follow.
    material: u32,
    numbers: HashMap<Vec<u8>, u32>,
    short_faces: usize,
    /// Positions with a weight other than 1.
    weights: usize,
    /// Colours of the `#MRGB` lines since the last other statement.
    paint: Vec<[f32; 3]>,
}

impl Parser<'_> {
    /// Takes the statements of a text that end at `end` or before; returns the length of what it took.
    fn statements(&mut self, text: &[u8], end: usize) -> Result<usize, SceneError> {
        let mut consumed = 0;
        while consumed < end {
            let (line, after) = next_logical_line(&text[consumed..]);
            let next = text.len() - after.len();
            if next > end {
                break;
            }
            self.line(&line)?;
            consumed = next;
        }
        Ok(consumed)
    }

    fn line(&mut self, line: &LogicalLine<'_>) -> Result<(), SceneError> {
        self.line_number += 1;
        self.statement(&line.text)?;
        if line.is_cut {
            self.warn(
                "continued lines",
                "it ends in a backslash, but the next line is a statement of its own",
            );
        }
        self.line_number += line.line_count - 1;
        Ok(())
    }

    fn statement(&mut self, line: &[u8]) -> Result<(), SceneError> {
        let (keyword, rest) = split_word(line);
        match keyword {
            b"#MRGB" => self.paint.extend(vertex_colors::painted(rest)),
            [] | [b'#', ..] => {}
            _ => {
                self.paint_positions();
                self.take(keyword, rest)?;
            }
        }
        Ok(())
    }

    fn take(&mut self, keyword: &[u8], rest: &[u8]) -> Result<(), SceneError> {
        match keyword {
            b"v" => self.position(rest)?,
            b"vt" => self.texcoord(rest),
            b"vn" => self.normal(rest),
            b"f" | b"fo" => self.face(rest)?,
            b"usemtl" => self.use_material(rest),
            b"mtllib" if !rest.is_empty() => self.obj.libraries.push(rest.to_vec()),
            _ if is_keyword(keyword) => {}
            _ if is_keyword(&keyword.to_ascii_lowercase()) => {
                return self.take(&keyword.to_ascii_lowercase(), rest);
            }
            _ => {
                let keyword = readable_bytes(keyword);
                self.warn("statements", &format!("`{keyword}` is no statement of OBJ; the line is ignored"));
            }
        }
        Ok(())
    }

    /// Gives the colours of `#MRGB` lines to as many of the last positions, as ZBrush and Blender do.
    fn paint_positions(&mut self) {
        if self.paint.is_empty() {
            return;
        }
        let count = self.obj.positions.len();
        let colors = &mut self.obj.colors;
        colors.resize(count, UNCOLORED);
        let painted = self.paint.len().min(count);
        colors[count - painted..].copy_from_slice(&self.paint[..painted]);
        self.paint.clear();
    }

    /// A position, and behind it a weight, or a colour of three numbers.
    fn position(&mut self, rest: &[u8]) -> Result<(), SceneError> {
        let mut position = [0.0; 3];
        let mut extra = [Number::Unreadable; 4];
        let mut found = 0;
        for word in words(rest).take(7) {
            let number = Number::from_word(word);
            match number {
                _ if found >= 3 => extra[found - 3] = number,
                Number::Finite(value) => position[found] = value,
                Number::NotFinite => position = [f64::NAN; 3],
                Number::Unreadable => {
                    return Err(self.bad(format!("`{}` is not a number", readable_bytes(word))));
                }
            }
            found += 1;
        }
        if found < 3 {
            return Err(self.bad(format!("a position needs 3 numbers, found {found}")));
        }
        if position.iter().any(|x| x.is_nan()) {
            position = [f64::NAN; 3];
            self.flaw(0, self.obj.positions.len());
        }
        let is_weighted = found == 4 && !matches!(extra[0], Number::Finite(0.0 | 1.0));
        self.weights += usize::from(is_weighted);
        self.color(extra.first_chunk().filter(|_| found >= 6));
        self.obj.positions.push(position);
        Ok(())
    }

    /// Keeps the colour of the position that is pushed next. A position without one is white.
    fn color(&mut self, numbers: Option<&[Number; 3]>) {
        let colors = &mut self.obj.colors;
        match numbers.map(|numbers| numbers.map(Number::finite_f32)) {
            Some([Some(red), Some(green), Some(blue)]) => {
                colors.resize(self.obj.positions.len(), UNCOLORED);
                colors.push([red, green, blue]);
            }
            _ if !colors.is_empty() => colors.push(UNCOLORED),
            _ => {}
        }
    }

    /// Texture coordinates are mended: a number that is missing or not finite becomes 0.
    fn texcoord(&mut self, rest: &[u8]) {
        let mut words = words(rest).map(|word| Number::from_word(word).finite_f32());
        let [u, v] = [words.next().flatten(), words.next().unwrap_or(Some(0.0))];
        if u.is_none() || v.is_none() {
            self.flaw(1, self.obj.texcoords.len());
        }
        self.obj.texcoords.push([u.unwrap_or(0.0), v.unwrap_or(0.0)]);
    }

    /// A normal that lacks a number becomes 0, for which one is computed later.
    fn normal(&mut self, rest: &[u8]) {
        let mut words = words(rest).map(|word| match Number::from_word(word) {
            Number::Finite(value) => Some(value),
            _ => None,
        });
        let found = [0; 3].map(|_| words.next().flatten());
        let normal = match found {
            [Some(x), Some(y), Some(z)] => glam::DVec3::new(x, y, z).normalize_or_zero().as_vec3(),
            _ => {
                self.flaw(2, self.obj.normals.len());
                glam::Vec3::ZERO
            }
        };
        self.obj.normals.push(normal.to_array());
    }

    fn face(&mut self, rest: &[u8]) -> Result<(), SceneError> {
        let start = self.obj.corners.len();
        for word in words(rest) {
            let corner = self.corner(word)?;
            self.obj.corners.push(corner);
        }
        let corner_count = self.obj.corners.len() - start;
        if corner_count < 3 {
            self.obj.corners.truncate(start);
            self.short_faces += 1;
            return Ok(());
        }
        let line = u32::try_from(self.line_number).unwrap_or(u32::MAX);
        let start = u32::try_from(start).unwrap_or(u32::MAX);
        self.obj.faces.push(Face { start, material: self.material, line });
        self.obj.triangle_count += corner_count - 2;
        Ok(())
    }

    fn corner(&mut self, word: &[u8]) -> Result<[u32; 3], SceneError> {
        let mut corner = [NONE; 3];
        let mut parts = word.split(|byte| *byte == b'/');
        for (kind, place) in corner.iter_mut().enumerate() {
            let text = parts.next().unwrap_or_default();
            if kind > 0 && text.is_empty() {
                continue;
            }
            *place = self.resolve(kind, index(text).ok_or_else(|| self.no_corner(word))?)?;
        }
        match parts.next() {
            None => Ok(corner),
            Some(_) => Err(self.no_corner(word)),
        }
    }

    /// Number of the element, from 0. Elements may follow the faces that name them.
    fn resolve(&mut self, kind: usize, index: i64) -> Result<u32, SceneError> {
        let absolute = if index < 0 { self.count(kind) as i64 + index } else { index - 1 };
        let Ok(position) = usize::try_from(absolute) else {
            return Err(self.out_of_range(kind, index, self.line_number));
        };
        if position >= self.reach[kind].highest {
            self.reach[kind] = Reach { highest: position + 1, index, line: self.line_number };
        }
        // Files whose numbers 32 bits do not hold are refused by `finish`.
        Ok(u32::try_from(position).unwrap_or(NONE - 1))
    }

    fn use_material(&mut self, name: &[u8]) {
        self.material = match self.numbers.get(name) {
            _ if name.is_empty() => 0,
            Some(&number) => number,
            None => {
                let number = self.obj.materials.len() as u32;
                self.obj.materials.push(Some(name.to_vec()));
                self.numbers.insert(name.to_vec(), number);
                number
            }
        };
    }

    fn finish(mut self) -> Result<ObjText, SceneError> {
        self.paint_positions();
        for kind in 0..3 {
            let Reach { highest, index, line } = self.reach[kind];
            if highest > self.count(kind) {
                return Err(self.out_of_range(kind, index, line));
            }
        }
        let path = self.path.to_path_buf();
        if self.obj.positions.is_empty() && self.obj.triangle_count == 0 {
            return Err(SceneError::NotObj { path, why: "it has neither vertices (`v`) nor faces (`f`)" });
        }
        if self.obj.triangle_count == 0 {
            return Err(SceneError::Empty { path, degenerate: 0 });
        }
        let limit = u32::MAX / 4;
        if self.obj.triangle_count.max(self.reach.map(|reach| reach.highest).into_iter().fold(0, usize::max))
            > limit as usize
        {
            return Err(SceneError::TooLarge { path, limit });
        }
        if self.short_faces > 0 {
            let line = format!("{} faces with fewer than 3 corners were left out", self.short_faces);
            self.obj.warnings.push("short faces", line);
        }
        if self.weights > 0 {
            let line = format!("weights of {} vertices (`v x y z w`) were ignored", self.weights);
            self.obj.warnings.push("weights", line);
        }
        Ok(self.obj)
    }

    fn count(&self, kind: usize) -> usize {
        [self.obj.positions.len(), self.obj.texcoords.len(), self.obj.normals.len()][kind]
    }

    fn flaw(&mut self, kind: usize, index: usize) {
        self.obj.flaws.push(Flaw { kind, index, line: self.line_number });
    }

    fn warn(&mut self, kind: &'static str, what: &str) {
        let line = format!("{}:{}: {what}", readable_name(self.path), self.line_number);
        self.obj.warnings.push(kind, line);
    }

    fn no_corner(&self, word: &[u8]) -> SceneError {
        self.bad(format!("`{}` is not a face corner", readable_bytes(word)))
    }

    fn bad(&self, what: String) -> SceneError {
        SceneError::BadLine { path: self.path.into(), line: self.line_number, what }
    }

    fn out_of_range(&self, kind: usize, index: i64, line: usize) -> SceneError {
        let (what, count) = (KINDS[kind], self.count(kind));
        SceneError::IndexOutOfRange { path: self.path.into(), line, what, index, count }
    }
}

/// A whole number. Scripts that write all numbers alike give it decimals, which are zeros (`12.000000`).
fn index(text: &[u8]) -> Option<i64> {
    let text = std::str::from_utf8(text).ok()?;
    let whole = || text.split_once('.').filter(|(_, decimals)| decimals.bytes().all(|digit| digit == b'0'));
    text.parse().ok().or_else(|| whole()?.0.parse().ok())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parsed(text: impl AsRef<[u8]>) -> Result<ObjText, SceneError> {
        parse(Path::new("a.obj"), text.as_ref(), &mut Progress::hidden())
    }

    /// Corners of each face, with numbers from 0.
    fn faces(text: impl AsRef<[u8]>) -> Vec<Vec<[u32; 3]>> {
        let obj = parsed(text).unwrap();
        (0..obj.faces.len()).map(|face| obj.corners.range(obj.corners_of(face)).copied().collect()).collect()
    }

    fn warnings(text: &str) -> Vec<String> {
        parsed(text).unwrap().warnings.into_lines()
    }

    const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";
    const PLAIN: [[u32; 3]; 3] = [[0, NONE, NONE], [1, NONE, NONE], [2, NONE, NONE]];

    #[test]
    fn corners_become_absolute() {
        assert_eq!(faces(format!("{CORNERS}f 1 2 3\n")), [PLAIN]);
        assert_eq!(
            faces(format!("{CORNERS}f -3/-1/-1 2//1 3/1\n")),
            [[[0, 0, 0], [1, NONE, 0], [2, 0, NONE]]]
        );
        assert_eq!(faces(format!("f 1 2 3\n{CORNERS}")), [PLAIN], "vertices may follow");
    }

    #[test]
    fn blanks_comments_and_continuations_are_understood() {
        let text =
            "# caf\u{e9}\r\nv 0 0 0 \r\n\tv 1 0 0 0.5 0.5 0.5\r\nv 0 1 0 # top\r\nf 1 2 \\ \r\n 3 # t  \r\n";
        assert_eq!(faces(text), [PLAIN]);
        assert_eq!(faces([b"# caf\xe9\n".as_slice(), CORNERS.as_bytes(), b"f 1 2 3"].concat()), [PLAIN]);
        assert_eq!(faces(format!("{CORNERS}f 1 2 3\n").replace('\n', "\r")), [PLAIN]);
    }

    #[test]
    fn lines_that_end_in_a_backslash_lose_nothing() {
        let text = format!("# from C:\\models\\\n{CORNERS}g parts\\\nf 1 2 3\nusemtl wall\\\nf 3 2 1\n");
        let obj = parsed(&text).unwrap();
        assert_eq!((obj.positions.len(), obj.faces.len()), (3, 2));
        assert_eq!(obj.materials, [None, Some(b"wall\\".to_vec())]);
        assert!(obj.warnings.into_lines().is_empty());
        let cut = warnings(&format!("{CORNERS}f 1 2 3 \\\nf 3 2 1\n"));
        assert!(cut[0].starts_with("a.obj:6: it ends in a backslash"), "{cut:?}");
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
            match parsed(format!("{CORNERS}{face}\n")).err().unwrap() {
                SceneError::IndexOutOfRange { line, what: w, index: i, .. } => {
                    assert_eq!((line, w, i), (6, what, index), "{face}");
                }
                other => panic!("{face}: {other}"),
            }
        }
    }

    #[test]
    fn text_without_a_mesh_is_refused() {
        assert!(matches!(parsed(b"\x89PNG\r\n\x1a\n\0\0"), Err(SceneError::NotObj { .. })));
        assert!(matches!(parsed("hello world\n"), Err(SceneError::NotObj { .. })));
        assert!(matches!(parsed(""), Err(SceneError::NotObj { .. })));
        assert!(matches!(parsed(CORNERS), Err(SceneError::Empty { .. })));
        assert!(matches!(parsed("\nv 0 0\n"), Err(SceneError::BadLine { line: 2, .. })));
        assert!(matches!(parsed("v 0 0 x\n"), Err(SceneError::BadLine { line: 1, .. })));
        assert!(matches!(parsed("v 0 0 0\nf 1/1/1/1 1 1\n"), Err(SceneError::BadLine { line: 2, .. })));
        assert!(matches!(parsed("v 0 0 0\nf 1.5 1 1\n"), Err(SceneError::BadLine { line: 2, .. })));
    }

    #[test]
    fn materials_are_numbered_by_first_use_and_their_names_are_bytes() {
        let text = [
            b"mtllib my file.mtl\nusemtl b c\n".as_slice(),
            CORNERS.as_bytes(),
            b"f 1 2 3\nusemtl M\xe4\nf 1 2 3\nusemtl M\xf6\nusemtl b c\nf 1 2 3\nusemtl\nf 1 2 3\n",
        ];
        let obj = parsed(text.concat()).unwrap();
        let names = [&b"b c"[..], b"M\xe4", b"M\xf6"].map(|name| Some(name.to_vec()));
        assert_eq!((obj.materials[0].clone(), &obj.materials[1..]), (None, &names[..]));
        assert_eq!(obj.libraries, [b"my file.mtl"]);
        assert_eq!(obj.faces.range(0..4).map(|face| face.material).collect::<Vec<_>>(), [1, 2, 1, 0]);
    }

    #[test]
    fn numbers_that_are_not_finite_are_flaws_with_their_lines() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1.#INF 0\nvt 0.5\nvt nan 1\nvt 1e39 1\nvn 0 -nan(ind) 1\n\
                    vn -1.#IND00 -1.#IND00 -1.#IND00\nvn 0 1\nvn 0 0 2\nf 1 2 3\n";
        let obj = parsed(text).unwrap();
        assert!(obj.texcoords.range(0..3).eq(&[[0.5, 0.0], [0.0, 1.0], [0.0, 1.0]]));
        assert!(obj.normals.range(0..4).eq(&[[0.0; 3], [0.0; 3], [0.0; 3], [0.0, 0.0, 1.0]]));
        assert!(obj.positions[2].iter().all(|x| x.is_nan()));
        let flaws: Vec<_> = obj.flaws.iter().map(|flaw| (flaw.kind, flaw.index, flaw.line)).collect();
        assert_eq!(flaws, [(0, 2, 3), (1, 1, 5), (1, 2, 6), (2, 0, 7), (2, 1, 8), (2, 2, 9)]);
    }

    #[test]
    fn colors_are_told_from_weights() {
        let faces = "f 1 2 3\n";
        let obj =
            parsed(format!("v 0 0 0\nv 1 0 0 0.1 0.2 0.3\nv 0 1 0 1 0 0 0.5\nv 1 1 1 1 0 nan\n{faces}"))
                .unwrap();
        let has_color: Vec<bool> = obj.colors.iter().map(|color| !color[0].is_nan()).collect();
        assert_eq!(has_color, [false, true, true, false]);
        assert_eq!(obj.colors[1..3], [[0.1, 0.2, 0.3], [1.0, 0.0, 0.0]]);
        let weighted = format!("v 0 0 0 1\nv 1 0 0 1.0\nv 0 1 0 0.5\nv 9 9 9 1 1\n{faces}");
        assert!(parsed(&weighted).unwrap().colors.is_empty());
        assert_eq!(warnings(&weighted), ["weights of 1 vertices (`v x y z w`) were ignored"]);
    }

    proptest! {
        #[test]
        fn any_bytes_end_in_a_result(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            let _ = parsed(&bytes);
        }
    }
}
