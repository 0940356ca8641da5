//! Mip levels that come and go within a budget, by what shaders read.

use lvk::{BufferHandle, CommandBuffer, Context, Holder, Readback, TextureHandle};
use lvk_gltf::{Image, Model};
use lvk_samples::app::array_buffer::buffer;
use lvk_samples::app::loading::LoadThread;
use lvk_samples::app::run_error::RunError;
use lvk_samples::app::sample_error::SampleError;

use super::super::materials::textures_of;
use super::plan::{MipChain, bytes, least_bytes, next_change, plan};
use super::upload::{mip_count, texture, with_levels};
use super::wanted::{UNREAD, WantedMips};

const MIB: u64 = 1 << 20;

/// Keeps the finest levels that shaders read resident, as far as a budget allows.
///
/// Shaders write the finest level of each image that they want to read into a buffer. The host reads the buffer some frames later,
/// plans, and loads one image after another on a thread. Texels of all levels stay in the host's memory.
pub(super) struct TextureStreaming {
    /// Bytes of all levels that are resident.
    budget: u64,
    images: Vec<Image>,
    chains: Vec<MipChain>,
    wanted: WantedMips,
    /// A level for each image.
    report: Holder<BufferHandle>,
    readback: Option<Readback>,
    load: Option<LoadThread<lvk::Result<LoadedMips>>>,
}

/// The levels of an image from one on.
pub(super) struct LoadedMips {
    pub(super) image: usize,
    pub(super) first_mip: u32,
    /// `None` if the device cannot read the format.
    pub(super) texture: Option<Holder<TextureHandle>>,
}

impl LoadedMips {
    fn new(ctx: &Context, images: &[Image], image: usize, first_mip: u32) -> lvk::Result<Self> {
        let texture = match images.get(image) {
            Some(source) => texture(ctx, source, first_mip)?,
            None => None,
        };
        Ok(Self { image, first_mip, texture })
    }
}

impl TextureStreaming {
    /// Prepares to stream the images of a model within `budget` bytes.
    ///
    /// # Errors
    /// [`SampleError::OutOfRange`] if the budget is smaller than what is always resident; [`SampleError::Device`].
    pub(super) fn new(ctx: &Context, model: &Model, budget: u64) -> Result<Self, SampleError> {
        let chains = chains(model);
        let least = least_bytes(&chains);
        if budget < least {
            return Err(SampleError::OutOfRange {
                setting: "--texture-budget",
                value: (budget / MIB) as u32,
                min: least.div_ceil(MIB) as u32,
                max: u32::MAX,
            });
        }
        let size = (model.images.len() * size_of::<u32>()).max(size_of::<u32>());
        Ok(Self {
            budget,
            images: model.images.iter().map(with_levels).collect(),
            wanted: WantedMips::new(chains.len()),
            report: buffer(ctx, "wanted mips", size as u64)?,
            chains,
            readback: None,
            load: None,
        })
    }

    /// Uploads the levels of an image that are always resident.
    pub(super) fn load_coarsest(&self, ctx: &Context, image: usize) -> lvk::Result<LoadedMips> {
        self.load(ctx, image, self.chains.get(image).map_or(0, MipChain::coarsest))
    }

    /// The budget, and the bytes of what is resident, in bytes.
    pub(super) fn usage(&self, resident: &[u32]) -> [u64; 2] {
        [self.budget, bytes(&self.chains, resident)]
    }

    /// The number of images that are coarser than shaders have wanted of late.
    pub(super) fn coarse_count(&self, resident: &[u32]) -> usize {
        let finest = self.chains.iter().zip(self.wanted.levels());
        let finest = finest.map(|(chain, wanted)| wanted.min(chain.coarsest()));
        finest.zip(resident).filter(|(finest, resident)| finest < resident).count()
    }

    /// The buffer that shaders write the levels to.
    pub(super) fn report(&self) -> BufferHandle {
        *self.report
    }

