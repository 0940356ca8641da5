//! An acceleration structure: its Vulkan object, its memory, and what it was built from.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;
use bitflags::bitflags;

use super::geometry::BlasGeometry;
use crate::barrier::ResourceId;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};

bitflags! {
    /// What a build is optimised for, and what may be done with the structure later.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub struct BuildFlags: u32 {
        /// Rays are traced as fast as possible; the build may take longer.
        const FAST_TRACE = 1;
        /// The build is as fast as possible; for structures built every frame.
        const FAST_BUILD = 1 << 1;
        /// The structure may be refitted after its inputs moved.
        const ALLOW_UPDATE = 1 << 2;
        /// The structure takes little memory.
        const LOW_MEMORY = 1 << 3;
    }
}

impl Default for BuildFlags {
    fn default() -> Self {
        Self::FAST_TRACE
    }
}

impl BuildFlags {
    pub(crate) fn raw(self) -> vk::BuildAccelerationStructureFlagsKHR {
        use vk::BuildAccelerationStructureFlagsKHR as Raw;
        let pairs = [
            (Self::FAST_TRACE, Raw::PREFER_FAST_TRACE),
            (Self::FAST_BUILD, Raw::PREFER_FAST_BUILD),
            (Self::ALLOW_UPDATE, Raw::ALLOW_UPDATE),
            (Self::LOW_MEMORY, Raw::LOW_MEMORY),
        ];
        pairs.iter().filter(|(bit, _)| self.contains(*bit)).fold(Raw::empty(), |all, (_, raw)| all | *raw)
    }

    /// Fails where two flags contradict each other.
    pub(crate) fn check(self, name: &str) -> Result<()> {
        if self.contains(Self::FAST_TRACE | Self::FAST_BUILD) {
            return Err(Error::usage(name, "choose either FAST_TRACE or FAST_BUILD"));
        }
        Ok(())
    }
}

/// Bytes an acceleration structure takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AccelStructSizes {
    /// Bytes of the structure itself.
    pub structure_bytes: u64,
    /// Bytes of scratch memory of a build.
    pub build_scratch_bytes: u64,
    /// Bytes of scratch memory of a refit; 0 without [`BuildFlags::ALLOW_UPDATE`].
    pub update_scratch_bytes: u64,
}

/// Whether a build starts anew or moves what is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum BuildMode {
    /// A whole new build: best quality, and the number of instances may change.
    #[default]
    Rebuild,
    /// Moves the boxes of the present tree. Needs [`BuildFlags::ALLOW_UPDATE`] and unchanged counts.
    Refit,
}

/// An acceleration structure, destroyed on drop.
pub(crate) struct AccelStruct {
    pub(crate) raw: vk::AccelerationStructureKHR,
    pub(crate) id: ResourceId,
    pub(crate) address: u64,
    pub(crate) flags: BuildFlags,
    pub(crate) sizes: AccelStructSizes,
    pub(crate) name: String,
    pub(crate) kind: AccelKind,
    _storage: Buffer,
    ext: ash::khr::acceleration_structure::Device,
}

/// What differs between the two levels.
pub(crate) enum AccelKind {
    /// A bottom-level structure.
    Blas(Blas),
    /// A top-level structure.
    Tlas(Tlas),
}

/// What a bottom-level structure is built from.
pub(crate) struct Blas {
    pub(crate) geometries: Vec<BlasGeometry>,
    /// The matrices of the geometries, 48 bytes for each.
    pub(crate) transforms: Option<Buffer>,
}

/// What a top-level structure shows.
pub(crate) struct Tlas {
    pub(crate) slot: u32,
    pub(crate) capacity: u32,
    contents: Mutex<TlasContents>,
}

/// The instances of the last build submitted.
#[derive(Default)]
pub(crate) struct TlasContents {
    /// `None` before the first build is submitted.
    pub(crate) instance_count: Option<u32>,
    /// The structures the instances refer to, kept alive as long as they are.
    pub(crate) blas: Vec<Arc<AccelStruct>>,
}

impl Tlas {
    pub(crate) fn new(slot: u32, capacity: u32) -> Self {
        Self { slot, capacity, contents: Mutex::default() }
    }

    pub(crate) fn contents(&self) -> MutexGuard<'_, TlasContents> {
        self.contents.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl AccelStruct {
    /// Makes the object with memory of its own; nothing is built yet.
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        name: &str,
        flags: BuildFlags,
        sizes: AccelStructSizes,
        kind: AccelKind,
    ) -> Result<Self> {
        let ext = gpu.accel()?.clone();
        let storage = BufferDesc {
            size_bytes: sizes.structure_bytes.max(1),
            usage: BufferUsage::empty(),
            debug_name: name,
            ..Default::default()
        };
        let storage = Buffer::new(gpu, &storage, InternalUsage::ACCEL_STORAGE)?;
        let ty = match kind {
            AccelKind::Blas(_) => vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL,
            AccelKind::Tlas(_) => vk::AccelerationStructureTypeKHR::TOP_LEVEL,
        };
        let info = vk::AccelerationStructureCreateInfoKHR::default()
            .buffer(storage.raw)
            .size(storage.size_bytes)
            .ty(ty);
        // SAFETY: the buffer has the usage and the size; offset 0 is aligned.
        let raw = unsafe { ext.create_acceleration_structure(&info, None) }
            .map_err(Error::vulkan("vkCreateAccelerationStructureKHR"))?;
        gpu.name(raw, name);
        let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(raw);
        // SAFETY: the structure is alive.
        let address = unsafe { ext.get_acceleration_structure_device_address(&info) };
        let name = name.to_owned();
        Ok(Self { raw, id: ResourceId::next(), address, flags, sizes, name, kind, _storage: storage, ext })
    }

    /// The bottom level, or an error that says what the handle names instead.
    pub(crate) fn blas(&self) -> Result<&Blas> {
        match &self.kind {
            AccelKind::Blas(blas) => Ok(blas),
            AccelKind::Tlas(_) => {
                Err(Error::usage(&self.name, "a bottom-level structure is needed, this is a top-level one"))
            }
        }
    }

    /// The top level, or an error that says what the handle names instead.
    pub(crate) fn tlas(&self) -> Result<&Tlas> {
        match &self.kind {
            AccelKind::Tlas(tlas) => Ok(tlas),
            AccelKind::Blas(_) => {
                Err(Error::usage(&self.name, "a top-level structure is needed, this is a bottom-level one"))
            }
        }
    }

    /// Scratch bytes of a build in this mode, or the reason why the mode is not allowed.
    pub(crate) fn scratch_bytes(&self, mode: BuildMode) -> Result<u64> {
        match mode {
            BuildMode::Rebuild => Ok(self.sizes.build_scratch_bytes),
            BuildMode::Refit if self.flags.contains(BuildFlags::ALLOW_UPDATE) => {
                Ok(self.sizes.update_scratch_bytes)
            }
            BuildMode::Refit => Err(Error::usage(
                &self.name,
                "a refit needs BuildFlags::ALLOW_UPDATE when the structure is created",
            )),
        }
    }
}

impl Drop for AccelStruct {
    fn drop(&mut self) {
        // SAFETY: the owner has waited until the GPU is done with the structure.
        unsafe { self.ext.destroy_acceleration_structure(self.raw, None) };
    }
}
