//! The bindless descriptor set: the owner of each slot, and the slots to write before the next submission.

use std::sync::Arc;

use ash::vk;

use super::index_checks::{BindlessArray, CheckPlan, IndexChecks};
use super::layout::{self, DescriptorCounts};
use super::slot_allocator::Slots;
use super::slot_array::{SlotArray, WrittenDescriptors};
use super::yuv_slots::{YuvSlot, YuvSlots};
use crate::error::{Error, Result};
use crate::format::Format;
use crate::gpu::Gpu;
use crate::gpu::caps::descriptor_limits::largest_fitting;
use crate::lock_order::{Guard, Mutex, Rank};
use crate::resource::ycbcr::YuvConversion;

/// Views in the slot of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TextureViews {
    pub(crate) sampled: Option<vk::ImageView>,
    pub(crate) storage: Option<vk::ImageView>,
}

/// Default descriptors: objects in every slot without an owner.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DefaultDescriptors {
    pub(crate) sampled: vk::ImageView,
    pub(crate) storage: vk::ImageView,
    pub(crate) sampler: vk::Sampler,
    pub(crate) tlas: Option<vk::AccelerationStructureKHR>,
    /// The TLAS table. Not a default: the buffer is the same for the whole life of the context.
    pub(crate) tlas_table: Option<vk::Buffer>,
}

/// The bindless descriptor set with its layout and pool.
pub(crate) struct Bindless {
    pub(crate) set_layout: vk::DescriptorSetLayout,
    pub(crate) set: vk::DescriptorSet,
    pool: vk::DescriptorPool,
    entries: Mutex<BindlessState>,
    /// Present if shaders check their indices.
    pub(crate) checks: Option<IndexChecks>,
    gpu: Arc<Gpu>,
}

struct BindlessState {
    defaults: Option<DefaultDescriptors>,
    textures: SlotArray<TextureViews>,
    /// State of the descriptors of sampled and of storage images. Most textures have only one of both.
    shown: [WrittenDescriptors; 2],
    samplers: SlotArray<vk::Sampler>,
    tlas: SlotArray<vk::AccelerationStructureKHR>,
    yuv: YuvSlots,
}

impl BindlessState {
    /// True if no descriptor must be written, as before most submissions.
    fn is_clean(&self) -> bool {
        let arrays = [&self.textures.slots, &self.samplers.slots, &self.tlas.slots];
        arrays.into_iter().all(Slots::is_clean) && self.yuv.is_clean()
    }
}

/// The arrays that the slot of a texture belongs to.
pub(crate) const TEXTURE_ARRAYS: [BindlessArray; 2] = [BindlessArray::Textures, BindlessArray::StorageImages];

impl Bindless {
    pub(crate) fn new(gpu: &Arc<Gpu>, max_textures: u32, yuv: YuvSlots, check_indices: bool) -> Result<Self> {
        let others = DescriptorCounts::new(gpu);
        let left = gpu.descriptor_limits().budget(&others.reserved, yuv.descriptors());
        let limits = &gpu.caps.limits;
        // A profile may have tightened them.
        let left = left.at_most(limits.max_bindless_textures, limits.max_bindless_samplers);
        let conversions = yuv.samplers();
        let textures = largest_fitting(left.texture_count(max_textures)?, |textures| {
            is_supported(gpu, &binding_counts(gpu, textures, left.samplers), &conversions)
        })?;
        let counts = binding_counts(gpu, textures, left.samplers);
        let capacities = [textures, left.samplers, textures, others.tlas_slots];
        let checks = if check_indices { Some(IndexChecks::new(gpu, capacities)?) } else { None };
        let set_layout = create_layout(gpu, &counts, &conversions)?;
        let (pool, set) = match create_set(gpu, set_layout, &counts, yuv.descriptors()) {
            Ok(made) => made,
            Err(error) => {
                // SAFETY: the layout was just created and nothing uses it.
                unsafe { gpu.device.destroy_descriptor_set_layout(set_layout, None) };
                return Err(error);
            }
        };
        let entries = BindlessState {
            defaults: None,
            textures: SlotArray::new("number of textures", textures),
            shown: [WrittenDescriptors::new(textures), WrittenDescriptors::new(textures)],
            samplers: SlotArray::new("number of samplers", left.samplers),
            tlas: SlotArray::new("number of top-level acceleration structures", others.tlas_slots),
            yuv,
        };
        let entries = Mutex::new(Rank::Bindless, entries);
        Ok(Self { set_layout, set, pool, entries, checks, gpu: Arc::clone(gpu) })
    }

