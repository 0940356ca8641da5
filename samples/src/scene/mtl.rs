//! Reads MTL libraries: Phong parameters, mirrors, glass and textures.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use lvk::{readable_bytes, readable_name};

use super::Material;
use super::byte_names::{FileFinder, names_in, path_of, unquoted, why_absent};
use super::image_name::{Absence, Image};
use super::mtl_text::{self, MapOptions, MtlEntry};
use super::texcoord_mapping::Mapping;
use super::text_lines::decoded;
use super::text_numbers::words;
use super::texture::{PictureBudget, Texture};
use super::warnings::Warnings;
use crate::app::input_file::{self, FileKind};

/// Materials by name, and the images they use.
#[derive(Default)]
pub(super) struct Library {
    /// Definitions by the rest of their `newmtl` line.
    materials: HashMap<Vec<u8>, Definition>,
    /// The rest of a `newmtl` line by its part in front of what may be a comment.
    shortened: HashMap<Vec<u8>, Vec<u8>>,
    textures: Vec<Texture>,
    texture_numbers: HashMap<(PathBuf, Option<PathBuf>), u32>,
    wants_normal_maps: bool,
    has_vertex_colors: bool,
    normal_maps: Vec<Texture>,
    /// `None` for images that cannot be read.
    normal_map_numbers: HashMap<PathBuf, Option<u32>>,
    budget: PictureBudget,
    warnings: Warnings,
    /// The folder of the OBJ file.
    folder: PathBuf,
    finder: Rc<FileFinder>,
}

/// Result of [`Library::select`].
pub(super) struct Selection {
    pub(super) materials: Vec<Material>,
    /// Changes of the texture coordinates of each material.
    pub(super) mappings: Vec<Option<Mapping>>,
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
    mapping: Option<Mapping>,
    /// Options of its image that are not applied.
    ignored_options: Vec<String>,
}

impl Library {
    /// Reads the libraries that the OBJ file at `obj_path` names. A missing library is a warning.
    pub(super) fn read(obj_path: &Path, arguments: &[Vec<u8>]) -> Self {
        let folder = obj_path.parent().unwrap_or(Path::new(""));
        let finder = Rc::new(FileFinder::default());
        let mut library = Self { folder: folder.into(), finder: finder.clone(), ..Self::default() };
        let mut seen = HashSet::new();
        let mut is_missing = false;
        for name in arguments.iter().flat_map(|argument| library_names(&finder, folder, argument)) {
            let found = finder.find(&[folder], &name, &[]);
            if !seen.insert(found.clone().unwrap_or_else(|| folder.join(path_of(&name)))) {
                continue;
            }
            match found {
                Some(file) => library.read_file(&file),
                None => {
                    let path = folder.join(path_of(&name));
                    library.warn_of_library(&path, &why_absent(&path, FileKind::Mtl));
                    is_missing = true;
                }
            }
        }
        let is_read = seen.contains(&obj_path.with_extension("mtl"));
        if is_missing && !is_read { library.with_namesake_of(obj_path) } else { library }
    }

    /// Reads the library that has the name of the OBJ file too, if there is one: both may have been renamed.
    pub(super) fn with_namesake_of(mut self, obj_path: &Path) -> Self {
        let path = obj_path.with_extension("mtl");
        if path.is_file() {
            let line = format!(
                "the material library {} has the name of the OBJ file; it is read",
                readable_name(&path)
            );
            self.warnings.push("namesakes", line);
            self.read_file(&path);
        }
        self
    }

    /// Materials have their normal maps too.
    pub(super) fn with_normal_maps(self) -> Self {
        Self { wants_normal_maps: true, ..self }
    }

    /// The mesh has colours, which a surface without a material shows as they are.
    pub(super) fn with_vertex_colors(self) -> Self {
        Self { has_vertex_colors: true, ..self }
    }

    fn read_file(&mut self, path: &Path) {
        let content = match input_file::read(path, FileKind::Mtl) {
            Ok(content) => content,
            Err(error) => return self.warn_of_library(path, &error.to_string()),
        };
        let (entries, flawed_lines) = mtl_text::parse(&decoded(&content));
        for line in flawed_lines {
            let text = format!("{}:{line}: a number is not finite; the line is ignored", readable_name(path));
            self.warnings.push("numbers of materials", text);
        }
        entries.iter().for_each(|entry| self.add(entry, path));
    }

    fn warn_of_library(&mut self, path: &Path, why: &str) {
        let line = format!("material library {}: {why}; materials are stand-ins", readable_name(path));
        self.warnings.push("material libraries", line);
    }

