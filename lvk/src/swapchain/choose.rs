//! Choice of swapchain parameters. Needs no device.

use ash::vk;

use super::desc::{ColorSpace, PresentMode};
use crate::format::Format;

/// Limits of a surface for its images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SurfaceLimits {
    pub(crate) min_images: u32,
    /// 0 means no limit.
    pub(crate) max_images: u32,
    /// Size of the window; [`ANY_EXTENT`] if the application chooses the size.
    pub(crate) current: [u32; 2],
    pub(crate) smallest: [u32; 2],
    pub(crate) largest: [u32; 2],
}

/// Extent of windows that adopt the size of their images.
pub(crate) const ANY_EXTENT: [u32; 2] = [u32::MAX; 2];

/// Returns the size of the images; `None` if no image can be presented.
pub(crate) fn choose_extent(limits: &SurfaceLimits, requested: [u32; 2]) -> Option<[u32; 2]> {
    if requested.contains(&0) || limits.largest.contains(&0) {
        return None;
    }
    let size = match limits.current {
        ANY_EXTENT => {
            std::array::from_fn(|side| requested[side].max(limits.smallest[side]).min(limits.largest[side]))
        }
        current => current,
    };
    (!size.contains(&0)).then_some(size)
}

/// Returns the number of images.
pub(crate) fn choose_image_count(limits: &SurfaceLimits, requested: u32, mode: PresentMode) -> u32 {
    let least = if mode == PresentMode::Mailbox { 3 } else { 0 };
    let requested = if requested == 0 { limits.min_images.saturating_add(1).max(least) } else { requested };
    let most = if limits.max_images == 0 { u32::MAX } else { limits.max_images };
    requested.max(limits.min_images).min(most)
}

/// Returns the first requested mode that is offered.
pub(crate) fn choose_present_mode(requested: &[PresentMode], offered: &[PresentMode]) -> PresentMode {
    requested.iter().copied().find(|wish| offered.contains(wish)).unwrap_or_default()
}

/// Returns format and colour space of the first request that is offered in a `usable` format.
pub(crate) fn choose_surface_format(
    requested: &[ColorSpace],
    offered: &[vk::SurfaceFormatKHR],
    usable: impl Fn(Format) -> bool,
) -> Option<(Format, ColorSpace)> {
    let is_offered = |format: Format, space: ColorSpace| {
        offered.iter().any(|pair| pair.format == format.raw() && pair.color_space == space.raw())
    };
    requested.iter().chain(&[ColorSpace::Srgb, ColorSpace::SrgbEncoded]).find_map(|space| {
        let mut formats = space.formats().iter().copied();
        let found = formats.find(|format| is_offered(*format, *space) && usable(*format));
        found.map(|format| (format, *space))
    })
}