    /// Writes the default descriptors into every slot. No command buffer has been submitted yet.
    pub(crate) fn write_defaults(&self, defaults: DefaultDescriptors) {
        let mut entries = self.lock();
        entries.defaults = Some(defaults);
        self.write_default_textures(defaults, entries.textures.owners.len() as u32);
        let samplers = (0..entries.samplers.owners.len() as u32).map(|slot| (slot, None));
        self.write_samplers(defaults, samplers);
        let tlas = (0..entries.tlas.owners.len() as u32).map(|slot| (slot, None));
        self.write_tlas(defaults, tlas);
        if let Some(table) = defaults.tlas_table {
            self.write_tlas_table(table);
        }
        self.write_yuv(entries.yuv.all_views());
    }

    /// Sets the default descriptor of a conversion; must precede [`write_defaults`](Self::write_defaults).
    pub(crate) fn set_yuv_default(&self, conversion: usize, view: vk::ImageView) {
        self.lock().yuv.set_default(conversion, view);
    }

    /// Returns the conversions that the device supports.
    pub(crate) fn yuv_conversions(&self) -> Vec<(usize, YuvConversion, vk::SamplerYcbcrConversion)> {
        self.lock().yuv.conversions()
    }

    /// Reserves a slot for a texture in Y'CbCr. `None` selects the first conversion of the format.
    pub(crate) fn reserve_yuv(
        &self,
        format: Format,
        conversion: Option<usize>,
        name: &str,
    ) -> Result<YuvSlot> {
        self.lock().yuv.reserve(format, conversion, name)
    }

    pub(crate) fn set_yuv(&self, slot: u32, view: vk::ImageView) {
        self.lock().yuv.set(slot, view);
    }

    /// Frees a slot of a Y'CbCr texture; see [`free_texture`](Self::free_texture).
    pub(crate) fn free_yuv(&self, slot: u32) {
        self.lock().yuv.free(slot);
    }

    pub(crate) fn reserve_texture(&self, name: &str) -> Result<u32> {
        let slot = self.lock().textures.reserve(name)?;
        self.record_reserved(&TEXTURE_ARRAYS, slot, name);
        Ok(slot)
    }

    pub(crate) fn reserve_sampler(&self, name: &str) -> Result<u32> {
        let slot = self.lock().samplers.reserve(name)?;
        self.record_reserved(&[BindlessArray::Samplers], slot, name);
        self.record_set(BindlessArray::Samplers, slot);
        Ok(slot)
    }

    pub(crate) fn reserve_tlas(&self, name: &str) -> Result<u32> {
        let slot = self.lock().tlas.reserve(name)?;
        self.record_reserved(&[BindlessArray::AccelStructs], slot, name);
        self.record_set(BindlessArray::AccelStructs, slot);
        Ok(slot)
    }

    pub(crate) fn set_texture(&self, slot: u32, views: TextureViews) {
        self.lock().textures.set(slot, Some(views));
        for (array, view) in TEXTURE_ARRAYS.into_iter().zip([views.sampled, views.storage]) {
            if view.is_some() {
                self.record_set(array, slot);
            }
        }
    }

    pub(crate) fn set_sampler(&self, slot: u32, sampler: vk::Sampler) {
        self.lock().samplers.set(slot, Some(sampler));
    }

    pub(crate) fn set_tlas(&self, slot: u32, tlas: vk::AccelerationStructureKHR) {
        self.lock().tlas.set(slot, Some(tlas));
    }

    /// Frees the slot of a texture that the GPU no longer uses. The slot is written with the default descriptor and can
    /// be reserved again.
    pub(crate) fn free_texture(&self, slot: u32) {
        let mut entries = self.lock();
        entries.textures.set(slot, None);
        entries.textures.slots.free(slot);
        self.record_free(&TEXTURE_ARRAYS, slot);
    }

    /// Frees the slot of a sampler; see [`free_texture`](Self::free_texture).
    pub(crate) fn free_sampler(&self, slot: u32) {
        let mut entries = self.lock();
        entries.samplers.set(slot, None);
        entries.samplers.slots.free(slot);
        self.record_free(&[BindlessArray::Samplers], slot);
    }

    /// Frees the slot of a TLAS; see [`free_texture`](Self::free_texture).
    pub(crate) fn free_tlas(&self, slot: u32) {
        let mut entries = self.lock();
        entries.tlas.set(slot, None);
        entries.tlas.slots.free(slot);
        self.record_free(&[BindlessArray::AccelStructs], slot);
    }