    fn add(&mut self, entry: &MtlEntry, path: &Path) {
        if self.materials.contains_key(&entry.name) {
            return;
        }
        for name in names_in(&entry.name).skip(1) {
            self.shortened.entry(name.to_vec()).or_insert_with(|| entry.name.clone());
        }
        let folders = Rc::new([path.parent().unwrap_or(Path::new("")).to_path_buf(), self.folder.clone()]);
        let mut material = convert(entry);
        let image =
            |name: &Option<Vec<u8>>| name.as_ref().map(|name| Image::new(&folders, &self.finder, name));
        let relief = image(&entry.relief_map);
        let (image, mask) = (image(&entry.diffuse_map), image(&entry.dissolve_map));
        // Exporters often leave Kd black beside a texture, meaning the texture alone.
        if image.is_some() && material.albedo == [0.0; 3] && !material.is_refractive() {
            material.albedo = [1.0; 3];
        }
        let MapOptions { scale, offset, ignored } = entry.diffuse_options.clone();
        let is_mapped = [scale, offset] != [[1.0; 2], [0.0; 2]];
        let mapping = is_mapped.then_some(Mapping { scale, offset });
        let definition = Definition { material, image, mask, relief, mapping, ignored_options: ignored };
        self.materials.insert(entry.name.clone(), definition);
    }

