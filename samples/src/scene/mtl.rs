//! Reads MTL libraries: Phong parameters, mirrors, glass and textures.
//!
//! Like the OBJ text, the MTL text is rewritten before tobj parses it: one odd line (`Kd spectral ...`,
//! `map_Kd -s 2 2 1 wood.png`) would otherwise cost the whole library.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use lvk::readable_name;

use super::Material;
use super::texture::{PictureBudget, Texture, find_image};
use super::warnings::Warnings;
use crate::app::input_file::{self, FileKind};

/// Materials by name, and the images they use.
#[derive(Default)]
pub(super) struct Library {
    materials: HashMap<String, Definition>,
    textures: Vec<Texture>,
    texture_numbers: HashMap<(PathBuf, Option<PathBuf>), u32>,
    wants_normal_maps: bool,
    normal_maps: Vec<Texture>,
    /// `None` for images that cannot be read.
    normal_map_numbers: HashMap<PathBuf, Option<u32>>,
    budget: PictureBudget,
    warnings: Warnings,
}

/// Result of [`Library::select`].
pub(super) struct Selection {
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<Texture>,
    pub(super) normal_maps: Vec<Texture>,
    pub(super) warnings: Vec<String>,
}

/// A material and its image, which is read when a face turns out to need it.
#[derive(Clone)]
struct Definition {
    material: Material,
    image: Option<Image>,
    /// Mask of holes: dark texels are holes.
    mask: Option<Image>,
    relief: Option<Image>,
}

/// An image as a library names it, and the folder of that library.
#[derive(Clone)]
struct Image {
    folder: PathBuf,
    name: String,
}

impl Library {
    /// Reads the libraries that the OBJ file at `obj_path` names. A missing library is a warning.
    pub(super) fn read(obj_path: &Path, names: &[String]) -> Self {
        let folder = obj_path.parent().unwrap_or(Path::new(""));
        let mut library = Self::default();
        let mut seen = HashSet::new();
        for file in names.iter().flat_map(|name| library_files(folder, name)) {
            if seen.insert(file.clone()) {
                library.read_file(&file);
            }
        }
        library
    }

    /// Materials have their normal maps too.
    pub(super) fn with_normal_maps(self) -> Self {
        Self { wants_normal_maps: true, ..self }
    }

    fn read_file(&mut self, path: &Path) {
        let content = match input_file::read(path, FileKind::Mtl) {
            Ok(content) => content,
            Err(error) => {
                let line =
                    format!("material library {}: {error}; materials are stand-ins", readable_name(path));
                return self.warnings.push("material libraries", line);
            }
        };
        let text = clean(&String::from_utf8_lossy(&content));
        match tobj::load_mtl_buf(&mut text.as_bytes()) {
            Ok((parsed, _)) => parsed.iter().for_each(|source| self.add(source, path)),
            Err(error) => {
                let line = format!("material library {}: {error}", readable_name(path));
                self.warnings.push("material libraries", line);
            }
        }
    }

