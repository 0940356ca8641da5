//! Semaphores that other devices, processes and APIs share by file descriptors.

use std::os::fd::{AsRawFd, IntoRawFd, OwnedFd};
use std::sync::Arc;

use ash::vk;

use super::Context;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::gpu::memory::external::owned_fd;

/// Kind of a semaphore (`VkSemaphoreType`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SemaphoreKind {
    /// Signalled and unsignalled; one wait follows each signal.
    Binary,
    /// A counter that rises.
    Timeline,
}

/// Type of the file descriptor that shares a semaphore (`VkExternalSemaphoreHandleTypeFlagBits`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SemaphoreFdType {
    /// The semaphore itself, for the same driver on the same device
    /// (`VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_OPAQUE_FD_BIT`).
    Opaque,
    /// One pending signal of a binary semaphore, as a Linux sync file
    /// (`VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_SYNC_FD_BIT`). An export takes the signal away, as a wait does.
    SyncFile,
}

impl SemaphoreFdType {
    fn raw(self) -> vk::ExternalSemaphoreHandleTypeFlags {
        match self {
            Self::Opaque => vk::ExternalSemaphoreHandleTypeFlags::OPAQUE_FD,
            Self::SyncFile => vk::ExternalSemaphoreHandleTypeFlags::SYNC_FD,
        }
    }
}

/// Description of a semaphore for [`Context::create_shared_semaphore`] and [`Context::import_semaphore`].
#[derive(Debug, Clone, Copy)]
pub struct SharedSemaphoreDesc<'a> {
    /// Kind. Default: [`SemaphoreKind::Binary`].
    pub kind: SemaphoreKind,
    /// Type of the file descriptor. Default: [`SemaphoreFdType::Opaque`].
    pub fd_type: SemaphoreFdType,
    /// Name in error messages, validation messages and debuggers. Default: `"shared semaphore"`.
    pub debug_name: &'a str,
}

impl Default for SharedSemaphoreDesc<'_> {
    fn default() -> Self {
        Self { kind: SemaphoreKind::Binary, fd_type: SemaphoreFdType::Opaque, debug_name: "shared semaphore" }
    }
}

/// A semaphore that is shared by file descriptors, destroyed on drop. Drop it after [`Context::wait_idle`], when every
/// submission that uses it is done.
pub struct SharedSemaphore {
    raw: vk::Semaphore,
    kind: SemaphoreKind,
    fd_type: SemaphoreFdType,
    /// True if it was created here, for export.
    exportable: bool,
    name: Box<str>,
    gpu: Arc<Gpu>,
}

impl std::fmt::Debug for SharedSemaphore {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { raw, kind, fd_type, name, .. } = self;
        out.debug_struct("SharedSemaphore")
            .field("name", name)
            .field("raw", raw)
            .field("kind", kind)
            .field("fd_type", fd_type)
            .finish()
    }
}

impl Context {
    /// Creates a semaphore that [`SharedSemaphore::export`] exports (`VkExportSemaphoreCreateInfo`). A timeline begins
    /// at 0.
    ///
    /// # Errors
    /// [`Unsupported`](Error::Unsupported) where the device or its driver does not export such a semaphore;
    /// [`InvalidUsage`](Error::InvalidUsage) for the sync file of a timeline.
    pub fn create_shared_semaphore(&self, desc: &SharedSemaphoreDesc<'_>) -> Result<SharedSemaphore> {
        let gpu = &self.device_state().gpu;
        check_semaphore(gpu, desc, vk::ExternalSemaphoreFeatureFlags::EXPORTABLE)?;
        let export = vk::ExportSemaphoreCreateInfo::default().handle_types(desc.fd_type.raw());
        SharedSemaphore::new(gpu, desc, Some(export))
    }

    /// Creates a semaphore from the file descriptor of another device, process or API (`vkImportSemaphoreFdKHR`). A
    /// [`SyncFile`](SemaphoreFdType::SyncFile) allows one wait; `None` is a sync file whose signal has come.
    ///
    /// # Safety
    /// The file descriptor was exported from a semaphore of this kind as this type; opaque ones by this driver on this
    /// device.
    ///
    /// # Errors
    /// As [`create_shared_semaphore`](Self::create_shared_semaphore), for the import; [`InvalidUsage`](Error::InvalidUsage)
    /// for a file descriptor that the driver does not know, and for none of an opaque semaphore. The file descriptor is
    /// closed then.
    pub unsafe fn import_semaphore(
        &self,
        desc: &SharedSemaphoreDesc<'_>,
        fd: Option<OwnedFd>,
    ) -> Result<SharedSemaphore> {
        // Vulkan's number for a sync file whose signal has come.
        const SIGNALLED: i32 = -1;
        let (gpu, name) = (&self.device_state().gpu, desc.debug_name);
        if fd.is_none() && desc.fd_type != SemaphoreFdType::SyncFile {
            let message =
                "only a sync file may be signalled and have no file descriptor; give it that of its export";
            return Err(Error::usage(name, message));
        }
        check_semaphore(gpu, desc, vk::ExternalSemaphoreFeatureFlags::IMPORTABLE)?;
        let semaphore = SharedSemaphore::new(gpu, desc, None)?;
        let flags = match desc.fd_type {
            SemaphoreFdType::Opaque => vk::SemaphoreImportFlags::empty(),
            SemaphoreFdType::SyncFile => vk::SemaphoreImportFlags::TEMPORARY,
        };
        let info = vk::ImportSemaphoreFdInfoKHR::default()
            .semaphore(semaphore.raw)
            .flags(flags)
            .handle_type(desc.fd_type.raw())
            .fd(fd.as_ref().map_or(SIGNALLED, AsRawFd::as_raw_fd));
        // SAFETY: the semaphore is new; the caller promises the rest.
        unsafe { functions(gpu).import_semaphore_fd(&info) }.map_err(|result| match result {
            vk::Result::ERROR_INVALID_EXTERNAL_HANDLE => Error::usage(
                name,
                "the file descriptor is no semaphore of its type that this device can import; export it by the same \
                 driver as this type",
            ),
            other => Error::vulkan("vkImportSemaphoreFdKHR", name)(other),
        })?;
        // The driver owns the file descriptor now.
        let _ = fd.map(IntoRawFd::into_raw_fd);
        Ok(semaphore)
    }
}