/// Returns the composite alpha bit to use: opaque if it is offered, otherwise the lowest offered bit.
pub(crate) fn choose_composite_alpha(offered: vk::CompositeAlphaFlagsKHR) -> vk::CompositeAlphaFlagsKHR {
    if offered.contains(vk::CompositeAlphaFlagsKHR::OPAQUE) {
        return vk::CompositeAlphaFlagsKHR::OPAQUE;
    }
    let raw = offered.as_raw();
    vk::CompositeAlphaFlagsKHR::from_raw(raw & raw.wrapping_neg())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn limits() -> impl Strategy<Value = SurfaceLimits> {
        let side = || prop_oneof![Just(0_u32), 1..5000_u32];
        let current = prop_oneof![Just(ANY_EXTENT), [side(), side()]];
        (1..5_u32, 0..9_u32, current, [0..64_u32, 0..64], [side(), side()]).prop_map(
            |(min_images, extra, current, smallest, largest)| SurfaceLimits {
                min_images,
                max_images: if extra == 0 { 0 } else { min_images + extra - 1 },
                current,
                smallest,
                largest: [largest[0].max(smallest[0]), largest[1].max(smallest[1])],
            },
        )
    }

    fn modes() -> impl Strategy<Value = Vec<PresentMode>> {
        use PresentMode::{Fifo, FifoRelaxed, Immediate, Mailbox};
        prop::collection::vec(prop::sample::select(vec![Fifo, FifoRelaxed, Immediate, Mailbox]), 0..5)
    }

    proptest! {
        #[test]
        fn images_have_the_size_of_the_window_or_one_it_takes(limits in limits(), requested in [0..6000_u32, 0..6000]) {
            match choose_extent(&limits, requested) {
                Some(size) if limits.current == ANY_EXTENT => {
                    for side in 0..2 {
                        prop_assert!(size[side] >= limits.smallest[side] && size[side] <= limits.largest[side]);
                        let inside = requested[side] >= limits.smallest[side] && requested[side] <= limits.largest[side];
                        prop_assert!(!inside || size[side] == requested[side]);
                    }
                    prop_assert!(!size.contains(&0));
                }
                Some(size) => prop_assert!(size == limits.current && !size.contains(&0)),
                None => {
                    let sizes = [requested, limits.current, limits.largest];
                    prop_assert!(sizes.iter().any(|size| size.contains(&0)));
                }
            }
        }

        #[test]
        fn there_are_as_many_images_as_wished_where_there_can_be(
            limits in limits(), requested in 0..20_u32, mode in modes()
        ) {
            let mode = choose_present_mode(&mode, &mode);
            let count = choose_image_count(&limits, requested, mode);
            prop_assert!(count >= limits.min_images && (limits.max_images == 0 || count <= limits.max_images));
            let free = limits.max_images == 0 || limits.max_images > limits.min_images + 3;
            if requested == 0 && free {
                prop_assert!(count > limits.min_images && (mode != PresentMode::Mailbox || count >= 3));
            }
            if requested >= limits.min_images && (limits.max_images == 0 || requested <= limits.max_images) && requested > 0 {
                prop_assert_eq!(count, requested);
            }
        }

        #[test]
        fn the_mode_is_the_first_wish_there_is(requested in modes(), offered in modes()) {
            let chosen = choose_present_mode(&requested, &offered);
            let first = requested.iter().find(|wish| offered.contains(wish));
            prop_assert_eq!(chosen, first.copied().unwrap_or(PresentMode::Fifo));
        }

        #[test]
        fn the_format_is_offered_and_usable_and_of_the_first_space_that_can_be(
            requested in prop::collection::vec(prop::sample::select(SPACES.to_vec()), 0..4),
            offered in prop::collection::vec((prop::sample::select(SPACES.to_vec()), 0..3_usize), 0..6),
            unusable in prop::sample::select(Format::ALL),
        ) {
            let pair = |(space, which): &(ColorSpace, usize)| {
                let formats = space.formats();
                let format = formats[which % formats.len()];
                vk::SurfaceFormatKHR { format: format.raw(), color_space: space.raw() }
            };
            let offered: Vec<_> = offered.iter().map(pair).collect();
            let can_be = |space: &ColorSpace| space.formats().iter().any(|format| {
                let pair = vk::SurfaceFormatKHR { format: format.raw(), color_space: space.raw() };
                *format != unusable && offered.contains(&pair)
            });
            let found = choose_surface_format(&requested, &offered, |format| format != unusable);
            let expected = requested.iter().chain(&[ColorSpace::Srgb, ColorSpace::SrgbEncoded]).find(|space| can_be(space));
            prop_assert_eq!(found.map(|(_, space)| space), expected.copied());
            if let Some((format, space)) = found {
                let pair = vk::SurfaceFormatKHR { format: format.raw(), color_space: space.raw() };
                prop_assert!(format != unusable && offered.contains(&pair));
            }
        }
    }

    const SPACES: [ColorSpace; 5] = [
        ColorSpace::Srgb,
        ColorSpace::SrgbEncoded,
        ColorSpace::DisplayP3,
        ColorSpace::ExtendedSrgbLinear,
        ColorSpace::Hdr10,
    ];

    #[test]
    fn one_way_of_blending_with_the_desktop_is_taken() {
        use vk::CompositeAlphaFlagsKHR as Alpha;
        assert_eq!(choose_composite_alpha(Alpha::INHERIT | Alpha::OPAQUE), Alpha::OPAQUE);
        assert_eq!(choose_composite_alpha(Alpha::INHERIT | Alpha::PRE_MULTIPLIED), Alpha::PRE_MULTIPLIED);
    }
}