    /// Records that nothing was read so far.
    pub(super) fn clear_report(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        let size = (self.chains.len().max(1) * size_of::<u32>()) as u64;
        cmd.fill_buffer(*self.report, 0, size, UNREAD)
    }

    /// Goes on without waiting: takes a report or what was loaded, if there is any, and begins the next load. Returns what was loaded.
    pub(super) fn go_on(&mut self, ctx: &Context, resident: &[u32]) -> Result<Option<LoadedMips>, RunError> {
        self.take_report(ctx)?;
        if let Some(load) = &mut self.load {
            let Some(loaded) = load.take() else { return Ok(None) };
            self.load = None;
            return Ok(Some(loaded?));
        }
        if let Some((image, first_mip)) = self.next(resident) {
            // `images` share their texels.
            let (ctx, images) = (ctx.clone(), self.images.clone());
            self.load = Some(LoadThread::start(move |_| LoadedMips::new(&ctx, &images, image, first_mip))?);
        }
        Ok(None)
    }

    /// Waits for the report of the commands so far. Returns the images that should have other levels, and their first ones: those that
    /// are too fine before the others. `is_first`: reports before do not count.
    pub(super) fn plan(
        &mut self,
        ctx: &Context,
        resident: &[u32],
        is_first: bool,
    ) -> lvk::Result<Vec<(usize, u32)>> {
        let mut levels = vec![UNREAD; self.chains.len()];
        if !levels.is_empty() {
            ctx.download_buffer(*self.report, 0, bytemuck::cast_slice_mut(&mut levels))?;
        }
        if is_first {
            self.wanted = WantedMips::new(self.chains.len());
        }
        self.wanted.add(&levels);
        let planned = plan(&self.chains, &self.wanted.levels(), self.budget);
        let pairs = || planned.iter().zip(resident).enumerate();
        let too_fine = pairs().filter(|(_, (planned, resident))| planned > resident);
        let too_coarse = pairs().filter(|(_, (planned, resident))| planned < resident);
        Ok(too_fine.chain(too_coarse).map(|(image, (planned, _))| (image, *planned)).collect())
    }

    /// Loads the levels of an image from `first_mip` on.
    pub(super) fn load(&self, ctx: &Context, image: usize, first_mip: u32) -> lvk::Result<LoadedMips> {
        LoadedMips::new(ctx, &self.images, image, first_mip)
    }

    fn next(&self, resident: &[u32]) -> Option<(usize, u32)> {
        let planned = plan(&self.chains, &self.wanted.levels(), self.budget);
        next_change(&self.chains, resident, &planned, self.budget)
    }

    fn take_report(&mut self, ctx: &Context) -> lvk::Result<()> {
        if self.chains.is_empty() {
            return Ok(());
        }
        if let Some(readback) = &self.readback {
            if !readback.is_ready()? {
                return Ok(());
            }
            let levels: Vec<u32> = bytemuck::pod_collect_to_vec(&readback.wait()?);
            self.wanted.add(&levels);
        }
        let size = (self.chains.len() * size_of::<u32>()) as u64;
        self.readback = Some(ctx.read_buffer_later(*self.report, 0..size)?);
        Ok(())
    }
}

/// The levels of each image. A sampler without mip levels reads the largest one only, so that its images have all levels resident.
fn chains(model: &Model) -> Vec<MipChain> {
    let mut is_pinned = vec![false; model.images.len()];
    for texture in model.materials.iter().flat_map(textures_of).filter_map(|(_, texture)| texture) {
        let sampler = model.samplers.get(texture.sampler);
        let has_mips = sampler.is_none_or(|sampler| sampler.mip_filter.is_some());
        if let Some(is_pinned) = is_pinned.get_mut(texture.image) {
            *is_pinned |= !has_mips;
        }
    }
    let pairs = model.images.iter().zip(is_pinned);
    pairs.map(|(image, is_pinned)| MipChain::new(&image.data, mip_count(image), is_pinned)).collect()
}
