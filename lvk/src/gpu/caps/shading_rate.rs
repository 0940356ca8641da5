//! Fragment shading rates: sizes, combiners and device limits.

use ash::vk;

use crate::error::{Error, Result};
use crate::gpu::answers::listed;

/// Combination of two rates into one (`VkFragmentShadingRateCombinerOpKHR`), separately for width and height.
/// All but [`Keep`](Self::Keep) and [`Replace`](Self::Replace) need [`ShadingRateLimits::combines`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ShadingRateCombiner {
    /// The first rate.
    #[default]
    Keep,
    /// The second rate.
    Replace,
    /// The finer of both rates.
    Min,
    /// The coarser of both rates.
    Max,
    /// The product of both rates. The sum of the exponents if [`ShadingRateLimits::multiplies`] is not set.
    Multiply,
}

impl ShadingRateCombiner {
    pub(crate) fn raw(self) -> vk::FragmentShadingRateCombinerOpKHR {
        use vk::FragmentShadingRateCombinerOpKHR as Raw;
        match self {
            Self::Keep => Raw::KEEP,
            Self::Replace => Raw::REPLACE,
            Self::Min => Raw::MIN,
            Self::Max => Raw::MAX,
            Self::Multiply => Raw::MUL,
        }
    }
}

/// Number of pixels that a fragment covers. The fragment shader runs once for all of them; coverage and depth
/// stay per pixel.
///
/// Three rates are combined: the rate of the pipeline or draw, of the primitive
/// (`gl_PrimitiveShadingRateEXT`), and of the pass's attachment. The device uses its coarsest size that is no
/// coarser than the result. Fragments are single pixels if shaders run once per sample. The same holds for
/// shaders that write depth, unless [`ShadingRateLimits::with_depth_writes`] is set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ShadingRate {
    /// Width and height in pixels, each 1, 2 or 4: one of [`Context::shading_rates`](crate::Context::shading_rates).
    /// Default: `[1, 1]`.
    pub size: [u32; 2],
    /// Combiner of the pipeline's rate with the primitive's rate. Default: [`ShadingRateCombiner::Keep`].
    pub primitive: ShadingRateCombiner,
    /// Combiner of that result with the attachment's rate. Default: [`ShadingRateCombiner::Keep`].
    pub attachment: ShadingRateCombiner,
}

impl Default for ShadingRate {
    fn default() -> Self {
        Self::new([1, 1])
    }
}

impl ShadingRate {
    /// Fragments of this size, independent of primitives and attachments.
    pub const fn new(size: [u32; 2]) -> Self {
        Self { size, primitive: ShadingRateCombiner::Keep, attachment: ShadingRateCombiner::Keep }
    }

    /// Fragments of the sizes given by the pass's attachment.
    pub const fn by_attachment() -> Self {
        Self { attachment: ShadingRateCombiner::Replace, ..Self::new([1, 1]) }
    }

    /// Fragments of the sizes given by primitives.
    pub const fn by_primitive() -> Self {
        Self { primitive: ShadingRateCombiner::Replace, ..Self::new([1, 1]) }
    }

    /// Returns the attachment texel, or `gl_PrimitiveShadingRateEXT`, that encodes this size. `None` for
    /// sides other than 1, 2 and 4.
    pub fn texel(size: [u32; 2]) -> Option<u8> {
        let [width, height] = [exponent(size[0])?, exponent(size[1])?];
        Some(width << 2 | height)
    }

    pub(crate) fn raw_size(&self) -> vk::Extent2D {
        vk::Extent2D { width: self.size[0], height: self.size[1] }
    }

    pub(crate) fn raw_combine(&self) -> [vk::FragmentShadingRateCombinerOpKHR; 2] {
        [self.primitive.raw(), self.attachment.raw()]
    }
}

fn exponent(side: u32) -> Option<u8> {
    match side {
        1 => Some(0),
        2 => Some(1),
        4 => Some(2),
        _ => None,
    }
}

/// A fragment size that a device supports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FragmentSize {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Sample counts of targets allowed with this size, as a sum: 5 means 1 and 4.
    pub samples: u32,
}