    /// Number of the image, which is read on first use; a stand-in and a warning when that fails.
    fn texture(&mut self, image: &Image, mask: Option<PathBuf>) -> u32 {
        let found = image.find();
        let path = found.as_ref().unwrap_or_else(|absence| &absence.path).clone();
        let key = (file_identity(&path), mask.as_deref().map(file_identity));
        if let Some(&number) = self.texture_numbers.get(&key) {
            return number;
        }
        let texture = match &found {
            Ok(path) => Texture::read(path, &mut self.budget),
            Err(absence) => Err(absence.why.clone()),
        };
        let texture = texture.unwrap_or_else(|why| {
            let line = format!("texture {}: {why}; magenta checks stand in", readable_name(&path));
            self.warnings.push("textures", line);
            Texture::stand_in(&readable_name(&path))
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
    fn normal_map(&mut self, image: &Image) -> Option<u32> {
        let found = image.find();
        let path = found.as_ref().unwrap_or_else(|absence| &absence.path).clone();
        let key = file_identity(&path);
        if let Some(&number) = self.normal_map_numbers.get(&key) {
            return number;
        }
        let read = match &found {
            Ok(path) => Texture::read_relief(path, &mut self.budget),
            Err(absence) => Err(absence.why.clone()),
        };
        let number = match read {
            Ok(map) => {
                self.normal_maps.push(map);
                Some(self.normal_maps.len() as u32 - 1)
            }
            Err(why) => {
                let line = format!("normal map {}: {why}; the surface is smooth", readable_name(&path));
                self.warnings.push("textures", line);
                None
            }
        };
        self.normal_map_numbers.insert(key, number);
        number
    }

    /// The file of the mask; none, and a warning, when there is none.
    fn mask_file(&mut self, mask: &Image) -> Option<PathBuf> {
        mask.find().map_err(|Absence { path, why }| self.warn_of_mask(&path, &why)).ok()
    }

    fn warn_of_mask(&mut self, path: &Path, why: &str) {
        self.warnings.push("textures", format!("mask {}: {why}; there are no holes", readable_name(path)));
    }

    /// The texture with alpha from the mask; as it is, with a warning, where the mask cannot be read.
    fn with_holes(&mut self, texture: Texture, mask: &Path) -> Texture {
        match Texture::read(mask, &mut self.budget) {
            Ok(mask) => {
                self.budget.give_back(&mask);
                texture.masked(&mask)
            }
            Err(why) => {
                self.warn_of_mask(mask, &why);
                texture
            }
        }
    }

    /// The materials that `names` ask for, in that order, with stand-ins for undefined ones; then the images
    /// of these and the warnings.
    pub(super) fn select(mut self, names: &[Option<Vec<u8>>]) -> Selection {
        let mut selected = Vec::with_capacity(names.len());
        let mapping = |name: &Option<Vec<u8>>| self.definition(name.as_deref()?)?.mapping;
        let mappings = names.iter().map(mapping).collect();
        for name in names {
            let Some(name) = name else {
                let albedo = if self.has_vertex_colors { 1.0 } else { 0.6 };
                selected.push(Material::matte("(none)", [albedo; 3]));
                continue;
            };
            selected.push(self.material(name));
        }
        let Self { textures, normal_maps, mut warnings, budget, .. } = self;
        budget.into_warnings().into_iter().for_each(|line| warnings.push("pictures", line));
        Selection { materials: selected, mappings, textures, normal_maps, warnings: warnings.into_lines() }
    }

    /// The definition that the rest of a `usemtl` line names.
    fn definition(&self, name: &[u8]) -> Option<&Definition> {
        let whole =
            |name: &[u8]| self.materials.get(name).or_else(|| self.materials.get(self.shortened.get(name)?));
        names_in(name).find_map(whole)
    }

    /// True if a name leads to a definition only where a comment is taken off both.
    fn is_guessed(&self, name: &[u8]) -> bool {
        let is_whole = names_in(name).any(|name| self.materials.contains_key(name));
        !is_whole && !self.shortened.contains_key(name.trim_ascii())
    }

    fn material(&mut self, name: &[u8]) -> Material {
        let Some(definition) = self.definition(name).cloned() else {
            let name = readable_bytes(name);
            let line = format!("material `{name}` is not defined; glaring orange stands in");
            self.warnings.push("materials", line);
            return Material::stand_in(&name);
        };
        if self.is_guessed(name) {
            let (name, taken) = (readable_bytes(name), &definition.material.name);
            let line =
                format!("material `{name}` is not defined; `{taken}` is taken, which is equal up to a `#`");
            self.warnings.push("materials", line);
        }
        let Definition { material, image, mask, relief, .. } = definition;
        for option in definition.ignored_options {
            let line = format!("material `{}`: the option `{option}` of its image is ignored", material.name);
            self.warnings.push("options of images", line);
        }
        let mask = mask.filter(|_| image.is_some()).and_then(|mask| self.mask_file(&mask));
        let is_masked = mask.is_some();
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

/// The names that a `mtllib` argument holds: one, which may hold blanks, or several.
fn library_names(finder: &FileFinder, folder: &Path, argument: &[u8]) -> Vec<Vec<u8>> {
    let exists = |name: &&[u8]| finder.find(&[folder], unquoted(name), &[]).is_some();
    let is_as_written = |name: &[u8]| folder.join(path_of(unquoted(name))).is_file();
    let parts: Vec<&[u8]> = words(argument).map(unquoted).collect();
    let owned = |parts: &[&[u8]]| parts.iter().map(|part| part.to_vec()).collect();
    if parts.len() > 1 && !names_in(argument).any(is_as_written) && parts.iter().all(&exists) {
        return owned(&parts);
    }
    match names_in(argument).find(&exists) {
        Some(whole) => owned(&[unquoted(whole)]),
        None if parts.iter().any(exists) => owned(&parts),
        None => owned(&[unquoted(argument)]),
    }
}

/// Phong parameters, mirror and glass from MTL's illumination models.
fn convert(entry: &MtlEntry) -> Material {
    let illumination = entry.illumination.unwrap_or(2);
    let specular = entry.specular.filter(|_| has_highlight(entry)).unwrap_or([0.0; 3]).map(unit);
    let mut material = Material {
        albedo: entry.diffuse.unwrap_or([0.6; 3]).map(unit),
        specular,
        shininess: entry.shininess.unwrap_or(10.0).clamp(1.0, 10_000.0),
        emission: entry.emissive.unwrap_or([0.0; 3]).map(|c| c.max(0.0)),
        ..Material::matte(&readable_bytes(&entry.name), [0.0; 3])
    };
    material.transmission = transmission(entry, illumination);
    if material.is_refractive() {
        let default_ior = if is_glass(illumination) { 1.5 } else { 1.0 };
        material.ior = entry.optical_density.unwrap_or(default_ior).clamp(1.0, 4.0);
        material.tint = filter_color(entry);
    } else if matches!(illumination, 3 | 5 | 8) {
        make_mirror(&mut material);
    }
    material
}

/// Models 0 and 1 have no highlight. An exponent of 0 would make one as large as the surface: exporters write it for none.
fn has_highlight(entry: &MtlEntry) -> bool {
    match entry.illumination {
        Some(0 | 1) => false,
        Some(3 | 5 | 8) => true,
        _ => entry.shininess != Some(0.0),
    }
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

/// Share of light that passes: one minus `d` (or `Tr`), and for a glass model without either what `Ni` and `Tf` say. Less than 0.05
/// counts as opaque.
fn transmission(entry: &MtlEntry, illumination: u8) -> f32 {
    let by_tr = entry.transparency.filter(|&tr| tr < 1.0).unwrap_or(0.0);
    let share = entry.dissolve.map_or(by_tr, |dissolve| 1.0 - dissolve);
    match share {
        s if s >= 0.05 => s.min(0.95),
        _ if is_glass(illumination) => transmission_of_glass(entry, illumination),
        _ => 0.0,
    }
}

/// 0.9, but for the opaque materials that exporters give a glass model. Maya writes model 4 with `Ni 1.00` for all materials,
/// and `Tf` as one minus their transparency; Cinema 4D writes model 4 with `d 1`.
fn transmission_of_glass(entry: &MtlEntry, illumination: u8) -> f32 {
    let bends = entry.optical_density.is_none_or(|density| density > 1.0);
    let is_said = entry.dissolve.is_some() || entry.transparency == Some(0.0);
    let is_said_opaque = is_said && (!bends || matches!(illumination, 4 | 9));
    match entry.filter {
        _ if is_said_opaque => 0.0,
        _ if bends => 0.9,
        filter => match 1.0 - filter.unwrap_or([1.0; 3]).into_iter().fold(0.0, f32::max) {
            share if share >= 0.05 => share.min(0.95),
            _ => 0.0,
        },
    }
}

/// Hue of `Tf`. Files disagree whether it filters or absorbs, so its brightness says nothing.
fn filter_color(entry: &MtlEntry) -> [f32; 3] {
    let values = entry.filter.unwrap_or([1.0; 3]);
    let brightest = values.into_iter().fold(0.0, f32::max);
    if brightest > 0.0 { values.map(|c| unit(c / brightest)) } else { [1.0; 3] }
}

fn unit(value: f32) -> f32 {
    value.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn materials(text: impl AsRef<[u8]>) -> (Vec<Material>, Vec<String>) {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.mtl"), text.as_ref()).unwrap();
        let library = Library::read(&folder.path().join("a.obj"), &[b"a.mtl".to_vec()]);
        let Selection { materials, warnings, .. } = library.select(&[Some(b"m".to_vec())]);
        (materials, warnings)
    }

    fn material(lines: &str) -> Material {
        materials(format!("newmtl m\n{lines}\n")).0.remove(0)
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
    fn a_byte_order_mark_is_skipped() {
        let (found, warnings) = materials("\u{feff}newmtl m\nKd 1 0 0\n");
        assert_eq!((found[0].albedo, warnings.len()), ([1.0, 0.0, 0.0], 0));
    }

    #[test]
    fn images_of_unused_materials_are_neither_read_nor_missed() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.mtl"), "newmtl m\nnewmtl other\nmap_Kd absent.png\n").unwrap();
        let library = Library::read(&folder.path().join("a.obj"), &[b"a.mtl".to_vec()]);
        let Selection { textures, warnings, .. } = library.select(&[Some(b"m".to_vec())]);
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

        let folder = tempfile::tempdir().unwrap();
        image::RgbImage::new(1, 1).save(folder.path().join("t.png")).unwrap();
        std::fs::write(folder.path().join("a.mtl"), "newmtl m\nmap_Kd t.png\nmap_d absent.png\n").unwrap();
        let library = Library::read(&folder.path().join("a.obj"), &[b"a.mtl".to_vec()]);
        let found = library.select(&[Some(b"m".to_vec())]);
        assert!(found.warnings[0].contains("absent.png: no such file; there are no holes"));
        assert!(!found.materials[0].is_masked);

        let library = Library::read(Path::new("/nowhere/a.obj"), &[b"absent.mtl".to_vec()]);
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
        let library = || Library::read(&folder.path().join("a.obj"), &[b"a.mtl".to_vec()]);
        let names = ["a", "b", "c", "d"].map(|name| Some(name.as_bytes().to_vec()));
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

    /// Names of the materials that `usemtl` lines get from a library with `text`.
    fn names(text: &[u8], asked: &[&[u8]]) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.mtl"), text).unwrap();
        let library = Library::read(&folder.path().join("a.obj"), &[b"a.mtl".to_vec()]);
        let names: Vec<_> = asked.iter().map(|name| Some(name.to_vec())).collect();
        library.select(&names).materials.into_iter().map(|material| material.name).collect()
    }

    #[test]
    fn names_are_compared_as_bytes() {
        let text = b"newmtl M\xe4\nKd 1 0 0\nnewmtl M\xf6\nKd 0 1 0\n";
        assert_eq!(names(text, &[b"M\xf6", b"M\xe4"]), ["M\\xf6", "M\\xe4"]);
        let stand_in = names(text, &["M\u{f6}".as_bytes()]);
        assert_eq!(stand_in, ["M\u{f6}"], "UTF-8 is another name");
    }

    #[test]
    fn comments_end_names_unless_the_whole_name_exists() {
        assert_eq!(
            names(b"newmtl wall # north\n", &[b"wall", b"wall # other", b"wall # north"]),
            ["wall # north"; 3]
        );
        let two = b"newmtl wall #1\nnewmtl wall #2\nnewmtl wall\n";
        assert_eq!(names(two, &[b"wall #2", b"wall #1", b"wall # x"]), ["wall #2", "wall #1", "wall"]);
    }

    #[test]
    fn comments_end_names_of_images_and_libraries() {
        let folder = tempfile::tempdir().unwrap();
        let save = |name: &str, red| {
            image::RgbImage::from_pixel(1, 1, image::Rgb([red, 0, 0]))
                .save(folder.path().join(name))
                .unwrap();
        };
        save("wood.png", 1);
        save("wood #2.png", 2);
        let text = "newmtl a\nmap_Kd wood.png # oak\nnewmtl b\nmap_Kd -s 1 1 \"wood #2.png\" # ash\nnewmtl c\nmap_Kd wood #2.png\n";
        std::fs::write(folder.path().join("my lib.mtl"), text).unwrap();
        let library = Library::read(&folder.path().join("a.obj"), &[b"my lib.mtl # materials".to_vec()]);
        let found = library.select(&[b"a", b"b", b"c"].map(|name| Some(name.to_vec())));
        assert_eq!(found.warnings, Vec::<String>::new());
        let reds: Vec<u8> = found
            .materials
            .iter()
            .map(|m| found.textures[m.albedo_texture.unwrap() as usize].pixels[0])
            .collect();
        assert_eq!(reds, [1, 2, 2]);
    }

    #[test]
    fn foreign_paths_and_other_capitals_lead_to_libraries() {
        let folder = tempfile::tempdir().unwrap();
        let units = "newmtl m\nKd 1 0 0\n".encode_utf16().flat_map(u16::to_le_bytes);
        let utf_16: Vec<u8> = [0xff, 0xfe].into_iter().chain(units).collect();
        for content in [b"newmtl m\nKd 1 0 0\n".to_vec(), b"newmtl m\rKd 1 0 0\r".to_vec(), utf_16] {
            std::fs::write(folder.path().join("a.mtl"), content).unwrap();
            for argument in
                ["a.mtl", "A.MTL", "C:\\Users\\x\\Desktop\\a.mtl", "\"a.mtl\"", "b.mtl /tmp/no/A.mtl"]
            {
                let library = Library::read(&folder.path().join("a.obj"), &[argument.as_bytes().to_vec()]);
                let found = library.select(&[Some(b"m".to_vec())]);
                assert_eq!(found.materials[0].albedo, [1.0, 0.0, 0.0], "{argument}");
            }
        }
    }

    #[test]
    fn a_line_may_name_several_libraries() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("x")).unwrap();
        for (name, text) in
            [("x/one.mtl", "newmtl a\n"), ("x/two.mtl", "newmtl b\n"), ("x/one two.mtl", "newmtl c\n")]
        {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        for (argument, defined) in [
            ("x/one.mtl x/two.mtl", vec!["a", "b"]),
            ("x/one.mtl x\\TWO.mtl # both", vec!["a", "b"]),
            ("x/one.mtl y/no.mtl", vec!["a"]),
            ("x/one two.mtl", vec!["c"]),
        ] {
            let library = Library::read(&folder.path().join("a.obj"), &[argument.as_bytes().to_vec()]);
            let found: Vec<_> = ["a", "b", "c"]
                .into_iter()
                .filter(|name| library.definition(name.as_bytes()).is_some())
                .collect();
            assert_eq!(found, defined, "{argument}");
        }
    }

    #[test]
    fn lines_with_numbers_that_are_not_finite_are_named() {
        let (found, warnings) = materials("newmtl m\nKd 1 1 1\nKd -1.#IND00 0 0\n");
        assert_eq!(found[0].albedo, [1.0; 3]);
        assert!(warnings.len() == 1 && warnings[0].contains("a.mtl:3"), "{warnings:?}");
    }
}