    fn add(&mut self, source: &tobj::Material, path: &Path) {
        if self.materials.contains_key(&source.name) {
            return;
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut material = convert(source);
        let image =
            |name: &Option<String>| name.clone().map(|name| Image { folder: folder.to_path_buf(), name });
        let relief = image(&source.normal_texture);
        let (image, mask) = (image(&source.diffuse_texture), image(&source.dissolve_texture));
        // Exporters often leave Kd black beside a texture, meaning the texture alone.
        if image.is_some() && material.albedo == [0.0; 3] && !material.is_refractive() {
            material.albedo = [1.0; 3];
        }
        self.materials.insert(source.name.clone(), Definition { material, image, mask, relief });
    }

    /// Number of the image, which is read on first use; a stand-in and a warning when that fails.
    fn texture(&mut self, Image { folder, name }: &Image, mask: Option<PathBuf>) -> u32 {
        let name = &name.replace('\\', "/");
        let found = find_image(folder, name);
        let path = found.clone().unwrap_or_else(|| folder.join(name));
        let key = (file_identity(&path), mask.as_deref().map(file_identity));
        if let Some(&number) = self.texture_numbers.get(&key) {
            return number;
        }
        let texture = match &found {
            Some(path) => Texture::read(path, &mut self.budget),
            None => Err("no such file".to_owned()),
        };
        let texture = texture.unwrap_or_else(|why| {
            let line = format!("texture {}: {why}; magenta checks stand in", readable_name(path));
            self.warnings.push("textures", line);
            Texture::stand_in(name)
        });
        let texture = match &mask {
            Some(mask) => self.with_holes(texture, mask),
            None => texture,
        };
        let number = self.textures.len() as u32;
        self.textures.push(texture);
        self.texture_numbers.insert(key, number);
        number
    }

    /// Number of the normal map, which is read on first use; none, and a warning, when that fails.
    fn normal_map(&mut self, Image { folder, name }: &Image) -> Option<u32> {
        let found = find_image(folder, name);
        let path = found.clone().unwrap_or_else(|| folder.join(name));
        let key = file_identity(&path);
        if let Some(&number) = self.normal_map_numbers.get(&key) {
            return number;
        }
        let read = match &found {
            Some(path) => Texture::read_relief(path, &mut self.budget),
            None => Err("no such file".to_owned()),
        };
        let number = match read {
            Ok(map) => {
                self.normal_maps.push(map);
                Some(self.normal_maps.len() as u32 - 1)
            }
            Err(why) => {
                let line = format!("normal map {}: {why}; the surface is smooth", readable_name(path));
                self.warnings.push("textures", line);
                None
            }
        };
        self.normal_map_numbers.insert(key, number);
        number
    }

    /// The texture with alpha from the mask; as it is, with a warning, where the mask cannot be read.
    fn with_holes(&mut self, texture: Texture, mask: &Path) -> Texture {
        match Texture::read(mask, &mut self.budget) {
            Ok(mask) => {
                self.budget.give_back(&mask);
                texture.masked(&mask)
            }
            Err(why) => {
                let line = format!("mask {}: {why}; there are no holes", readable_name(mask));
                self.warnings.push("textures", line);
                texture
            }
        }
    }

    /// The materials that `names` ask for, in that order, with stand-ins for undefined ones; then the images
    /// of these and the warnings.
    pub(super) fn select(mut self, names: &[Option<String>]) -> Selection {
        let mut selected = Vec::with_capacity(names.len());
        for name in names {
            let Some(name) = name else {
                selected.push(Material::matte("(none)", [0.6; 3]));
                continue;
            };
            selected.push(self.material(name));
        }
        let Self { textures, normal_maps, mut warnings, budget, .. } = self;
        budget.into_warnings().into_iter().for_each(|line| warnings.push("pictures", line));
        Selection { materials: selected, textures, normal_maps, warnings: warnings.into_lines() }
    }

    fn material(&mut self, name: &str) -> Material {
        let Some(Definition { material, image, mask, relief }) = self.materials.get(name).cloned() else {
            let line = format!("material `{}` is not defined; glaring orange stands in", readable_name(name));
            self.warnings.push("materials", line);
            return Material::stand_in(name);
        };
        let mask = mask.and_then(|mask| find_image(&mask.folder, &mask.name));
        let is_masked = image.is_some() && mask.is_some();
        let albedo_texture = image.map(|image| self.texture(&image, mask));
        let relief = relief.filter(|_| self.wants_normal_maps);
        let normal_map = relief.and_then(|relief| self.normal_map(&relief));
        Material { albedo_texture, is_masked, normal_map, ..material }
    }
}

/// The same for all names of one file: Windows and macOS ignore capitals. The path itself if there is no such file.
fn file_identity(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

/// The files that a `mtllib` argument means: one name that may hold blanks, or several names.
fn library_files(folder: &Path, argument: &str) -> Vec<PathBuf> {
    let argument = argument.trim_matches('"').replace('\\', "/");
    let whole = folder.join(&argument);
    let parts: Vec<PathBuf> = argument.split_whitespace().map(|part| folder.join(part)).collect();
    match parts.iter().any(|part| part.is_file()) && !whole.is_file() {
        true => parts,
        false => vec![whole],
    }
}

/// Keeps the lines that [`convert`] uses, in the form that tobj accepts.
fn clean(text: &str) -> String {
    let mut cleaned = String::with_capacity(text.len());
    let mut inside = false;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    for line in text.lines().map(str::trim) {
        let (keyword, rest) = line.split_once(|c: char| c.is_whitespace()).unwrap_or((line, ""));
        let rest = rest.trim();
        let kept = match keyword.to_ascii_lowercase().as_str() {
            "newmtl" if !rest.is_empty() => Some(format!("newmtl {rest}")),
            "kd" => color(rest).map(|c| format!("Kd {c}")),
            "ks" => color(rest).map(|c| format!("Ks {c}")),
            "ke" => color(rest).map(|c| format!("Ke {c}")),
            "tf" => color(rest).map(|c| format!("Tf {c}")),
            "ns" => number(rest).map(|n| format!("Ns {n}")),
            "ni" => number(rest).map(|n| format!("Ni {n}")),
            "d" => number(rest.trim_start_matches("-halo")).map(|n| format!("d {n}")),
            "tr" => number(rest).map(|n| format!("Tr {n}")),
            "illum" => number(rest).map(|n| format!("illum {}", n.clamp(0.0, 10.0) as u8)),
            "map_kd" => image_name(rest).map(|name| format!("map_Kd {name}")),
            "map_d" => image_name(rest).map(|name| format!("map_d {name}")),
            "norm" | "map_bump" | "bump" => image_name(rest).map(|name| format!("map_Bump {name}")),
            _ => None,
        };
        inside |= keyword.eq_ignore_ascii_case("newmtl");
        if let Some(kept) = kept.filter(|_| inside) {
            cleaned.push_str(&kept);
            cleaned.push('\n');
        }
    }
    cleaned
}

fn number(text: &str) -> Option<f32> {
    text.split_whitespace().next()?.parse().ok().filter(|n: &f32| n.is_finite())
}

/// Three numbers, or one that stands for all three.
fn color(text: &str) -> Option<String> {
    let mut words = text.split_whitespace().map(|word| word.parse::<f32>().ok().filter(|n| n.is_finite()));
    let red = words.next()??;
    let (green, blue) = match words.next() {
        Some(green) => (green?, words.next()??),
        None => (red, red),
    };
    Some(format!("{red} {green} {blue}"))
}

/// The file name behind the options of a `map_` line; it may hold blanks. The options are not applied.
fn image_name(text: &str) -> Option<String> {
    let mut rest = text.trim();
    while rest.starts_with('-') {
        let (option, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        let (fewest, most) = match option.to_ascii_lowercase().as_str() {
            "-s" | "-o" | "-t" => (1, 3),
            "-mm" => (2, 2),
            "-blendu" | "-blendv" | "-cc" | "-clamp" | "-texres" | "-bm" | "-boost" | "-imfchan"
            | "-type" => (1, 1),
            _ => break,
        };
        rest = after.trim_start();
        for i in 0..most {
            let (word, after) = rest.split_once(char::is_whitespace)?;
            if i >= fewest && word.parse::<f32>().is_err() {
                break;
            }
            rest = after.trim_start();
        }
    }
    let name = rest.trim_matches('"').trim();
    (!name.is_empty()).then(|| name.to_owned())
}

/// Phong parameters, mirror and glass from MTL's illumination models.
fn convert(source: &tobj::Material) -> Material {
    let specular = source.specular.unwrap_or([0.0; 3]).map(unit);
    let illumination = source.illumination_model.unwrap_or(2);
    let mut material = Material {
        albedo: source.diffuse.unwrap_or([0.6; 3]).map(unit),
        specular,
        shininess: source.shininess.unwrap_or(10.0).clamp(1.0, 10_000.0),
        emission: source.emissive.unwrap_or([0.0; 3]).map(|c| c.max(0.0)),
        ..Material::matte(&source.name, [0.0; 3])
    };
    material.transmission = transmission(source, illumination);
    if material.is_refractive() {
        let default_ior = if is_glass(illumination) { 1.5 } else { 1.0 };
        material.ior = source.optical_density.unwrap_or(default_ior).clamp(1.0, 4.0);
        material.tint = filter_color(source);
    } else if matches!(illumination, 3 | 5 | 8) {
        make_mirror(&mut material);
    }
    material
}

/// A mirror as strong as its brightest `Ks` and of its colour. Rough metal (low `Ns`) scatters instead: below
/// an exponent of 20 half of the mirror is gone.
fn make_mirror(material: &mut Material) {
    let strength = material.specular.into_iter().fold(0.0, f32::max);
    if strength <= 0.0 {
        return;
    }
    let polish = material.shininess / (material.shininess + 20.0);
    material.reflectivity = 0.95 * strength * polish;
    material.tint = material.specular.map(|c| c / strength);
    // The diffuse light of a rough metal has the metal's colour, though Phong's diffuse part is black in the file.
    let scattered = material.specular.map(|c| 0.4 * c);
    material.albedo = std::array::from_fn(|i| material.albedo[i].max(scattered[i]));
}

fn is_glass(illumination: u8) -> bool {
    matches!(illumination, 4 | 6 | 7 | 9)
}

/// Share of light that passes: one minus `d` (or `Tr`); 0.9 for a glass model that says nothing else. Less than
/// 0.05 counts as opaque.
fn transmission(source: &tobj::Material, illumination: u8) -> f32 {
    let by_tr = || source.unknown_param.get("Tr")?.parse::<f32>().ok().filter(|&tr| tr < 1.0);
    let share = match source.dissolve {
        Some(dissolve) => 1.0 - dissolve,
        None => by_tr().unwrap_or(0.0),
    };
    match share {
        s if s >= 0.05 => s.min(0.95),
        _ if is_glass(illumination) => 0.9,
        _ => 0.0,
    }
}

/// Hue of `Tf`. Files disagree whether it filters or absorbs, so its brightness says nothing.
fn filter_color(source: &tobj::Material) -> [f32; 3] {
    let words = source.unknown_param.get("Tf").map(String::as_str).unwrap_or_default();
    let values: Vec<f32> = words.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let brightest = values.iter().copied().fold(0.0, f32::max);
    match values[..] {
        [red, green, blue] if brightest > 0.0 => [red, green, blue].map(|c| unit(c / brightest)),
        _ => [1.0; 3],
    }
}

fn unit(value: f32) -> f32 {
    value.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn materials(text: &str) -> (Vec<Material>, Vec<String>) {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.mtl"), text).unwrap();
        let library = Library::read(&folder.path().join("a.obj"), &["a.mtl".to_owned()]);
        let Selection { materials, warnings, .. } = library.select(&[Some("m".to_owned())]);
        (materials, warnings)
    }

    fn material(lines: &str) -> Material {
        materials(&format!("newmtl m\n{lines}\n")).0.remove(0)
    }

    #[test]
    fn phong_parameters_are_read() {
        let m = material("Kd 0.1 0.2 0.3\r\n\tKs 0.5\r\nNs 30\r\nKe 2 3 4\r\nillum 2");
        assert_eq!((m.albedo, m.specular, m.shininess), ([0.1, 0.2, 0.3], [0.5; 3], 30.0));
        assert_eq!((m.emission, m.reflectivity, m.transmission), ([2.0, 3.0, 4.0], 0.0, 0.0));
    }

    #[test]
    fn metals_mirror_in_their_colour() {
        let gold = material("Kd 0 0 0\nKs 0.8 0.4 0.2\nNs 10000\nillum 3");
        assert!((gold.reflectivity - 0.76).abs() < 0.01, "{}", gold.reflectivity);
        assert_eq!(gold.tint, [1.0, 0.5, 0.25]);
        let iron = material("Ks 0.8 0.8 0.8\nNs 10\nillum 3");
        assert!(iron.reflectivity < 0.4 * gold.reflectivity.max(0.7));
        assert_eq!(material("Kd 1 1 1\nillum 3").reflectivity, 0.0, "no Ks, no mirror");
    }

    #[test]
    fn glass_is_told_by_model_or_opacity() {
        let glass = material("illum 7\nTf 0.1 0.1 0.05");
        assert_eq!((glass.transmission, glass.ior, glass.tint), (0.9, 1.5, [1.0, 1.0, 0.5]));
        let water = material("Ni 1.33\nd 0.4");
        assert!((water.transmission - 0.6).abs() < 1e-6 && water.ior == 1.33);
        assert_eq!(material("Tr 0.25").transmission, 0.25);
        assert_eq!(material("d 1\nTf 1 1 1\nTr 1").transmission, 0.0);
        assert_eq!(material("d 0.978").transmission, 0.0);
    }

    #[test]
    fn odd_lines_cost_only_themselves() {
        let m = material("Kd spectral file.rfl 1\nKs x\nNs\nillum two\nd -halo 0.5\nNi nan\nKe 1 1 1");
        assert_eq!((m.emission, m.specular, m.transmission), ([1.0; 3], [0.0; 3], 0.5));
    }

    #[test]
    fn the_image_name_follows_the_options() {
        for (text, name) in [
            ("wood.png", "wood.png"),
            ("-s 2 2 1 my wood.png", "my wood.png"),
            ("-s 2 -o 0.5 0.5 -clamp on \"a b.png\"", "a b.png"),
            ("-mm 0 1 -bm 0.3 -imfchan r a.png", "a.png"),
            ("-strange.png", "-strange.png"),
        ] {
            assert_eq!(image_name(text).as_deref(), Some(name), "{text}");
        }
        assert_eq!(image_name("-s 1 1 1"), None);
        assert_eq!(image_name(""), None);
    }

    #[test]
    fn a_byte_order_mark_is_skipped() {
        let (found, warnings) = materials("\u{feff}newmtl m\nKd 1 0 0\n");
        assert_eq!((found[0].albedo, warnings.len()), ([1.0, 0.0, 0.0], 0));
    }

    #[test]
    fn images_of_unused_materials_are_neither_read_nor_missed() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.mtl"), "newmtl m\nnewmtl other\nmap_Kd absent.png\n").unwrap();
        let library = Library::read(&folder.path().join("a.obj"), &["a.mtl".to_owned()]);
        let Selection { textures, warnings, .. } = library.select(&[Some("m".to_owned())]);
        assert_eq!((textures.len(), warnings.len()), (0, 0), "{warnings:?}");
    }

    #[test]
    fn missing_materials_are_named_and_replaced() {
        let (found, warnings) =
            materials("newmtl m\nmap_Kd maps\\absent.png\nnewmtl other\nmap_Kd maps/absent.png\n");
        assert_eq!(found[0].albedo_texture, Some(0));
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].contains("absent.png"));

        let (found, warnings) = materials("newmtl other\n");
        assert_eq!(found[0], Material::stand_in("m"));
        assert!(warnings[0].contains("`m`"));

        let library = Library::read(Path::new("/nowhere/a.obj"), &["absent.mtl".to_owned()]);
        assert!(library.select(&[]).warnings[0].contains("absent.mtl"));
    }

