//! Buffers and buffer views, compressed ones decoded.

use std::borrow::Cow;

use super::budget::Budget;
use super::document::Document;
use super::extensions::Meshopt;
use super::files::Files;
use super::meshopt;
use super::place::place;
use crate::Problem;

/// The bytes of all buffers.
#[derive(Debug)]
pub(super) struct Buffers<'a> {
    buffers: Vec<Cow<'a, [u8]>>,
    /// Decoded bytes of each view that is compressed.
    decoded: Vec<Option<Vec<u8>>>,
}

impl<'a> Buffers<'a> {
    /// Reads all buffers, and decodes all views.
    pub(super) fn read(
        document: &Document,
        bin: Option<&'a [u8]>,
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
    pub(super) fn view(&self, document: &Document, index: usize) -> Result<&[u8], Problem> {
        if let Some(Some(decoded)) = self.decoded.get(index) {
            return Ok(decoded);
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
    ) -> Result<&[u8], Problem> {
        let Some(bytes) = self.buffers.get(buffer) else {
            let (index, count) = (buffer as u64, self.buffers.len() as u64);
            return Err(Problem::OutOfRange { place: place(), what: "buffer", index, count });
        };
        let end = u128::from(offset) + u128::from(length);
        let range = usize::try_from(offset).ok().zip(usize::try_from(end).ok());
        range.and_then(|(start, end)| bytes.get(start..end)).ok_or_else(|| Problem::Truncated {
            place: place(),
            end,
            what: format!("buffer {buffer}"),
            length: bytes.len() as u64,
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
        let size = meshopt.count.saturating_mul(meshopt.byte_stride);
        let wanted = document.root.buffer_views.get(index).map_or(0, |view| view.byte_length.0);
        if size != wanted {
            return Err(damaged("the count and the stride do not give the length of the buffer view"));
        }
        let mut elements = budget.list(size, place)?;
        elements.resize(size as usize, 0);
        meshopt::decode(meshopt, data, &mut elements).map_err(damaged)?;
        Ok(elements)
    }
}

/// Returns the bytes of a buffer. A buffer that only stands for those who cannot decode is empty.
fn read_buffer<'a>(
    document: &Document,
    index: usize,
    bin: Option<&'a [u8]>,
    files: &Files<'_>,
    budget: &Budget,
) -> Result<Cow<'a, [u8]>, Problem> {
    let buffer = &document.root.buffers[index];
    let extensions = document.extensions.buffers.get(index).map(|buffer| &buffer.extensions);
    let is_fallback = extensions.and_then(|all| all.meshopt.as_ref()).is_some_and(|meshopt| meshopt.fallback);
    let name = || place("buffer", index, buffer.name.as_deref());
    let bytes = match (&buffer.uri, bin) {
        _ if is_fallback => return Ok(Cow::Borrowed(&[])),
        (Some(uri), _) => Cow::Owned(files.resolve(uri, budget, &name)?),
        (None, Some(bin)) if index == 0 => Cow::Borrowed(bin),
        (None, _) => {
            let rule = "it has neither a URI nor the data of a GLB".into();
            return Err(Problem::Rule { place: name(), rule });
        }
    };
    let length = buffer.byte_length.0;
    if length > bytes.len() as u64 {
        let (end, has) = (u128::from(length), bytes.len() as u64);
        return Err(Problem::Truncated { place: name(), end, what: "its data".into(), length: has });
    }
    Ok(bytes)
}
