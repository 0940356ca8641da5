//! Samplers.

use std::sync::Arc;

use ash::vk;

use crate::error::{Error, Result};
use crate::gpu::Gpu;

/// How texels are interpolated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Filter {
    /// The nearest texel.
    Nearest,
    /// Linear interpolation.
    #[default]
    Linear,
}

/// What lies outside of 0..1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum AddressMode {
    /// The texture again.
    #[default]
    Repeat,
    /// The texture again, mirrored each time.
    MirroredRepeat,
    /// The texel at the edge.
    ClampToEdge,
    /// Transparent black.
    ClampToBorder,
}

/// A comparison, of depths or of a reference with a texel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum CompareOp {
    /// Never passes.
    Never,
    /// Passes if less.
    #[default]
    Less,
    /// Passes if equal.
    Equal,
    /// Passes if less or equal.
    LessOrEqual,
    /// Passes if greater.
    Greater,
    /// Passes if not equal.
    NotEqual,
    /// Passes if greater or equal.
    GreaterOrEqual,
    /// Always passes.
    Always,
}

impl CompareOp {
    pub(crate) fn raw(self) -> vk::CompareOp {
        match self {
            Self::Never => vk::CompareOp::NEVER,
            Self::Less => vk::CompareOp::LESS,
            Self::Equal => vk::CompareOp::EQUAL,
            Self::LessOrEqual => vk::CompareOp::LESS_OR_EQUAL,
            Self::Greater => vk::CompareOp::GREATER,
            Self::NotEqual => vk::CompareOp::NOT_EQUAL,
            Self::GreaterOrEqual => vk::CompareOp::GREATER_OR_EQUAL,
            Self::Always => vk::CompareOp::ALWAYS,
        }
    }
}

/// Describes a sampler.
#[derive(Debug, Clone, Copy)]
pub struct SamplerDesc<'a> {
    /// Filter when texels are larger than pixels.
    pub mag_filter: Filter,
    /// Filter when texels are smaller than pixels.
    pub min_filter: Filter,
    /// Filter between mips.
    pub mip_filter: Filter,
    /// Addressing along u, v and w.
    pub address: [AddressMode; 3],
    /// Largest anisotropy, 1 to 16; clamped to the device's.
    pub max_anisotropy: f32,
    /// Makes a comparison sampler, read through `kSamplersShadow[]`.
    pub compare: Option<CompareOp>,
    /// Added to the level of detail.
    pub lod_bias: f32,
    /// Smallest and largest level of detail.
    pub lod_range: [f32; 2],
    /// Name in error messages, validation messages and debuggers.
    pub debug_name: &'a str,
}

impl Default for SamplerDesc<'_> {
    fn default() -> Self {
        Self {
            mag_filter: Filter::Linear,
            min_filter: Filter::Linear,
            mip_filter: Filter::Linear,
            address: [AddressMode::Repeat; 3],
            max_anisotropy: 1.0,
            compare: None,
            lod_bias: 0.0,
            lod_range: [0.0, vk::LOD_CLAMP_NONE],
            debug_name: "sampler",
        }
    }
}

/// A sampler, destroyed on drop.
pub(crate) struct Sampler {
    pub(crate) raw: vk::Sampler,
    pub(crate) slot: u32,
    pub(crate) name: String,
    gpu: Arc<Gpu>,
}

impl Sampler {
    pub(crate) fn new(gpu: &Arc<Gpu>, desc: &SamplerDesc<'_>, slot: u32) -> Result<Self> {
        let [min_lod, max_lod] = desc.lod_range;
        let numbers = [min_lod, max_lod, desc.lod_bias, desc.max_anisotropy];
        if numbers.iter().any(|n| n.is_nan()) || min_lod > max_lod {
            let message = "level of detail, bias and anisotropy must be numbers, and the range in order";
            return Err(Error::usage(desc.debug_name, message));
        }
        let anisotropy = desc.max_anisotropy.clamp(1.0, gpu.caps.max_anisotropy);
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter(desc.mag_filter))
            .min_filter(filter(desc.min_filter))
            .mipmap_mode(mip_mode(desc.mip_filter))
            .address_mode_u(address(desc.address[0]))
            .address_mode_v(address(desc.address[1]))
            .address_mode_w(address(desc.address[2]))
            .anisotropy_enable(anisotropy > 1.0)
            .max_anisotropy(anisotropy)
            .compare_enable(desc.compare.is_some())
            .compare_op(desc.compare.unwrap_or_default().raw())
            .mip_lod_bias(desc.lod_bias.clamp(-2.0, 2.0))
            .min_lod(min_lod)
            .max_lod(max_lod);
        // SAFETY: the description is valid.
        let raw =
            unsafe { gpu.device.create_sampler(&info, None) }.map_err(Error::vulkan("vkCreateSampler"))?;
        gpu.name(raw, desc.debug_name);
        Ok(Self { raw, slot, name: desc.debug_name.to_owned(), gpu: Arc::clone(gpu) })
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        // SAFETY: the owner has waited until the GPU is done with the sampler.
        unsafe { self.gpu.device.destroy_sampler(self.raw, None) };
    }
}

fn filter(filter: Filter) -> vk::Filter {
    match filter {
        Filter::Nearest => vk::Filter::NEAREST,
        Filter::Linear => vk::Filter::LINEAR,
    }
}

fn mip_mode(filter: Filter) -> vk::SamplerMipmapMode {
    match filter {
        Filter::Nearest => vk::SamplerMipmapMode::NEAREST,
        Filter::Linear => vk::SamplerMipmapMode::LINEAR,
    }
}

fn address(mode: AddressMode) -> vk::SamplerAddressMode {
    match mode {
        AddressMode::Repeat => vk::SamplerAddressMode::REPEAT,
        AddressMode::MirroredRepeat => vk::SamplerAddressMode::MIRRORED_REPEAT,
        AddressMode::ClampToEdge => vk::SamplerAddressMode::CLAMP_TO_EDGE,
        AddressMode::ClampToBorder => vk::SamplerAddressMode::CLAMP_TO_BORDER,
    }
}
