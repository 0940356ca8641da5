//! Loading of files.

mod accessors;
mod attributes;
mod budget;
mod buffers;
mod container;
mod document;
mod extensions;
mod files;
mod images;
mod ktx2_texels;
mod materials;
mod meshes;
mod meshopt;
mod motion;
mod parallel;
mod place;
mod scan;
mod scene;
mod source;
mod textures;
mod topology;
mod vertices;

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

pub use self::document::SUPPORTED_EXTENSIONS;

use self::accessors::Accessors;
use self::budget::Budget;
use self::buffers::Buffers;
use self::container::Container;
use self::document::Document;
use self::files::Files;
use self::images::Images;
use self::place::place;
use self::source::Source;
use self::textures::Textures;
use crate::{Error, Image, ImageData, Mesh, Model, Node, Problem, Result, Warning};

/// How to load a model.
#[derive(Clone, Copy, Default)]
pub struct LoadOptions<'a> {
    /// The most memory that the load takes.
    pub memory: MemoryLimit,
    /// Called from time to time, in the thread that loads. `Break` stops the load with [`Problem::Stopped`].
    pub on_progress: Option<&'a dyn Fn(Progress) -> ControlFlow<()>>,
    /// Most threads that decode meshes and images, that of the caller among them. `None`: as many as there are cores.
    pub most_threads: Option<usize>,
}

/// Most memory of a load and of its model: a fixed part and a multiple of the bytes of the files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryLimit {
    /// Bytes for every file. Small files may hold large images.
    pub fixed_bytes: u64,
    /// Bytes for each byte of the file, and of the buffers and images that it names.
    pub multiple: u64,
}

/// How far a load is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// What is being done.
    pub step: &'static str,
    /// Objects of this step that are done.
    pub done: usize,
    /// Objects of this step.
    pub total: usize,
}

impl Default for MemoryLimit {
    /// One GiB and 64 bytes for each byte.
    fn default() -> Self {
        Self { fixed_bytes: 1 << 30, multiple: 64 }
    }
}

impl Model {
    /// Reads a `.gltf` or `.glb` file. Its content says which of the two it is. Buffers and images that it names by a
    /// relative path are read from its folder and the folders inside of it. Vertices are read as they are decoded, a mesh at a time:
    /// the bytes of the file are never in memory as a whole.
    ///
    /// # Errors
    /// [`Error`], if a file cannot be read, breaks a rule of the format, requires an unknown extension, or would take more
    /// memory than [`LoadOptions::memory`].
    pub fn load(path: &Path, options: &LoadOptions<'_>) -> Result<Self> {
        let budget = Budget::new(options.memory);
        let folder = path.parent().unwrap_or(Path::new(""));
        let file = files::open(path, &budget);
        let model = file.and_then(|file| load(file.whole(), Some(folder), options, &budget));
        model.map_err(|problem| Error { file: place::shortened_path(path), problem })
    }

    /// Reads the bytes of a `.gltf` or `.glb` file. Other files that it names are read from `folder`; without a folder it
    /// may not name any.
    ///
    /// # Errors
    /// As [`Model::load`].
    pub fn from_bytes(bytes: &[u8], folder: Option<&Path>, options: &LoadOptions<'_>) -> Result<Self> {
        let budget = Budget::new(options.memory);
        budget.add_file(bytes.len() as u64);
        load(Source::Memory(bytes), folder, options, &budget)
            .map_err(|problem| Error { file: "model".into(), problem })
    }
}

fn load(
    file: Source<'_>,
    folder: Option<&Path>,
    options: &LoadOptions<'_>,
    budget: &Budget,
) -> Result<Model, Problem> {
    let Container { json, bin } = Container::read(file)?;
    let document = Document::parse(&json, budget)?;
    drop(json);
    let files = Files::new(folder);
    let buffers = Buffers::read(&document, bin, &files, budget)?;
    let accessors = Accessors { document: &document, buffers: &buffers, budget };
    let root = &document.root;

    let mut warnings = document.warnings();
    let mut textures = Textures::new(&document);
    let materials = materials::read_materials(&document, &mut textures, &mut warnings)?;
    let read_mesh = |index| meshes::read_mesh(accessors, &materials, index);
    let meshes = parallel::map("meshes", root.meshes.len(), options, read_mesh)?;
    let meshes = warn(meshes, &mut warnings);
    let nodes = scene::read_nodes(accessors, &mut warnings)?;
    check_weights(&nodes, &meshes)?;
    let skins = motion::read_skins(accessors)?;
    motion::check_joints(&nodes, &meshes, &skins)?;
    let animations = motion::read_animations(accessors, &nodes, &meshes, &mut warnings)?;
    let images = Images { document: &document, buffers: &buffers, files: &files, budget };
    let images = read_images(images, &textures, options, &mut warnings)?;
    let model = Model {
        scenes: scene::read_scenes(root, &nodes)?,
        default_scene: root.scene.map(|scene| scene.value()).or((!root.scenes.is_empty()).then_some(0)),
        nodes,
        meshes,
        materials,
        images,
        samplers: textures.samplers,
        cameras: scene::read_cameras(root)?,
        lights: scene::read_lights(root, &mut warnings)?,
        skins,
        animations,
        warnings,
    };
    check_transforms(&model)?;
    Ok(model)
}

/// Separates results and their warnings.
fn warn<T>(results: Vec<(T, Vec<Warning>)>, warnings: &mut Vec<Warning>) -> Vec<T> {
    let separate = |(result, more): (T, Vec<Warning>)| {
        warnings.extend(more);
        result
    };
    results.into_iter().map(separate).collect()
}

/// Decodes each image that is used once, whether as colour, as data, or as both.
fn read_images(
    images: Images<'_>,
    textures: &Textures<'_>,
    options: &LoadOptions<'_>,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Image>, Problem> {
    let mut sources: Vec<usize> = textures.images.iter().map(|(source, _)| *source).collect();
    sources.sort_unstable();
    sources.dedup();
    let decoded = parallel::map("images", sources.len(), options, |number| images.decode(sources[number]))?;
    let decoded: Vec<Arc<ImageData>> = warn(decoded, warnings).into_iter().map(Arc::new).collect();
    let image = |(source, color_space): &(usize, crate::ColorSpace)| {
        let number = sources.partition_point(|other| other < source);
        let name = images.document.root.images[*source].name.clone();
        Image { name, source: *source, color_space: *color_space, data: Arc::clone(&decoded[number]) }
    };
    Ok(textures.images.iter().map(image).collect())
}

/// Checks the weights of nodes against the morph targets of their meshes.
fn check_weights(nodes: &[Node], meshes: &[Mesh]) -> Result<(), Problem> {
    for (index, node) in nodes.iter().enumerate().filter(|(_, node)| !node.weights.is_empty()) {
        let targets = node.mesh.map_or(0, |mesh| meshes[mesh].weights.len());
        meshes::check_weights(&node.weights, targets, &place("node", index, node.name.as_deref()))?;
    }
    Ok(())
}

/// Checks that products of transforms are finite. Numbers of a file may be as large as floats are.
fn check_transforms(model: &Model) -> Result<(), Problem> {
    let pose = model.pose(None, 0.0);
    let Some(index) = pose.world.iter().position(|matrix| !matrix.is_finite()) else { return Ok(()) };
    let place = place("node", index, model.nodes[index].name.as_deref());
    Err(Problem::NotFinite { place, what: "the product of the transforms of its ancestors".into() })
}
