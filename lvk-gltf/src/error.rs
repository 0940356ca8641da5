//! Errors of loading a model.

use std::io;

/// Result of a load.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A file that cannot be loaded. The message names the file, the object in it, and what to change.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {problem}")]
pub struct Error {
    /// The file, as given, or `model` for bytes in memory.
    pub file: String,
    /// The problem.
    pub problem: Problem,
}

/// Why a file cannot be loaded.
///
/// `place` is the object in the file, such as `mesh 3 'Body', primitive 1, accessor 12`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// The load was stopped by [`LoadOptions::on_progress`](crate::LoadOptions::on_progress).
    #[error("the load was stopped")]
    Stopped,
    /// The file, or one that it names, cannot be read.
    #[error("cannot read {name}: {source}")]
    File {
        /// The file.
        name: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file is neither glTF JSON nor GLB.
    #[error("it is not glTF 2.0: it begins neither with '{{' nor with 'glTF'")]
    NotGltf,
    /// The version of the format is not 2.
    #[error("it has version {version} of glTF, and only 2 can be read; export it as glTF 2.0")]
    Version {
        /// The version that the file states.
        version: String,
    },
    /// The GLB container is damaged or cut off.
    #[error("the GLB container is damaged: {what}; copy or export the file again")]
    Container {
        /// What is wrong.
        what: String,
    },
    /// The JSON is damaged, or is not that of glTF.
    #[error("the JSON is not that of glTF: {what}; export the file again")]
    Json {
        /// What is wrong, with line and column.
        what: String,
    },
    /// The file requires an extension that the loader does not know.
    #[error("it requires the extension {extension}, which is not supported; export it without{remedy}")]
    RequiredExtension {
        /// Name of the extension.
        extension: String,
        /// A further remedy, or nothing.
        remedy: &'static str,
    },
    /// The load would take more memory than it may.
    #[error(
        "{place} takes {bytes} bytes, more than the {left} that are left of {limit} for a file of this size; \
         if the file is right, raise LoadOptions::memory"
    )]
    Memory {
        /// The object.
        place: String,
        /// Bytes that it takes.
        bytes: u64,
        /// Bytes that are left.
        left: u64,
        /// Bytes for the whole load.
        limit: u64,
    },
    /// A path or data URI cannot be used.
    #[error("{place}: the URI '{uri}' {why}")]
    Uri {
        /// The buffer or image.
        place: String,
        /// The start of the URI.
        uri: String,
        /// What is wrong, and the remedy.
        why: &'static str,
    },
    /// Data is shorter than what refers to it: the file is cut off, or an offset, a count or a length is wrong.
    #[error("{place} ends at byte {end} of {what}, which has {length}; the file is cut off or damaged")]
    Truncated {
        /// The object.
        place: String,
        /// Where it ends.
        end: u128,
        /// What it lies in.
        what: String,
        /// Bytes of that.
        length: u64,
    },
    /// A reference, an index of a vertex or a joint is out of range.
    #[error("{place}: {what} {index} is out of range, as there are {count}; export the file again")]
    OutOfRange {
        /// The object.
        place: String,
        /// What is referred to.
        what: &'static str,
        /// The index.
        index: u64,
        /// Number of what is referred to.
        count: u64,
    },
    /// An accessor has a type that its use does not allow.
    #[error("{place} has the type {found}, but {wanted} is needed; export the file again")]
    AccessorType {
        /// The accessor and its use.
        place: String,
        /// Its type.
        found: String,
        /// The types that are allowed.
        wanted: &'static str,
    },
    /// Two lists that belong together differ in length.
    #[error("{place} has {found} entries, but {wanted} are needed; export the file again")]
    Count {
        /// The list.
        place: String,
        /// Its entries.
        found: u64,
        /// Entries that are needed.
        wanted: u64,
    },
    /// A number is NaN or infinite.
    #[error("{place}: {what} is not finite (NaN or infinity, or beyond 3.4e38); export the file again")]
    NotFinite {
        /// The object.
        place: String,
        /// The number.
        what: String,
    },
    /// Nodes do not form trees: a node is its own ancestor or has two parents.
    #[error("{place} {what}; nodes must form trees, so export the file again")]
    Hierarchy {
        /// The node.
        place: String,
        /// What is wrong.
        what: String,
    },
    /// An image cannot be decoded.
    #[error("{place}: {why}")]
    Image {
        /// The image.
        place: String,
        /// The reason, and the remedy.
        why: String,
    },
    /// Compressed data cannot be decoded.
    #[error("{place}: the data of {codec} is damaged ({why}); compress the file again")]
    Compressed {
        /// The buffer view.
        place: String,
        /// The codec.
        codec: &'static str,
        /// What is wrong.
        why: &'static str,
    },
    /// Another rule of the format is broken.
    #[error("{place}: {rule}; export the file again")]
    Rule {
        /// The object.
        place: String,
        /// The rule, or what breaks it.
        rule: String,
    },
}
