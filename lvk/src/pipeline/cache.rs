//! The pipeline cache of a context: compiled shaders, kept in a file between runs.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ash::vk;

use super::cache_file::{CacheOwner, decode_file, encode_file};
use crate::cache_file::{MAX_BYTES, checksum};
use crate::error::readable::readable_name;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::lock_order::{Mutex, Rank};
use crate::regular_file;
use crate::temporary_file::{remove_replacements, replace_file};

/// The pipeline cache of a context that has a cache file. The file is written and the cache destroyed on drop.
pub(crate) struct PipelineCache {
    pub(crate) raw: vk::PipelineCache,
    /// Bytes of compiled shaders that the file held for this device and driver.
    pub(crate) loaded_bytes: u64,
    path: PathBuf,
    owner: CacheOwner,
    /// Checksum of the data in the file, if known. The lock is held while the file is written.
    on_disk: Mutex<Option<u64>>,
    gpu: Arc<Gpu>,
}

impl PipelineCache {
    /// Creates the cache from the file. If the file is missing or unusable, the cache starts empty and a message goes
    /// to the `log` crate.
    pub(crate) fn new(gpu: &Arc<Gpu>, path: &Path) -> Result<Self> {
        let owner = cache_owner(gpu);
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        remove_replacements(folder.unwrap_or(Path::new(".")), |cache| {
            path.file_name() == Some(cache.as_ref())
        });
        let file = read_if_present(path);
        let data = file.as_deref().and_then(|file| match decode_file(&owner, file) {
            Ok(data) => Some(data),
            Err(refusal) => {
                log::warn!("the pipeline cache '{}' is dropped: {refusal}", readable_name(path));
                None
            }
        });
        let (raw, data) = create_from(path, data.unwrap_or_default(), |data| create_cache(gpu, data))?;
        gpu.name(raw, "pipeline cache");
        let on_disk = (!data.is_empty()).then(|| checksum(&[data]));
        Ok(Self {
            raw,
            loaded_bytes: data.len() as u64,
            path: path.to_owned(),
            owner,
            on_disk: Mutex::new(Rank::PipelineCacheFile, on_disk),
            gpu: Arc::clone(gpu),
        })
    }

    /// Writes the file.
    pub(crate) fn save(&self) -> Result<()> {
        self.write(true)
    }

    /// Writes the file. Without `always`, an unchanged file is not written again.
    fn write(&self, always: bool) -> Result<()> {
        // Before the data is read: what another thread reads later must not be overwritten.
        let mut on_disk = self.on_disk.lock();
        // SAFETY: the cache is alive.
        let data = unsafe { self.gpu.device.get_pipeline_cache_data(self.raw) }
            .map_err(Error::vulkan("vkGetPipelineCacheData", self.path.display()))?;
        let sum = checksum(&[&data]);
        if !always && *on_disk == Some(sum) && self.path.exists() {
            return Ok(());
        }
        replace_file(&self.path, &encode_file(&self.owner, &data)).map_err(|error| Error::File {
            path: self.path.clone(),
            message: format!("the pipeline cache cannot be written: {error}"),
        })?;
        *on_disk = Some(sum);
        Ok(())
    }
}

impl Drop for PipelineCache {
    fn drop(&mut self) {
        if let Err(error) = self.write(false) {
            log::warn!("{error}");
        }
        // SAFETY: no pipeline is being created: every function that creates one holds the context.
        unsafe { self.gpu.device.destroy_pipeline_cache(self.raw, None) };
    }
}

/// Returns the bytes of the file if it can be read. At the first run there is no file.
fn read_if_present(path: &Path) -> Option<Vec<u8>> {
    let error = match regular_file::read(path, MAX_BYTES) {
        Ok(file) => return Some(file),
        Err(error) => error,
    };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if error.kind() != ErrorKind::NotFound {
        log::warn!("the pipeline cache '{}' cannot be read: {error}", readable_name(path));
    } else if folder.is_some_and(|folder| !folder.is_dir()) {
        log::warn!("the folder of the pipeline cache '{}' does not exist; create it", readable_name(path));
    }
    None
}

/// Creates a cache from `data` through `create`, or an empty one if the driver rejects `data`. A shortage of memory rejects nothing: a cache
/// that is dropped for it would be lost, since the file is written again in the end.
fn create_from<'a>(
    path: &Path,
    data: &'a [u8],
    mut create: impl FnMut(&[u8]) -> Result<vk::PipelineCache, vk::Result>,
) -> Result<(vk::PipelineCache, &'a [u8])> {
    let failed = || Error::vulkan("vkCreatePipelineCache", path.display());
    match create(data) {
        Ok(raw) => Ok((raw, data)),
        Err(result) if data.is_empty() || is_shortage(result) => Err(failed()(result)),
        Err(result) => {
            log::warn!(
                "the pipeline cache '{}' is dropped: the driver returns {result}",
                readable_name(path)
            );
            Ok((create(&[]).map_err(failed())?, &[]))
        }
    }
}

/// True if a command failed for lack of memory, which says nothing about its data.
fn is_shortage(result: vk::Result) -> bool {
    matches!(result, vk::Result::ERROR_OUT_OF_HOST_MEMORY | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY)
}

fn create_cache(gpu: &Gpu, data: &[u8]) -> Result<vk::PipelineCache, vk::Result> {
    let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
    // SAFETY: the data is empty, or was written by this driver for this device.
    unsafe { gpu.device.create_pipeline_cache(&info, None) }
}

fn cache_owner(gpu: &Gpu) -> CacheOwner {
    let mut ids = vk::PhysicalDeviceIDProperties::default();
    let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut ids);
    // SAFETY: the physical device belongs to the instance.
    unsafe { gpu.instance.raw.get_physical_device_properties2(gpu.physical(), &mut all) };
    let plain = all.properties;
    CacheOwner {
        vendor: plain.vendor_id,
        device: plain.device_id,
        driver_version: plain.driver_version,
        driver_uuid: ids.driver_uuid,
        cache_uuid: plain.pipeline_cache_uuid,
    }
}

#[cfg(test)]
mod tests {
    use ash::vk::Handle as _;

    use super::*;

    /// Creates a cache of these data by a driver that fails with `failure` if there are some.
    fn created(data: &[u8], failure: vk::Result) -> Result<(vk::PipelineCache, &[u8])> {
        create_from(Path::new("cache"), data, |data| match data {
            [] => Ok(vk::PipelineCache::from_raw(1)),
            _ => Err(failure),
        })
    }

    #[test]
    fn a_shortage_of_memory_is_an_error_and_drops_no_data() {
        for (failure, what) in [
            (vk::Result::ERROR_OUT_OF_HOST_MEMORY, "host"),
            (vk::Result::ERROR_OUT_OF_DEVICE_MEMORY, "device"),
        ] {
            let error = created(b"data", failure).unwrap_err().to_string();
            assert_eq!(error, format!("out of {what} memory in vkCreatePipelineCache for 'cache'"));
        }
    }

    #[test]
    fn data_that_a_driver_rejects_are_dropped() {
        let (raw, data) = created(b"data", vk::Result::ERROR_INITIALIZATION_FAILED).unwrap();
        assert_eq!((raw.as_raw(), data), (1, &[][..]));
        let failure = vk::Result::ERROR_UNKNOWN;
        let error = create_from(Path::new("cache"), b"data", |_| Err(failure)).unwrap_err().to_string();
        assert!(error.starts_with("vkCreatePipelineCache failed for 'cache'"), "{error}");
    }
}
