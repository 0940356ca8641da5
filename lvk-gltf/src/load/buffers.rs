//! Buffers and buffer views, compressed ones decoded.

use super::budget::Budget;
use super::document::Document;
use super::extensions::Meshopt;
use super::files::{Files, Resolved};
use super::meshopt;
use super::place::place;
use super::source::Source;
use crate::Problem;

/// All buffers.
#[derive(Debug)]
pub(super) struct Buffers<'a> {
    buffers: Vec<Buffer<'a>>,
    /// Decoded bytes of each view that is compressed.
    decoded: Vec<Option<Vec<u8>>>,
}

/// Where the bytes of a buffer are.
#[derive(Debug)]
enum Buffer<'a> {
    Glb(Source<'a>),
    Uri(Resolved),
}

impl Buffer<'_> {
    fn source(&self) -> Source<'_> {
        match self {
            Self::Glb(source) => *source,
            Self::Uri(resolved) => resolved.source(),
        }
    }
}

impl<'a> Buffers<'a> {
    /// Opens all buffers, and decodes all views that are compressed.
    pub(super) fn read(
        document: &Document,
        bin: Option<Source<'a>>,
        files: &Files<'_>,
        budget: &Budget,
    ) -> Result<Self, Problem> {
        let mut buffers = Vec::new();
        for index in 0..document.root.buffers.len() {
            buffers.push(read_buffer(document, index, bin, files, budget)?);
        }
        let mut buffers = Self { buffers, decoded: Vec::new() };
        for (index, view) in document.extensions.buffer_views.iter().enumerate() {
            let meshopt = view.extensions.meshopt.as_ref();
            let decoded =
                meshopt.map(|meshopt| buffers.decode(document, index, meshopt, budget)).transpose()?;
            buffers.decoded.push(decoded);
        }
        Ok(buffers)
    }

    /// Returns the bytes of a view.
    pub(super) fn view(&self, document: &Document, index: usize) -> Result<Source<'_>, Problem> {
        if let Some(Some(decoded)) = self.decoded.get(index) {
            return Ok(Source::Memory(decoded));
        }
        let Some(view) = document.root.buffer_views.get(index) else {
            let count = document.root.buffer_views.len() as u64;
            return Err(Problem::OutOfRange {
                place: "the file".into(),
                what: "buffer view",
                index: index as u64,
                count,
            });
        };
        let offset = view.byte_offset.map_or(0, |offset| offset.0);
        self.bytes(view.buffer.value(), offset, view.byte_length.0, &|| format!("buffer view {index}"))
    }

    fn bytes(
        &self,
        buffer: usize,
        offset: u64,
        length: u64,
        place: &dyn Fn() -> String,
    ) -> Result<Source<'_>, Problem> {
        let Some(bytes) = self.buffers.get(buffer).map(Buffer::source) else {
            let (index, count) = (buffer as u64, self.buffers.len() as u64);
            return Err(Problem::OutOfRange { place: place(), what: "buffer", index, count });
        };
        let end = u128::from(offset) + u128::from(length);
        bytes.part(offset, length).ok_or_else(|| Problem::Truncated {
            place: place(),
            end,
            what: format!("buffer {buffer}"),
            length: bytes.length(),
        })
    }

    fn decode(
        &self,
        document: &Document,
        index: usize,
        meshopt: &Meshopt,
        budget: &Budget,
    ) -> Result<Vec<u8>, Problem> {
        let place = || format!("buffer view {index}");
        let damaged = |why| Problem::Compressed { place: place(), codec: "meshopt compression", why };
        meshopt::check(meshopt).map_err(damaged)?;
        let data = self.bytes(meshopt.buffer as usize, meshopt.byte_offset, meshopt.byte_length, &place)?;
        let data = budget.read(data, place)?;
        let size = meshopt.count.saturating_mul(meshopt.byte_stride);
        let wanted = document.root.buffer_views.get(index).map_or(0, |view| view.byte_length.0);
        if size != wanted {
            return Err(damaged("the count and the stride do not give the length of the buffer view"));
        }
        let mut elements = budget.list(size, place)?;
        elements.resize(size as usize, 0);
        meshopt::decode(meshopt, &data, &mut elements).map_err(damaged)?;
        Ok(elements)
    }
}

/// Finds the bytes of a buffer. A buffer that only stands for those who cannot decode is empty.
fn read_buffer<'a>(
    document: &Document,
    index: usize,
    bin: Option<Source<'a>>,
    files: &Files<'_>,
    budget: &Budget,
) -> Result<Buffer<'a>, Problem> {
    let buffer = &document.root.buffers[index];
    let extensions = document.extensions.buffers.get(index).map(|buffer| &buffer.extensions);
    let is_fallback = extensions.and_then(|all| all.meshopt.as_ref()).is_some_and(|meshopt| meshopt.fallback);
    let name = || place("buffer", index, buffer.name.as_deref());
    let bytes = match (&buffer.uri, bin) {
        _ if is_fallback => return Ok(Buffer::Glb(Source::Memory(&[]))),
        (Some(uri), _) => Buffer::Uri(files.resolve(uri, budget, &name)?),
        (None, Some(bin)) if index == 0 => Buffer::Glb(bin),
        (None, _) => {
            let rule = "it has neither a URI nor the data of a GLB".into();
            return Err(Problem::Rule { place: name(), rule });
        }
    };
    let length = buffer.byte_length.0;
    let has = bytes.source().length();
    if length > has {
        let end = u128::from(length);
        return Err(Problem::Truncated { place: name(), end, what: "its data".into(), length: has });
    }
    Ok(bytes)
}