    /// Records that the handle of a slot's owner was destroyed. `newest` returns the number of the last command buffer
    /// begun before.
    pub(crate) fn record_retired(&self, arrays: &[BindlessArray], slot: u32, newest: impl FnOnce() -> u64) {
        if let Some(checks) = &self.checks {
            let newest = newest();
            arrays.iter().for_each(|array| checks.mark_retired(*array, slot, newest));
        }
    }

    /// Returns the check parameters of a module of this name; `None` without index checks.
    pub(crate) fn check_plan(&self, shader: &str) -> Option<CheckPlan> {
        self.checks.as_ref().map(|checks| checks.plan(shader))
    }

    fn record_reserved(&self, arrays: &[BindlessArray], slot: u32, name: &str) {
        if let Some(checks) = &self.checks {
            checks.reserve(arrays, slot, name);
        }
    }

    fn record_set(&self, array: BindlessArray, slot: u32) {
        if let Some(checks) = &self.checks {
            checks.mark_alive(array, slot);
        }
    }

    fn record_free(&self, arrays: &[BindlessArray], slot: u32) {
        if let Some(checks) = &self.checks {
            arrays.iter().for_each(|array| checks.mark_free(*array, slot));
        }
    }

    /// Writes the dirty slots. Called before every submission.
    pub(crate) fn flush(&self) {
        let mut entries = self.lock();
        let Some(defaults) = entries.defaults.filter(|_| !entries.is_clean()) else { return };
        self.write_textures(defaults, &mut entries);
        self.write_samplers(defaults, entries.samplers.take_dirty().into_iter());
        self.write_tlas(defaults, entries.tlas.take_dirty().into_iter());
        self.write_yuv(entries.yuv.take_dirty());
    }

    fn write_yuv(&self, slots: Vec<(u32, vk::ImageView)>) {
        let mut views = Runs::default();
        for (slot, view) in slots {
            views.push(slot, image_info(view, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL));
        }
        self.write(&views, layout::YCBCR);
    }

    fn write_default_textures(&self, defaults: DefaultDescriptors, count: u32) {
        let (mut sampled, mut storage) = (Runs::default(), Runs::default());
        for slot in 0..count {
            sampled.push(slot, sampled_image(defaults.sampled));
            storage.push(slot, storage_image(defaults.storage));
        }
        self.write_images(&sampled, &storage);
    }

    fn write_textures(&self, defaults: DefaultDescriptors, entries: &mut BindlessState) {
        let (mut sampled, mut storage) = (Runs::default(), Runs::default());
        let [shown_sampled, shown_storage] = &mut entries.shown;
        for (slot, views) in entries.textures.take_dirty() {
            let (read, written) = views.map_or((None, None), |views| (views.sampled, views.storage));
            if shown_sampled.must_write(slot, read.is_some()) {
                sampled.push(slot, sampled_image(read.unwrap_or(defaults.sampled)));
            }
            if shown_storage.must_write(slot, written.is_some()) {
                storage.push(slot, storage_image(written.unwrap_or(defaults.storage)));
            }
        }
        self.write_images(&sampled, &storage);
    }

    fn write_images(&self, sampled: &Runs<vk::DescriptorImageInfo>, storage: &Runs<vk::DescriptorImageInfo>) {
        self.write(sampled, layout::SAMPLED_IMAGES);
        self.write(storage, layout::STORAGE_IMAGES);
    }

    fn write_samplers(
        &self,
        defaults: DefaultDescriptors,
        slots: impl Iterator<Item = (u32, Option<vk::Sampler>)>,
    ) {
        let mut samplers = Runs::default();
        for (slot, owner) in slots {
            let sampler = owner.unwrap_or(defaults.sampler);
            samplers.push(slot, vk::DescriptorImageInfo::default().sampler(sampler));
        }
        self.write(&samplers, layout::SAMPLERS);
    }

    fn write(&self, runs: &Runs<vk::DescriptorImageInfo>, binding: u32) {
        let writes: Vec<_> = runs
            .iter()
            .map(|(first, infos)| self.descriptor_write(binding, first).image_info(infos))
            .collect();
        if !writes.is_empty() {
            // SAFETY: the views and samplers are alive. Dirty slots are not in use by the GPU, as a slot is only
            // rewritten after the timeline has passed its last use. The lock serialises updates.
            unsafe { self.gpu.device.update_descriptor_sets(&writes, &[]) };
        }
    }

