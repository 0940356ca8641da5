//! Samplers.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use ash::vk;

use super::portability::sampler_needs;
use crate::error::{Error, Result, check_limit};
use crate::gpu::Gpu;
use crate::gpu::caps::optional_features::OptionalFeature;

/// Interpolation of texels (`VkFilter`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Filter {
    /// The nearest texel.
    Nearest,
    /// Linear interpolation.
    #[default]
    Linear,
}

impl Filter {
    pub(crate) fn raw(self) -> vk::Filter {
        match self {
            Self::Nearest => vk::Filter::NEAREST,
            Self::Linear => vk::Filter::LINEAR,
        }
    }
}

/// Result of a lookup at coordinates outside of 0..1 (`VkSamplerAddressMode`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum AddressMode {
    /// Repeats the texture.
    #[default]
    Repeat,
    /// Repeats the texture, mirrored each time.
    MirroredRepeat,
    /// Returns the texel at the edge.
    ClampToEdge,
    /// Returns the [`border`](SamplerDesc::border) of the sampler.
    ClampToBorder,
    /// Mirrors the texture once, then returns the texel at the edge
    /// ([`OptionalFeature::MirrorClampToEdge`](crate::OptionalFeature)).
    MirrorClampToEdge,
}

/// Colour beyond the edge of a texture under [`AddressMode::ClampToBorder`] (`VkBorderColor`). Integer textures need an
/// integer colour, all other textures one of the others.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum BorderColor {
    /// All channels 0.
    #[default]
    TransparentBlack,
    /// Channels 0, alpha 1.
    OpaqueBlack,
    /// All channels 1.
    OpaqueWhite,
    /// All channels 0, for integer textures.
    TransparentBlackInteger,
    /// Channels 0, alpha 1, for integer textures.
    OpaqueBlackInteger,
    /// All channels 1, for integer textures.
    OpaqueWhiteInteger,
    /// Any colour ([`OptionalFeature::CustomBorderColorWithoutFormat`](crate::OptionalFeature)). Devices may round it
    /// to the precision of the sampled texture. The number of such samplers at a time is
    /// [limited](crate::Limits::max_custom_borders).
    Custom([f32; 4]),
    /// Any colour, for integer textures; see [`Custom`](BorderColor::Custom).
    CustomInteger([u32; 4]),
}

impl BorderColor {
    fn raw(self) -> vk::BorderColor {
        match self {
            Self::TransparentBlack => vk::BorderColor::FLOAT_TRANSPARENT_BLACK,
            Self::OpaqueBlack => vk::BorderColor::FLOAT_OPAQUE_BLACK,
            Self::OpaqueWhite => vk::BorderColor::FLOAT_OPAQUE_WHITE,
            Self::TransparentBlackInteger => vk::BorderColor::INT_TRANSPARENT_BLACK,
            Self::OpaqueBlackInteger => vk::BorderColor::INT_OPAQUE_BLACK,
            Self::OpaqueWhiteInteger => vk::BorderColor::INT_OPAQUE_WHITE,
            Self::Custom(_) => vk::BorderColor::FLOAT_CUSTOM_EXT,
            Self::CustomInteger(_) => vk::BorderColor::INT_CUSTOM_EXT,
        }
    }

    /// Returns the colour if it is a custom one.
    fn custom_color(self) -> Option<vk::ClearColorValue> {
        match self {
            Self::Custom(float32) => Some(vk::ClearColorValue { float32 }),
            Self::CustomInteger(uint32) => Some(vk::ClearColorValue { uint32 }),
            _ => None,
        }
    }
}

/// Reduction of the texels that a filter reads (`VkSamplerReductionMode`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum SamplerReductionMode {
    /// The weighted mean.
    #[default]
    Mean,
    /// The least texel with a weight, channel by channel. Needs a format with
    /// [`FormatSupport::min_max`](crate::FormatSupport).
    Min,
    /// The greatest texel with a weight, channel by channel. Needs a format with
    /// [`FormatSupport::min_max`](crate::FormatSupport).
    Max,
}