/// Shading rate limits of a device (`VkPhysicalDeviceFragmentShadingRatePropertiesKHR`). All zero if the
/// device has no shading rates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ShadingRateLimits {
    /// Maximum size of fragments, in pixels.
    pub max_size: [u32; 2],
    /// Minimum number of pixels per texel of an attachment, along each axis.
    pub min_texel: [u32; 2],
    /// Maximum number of pixels per texel of an attachment, along each axis.
    pub max_texel: [u32; 2],
    /// Maximum aspect ratio of the pixels per texel.
    pub max_texel_aspect: u32,
    /// True if the device supports [`ShadingRateCombiner::Min`], [`Max`](ShadingRateCombiner::Max) and
    /// [`Multiply`](ShadingRateCombiner::Multiply).
    pub combines: bool,
    /// True if [`ShadingRateCombiner::Multiply`] multiplies. Otherwise it adds exponents.
    pub multiplies: bool,
    /// True if fragments may cover several pixels with shaders that write depth.
    pub with_depth_writes: bool,
}

impl ShadingRateLimits {
    pub(crate) fn from_properties(raw: &vk::PhysicalDeviceFragmentShadingRatePropertiesKHR<'_>) -> Self {
        let size = |extent: vk::Extent2D| [extent.width, extent.height];
        Self {
            max_size: size(raw.max_fragment_size),
            min_texel: size(raw.min_fragment_shading_rate_attachment_texel_size),
            max_texel: size(raw.max_fragment_shading_rate_attachment_texel_size),
            max_texel_aspect: raw.max_fragment_shading_rate_attachment_texel_size_aspect_ratio,
            combines: raw.fragment_shading_rate_non_trivial_combiner_ops == vk::TRUE,
            multiplies: raw.fragment_shading_rate_strict_multiply_combiner == vk::TRUE,
            with_depth_writes: raw.fragment_shading_rate_with_shader_depth_stencil_writes == vk::TRUE,
        }
    }

    /// Returns an error unless a texel of an attachment may cover this number of pixels.
    pub(crate) fn check_texel(&self, texel: [u32; 2]) -> Result<(), String> {
        let fits = (0..2).all(|axis| {
            let range = self.min_texel[axis]..=self.max_texel[axis];
            texel[axis].is_power_of_two() && range.contains(&texel[axis])
        });
        let [short, long] = [texel[0].min(texel[1]), texel[0].max(texel[1])];
        if fits && long / short.max(1) <= self.max_texel_aspect {
            return Ok(());
        }
        Err(format!(
            "a texel stands for {texel:?} pixels, but the device takes powers of two from {:?} to {:?}, one side at most {} \
             times the other",
            self.min_texel, self.max_texel, self.max_texel_aspect
        ))
    }
}

/// Reason why a rate cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum ShadingRateError {
    /// Invalid on every device.
    Wrong(String),
    /// Unsupported by this device.
    Lacks(String),
}

/// Returns an error unless the device supports the rate's size with this sample count, and the rate's
/// combiners.
pub(crate) fn check_rate(
    rate: &ShadingRate,
    samples: u32,
    sizes: &[FragmentSize],
    combines: bool,
) -> Result<(), ShadingRateError> {
    if ShadingRate::texel(rate.size).is_none() {
        let message = format!("fragments are 1, 2 or 4 pixels wide and high, not {:?}", rate.size);
        return Err(ShadingRateError::Wrong(message));
    }
    let fits = |known: &&FragmentSize| known.samples & samples != 0 || known.size == [1, 1];
    let there: Vec<[u32; 2]> = sizes.iter().filter(fits).map(|known| known.size).collect();
    if rate.size != [1, 1] && !there.contains(&rate.size) {
        return Err(ShadingRateError::Lacks(format!("with {samples} samples a pixel it has {there:?}")));
    }
    let simple =
        |by: ShadingRateCombiner| matches!(by, ShadingRateCombiner::Keep | ShadingRateCombiner::Replace);
    if combines || [rate.primitive, rate.attachment].into_iter().all(simple) {
        return Ok(());
    }
    Err(ShadingRateError::Lacks(
        "it only keeps or replaces rates (fragmentShadingRateNonTrivialCombinerOps)".to_owned(),
    ))
}