    fn write_tlas(
        &self,
        defaults: DefaultDescriptors,
        slots: impl Iterator<Item = (u32, Option<vk::AccelerationStructureKHR>)>,
    ) {
        let mut runs = Runs::default();
        for (slot, owner) in slots {
            if let Some(raw) = owner.or(defaults.tlas) {
                runs.push(slot, raw);
            }
        }
        for (first, raw) in runs.iter() {
            let mut structures =
                vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(raw);
            let mut write = self.descriptor_write(layout::ACCEL_STRUCTS, first).push_next(&mut structures);
            write.descriptor_count = raw.len() as u32;
            // SAFETY: as in `write`.
            unsafe { self.gpu.device.update_descriptor_sets(&[write], &[]) };
        }
    }

    fn write_tlas_table(&self, table: vk::Buffer) {
        let info = [vk::DescriptorBufferInfo::default().buffer(table).range(vk::WHOLE_SIZE)];
        let write = self.descriptor_write(layout::TLAS_TABLE, 0).buffer_info(&info);
        // SAFETY: the buffer lives as long as the set, and nothing has been submitted yet.
        unsafe { self.gpu.device.update_descriptor_sets(&[write], &[]) };
    }

    fn descriptor_write<'a>(&self, binding: u32, first: u32) -> vk::WriteDescriptorSet<'a> {
        vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_binding(binding)
            .dst_array_element(first)
            .descriptor_type(layout::descriptor_type(binding))
    }

    /// Returns the numbers of taken slots of textures, samplers, TLAS and Y'CbCr textures, without default descriptors.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) fn taken_counts(&self) -> [usize; 4] {
        let entries = self.lock();
        let arrays = [&entries.textures.slots, &entries.samplers.slots, &entries.tlas.slots];
        let [textures, samplers, tlas] = arrays.map(Slots::taken_count);
        [textures, samplers, tlas, entries.yuv.taken_count()]
    }

    fn lock(&self) -> Guard<'_, BindlessState> {
        self.entries.lock()
    }
}