impl SharedSemaphore {
    fn new(
        gpu: &Arc<Gpu>,
        desc: &SharedSemaphoreDesc<'_>,
        export: Option<vk::ExportSemaphoreCreateInfo<'_>>,
    ) -> Result<Self> {
        let SharedSemaphoreDesc { kind, fd_type, debug_name } = *desc;
        let exportable = export.is_some();
        let mut export = export;
        let mut ty = vk::SemaphoreTypeCreateInfo::default().semaphore_type(raw_kind(kind));
        let mut info = vk::SemaphoreCreateInfo::default().push_next(&mut ty);
        if let Some(export) = &mut export {
            info = info.push_next(export);
        }
        // SAFETY: the description is valid, and the handle type is checked.
        let raw = unsafe { gpu.device.create_semaphore(&info, None) }
            .map_err(Error::vulkan("vkCreateSemaphore", debug_name))?;
        gpu.name(raw, debug_name);
        Ok(Self { raw, kind, fd_type, exportable, name: debug_name.into(), gpu: Arc::clone(gpu) })
    }

    /// Returns the semaphore for [`RawWait`](crate::RawWait) and [`RawSignal`](crate::RawSignal) of
    /// [`Context::submit_with`].
    pub fn raw(&self) -> vk::Semaphore {
        self.raw
    }

    /// Returns the kind of the semaphore.
    pub fn kind(&self) -> SemaphoreKind {
        self.kind
    }

    /// Exports the semaphore (`vkGetSemaphoreFdKHR`). Each call returns a new file descriptor, or `None` for a
    /// [`SyncFile`](SemaphoreFdType::SyncFile) whose signal has come, so that no wait is needed: drivers may return either.
    ///
    /// # Safety
    /// A semaphore that is exported as [`SyncFile`](SemaphoreFdType::SyncFile) has a pending signal, and no waiter.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for an imported semaphore; [`Vulkan`](Error::Vulkan) for an error of the
    /// driver, such as too many open files.
    pub unsafe fn export(&self) -> Result<Option<OwnedFd>> {
        if !self.exportable {
            return Err(Error::usage(
                &*self.name,
                "it was imported; export the one that its exporter created",
            ));
        }
        let info = vk::SemaphoreGetFdInfoKHR::default().semaphore(self.raw).handle_type(self.fd_type.raw());
        // SAFETY: the semaphore was created for export as this type; the caller promises the rest.
        let fd = unsafe { functions(&self.gpu).get_semaphore_fd(&info) }
            .map_err(Error::vulkan("vkGetSemaphoreFdKHR", &self.name))?;
        // SAFETY: Vulkan gives the caller a new file descriptor, or -1.
        match unsafe { owned_fd(fd) } {
            None if self.fd_type != SemaphoreFdType::SyncFile => {
                Err(Error::vulkan("vkGetSemaphoreFdKHR", &self.name)(vk::Result::ERROR_UNKNOWN))
            }
            fd => Ok(fd),
        }
    }
}

impl Drop for SharedSemaphore {
    fn drop(&mut self) {
        // SAFETY: submissions with raw semaphores are unsafe, and their callers keep the semaphores alive.
        unsafe { self.gpu.device.destroy_semaphore(self.raw, None) };
    }
}

fn functions(gpu: &Gpu) -> ash::khr::external_semaphore_fd::Device {
    ash::khr::external_semaphore_fd::Device::new(&gpu.instance.raw, &gpu.device)
}

fn raw_kind(kind: SemaphoreKind) -> vk::SemaphoreType {
    match kind {
        SemaphoreKind::Binary => vk::SemaphoreType::BINARY,
        SemaphoreKind::Timeline => vk::SemaphoreType::TIMELINE,
    }
}

/// Fails unless the driver shares such semaphores in this direction.
fn check_semaphore(
    gpu: &Gpu,
    desc: &SharedSemaphoreDesc<'_>,
    direction: vk::ExternalSemaphoreFeatureFlags,
) -> Result<()> {
    let SharedSemaphoreDesc { kind, fd_type, debug_name } = *desc;
    if kind == SemaphoreKind::Timeline && fd_type == SemaphoreFdType::SyncFile {
        let message = "a sync file holds a binary semaphore; share a timeline as Opaque";
        return Err(Error::usage(debug_name, message));
    }
    let what = format!("the shared {kind:?} semaphore '{debug_name}'");
    gpu.require(OptionalFeature::ExternalSemaphoreFd, &what)?;
    let mut ty = vk::SemaphoreTypeCreateInfo::default().semaphore_type(raw_kind(kind));
    let info =
        vk::PhysicalDeviceExternalSemaphoreInfo::default().handle_type(fd_type.raw()).push_next(&mut ty);
    let mut found = vk::ExternalSemaphoreProperties::default();
    // SAFETY: the physical device belongs to the instance.
    unsafe {
        let instance = &gpu.instance.raw;
        instance.get_physical_device_external_semaphore_properties(gpu.physical(), &info, &mut found);
    }
    if found.external_semaphore_features.contains(direction) {
        return Ok(());
    }
    Err(Error::unsupported(
        what,
        format!("the driver does not share it as {fd_type:?}; take another type or kind"),
    ))
}