/// The functions of `VK_KHR_fragment_shading_rate`, and the fragment sizes of the device.
pub(crate) struct ShadingRates {
    pub(crate) functions: ash::khr::fragment_shading_rate::Device,
    pub(crate) sizes: Vec<FragmentSize>,
}

impl ShadingRates {
    /// Creates the functions, for a device with
    /// [`OptionalFeature::PipelineShadingRate`](crate::OptionalFeature::PipelineShadingRate).
    pub(crate) fn new(instance: &ash::Instance, device: &ash::Device, sizes: Vec<FragmentSize>) -> Self {
        Self { functions: ash::khr::fragment_shading_rate::Device::new(instance, device), sizes }
    }
}

/// Returns the fragment sizes of a device that has the extension.
///
/// # Errors
/// Those of `vkGetPhysicalDeviceFragmentShadingRatesKHR`.
pub(crate) fn query_fragment_sizes(
    entry: &ash::Entry,
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
) -> Result<Vec<FragmentSize>> {
    let functions = ash::khr::fragment_shading_rate::Instance::new(entry, instance);
    let ask = functions.fp().get_physical_device_fragment_shading_rates_khr;
    // SAFETY: the physical device belongs to the instance and has the extension. The list is null, or has room for the count.
    fragment_sizes(|count, list| unsafe { ask(physical, count, list) })
}