impl SamplerReductionMode {
    fn raw(self) -> vk::SamplerReductionMode {
        match self {
            Self::Mean => vk::SamplerReductionMode::WEIGHTED_AVERAGE,
            Self::Min => vk::SamplerReductionMode::MIN,
            Self::Max => vk::SamplerReductionMode::MAX,
        }
    }
}

/// A comparison of depths, or of a reference with a texel (`VkCompareOp`).
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
    /// Filter when texels are larger than pixels. Default: [`Filter::Linear`].
    pub mag_filter: Filter,
    /// Filter when texels are smaller than pixels. Default: [`Filter::Linear`].
    pub min_filter: Filter,
    /// Filter between mips. Default: [`Filter::Linear`].
    pub mip_filter: Filter,
    /// Addressing along u, v and w. Default: [`AddressMode::Repeat`] along each.
    pub address: [AddressMode; 3],
    /// Largest anisotropy, 1 to 16; clamped to the limit of the device. Default: 1.
    pub max_anisotropy: f32,
    /// Comparison of a comparison sampler, which shaders read through `kSamplersShadow[]`; `None` for other samplers.
    /// Default: none.
    pub compare: Option<CompareOp>,
    /// Colour beyond the edge under [`AddressMode::ClampToBorder`]. Default: [`BorderColor::TransparentBlack`].
    pub border: BorderColor,
    /// Reduction of the texels that are read. Must be the mean in comparison samplers.
    /// Default: [`SamplerReductionMode::Mean`].
    pub reduction: SamplerReductionMode,
    /// Value added to the level of detail; its magnitude is at most [`Limits::max_lod_bias`](crate::Limits).
    /// Default: 0.
    pub lod_bias: f32,
    /// Smallest and largest level of detail. Default: 0 and 1000, all mips (`VK_LOD_CLAMP_NONE`).
    pub lod_range: [f32; 2],
    /// Name in error messages, validation messages and debuggers. Default: `"sampler"`.
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
            border: BorderColor::TransparentBlack,
            reduction: SamplerReductionMode::Mean,
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
    /// Released after the sampler is destroyed.
    _custom_border: Option<CustomBorder>,
    gpu: Arc<Gpu>,
}

impl Sampler {
    pub(crate) fn new(gpu: &Arc<Gpu>, desc: &SamplerDesc<'_>, slot: u32) -> Result<Self> {
        check_sampler(gpu, desc)?;
        let custom = desc.border.custom_color();
        let custom_border = custom.map(|_| CustomBorder::acquire(gpu, desc.debug_name)).transpose()?;
        let mut border = vk::SamplerCustomBorderColorCreateInfoEXT::default()
            .custom_border_color(custom.unwrap_or_default());
        let mut reduction =
            vk::SamplerReductionModeCreateInfo::default().reduction_mode(desc.reduction.raw());
        let mut info = create_info(desc, gpu.caps.max_anisotropy);
        if custom_border.is_some() {
            info = info.push_next(&mut border);
        }
        if desc.reduction != SamplerReductionMode::Mean {
            info = info.push_next(&mut reduction);
        }
        // SAFETY: the description is valid, and the features it needs are on.
        let raw = unsafe { gpu.device.create_sampler(&info, None) }
            .map_err(Error::vulkan("vkCreateSampler", desc.debug_name))?;
        gpu.name(raw, desc.debug_name);
        let name = desc.debug_name.to_owned();
        Ok(Self { raw, slot, name, _custom_border: custom_border, gpu: Arc::clone(gpu) })
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        // SAFETY: the owner has waited until the GPU is done with the sampler.
        unsafe { self.gpu.device.destroy_sampler(self.raw, None) };
    }
}

/// One of the limited number of custom border colours of the device.
struct CustomBorder(Arc<Gpu>);

impl CustomBorder {
    fn acquire(gpu: &Arc<Gpu>, name: &str) -> Result<Self> {
        let limit = gpu.caps.limits.max_custom_borders;
        let taken = gpu.custom_borders.fetch_add(1, Ordering::Relaxed);
        let own = Self(Arc::clone(gpu));
        let what = "number of samplers with a border colour of their own";
        check_limit(name, what, u64::from(taken) + 1, limit.into())?;
        Ok(own)
    }
}

