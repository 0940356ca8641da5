//! Limits of images by kind. Each kind is queried once, because the result never changes and a query costs as
//! much as creating the image.

use std::collections::HashMap;

use ash::vk;

use crate::lock_order::{Rank, RwLock};

/// Properties of an image that its limits depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct ImageKind {
    format: vk::Format,
    ty: vk::ImageType,
    tiling: vk::ImageTiling,
    usage: vk::ImageUsageFlags,
    flags: vk::ImageCreateFlags,
}

/// Limits of a kind of image, or the driver's error.
pub(crate) type ImageLimitsResult = Result<vk::ImageFormatProperties, vk::Result>;

/// Cached results.
pub(crate) struct ImageLimitCache(RwLock<HashMap<ImageKind, ImageLimitsResult>>);

impl ImageLimitCache {
    pub(crate) fn new() -> Self {
        Self(RwLock::new(Rank::ImageLimitCache, HashMap::new()))
    }

    /// Returns the limits of an image of this description, or the driver's error.
    pub(crate) fn image_limits(
        &self,
        instance: &ash::Instance,
        device: vk::PhysicalDevice,
        info: &vk::ImageCreateInfo<'_>,
    ) -> ImageLimitsResult {
        let kind = ImageKind {
            format: info.format,
            ty: info.image_type,
            tiling: info.tiling,
            usage: info.usage,
            flags: info.flags,
        };
        self.get_or_query(kind, || {
            // SAFETY: the physical device belongs to the instance.
            unsafe {
                instance.get_physical_device_image_format_properties(
                    device,
                    kind.format,
                    kind.ty,
                    kind.tiling,
                    kind.usage,
                    kind.flags,
                )
            }
        })
    }

    fn get_or_query(&self, kind: ImageKind, query: impl FnOnce() -> ImageLimitsResult) -> ImageLimitsResult {
        let known = self.0.read().get(&kind).copied();
        known.unwrap_or_else(|| {
            let answer = query();
            if is_permanent(&answer) {
                self.0.write().insert(kind, answer);
            }
            answer
        })
    }
}

/// True if a repeated query returns the same result. Errors other than an unsupported format may be
/// temporary, such as lack of memory.
fn is_permanent(answer: &ImageLimitsResult) -> bool {
    matches!(answer, Ok(_) | Err(vk::Result::ERROR_FORMAT_NOT_SUPPORTED))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: ImageKind = ImageKind {
        format: vk::Format::R8G8B8A8_UNORM,
        ty: vk::ImageType::TYPE_2D,
        tiling: vk::ImageTiling::OPTIMAL,
        usage: vk::ImageUsageFlags::SAMPLED,
        flags: vk::ImageCreateFlags::empty(),
    };

    /// Queries each kind twice. Returns whether each result was right, and the number of queries to the
    /// device.
    fn ask_twice(kinds: &[ImageKind], answer: impl Fn(&ImageKind) -> ImageLimitsResult) -> (Vec<bool>, u32) {
        let (limits, mut asked) = (ImageLimitCache::new(), 0);
        let mut get = |kind: &ImageKind| {
            limits.get_or_query(*kind, || {
                asked += 1;
                answer(kind)
            })
        };
        let size = |answer: ImageLimitsResult| answer.map(|limits| limits.max_resource_size);
        let right =
            [kinds, kinds].concat().iter().map(|kind| size(get(kind)) == size(answer(kind))).collect();
        (right, asked)
    }

    #[test]
    fn each_kind_of_image_has_its_own_answer_and_is_asked_for_once() {
        let kinds = [
            PLAIN,
            ImageKind { format: vk::Format::R8_UNORM, ..PLAIN },
            ImageKind { ty: vk::ImageType::TYPE_3D, ..PLAIN },
            ImageKind { tiling: vk::ImageTiling::LINEAR, ..PLAIN },
            ImageKind { usage: vk::ImageUsageFlags::STORAGE, ..PLAIN },
            ImageKind { flags: vk::ImageCreateFlags::CUBE_COMPATIBLE, ..PLAIN },
        ];
        let place = |kind: &ImageKind| kinds.iter().position(|other| other == kind).unwrap() as u64;
        let answer = |kind: &ImageKind| match place(kind) {
            0 => Err(vk::Result::ERROR_FORMAT_NOT_SUPPORTED),
            place => Ok(vk::ImageFormatProperties { max_resource_size: place, ..Default::default() }),
        };
        let (right, asked) = ask_twice(&kinds, answer);
        assert!(right.iter().all(|right| *right), "{right:?}");
        assert_eq!(asked, kinds.len() as u32);
    }

    #[test]
    fn a_device_that_was_short_of_memory_is_asked_again() {
        let (_, asked) = ask_twice(&[PLAIN], |_| Err(vk::Result::ERROR_OUT_OF_HOST_MEMORY));
        assert_eq!(asked, 2);
    }
}