    #[test]
    fn normal_maps_are_read_where_they_are_wanted() {
        let folder = tempfile::tempdir().unwrap();
        image::RgbImage::from_pixel(2, 2, image::Rgb([128, 128, 255]))
            .save(folder.path().join("n.png"))
            .unwrap();
        let text =
            "newmtl a\nnorm n.png\nnewmtl b\nmap_Bump -bm 0.3 n.png\nnewmtl c\nbump absent.png\nnewmtl d\n";
        std::fs::write(folder.path().join("a.mtl"), text).unwrap();
        let library = || Library::read(&folder.path().join("a.obj"), &["a.mtl".to_owned()]);
        let names = ["a", "b", "c", "d"].map(|name| Some(name.to_owned()));
        let with = library().with_normal_maps().select(&names);
        let numbers =
            |found: &Selection| -> Vec<_> { found.materials.iter().map(|m| m.normal_map).collect() };
        assert_eq!(numbers(&with), [Some(0), Some(0), None, None]);
        assert_eq!((with.normal_maps.len(), with.warnings.len()), (1, 1), "{:?}", with.warnings);
        assert!(with.warnings[0].contains("absent.png"));
        let without = library().select(&names);
        assert_eq!((numbers(&without), without.normal_maps.len()), (vec![None; 4], 0));
        assert!(without.warnings.is_empty(), "{:?}", without.warnings);
    }
}