impl Drop for CustomBorder {
    fn drop(&mut self) {
        self.0.custom_borders.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Fails unless the device can create the sampler.
fn check_sampler(gpu: &Gpu, desc: &SamplerDesc<'_>) -> Result<()> {
    let wrong = |message: &str| Err(Error::usage(desc.debug_name, message));
    let [min_lod, max_lod] = desc.lod_range;
    let numbers = [min_lod, max_lod, desc.lod_bias, desc.max_anisotropy];
    if numbers.iter().any(|n| n.is_nan()) || min_lod > max_lod {
        return wrong("level of detail, bias and anisotropy must be numbers, and the range in order");
    }
    let needs = sampler_needs(desc.compare.is_some(), desc.lod_bias);
    gpu.require_portable(&format!("sampler '{}'", desc.debug_name), needs)?;
    let limit = gpu.caps.limits.max_lod_bias;
    if desc.lod_bias.abs() > limit {
        return wrong(&format!("the level of detail can be biased by {limit}, not by {}", desc.lod_bias));
    }
    if desc.compare.is_some() && desc.reduction != SamplerReductionMode::Mean {
        return wrong("comparison samplers take the mean of their results; leave the reduction at Mean");
    }
    let needed = [
        (desc.address.contains(&AddressMode::MirrorClampToEdge), OptionalFeature::MirrorClampToEdge),
        (desc.reduction != SamplerReductionMode::Mean, OptionalFeature::FilterMinMax),
        (desc.border.custom_color().is_some(), OptionalFeature::CustomBorderColors),
        (desc.border.custom_color().is_some(), OptionalFeature::CustomBorderColorWithoutFormat),
    ];
    match needed.into_iter().find(|(needs, feature)| *needs && !gpu.caps.has(*feature)) {
        None => Ok(()),
        Some((_, feature)) => Err(gpu.unsupported(&format!(
            "{}, which sampler '{}' needs",
            feature.vulkan_name(),
            desc.debug_name
        ))),
    }
}

fn create_info(desc: &SamplerDesc<'_>, max_anisotropy: f32) -> vk::SamplerCreateInfo<'static> {
    let anisotropy = desc.max_anisotropy.clamp(1.0, max_anisotropy);
    vk::SamplerCreateInfo::default()
        .mag_filter(desc.mag_filter.raw())
        .min_filter(desc.min_filter.raw())
        .mipmap_mode(raw_mip_mode(desc.mip_filter))
        .address_mode_u(raw_address_mode(desc.address[0]))
        .address_mode_v(raw_address_mode(desc.address[1]))
        .address_mode_w(raw_address_mode(desc.address[2]))
        .anisotropy_enable(anisotropy > 1.0)
        .max_anisotropy(anisotropy)
        .compare_enable(desc.compare.is_some())
        .compare_op(desc.compare.unwrap_or_default().raw())
        .border_color(desc.border.raw())
        .mip_lod_bias(desc.lod_bias)
        .min_lod(desc.lod_range[0])
        .max_lod(desc.lod_range[1])
}

fn raw_mip_mode(filter: Filter) -> vk::SamplerMipmapMode {
    match filter {
        Filter::Nearest => vk::SamplerMipmapMode::NEAREST,
        Filter::Linear => vk::SamplerMipmapMode::LINEAR,
    }
}

fn raw_address_mode(mode: AddressMode) -> vk::SamplerAddressMode {
    match mode {
        AddressMode::Repeat => vk::SamplerAddressMode::REPEAT,
        AddressMode::MirroredRepeat => vk::SamplerAddressMode::MIRRORED_REPEAT,
        AddressMode::ClampToEdge => vk::SamplerAddressMode::CLAMP_TO_EDGE,
        AddressMode::ClampToBorder => vk::SamplerAddressMode::CLAMP_TO_BORDER,
        AddressMode::MirrorClampToEdge => vk::SamplerAddressMode::MIRROR_CLAMP_TO_EDGE,
    }
}