impl Drop for Bindless {
    fn drop(&mut self) {
        // SAFETY: the context has waited for the GPU before its parts are dropped.
        unsafe {
            self.gpu.device.destroy_descriptor_pool(self.pool, None);
            self.gpu.device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// Runs of descriptors of consecutive slots, so that one write covers many descriptors.
struct Runs<T> {
    infos: Vec<T>,
    starts: Vec<(u32, usize)>,
    next: u32,
}

impl<T> Default for Runs<T> {
    fn default() -> Self {
        Self { infos: Vec::new(), starts: Vec::new(), next: 0 }
    }
}

impl<T> Runs<T> {
    /// Adds a slot. Slots must be added in ascending order.
    fn push(&mut self, slot: u32, info: T) {
        if self.starts.is_empty() || slot != self.next {
            self.starts.push((slot, self.infos.len()));
        }
        self.infos.push(info);
        self.next = slot + 1;
    }

    fn iter(&self) -> impl Iterator<Item = (u32, &[T])> {
        let ends = self.starts.iter().skip(1).map(|(_, start)| *start).chain([self.infos.len()]);
        self.starts.iter().zip(ends).map(|((slot, start), end)| (*slot, &self.infos[*start..end]))
    }
}

fn sampled_image(view: vk::ImageView) -> vk::DescriptorImageInfo {
    image_info(view, vk::ImageLayout::READ_ONLY_OPTIMAL)
}

fn storage_image(view: vk::ImageView) -> vk::DescriptorImageInfo {
    image_info(view, vk::ImageLayout::GENERAL)
}

fn image_info(view: vk::ImageView, layout: vk::ImageLayout) -> vk::DescriptorImageInfo {
    vk::DescriptorImageInfo::default().image_view(view).image_layout(layout)
}

/// A binding and its descriptor count.
type BindingCount = (u32, u32);

/// Returns the bindings with their descriptor counts, without the Y'CbCr binding.
fn binding_counts(gpu: &Gpu, textures: u32, samplers: u32) -> [BindingCount; 5] {
    let others = DescriptorCounts::new(gpu);
    [
        (layout::SAMPLED_IMAGES, textures),
        (layout::SAMPLERS, samplers),
        (layout::STORAGE_IMAGES, textures),
        (layout::ACCEL_STRUCTS, others.hardware_tlas),
        (layout::TLAS_TABLE, others.tlas_tables),
    ]
}

/// True if the device supports a set of this size. The descriptor limits do not cover the size of descriptors in bytes.
fn is_supported(gpu: &Gpu, counts: &[BindingCount], yuv: &[vk::Sampler]) -> bool {
    with_layout_info(counts, yuv, |info| {
        let mut support = vk::DescriptorSetLayoutSupport::default();
        // SAFETY: the counts are within the limits of descriptors, and the samplers are alive.
        unsafe { gpu.device.get_descriptor_set_layout_support(info, &mut support) };
        support.supported == vk::TRUE
    })
}

fn create_layout(gpu: &Gpu, counts: &[BindingCount], yuv: &[vk::Sampler]) -> Result<vk::DescriptorSetLayout> {
    // SAFETY: the counts, including all other descriptors of `DescriptorCounts`, are within the descriptor limits, and
    // the device supports the layout.
    with_layout_info(counts, yuv, |info| unsafe { gpu.device.create_descriptor_set_layout(info, None) })
        .map_err(Error::vulkan("vkCreateDescriptorSetLayout", "bindless layout"))
}

/// Calls `then` with the description of the layout.
fn with_layout_info<T>(
    counts: &[BindingCount],
    yuv: &[vk::Sampler],
    then: impl FnOnce(&vk::DescriptorSetLayoutCreateInfo<'_>) -> T,
) -> T {
    let used: Vec<_> = counts.iter().filter(|(_, count)| *count > 0).collect();
    let mut bindings: Vec<_> = used
        .iter()
        .map(|(binding, count)| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(*binding)
                .descriptor_type(layout::descriptor_type(*binding))
                .descriptor_count(*count)
                .stage_flags(vk::ShaderStageFlags::ALL)
        })
        .collect();
    let mut flags: Vec<_> = used.iter().map(|(binding, _)| binding_flags(*binding)).collect();
    if !yuv.is_empty() {
        let binding = vk::DescriptorSetLayoutBinding::default()
            .binding(layout::YCBCR)
            .descriptor_type(layout::descriptor_type(layout::YCBCR))
            .immutable_samplers(yuv)
            .stage_flags(vk::ShaderStageFlags::ALL);
        bindings.push(binding);
        flags.push(binding_flags(layout::YCBCR));
    }
    let mut flags = vk::DescriptorSetLayoutBindingFlagsCreateInfo::default().binding_flags(&flags);
    let info = vk::DescriptorSetLayoutCreateInfo::default()
        .flags(vk::DescriptorSetLayoutCreateFlags::UPDATE_AFTER_BIND_POOL)
        .bindings(&bindings)
        .push_next(&mut flags);
    then(&info)
}

/// Returns the flags of a binding. The TLAS table is written once. Slots of all other bindings change while others are
/// in use.
fn binding_flags(binding: u32) -> vk::DescriptorBindingFlags {
    use vk::DescriptorBindingFlags as Flags;
    if binding == layout::TLAS_TABLE {
        return Flags::PARTIALLY_BOUND;
    }
    Flags::UPDATE_AFTER_BIND | Flags::UPDATE_UNUSED_WHILE_PENDING | Flags::PARTIALLY_BOUND
}

fn create_set(
    gpu: &Gpu,
    layout: vk::DescriptorSetLayout,
    counts: &[BindingCount],
    yuv: u32,
) -> Result<(vk::DescriptorPool, vk::DescriptorSet)> {
    let yuv = (layout::YCBCR, yuv);
    let sizes: Vec<_> = counts
        .iter()
        .chain([&yuv])
        .filter(|(_, count)| *count > 0)
        .map(|(binding, count)| {
            let ty = layout::descriptor_type(*binding);
            vk::DescriptorPoolSize::default().ty(ty).descriptor_count(*count)
        })
        .collect();
    let info = vk::DescriptorPoolCreateInfo::default()
        .flags(vk::DescriptorPoolCreateFlags::UPDATE_AFTER_BIND)
        .max_sets(1)
        .pool_sizes(&sizes);
    // SAFETY: the description is valid.
    let pool = unsafe { gpu.device.create_descriptor_pool(&info, None) }
        .map_err(Error::vulkan("vkCreateDescriptorPool", "bindless pool"))?;
    let layouts = [layout];
    let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
    // SAFETY: the pool is new and has room for this one set.
    match unsafe { gpu.device.allocate_descriptor_sets(&info) } {
        Ok(sets) => {
            gpu.name(sets[0], "bindless set");
            gpu.name(pool, "bindless pool");
            gpu.name(layouts[0], "bindless layout");
            Ok((pool, sets[0]))
        }
        Err(result) => {
            // SAFETY: nothing was allocated from the pool.
            unsafe { gpu.device.destroy_descriptor_pool(pool, None) };
            Err(Error::vulkan("vkAllocateDescriptorSets", "bindless set")(result))
        }
    }
}
