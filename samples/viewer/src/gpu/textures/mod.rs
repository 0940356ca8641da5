//! Images and samplers of a model on the GPU: all of them, or as many of their mip levels as a budget allows.

mod formats;
mod plan;
mod streaming;
mod upload;
mod wanted;

use lvk::{BufferHandle, CommandBuffer, Context, Holder, SamplerDesc, SamplerHandle, TextureHandle};
use lvk_gltf::{Model, TextureRef};
use lvk_samples::app::run_error::RunError;
use lvk_samples::app::sample_error::SampleError;

use super::layout::GpuTextureSlot;
use formats::sampler_desc;
use streaming::{LoadedMips, TextureStreaming};

/// Images and samplers on the GPU.
pub(crate) struct GpuTextures {
    images: Vec<ResidentImage>,
    samplers: Vec<Holder<SamplerHandle>>,
    /// `None` if all levels are resident.
    streaming: Option<TextureStreaming>,
    /// What is left out, for the user to read.
    pub(crate) warnings: Vec<String>,
}

/// An image of which some levels are resident.
struct ResidentImage {
    /// `None` for an image whose format the device lacks.
    texture: Option<Holder<TextureHandle>>,
    /// The level of the image that the largest level of the texture is.
    first_mip: u32,
    /// Texels of the largest level of the image.
    extent: [u32; 2],
}

/// Memory of textures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TextureMemory {
    /// Most bytes that may be resident.
    pub budget: u64,
    /// Bytes of all levels that are resident.
    pub resident: u64,
    /// Images that are coarser than shaders have wanted of late.
    pub coarse_count: usize,
}

impl GpuTextures {
    /// Uploads the images of a model: all levels, or with a budget in bytes those that are always resident.
    pub(crate) fn new(ctx: &Context, model: &Model, budget: Option<u64>) -> Result<Self, SampleError> {
        let streaming = budget.map(|budget| TextureStreaming::new(ctx, model, budget)).transpose()?;
        let mut all = Self { images: Vec::new(), samplers: Vec::new(), streaming, warnings: Vec::new() };
        for (place, image) in model.images.iter().enumerate() {
            let (first_mip, texture) = match &all.streaming {
                Some(streaming) => {
                    let loaded = streaming.load_coarsest(ctx, place)?;
                    (loaded.first_mip, loaded.texture)
                }
                None => (0, upload::whole(ctx, image)?),
            };
            if texture.is_none() {
                let (format, name) = (image.data.format, image.name.as_deref().unwrap_or("image"));
                all.warnings.push(format!(
                    "image {} '{name}': the device cannot read {format:?}; it is left out",
                    image.source
                ));
            }
            all.images.push(ResidentImage { texture, first_mip, extent: image.data.extent() });
        }
        for sampler in &model.samplers {
            all.samplers.push(ctx.create_sampler(&sampler_desc(sampler))?);
        }
        all.samplers.push(ctx.create_sampler(&SamplerDesc::default())?);
        Ok(all)
    }

    /// A slot for the texture, without a transform; `None` where there is no such texture.
    pub(crate) fn slot(&self, texture: &TextureRef) -> Option<GpuTextureSlot> {
        let image = self.images.get(texture.image)?;
        let sampler = self.samplers.get(texture.sampler).or(self.samplers.last())?;
        Some(GpuTextureSlot {
            tex: image.texture.as_ref()?.index(),
            sampler: sampler.index(),
            image: texture.image as u32,
            first_mip: image.first_mip,
            extent: image.extent,
            ..bytemuck::Zeroable::zeroed()
        })
    }

    /// Writes into a slot what its image is at now.
    pub(crate) fn update(&self, slot: &mut GpuTextureSlot) {
        if let Some(ResidentImage { texture: Some(texture), first_mip, .. }) =
            self.images.get(slot.image as usize)
        {
            (slot.tex, slot.first_mip) = (texture.index(), *first_mip);
        }
    }

    /// True if levels come and go.
    pub(crate) fn is_streaming(&self) -> bool {
        self.streaming.is_some()
    }

    /// Memory of textures; `None` without a budget.
    pub(crate) fn memory(&self) -> Option<TextureMemory> {
        let (streaming, first_mips) = (self.streaming.as_ref()?, self.first_mips());
        let [budget, resident] = streaming.usage(&first_mips);
        Some(TextureMemory { budget, resident, coarse_count: streaming.coarse_count(&first_mips) })
    }

    /// The buffer that shaders write the levels to that they want; none without a budget.
    pub(crate) fn report(&self) -> Option<BufferHandle> {
        self.streaming.as_ref().map(TextureStreaming::report)
    }

    /// Records that shaders have wanted no level so far.
    pub(crate) fn clear_report(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        self.streaming.as_ref().map_or(Ok(()), |streaming| streaming.clear_report(cmd))
    }

    /// Takes what has been loaded, without waiting, and begins the next load. Returns true if other levels are resident now.
    pub(crate) fn go_on(&mut self, ctx: &Context) -> Result<bool, RunError> {
        if !self.is_streaming() {
            return Ok(false);
        }
        let first_mips = self.first_mips();
        let Some(streaming) = &mut self.streaming else { return Ok(false) };
        let loaded = streaming.go_on(ctx, &first_mips)?;
        Ok(loaded.is_some_and(|loaded| self.replace(loaded)))
    }

    /// Waits for what shaders have wanted, and loads it. `is_first`: nothing that they wanted before counts. Returns true if other
    /// levels are resident now.
    pub(crate) fn load_wanted(&mut self, ctx: &Context, is_first: bool) -> lvk::Result<bool> {
        let first_mips = self.first_mips();
        let Some(streaming) = &mut self.streaming else { return Ok(false) };
        let changes = streaming.plan(ctx, &first_mips, is_first)?;
        let has_changes = !changes.is_empty();
        for (image, first_mip) in changes {
            let Some(streaming) = &self.streaming else { break };
            let loaded = streaming.load(ctx, image, first_mip)?;
            self.replace(loaded);
        }
        Ok(has_changes)
    }

    fn first_mips(&self) -> Vec<u32> {
        self.images.iter().map(|image| image.first_mip).collect()
    }

    fn replace(&mut self, loaded: LoadedMips) -> bool {
        let Some(image) = self.images.get_mut(loaded.image) else { return false };
        (image.texture, image.first_mip) = (loaded.texture, loaded.first_mip);
        true
    }
}
