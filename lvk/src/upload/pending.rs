//! Uploads that wait for the next submission, as plain values.

use std::sync::Arc;

use ash::vk;

use super::copy_regions::{CopyRegion, CopyRegions};
use super::staging::StagingRegion;
use crate::barrier::{IdMap, ResourceId, Subresources};
use crate::resource::region::Region;
use crate::resource::{Buffer, Texture};

/// Uploads in order. Those of one buffer are merged.
#[derive(Default)]
pub(crate) struct PendingUploads {
    pub(crate) buffers: Vec<BufferUploads>,
    index_by_id: IdMap<usize>,
    pub(crate) textures: Vec<TextureUpload>,
    pub(crate) pages: Vec<UsedPage>,
    bytes: u64,
}

/// Pending writes to a buffer.
pub(crate) struct BufferUploads {
    pub(crate) target: Arc<Buffer>,
    pub(crate) regions: CopyRegions,
}

/// A pending write to a texture, or the initialisation of a new one.
pub(crate) struct TextureUpload {
    pub(crate) target: Arc<Texture>,
    /// A region with its bytes; `None` for a new texture without contents, which shaders may read nevertheless.
    pub(crate) texels: Option<(Region, StagingRegion)>,
}

impl BufferUploads {
    /// Returns true if the buffer was destroyed and the GPU is done with it. Then no other reference exists or can be
    /// created.
    pub(crate) fn is_dead(&self) -> bool {
        Arc::strong_count(&self.target) == 1
    }
}

impl TextureUpload {
    /// Returns true as [`BufferUploads::is_dead`] does, for all textures of the image. An image with two pending
    /// uploads stays, which is harmless.
    fn is_dead(&self) -> bool {
        Arc::strong_count(&self.target) == 1 && Arc::strong_count(&self.target.image) == 1
    }
}

/// A page of staging memory, with the number of its regions to read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct UsedPage {
    pub(crate) page: usize,
    pub(crate) raw: vk::Buffer,
    pub(crate) count: u32,
}

impl PendingUploads {
    pub(crate) fn is_empty(&self) -> bool {
        self.buffers.is_empty() && self.textures.is_empty() && self.pages.is_empty()
    }

    /// Removes the uploads of destroyed textures, and returns these textures.
    pub(crate) fn drain_dead(&mut self) -> impl Iterator<Item = Arc<Texture>> {
        self.textures.extract_if(.., |upload| upload.is_dead()).map(|upload| upload.target)
    }

    /// Returns the number of pending staged bytes.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Adds a write of staged bytes to a buffer. It overwrites earlier pending writes.
    pub(crate) fn add_buffer_upload(
        &mut self,
        target: &Arc<Buffer>,
        offset: u64,
        bytes: u64,
        staged: StagingRegion,
    ) {
        let row = *self.index_by_id.entry(target.id).or_insert_with(|| {
            self.buffers.push(BufferUploads { target: Arc::clone(target), regions: CopyRegions::default() });
            self.buffers.len() - 1
        });
        let piece = CopyRegion { target: offset, bytes, page: staged.page, source: staged.offset };
        self.buffers[row].regions.add(piece);
        self.count_page_use(staged, bytes);
    }

    /// Adds a write of staged bytes to a region of a texture.
    pub(crate) fn add_texture_upload(
        &mut self,
        target: Arc<Texture>,
        region: Region,
        bytes: u64,
        staged: StagingRegion,
    ) {
        self.textures.push(TextureUpload { target, texels: Some((region, staged)) });
        self.count_page_use(staged, bytes);
    }

    /// Adds a new texture without contents, to make it readable.
    pub(crate) fn add_new_texture(&mut self, target: Arc<Texture>) {
        self.textures.push(TextureUpload { target, texels: None });
    }

    fn count_page_use(&mut self, staged: StagingRegion, bytes: u64) {
        self.bytes += bytes;
        match self.pages.iter_mut().rev().find(|used| used.page == staged.page) {
            Some(used) => used.count += 1,
            None => self.pages.push(UsedPage { page: staged.page, raw: staged.buffer, count: 1 }),
        }
    }
}

/// Splits writes of image parts into rounds in which no part is written twice. Returns the end of each round.
pub(crate) fn write_round_ends(
    parts: impl IntoIterator<Item = Option<(ResourceId, Subresources)>>,
) -> Vec<usize> {
    let mut ends = Vec::new();
    let mut written: IdMap<Vec<Subresources>> = IdMap::default();
    let mut count = 0;
    for (place, part) in parts.into_iter().enumerate() {
        count = place + 1;
        let Some((id, part)) = part else { continue };
        let before = written.entry(id).or_default();
        if before.iter().any(|other| other.intersection(part).is_some()) {
            ends.push(place);
            written.clear();
            written.insert(id, vec![part]);
        } else {
            before.push(part);
        }
    }
    ends.push(count);
    ends
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_round_writes_no_part_twice_and_ends_only_where_it_must(
            writes in prop::collection::vec(prop::option::of((0..3_u64, 0..4_u32, 1..3_u32, 0..3_u32)), 0..40)
        ) {
            let parts: Vec<_> = writes
                .iter()
                .map(|write| {
                    let (id, base_mip, mip_count, base_layer) = (*write)?;
                    Some((ResourceId(id), Subresources { base_mip, mip_count, base_layer, layer_count: 1 }))
                })
                .collect();
            let overlap = |a: usize, b: usize| match (parts[a], parts[b]) {
                (Some((a, x)), Some((b, y))) => a == b && x.intersection(y).is_some(),
                _ => false,
            };
            let (mut start, ends) = (0, write_round_ends(parts.iter().copied()));
            prop_assert_eq!(ends.last(), Some(&parts.len()));
            for end in ends {
                prop_assert!((start..end).all(|a| (start..a).all(|b| !overlap(a, b))));
                if end < parts.len() {
                    prop_assert!((start..end).any(|before| overlap(before, end)));
                }
                start = end;
            }
        }
    }
}
