//! Parses MTL text as found in the wild: an odd line (`Kd spectral ...`, `map_Kd -s 2 2 1 wood.png`) costs only itself.

use super::text_lines::{lines, split_word};
use super::text_numbers::{Number, words};

/// A `newmtl` and the statements behind it, the last of each kind.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct MtlEntry {
    /// The name and what follows it on its line.
    pub name: Vec<u8>,
    /// `Kd`.
    pub diffuse: Option<[f32; 3]>,
    /// `Ks`.
    pub specular: Option<[f32; 3]>,
    /// `Ke`.
    pub emissive: Option<[f32; 3]>,
    /// `Tf`.
    pub filter: Option<[f32; 3]>,
    /// `Ns`.
    pub shininess: Option<f32>,
    /// `Ni`.
    pub optical_density: Option<f32>,
    /// `d`.
    pub dissolve: Option<f32>,
    /// `Tr`.
    pub transparency: Option<f32>,
    /// `illum`.
    pub illumination: Option<u8>,
    /// `map_Kd`: the name behind the options and what follows it on its line.
    pub diffuse_map: Option<Vec<u8>>,
    /// `map_d`, in the same form.
    pub dissolve_map: Option<Vec<u8>>,
    /// `norm`, `map_bump` or `bump`, in the same form.
    pub relief_map: Option<Vec<u8>>,
}

/// The entries of the decoded MTL file `content`, and the lines, from 1, with numbers that are not finite.
pub(super) fn parse(content: &[u8]) -> (Vec<MtlEntry>, Vec<usize>) {
    let mut entries: Vec<MtlEntry> = Vec::new();
    let mut flawed_lines = Vec::new();
    for (line, number) in lines(content).zip(1..) {
        let (keyword, rest) = split_word(line);
        let keyword = keyword.to_ascii_lowercase();
        if keyword == b"newmtl" && !rest.is_empty() {
            entries.push(MtlEntry { name: rest.trim_ascii().to_vec(), ..MtlEntry::default() });
        } else if let Some(entry) = entries.last_mut()
            && entry.take(&keyword, rest)
            && words(rest).any(|word| Number::from_word(word) == Number::NotFinite)
        {
            flawed_lines.push(number);
        }
    }
    (entries, flawed_lines)
}

impl MtlEntry {
    /// Takes a statement whose lower-case keyword and argument are given. True if its argument is numbers.
    fn take(&mut self, keyword: &[u8], rest: &[u8]) -> bool {
        fn replace<T>(place: &mut Option<T>, value: Option<T>) -> bool {
            *place = value.or(place.take());
            true
        }
        match keyword {
            b"kd" => replace(&mut self.diffuse, color(rest)),
            b"ks" => replace(&mut self.specular, color(rest)),
            b"ke" => replace(&mut self.emissive, color(rest)),
            b"tf" => replace(&mut self.filter, color(rest)),
            b"ns" => replace(&mut self.shininess, number(rest)),
            b"ni" => replace(&mut self.optical_density, number(rest)),
            b"d" => replace(&mut self.dissolve, number(rest.strip_prefix(b"-halo").unwrap_or(rest))),
            b"tr" => replace(&mut self.transparency, number(rest)),
            b"illum" => replace(&mut self.illumination, number(rest).map(|n| n.clamp(0.0, 10.0) as u8)),
            b"map_kd" => !replace(&mut self.diffuse_map, image_name(rest)),
            b"map_d" => !replace(&mut self.dissolve_map, image_name(rest)),
            b"norm" | b"map_bump" | b"bump" => !replace(&mut self.relief_map, image_name(rest)),
            _ => false,
        }
    }
}

fn number(text: &[u8]) -> Option<f32> {
    words(text).next().and_then(|word| Number::from_word(word).finite_f32())
}

/// Three numbers, or one that stands for all three.
fn color(text: &[u8]) -> Option<[f32; 3]> {
    let mut numbers = words(text).map(|word| Number::from_word(word).finite_f32());
    let red = numbers.next()??;
    match numbers.next() {
        Some(green) => Some([red, green?, numbers.next()??]),
        None => Some([red; 3]),
    }
}

/// The file name behind the options of a `map_` line, and what follows it; it may hold blanks. The options are not applied.
fn image_name(text: &[u8]) -> Option<Vec<u8>> {
    let mut rest = text.trim_ascii();
    while rest.starts_with(b"-") {
        let (option, after) = split_word(rest);
        let (fewest, most) = match option.to_ascii_lowercase().as_slice() {
            b"-s" | b"-o" | b"-t" => (1, 3),
            b"-mm" => (2, 2),
            b"-blendu" | b"-blendv" | b"-cc" | b"-clamp" | b"-texres" | b"-bm" | b"-boost" | b"-imfchan"
            | b"-type" => (1, 1),
            _ => break,
        };
        rest = after;
        for i in 0..most {
            let (word, after) = split_word(rest);
            if i >= fewest && Number::from_word(word) == Number::Unreadable {
                break;
            }
            rest = after;
        }
    }
    (!rest.is_empty()).then(|| rest.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(text: &str) -> Vec<MtlEntry> {
        parse(text.as_bytes()).0
    }

    #[test]
    fn statements_are_read_in_any_case_and_with_comments() {
        let entry = &entries(
            "Kd 1 1 1\nNEWMTL m\r\n\tkd 0.1 0.2 0.3 # red\nKs 0.5#grey\nNs 30\nd -halo 0.5\nILLUM 7 # glass\n",
        )[0];
        assert_eq!(
            (entry.name.as_slice(), entry.diffuse, entry.specular),
            (&b"m"[..], Some([0.1, 0.2, 0.3]), Some([0.5; 3]))
        );
        assert_eq!((entry.shininess, entry.dissolve, entry.illumination), (Some(30.0), Some(0.5), Some(7)));
    }

    #[test]
    fn odd_lines_cost_only_themselves() {
        let text =
            "newmtl\nnewmtl m\nKd spectral file.rfl 1\nKs x\nNs\nillum two\nKd 1 2\nKe 1 1 1\nmap_Kd\n";
        let expected = MtlEntry { name: b"m".to_vec(), emissive: Some([1.0; 3]), ..MtlEntry::default() };
        assert_eq!(entries(text), [expected]);
    }

    #[test]
    fn numbers_that_are_not_finite_are_known_by_their_lines() {
        let (found, lines) = parse(b"newmtl m\nKd -1.#IND00 0 0\nNs nan\nmap_Kd inf\nNi 1.5\nd 1.#QNAN\n");
        assert_eq!((found[0].diffuse, found[0].shininess, found[0].optical_density), (None, None, Some(1.5)));
        assert_eq!((found[0].diffuse_map.as_deref(), lines), (Some(&b"inf"[..]), vec![2, 3, 6]));
    }

    #[test]
    fn the_image_name_follows_the_options() {
        for (text, name) in [
            ("wood.png", "wood.png"),
            ("-s 2 2 1 my wood.png", "my wood.png"),
            ("-s 2 -o 0.5 0.5 -clamp on \"a b.png\"", "\"a b.png\""),
            ("-mm 0 1 -bm 0.3 -imfchan r a.png", "a.png"),
            ("-s 1 2.png", "2.png"),
            ("-strange.png", "-strange.png"),
            ("wood.png # of oak", "wood.png # of oak"),
        ] {
            assert_eq!(image_name(text.as_bytes()).as_deref(), Some(name.as_bytes()), "{text}");
        }
        assert_eq!(image_name(b"-s"), None);
        assert_eq!(image_name(b"-s 1 1 1"), None);
        assert_eq!(image_name(b""), None);
    }
}
