//! Parses MTL text as found in the wild: an odd line (`Kd spectral ...`) costs only itself.

use lvk::readable_bytes;

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
    /// The options of `map_Kd`.
    pub diffuse_options: MapOptions,
    /// `map_d`, in the same form.
    pub dissolve_map: Option<Vec<u8>>,
    /// `norm`, `map_bump` or `bump`, in the same form.
    pub relief_map: Option<Vec<u8>>,
}

/// Options in front of the name of an image.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MapOptions {
    /// `-s`: factors of `u` and `v`.
    pub scale: [f32; 2],
    /// `-o`: added to `u` and `v` after scaling.
    pub offset: [f32; 2],
    /// Options that change the image and are not applied, as in the file.
    pub ignored: Vec<String>,
}

impl Default for MapOptions {
    fn default() -> Self {
        Self { scale: [1.0; 2], offset: [0.0; 2], ignored: Vec::new() }
    }
}

impl MapOptions {
    /// Takes an option in lower case and its values.
    fn take(&mut self, option: &[u8], values: &[&[u8]]) {
        let number = |i: usize| values.get(i).and_then(|word| Number::from_word(word).finite_f32());
        let replace =
            |pair: &mut [f32; 2]| pair.iter_mut().zip(0..).for_each(|(x, i)| *x = number(i).unwrap_or(*x));
        let usual: &[f32] = match option {
            b"-s" => return replace(&mut self.scale),
            b"-o" => return replace(&mut self.offset),
            b"-t" => &[0.0; 3],
            b"-mm" => &[0.0, 1.0],
            b"-clamp" | b"-cc" if values[0].eq_ignore_ascii_case(b"off") => return,
            b"-clamp" | b"-cc" | b"-imfchan" => &[],
            _ => return,
        };
        if usual.is_empty() || (0..values.len()).any(|i| number(i) != usual.get(i).copied()) {
            let words = std::iter::once(option).chain(values.iter().copied());
            self.ignored.push(words.map(readable_bytes).collect::<Vec<_>>().join(" "));
        }
    }
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
            b"map_kd" => {
                if let Some((name, options)) = image_name(rest) {
                    (self.diffuse_map, self.diffuse_options) = (Some(name), options);
                }
                false
            }
            b"map_d" => !replace(&mut self.dissolve_map, name_alone(rest)),
            b"norm" | b"map_bump" | b"bump" => !replace(&mut self.relief_map, name_alone(rest)),
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

fn name_alone(text: &[u8]) -> Option<Vec<u8>> {
    image_name(text).map(|(name, _)| name)
}

/// The file name behind the options of a `map_` line and what follows it, which may hold blanks, and the options.
fn image_name(text: &[u8]) -> Option<(Vec<u8>, MapOptions)> {
    let mut rest = text.trim_ascii();
    let mut options = MapOptions::default();
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
        let mut values = Vec::with_capacity(most);
        for i in 0..most {
            let (word, after) = split_word(rest);
            if i >= fewest && Number::from_word(word) == Number::Unreadable {
                break;
            }
            values.push(word);
            rest = after;
        }
        options.take(&option.to_ascii_lowercase(), &values);
    }
    (!rest.is_empty()).then(|| (rest.to_vec(), options))
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
            assert_eq!(name_alone(text.as_bytes()).as_deref(), Some(name.as_bytes()), "{text}");
        }
        assert_eq!(image_name(b"-s"), None);
        assert_eq!(image_name(b"-s 1 1 1"), None);
        assert_eq!(image_name(b""), None);
    }

    #[test]
    fn options_are_taken_or_known_to_be_ignored() {
        let options = |text: &str| image_name(text.as_bytes()).unwrap().1;
        let placed = options("-o 0.5 0.25 0 -S 2 3 1 a.png");
        assert_eq!((placed.scale, placed.offset, placed.ignored.len()), ([2.0, 3.0], [0.5, 0.25], 0));
        assert_eq!(options("-s 2 a.png").scale, [2.0, 1.0]);
        for usual in [
            "-t 0 0 0",
            "-mm 0 1",
            "-clamp off",
            "-cc OFF",
            "-blendu on -blendv off -texres 512 -boost 2",
            "-bm 1",
        ] {
            assert_eq!(options(&format!("{usual} a.png")), MapOptions::default(), "{usual}");
        }
        let ignored = options("-clamp on -mm 0.2 0.5 -imfchan r -t 1 a.png").ignored;
        assert_eq!(ignored, ["-clamp on", "-mm 0.2 0.5", "-imfchan r", "-t 1"]);
    }
}
