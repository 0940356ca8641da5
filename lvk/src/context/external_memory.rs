//! Buffers and textures whose memory is shared by file descriptors.

use super::Context;
use super::create::NO_SLOT;
use super::holder::Holder;
use crate::error::{Error, Result};
use crate::gpu::memory::external::{MemoryFd, MemoryFdType};
use crate::handle::{BufferHandle, TextureHandle};
use crate::resource::buffer::BufferDesc;
use crate::resource::sharing::{Sharing, drm_layout};
use crate::resource::texture_desc::TextureDesc;
use crate::resource::{Buffer, Texture};

impl Context {
    /// Creates a buffer whose memory can be exported ([`export_buffer`](Self::export_buffer)).
    ///
    /// # Errors
    /// As [`create_buffer`](Self::create_buffer). [`Unsupported`](Error::Unsupported) where the device or its driver does
    /// not export such memory. [`InvalidUsage`](Error::InvalidUsage) for memory other than
    /// [`MemoryKind::Device`](crate::MemoryKind::Device).
    pub fn create_exportable_buffer(
        &self,
        desc: &BufferDesc<'_>,
        fd_type: MemoryFdType,
    ) -> Result<Holder<BufferHandle>> {
        let holder = self.new_shared_buffer(desc, Sharing::Export(fd_type))?;
        if let Some(data) = desc.data {
            self.upload_buffer(holder.handle(), 0, data)?;
        }
        Ok(holder)
    }

    /// Creates a texture whose memory can be exported ([`export_texture`](Self::export_texture)). A texture in a
    /// [`DmaBuf`](MemoryFdType::DmaBuf) is 2D, has a colour format, one mip, one sample and no view formats. The driver
    /// chooses its DRM format modifier.
    ///
    /// # Errors
    /// As [`create_texture`](Self::create_texture). [`Unsupported`](Error::Unsupported) where the device or its driver
    /// does not export such memory. [`InvalidUsage`](Error::InvalidUsage) for textures in Y'CbCr, for transient ones, and
    /// for a dma-buf with any other texture than named above.
    pub fn create_exportable_texture(
        &self,
        desc: &TextureDesc<'_>,
        fd_type: MemoryFdType,
    ) -> Result<Holder<TextureHandle>> {
        let holder = self.new_shared_texture(desc, Sharing::Export(fd_type))?;
        self.fill_texture(holder.handle(), desc)?;
        Ok(holder)
    }

    /// Exports the memory of a buffer (`vkGetMemoryFdKHR`). Each call returns a new file descriptor.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a buffer that was created without shared memory.
    pub fn export_buffer(&self, buffer: BufferHandle) -> Result<MemoryFd> {
        let (shared, buffer) = (self.device_state(), self.device_state().store.buffers.get(buffer)?);
        let refused =
            || Error::usage(&buffer.name, "create the buffer by create_exportable_buffer to export it");
        let (memory, fd_type) = buffer.shared_memory().ok_or_else(refused)?;
        Ok(MemoryFd {
            fd: shared.gpu.export_memory(&buffer.name, memory, fd_type)?,
            fd_type,
            allocation_bytes: memory.size,
            memory_type_index: memory.unmanaged_type().unwrap_or_default(),
            drm_layout: None,
        })
    }

    /// Exports the memory of a texture (`vkGetMemoryFdKHR`). Each call returns a new file descriptor.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a texture that was created without shared memory.
    pub fn export_texture(&self, texture: TextureHandle) -> Result<MemoryFd> {
        let (shared, texture) = (self.device_state(), self.device_state().store.textures.get(texture)?);
        let refused =
            || Error::usage(&texture.name, "create the texture by create_exportable_texture to export it");
        let image = &texture.image;
        let (memory, fd_type) = image.shared_memory().ok_or_else(refused)?;
        let layout = || drm_layout(&shared.gpu, image.raw, image.format.raw(), &texture.name);
        Ok(MemoryFd {
            fd: shared.gpu.export_memory(&texture.name, memory, fd_type)?,
            fd_type,
            allocation_bytes: memory.size,
            memory_type_index: memory.unmanaged_type().unwrap_or_default(),
            drm_layout: (fd_type == MemoryFdType::DmaBuf).then(layout).transpose()?,
        })
    }

    /// Creates a buffer in imported memory (`VkImportMemoryFdInfoKHR`). The buffer keeps the memory alive, whatever the
    /// exporter does. [`CommandBuffer::acquire_external_buffer`](crate::CommandBuffer::acquire_external_buffer) makes the
    /// contents available.
    ///
    /// # Safety
    /// The description equals that of the exporter: size, usage, and for opaque memory the device and its driver. The
    /// values of `memory` are those of its export. All accesses by others are ordered by semaphores.
    ///
    /// # Errors
    /// As [`create_exportable_buffer`](Self::create_exportable_buffer), and [`InvalidUsage`](Error::InvalidUsage) for
    /// initial data, for memory that is too small or of a type that no such buffer has, and for a file descriptor that
    /// the driver does not know. The file descriptor is closed then.
    pub unsafe fn import_buffer_memory(
        &self,
        desc: &BufferDesc<'_>,
        memory: MemoryFd,
    ) -> Result<Holder<BufferHandle>> {
        check_no_data(desc.debug_name, desc.data.is_some())?;
        self.new_shared_buffer(desc, Sharing::Import(memory))
    }

    /// Creates a texture in imported memory (`VkImportMemoryFdInfoKHR`). The texture keeps the memory alive, whatever the
    /// exporter does. [`CommandBuffer::acquire_external_texture`](crate::CommandBuffer::acquire_external_texture) makes
    /// the contents available.
    ///
    /// # Safety
    /// As [`import_buffer_memory`](Self::import_buffer_memory). The description equals that of the exporter: kind,
    /// format, extent, mips, samples, usage and view formats.
    ///
    /// # Errors
    /// As [`create_exportable_texture`](Self::create_exportable_texture) and
    /// [`import_buffer_memory`](Self::import_buffer_memory), and [`InvalidUsage`](Error::InvalidUsage) for a dma-buf
    /// without its [`DrmLayout`](crate::DrmLayout).
    pub unsafe fn import_texture_memory(
        &self,
        desc: &TextureDesc<'_>,
        memory: MemoryFd,
    ) -> Result<Holder<TextureHandle>> {
        check_no_data(desc.debug_name, desc.data.is_some() || desc.generate_mips)?;
        self.new_shared_texture(desc, Sharing::Import(memory))
    }

    fn new_shared_buffer(&self, desc: &BufferDesc<'_>, sharing: Sharing) -> Result<Holder<BufferHandle>> {
        let buffer = Buffer::with_shared_memory(&self.device_state().gpu, desc, sharing)?;
        Ok(Holder::new(self, self.device_state().store.buffers.insert(buffer), NO_SLOT))
    }

    fn new_shared_texture(&self, desc: &TextureDesc<'_>, sharing: Sharing) -> Result<Holder<TextureHandle>> {
        let gpu = &self.device_state().gpu;
        self.add_texture(desc, |slot| Texture::with_shared_memory(gpu, desc, sharing, slot))
    }
}

fn check_no_data(name: &str, has_data: bool) -> Result<()> {
    if has_data {
        return Err(Error::usage(
            name,
            "imported memory has its contents; upload others once the object is imported",
        ));
    }
    Ok(())
}
