//! The work that runs before the next submission: uploads, builds of acceleration structures and others.

use std::sync::Arc;

use super::Context;
use crate::command::CommandBuffer;
use crate::cpu_scope::cpu_scope;
use crate::device_state::DeferredObject;
use crate::error::Result;
use crate::lock_order::Guard;
use crate::queue::Queue;
use crate::resource::region::{Region, TextureRegion};
use crate::resource::{Buffer, Texture};
use crate::submit::SubmitHandle;
use crate::upload::PendingUploads;
use crate::upload::staging::STAGING;

/// The work that runs before the next submission.
#[derive(Default)]
pub(super) struct Prologue {
    /// Uploads that run after `commands`.
    uploads: PendingUploads,
    commands: Option<CommandBuffer>,
    /// The last submission made to free staging memory.
    made_room: SubmitHandle,
}

impl Context {
    /// Records into the command buffer that runs before the next submission. Its earlier commands stay there even if
    /// `record` fails.
    pub(crate) fn record_in_prologue<T>(
        &self,
        record: impl FnOnce(&mut CommandBuffer) -> Result<T>,
    ) -> Result<T> {
        let mut pending = self.lock_prologue();
        let cmd = self.prologue_command_buffer(&mut pending)?;
        let result = record(cmd);
        // This command buffer runs before the next submission, so commands recorded from now on may rely on it.
        cmd.apply_tlas_updates();
        result
    }

    /// Returns the command buffer that runs before the next submission, with all uploads so far. Clears the TLAS table
    /// entries of freed slots first, because the next commands may belong to new owners of these slots.
    pub(super) fn prologue_command_buffer<'a>(
        &self,
        pending: &'a mut Prologue,
    ) -> Result<&'a mut CommandBuffer> {
        let cmd = match &mut pending.commands {
            Some(cmd) => cmd,
            none => {
                let mut recording = self.device_state().submitter.acquire(Queue::Graphics)?;
                recording.labels.set_name("uploads and builds");
                none.insert(self.new_command_buffer(Queue::Graphics, recording))
            }
        };
        let freed = std::mem::take(&mut *self.device_state().freed_tlas_slots());
        cmd.clear_tlas_entries(&freed);
        self.drop_dead_uploads(&mut pending.uploads);
        if !pending.uploads.is_empty() {
            cmd.record_uploads(std::mem::take(&mut pending.uploads))?;
        }
        Ok(cmd)
    }

    /// Takes the command buffer that runs before the next submission, if there is pending work.
    pub(super) fn take_prologue(&self, pending: &mut Prologue) -> Result<Option<CommandBuffer>> {
        self.drop_dead_uploads(&mut pending.uploads);
        if !pending.uploads.is_empty() {
            self.prologue_command_buffer(pending)?;
        }
        Ok(pending.commands.take())
    }

    /// Drops uploads to destroyed textures, which need no contents.
    fn drop_dead_uploads(&self, uploads: &mut PendingUploads) {
        for gone in uploads.drain_dead() {
            self.device_state().free_now(DeferredObject::TextureRef(gone));
        }
    }

    /// Writes bytes of a buffer before the next submission. The bytes are copied before the lock is taken.
    pub(super) fn upload_to_buffer(&self, target: &Arc<Buffer>, offset: u64, bytes: &[u8]) -> Result<()> {
        cpu_scope!("upload buffer");
        // Adjacent uploads are thereby adjacent in staging memory too, and become one copy.
        const ALIGNMENT: u64 = 4;
        target.check_range(offset, bytes.len() as u64)?;
        if bytes.is_empty() {
            return Ok(());
        }
        let staged = self.device_state().staging.keep_region(bytes, ALIGNMENT);
        let staged = staged.map_err(|error| error.with_owner(STAGING, &target.name))?;
        let mut pending = self.lock_prologue();
        pending.uploads.add_buffer_upload(target, offset, bytes.len() as u64, staged);
        self.flush_if_over_budget(pending)
    }

    /// Writes tightly packed texels before the next submission. The texels are copied before the lock is taken.
    pub(super) fn upload_texture_object(
        &self,
        target: &Arc<Texture>,
        region: &TextureRegion,
        bytes: &[u8],
    ) -> Result<()> {
        cpu_scope!("upload texture");
        if let Some(place) = &target.image.transient_place {
            return Err(place.not_begun(&target.name));
        }
        let region = target.check_upload(region, bytes.len() as u64)?;
        self.upload_region(target, region, bytes)
    }

    /// Uploads like [`upload_texture_object`](Self::upload_texture_object), for `bytes` of exactly the size of the
    /// region.
    pub(super) fn upload_region(&self, target: &Arc<Texture>, region: Region, bytes: &[u8]) -> Result<()> {
        // A multiple of 16 suits texels and blocks of every size.
        const ALIGNMENT: u64 = 16;
        target.image.add_texture()?;
        let staged = self.device_state().staging.keep_region(bytes, ALIGNMENT);
        let staged = staged.map_err(|error| {
            target.image.remove_texture();
            error.with_owner(STAGING, &target.name)
        })?;
        let mut pending = self.lock_prologue();
        pending.uploads.add_texture_upload(Arc::clone(target), region, bytes.len() as u64, staged);
        self.flush_if_over_budget(pending)
    }

    /// Makes a new texture without contents readable by shaders.
    pub(super) fn make_texture_visible(&self, texture: &Arc<Texture>) -> Result<()> {
        texture.image.add_texture()?;
        self.lock_prologue().uploads.add_new_texture(Arc::clone(texture));
        Ok(())
    }

    /// Submits uploads that fill half of the staging memory, so that this half is copied while the caller fills the
    /// other half. If the GPU is slower than the caller, waits for the previous half.
    fn flush_if_over_budget(&self, pending: Guard<'_, Prologue>) -> Result<()> {
        if pending.uploads.bytes() < self.device_state().staging.half_bytes() {
            return Ok(());
        }
        drop(pending);
        let submitted = self.flush()?;
        let before = std::mem::replace(&mut self.lock_prologue().made_room, submitted);
        self.wait(before)
    }

    pub(super) fn lock_prologue(&self) -> Guard<'_, Prologue> {
        self.inner.prologue.lock()
    }
}