/// Returns the fragment sizes through `ask`, which works like `vkGetPhysicalDeviceFragmentShadingRatesKHR` of one device.
fn fragment_sizes(
    ask: impl FnMut(&mut u32, *mut vk::PhysicalDeviceFragmentShadingRateKHR<'static>) -> vk::Result,
) -> Result<Vec<FragmentSize>> {
    let found =
        listed(ask).map_err(Error::vulkan("vkGetPhysicalDeviceFragmentShadingRatesKHR", "fragment sizes"))?;
    let size = |raw: &vk::PhysicalDeviceFragmentShadingRateKHR<'_>| FragmentSize {
        size: [raw.fragment_size.width, raw.fragment_size.height],
        // Drivers set all bits for single pixels, which support every sample count.
        samples: raw.sample_counts.as_raw() & 0x7f,
    };
    Ok(found.iter().map(size).collect())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Fragment sizes of a typical desktop GPU, coarse to fine.
    const SIZES: [FragmentSize; 4] = [
        FragmentSize { size: [4, 4], samples: 1 },
        FragmentSize { size: [2, 2], samples: 7 },
        FragmentSize { size: [1, 2], samples: 7 },
        FragmentSize { size: [1, 1], samples: 127 },
    ];

    #[test]
    fn texels_are_exponents_of_two() {
        for (size, texel) in [([1, 1], 0), ([1, 2], 1), ([2, 1], 4), ([2, 2], 5), ([4, 2], 9), ([4, 4], 10)] {
            assert_eq!(ShadingRate::texel(size), Some(texel));
        }
        for size in [[0, 1], [3, 1], [1, 8]] {
            assert_eq!(ShadingRate::texel(size), None);
        }
    }

    #[test]
    fn sizes_are_those_of_the_device_for_the_samples() {
        let of = |size, samples| check_rate(&ShadingRate::new(size), samples, &SIZES, true);
        assert_eq!(of([4, 4], 1), Ok(()));
        assert_eq!(of([2, 2], 4), Ok(()));
        assert_eq!(of([1, 1], 64), Ok(()));
        let lacks = "with 4 samples a pixel it has [[2, 2], [1, 2], [1, 1]]".to_owned();
        assert_eq!(of([4, 4], 4), Err(ShadingRateError::Lacks(lacks)));
        assert!(matches!(of([2, 1], 1), Err(ShadingRateError::Lacks(_))));
        assert!(matches!(of([3, 1], 1), Err(ShadingRateError::Wrong(why)) if why.ends_with("not [3, 1]")));
        assert_eq!(
            check_rate(&ShadingRate::default(), 1, &[], false),
            Ok(()),
            "single pixels are everywhere"
        );
    }

    #[test]
    fn only_some_devices_compare_rates() {
        use ShadingRateCombiner::{Keep, Max, Min, Multiply, Replace};
        for (by, simple) in [(Keep, true), (Replace, true), (Min, false), (Max, false), (Multiply, false)] {
            for rate in [
                ShadingRate { primitive: by, ..ShadingRate::default() },
                ShadingRate { attachment: by, ..ShadingRate::default() },
            ] {
                assert_eq!(check_rate(&rate, 1, &SIZES, false).is_ok(), simple, "{by:?}");
                assert_eq!(check_rate(&rate, 1, &SIZES, true), Ok(()));
            }
        }
    }

    proptest! {
        #[test]
        fn texels_of_attachments_are_within_the_limits(
            texel in prop::array::uniform2(0..40_u32), least in 0..4_u32, more in 0..3_u32, aspect in 1..5_u32,
        ) {
            let limits = ShadingRateLimits {
                min_texel: [1 << least; 2],
                max_texel: [1 << (least + more); 2],
                max_texel_aspect: aspect,
                ..Default::default()
            };
            let sides = texel.iter().all(|side| {
                (least..=least + more).any(|exponent| *side == 1 << exponent)
            });
            let square = texel[0].max(texel[1]) <= aspect * texel[0].min(texel[1]);
            prop_assert_eq!(limits.check_texel(texel).is_ok(), sides && square);
        }
    }

    /// Answers as a driver of two sizes would, but for the call `fails_at`, counted from 1.
    fn two_sizes(
        fails_at: usize,
        error: vk::Result,
    ) -> impl FnMut(&mut u32, *mut vk::PhysicalDeviceFragmentShadingRateKHR<'static>) -> vk::Result {
        let mut calls = 0;
        move |count, list| {
            calls += 1;
            if calls == fails_at {
                return error;
            }
            *count = 2;
            if !list.is_null() {
                let known = |width, samples| vk::PhysicalDeviceFragmentShadingRateKHR {
                    fragment_size: vk::Extent2D { width, height: 1 },
                    sample_counts: vk::SampleCountFlags::from_raw(samples),
                    ..Default::default()
                };
                // SAFETY: the list has room for two sizes.
                unsafe { (*list, *list.add(1)) = (known(2, 3), known(1, u32::MAX)) };
            }
            vk::Result::SUCCESS
        }
    }

    #[test]
    fn sizes_are_listed_and_a_list_that_was_incomplete_is_asked_for_again() {
        let expected =
            [FragmentSize { size: [2, 1], samples: 3 }, FragmentSize { size: [1, 1], samples: 127 }];
        assert_eq!(fragment_sizes(two_sizes(0, vk::Result::SUCCESS)).unwrap(), expected);
        assert_eq!(fragment_sizes(two_sizes(2, vk::Result::INCOMPLETE)).unwrap(), expected);
    }

    #[test]
    fn a_driver_without_memory_for_its_sizes_is_no_device_without_sizes() {
        for (error, what) in [
            (vk::Result::ERROR_OUT_OF_HOST_MEMORY, "host"),
            (vk::Result::ERROR_OUT_OF_DEVICE_MEMORY, "device"),
        ] {
            for call in [1, 2] {
                let told = fragment_sizes(two_sizes(call, error)).unwrap_err().to_string();
                let expected = format!(
                    "out of {what} memory in vkGetPhysicalDeviceFragmentShadingRatesKHR for 'fragment sizes'"
                );
                assert_eq!(told, expected, "call {call}");
            }
        }
    }

    #[test]
    fn a_device_without_attachments_takes_no_texel() {
        assert!(ShadingRateLimits::default().check_texel([16, 16]).is_err());
        assert!(ShadingRateLimits::default().check_texel([0, 0]).is_err());
    }
}
