//! Which mip levels are resident, decided within a budget.

use lvk_gltf::ImageData;

/// Largest side of the levels that are always resident, in texels.
const TAIL_SIDE: u32 = 32;

/// The mip levels of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct MipChain {
    /// Bytes of each level, the largest first.
    bytes: Vec<u64>,
    /// The first level that is always resident; the smaller ones are too.
    coarsest: u32,
}

impl MipChain {
    /// The levels that a texture of the image has. If `is_pinned`, all of them are always resident.
    pub(super) fn new(image: &ImageData, mip_count: u32, is_pinned: bool) -> Self {
        let [width, height] = image.extent();
        let side = |level: u32, side: u32| side.checked_shr(level).unwrap_or(0).max(1);
        let bytes = (0..mip_count)
            .map(|level| image.format.level_bytes(side(level, width), side(level, height)))
            .collect();
        let tail = (0..mip_count).find(|level| side(*level, width.max(height)) <= TAIL_SIDE);
        let coarsest = if is_pinned { 0 } else { tail.unwrap_or(mip_count.saturating_sub(1)) };
        Self { bytes, coarsest }
    }

    /// The first level that is always resident.
    pub(super) fn coarsest(&self) -> u32 {
        self.coarsest
    }

    /// Bytes of a level and of all smaller ones.
    pub(super) fn bytes_from(&self, level: u32) -> u64 {
        self.bytes.iter().skip(level as usize).sum()
    }

    fn level(&self, wanted: u32, bias: u32) -> u32 {
        wanted.saturating_add(bias).min(self.coarsest)
    }
}

/// Bytes of images of which these levels and all smaller ones are resident.
pub(super) fn bytes(chains: &[MipChain], levels: &[u32]) -> u64 {
    chains.iter().zip(levels).map(|(chain, level)| chain.bytes_from(*level)).sum()
}

/// Bytes of what is always resident: the smallest budget.
pub(super) fn least_bytes(chains: &[MipChain]) -> u64 {
    chains.iter().map(|chain| chain.bytes_from(chain.coarsest)).sum()
}

/// The first level of each image that should be resident, where shaders want to read the levels `wanted`. All images are coarser than
/// wanted by as few levels as the budget allows; what is left of the budget makes some of them one level finer.
pub(super) fn plan(chains: &[MipChain], wanted: &[u32], budget: u64) -> Vec<u32> {
    let biased = |bias: u32| -> Vec<u32> {
        chains.iter().zip(wanted).map(|(chain, wanted)| chain.level(*wanted, bias)).collect()
    };
    let most = chains.iter().map(MipChain::coarsest).max().unwrap_or(0);
    let bias = (0..most).find(|bias| bytes(chains, &biased(*bias)) <= budget).unwrap_or(most);
    let mut levels = biased(bias);
    let mut used = bytes(chains, &levels);
    for ((chain, level), wanted) in chains.iter().zip(&mut levels).zip(wanted) {
        if *level > chain.level(*wanted, 0) {
            let more = chain.bytes_from(*level - 1) - chain.bytes_from(*level);
            if used.saturating_add(more) <= budget {
                (*level, used) = (*level - 1, used + more);
            }
        }
    }
    levels
}

/// The next image to load anew, and from which level on, on the way from the levels that are resident to a plan. Levels that no shader
/// wants stay until their room is needed. `None`: every image is as fine as planned.
pub(super) fn next_change(
    chains: &[MipChain],
    resident: &[u32],
    planned: &[u32],
    budget: u64,
) -> Option<(usize, u32)> {
    let pairs = || resident.iter().zip(planned).enumerate();
    let lacking = pairs().filter(|(_, (resident, planned))| resident > planned);
    let (image, (from, to)) = lacking.max_by_key(|(_, (resident, planned))| **resident - **planned)?;
    let chain = chains.get(image)?;
    let more = chain.bytes_from(*to).saturating_sub(chain.bytes_from(*from));
    if bytes(chains, resident).saturating_add(more) <= budget {
        return Some((image, *to));
    }
    let spare = pairs().filter(|(_, (resident, planned))| resident < planned);
    let (image, (_, to)) = spare.max_by_key(|(_, (resident, planned))| **planned - **resident)?;
    Some((image, *to))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lvk_gltf::{MipLevel, TexelFormat};
    use proptest::prelude::*;

    fn chain(width: u32, height: u32, is_pinned: bool) -> MipChain {
        let level = MipLevel { width, height, bytes: Vec::new() };
        let image = ImageData { format: TexelFormat::Rgba8, mips: vec![level] };
        MipChain::new(&image, width.max(height).ilog2() + 1, is_pinned)
    }

    #[test]
    fn a_chain_ends_at_one_texel_and_keeps_its_small_levels() {
        let chain = chain(256, 64, false);
        assert_eq!(
            chain.bytes_from(0),
            4 * (256 * 64 + 128 * 32 + 64 * 16 + 32 * 8 + 16 * 4 + 8 * 2 + 4 + 2 + 1)
        );
        assert_eq!((chain.coarsest(), chain.bytes_from(8), chain.bytes_from(9)), (3, 4, 0));
        assert_eq!(super::tests::chain(256, 64, true).coarsest(), 0);
        assert_eq!(super::tests::chain(16, 16, false).coarsest(), 0);
    }

    #[test]
    fn all_images_lose_the_same_and_the_first_gets_what_is_left() {
        let chains = vec![chain(128, 128, false); 3];
        let [whole, half] = [0, 1].map(|level| chains[0].bytes_from(level));
        assert_eq!(plan(&chains, &[0, 0, 0], 3 * whole), [0, 0, 0]);
        assert_eq!(plan(&chains, &[0, 0, 0], 3 * whole - 1), [0, 0, 1]);
        assert_eq!(plan(&chains, &[0, 1, 9], whole + 2 * half), [0, 1, 2]);
        assert_eq!(plan(&chains, &[0, 0, 0], 0), [2, 2, 2]);
    }

    fn cases() -> impl Strategy<Value = (Vec<MipChain>, Vec<u32>, Vec<u32>, u64)> {
        let image = (1..2048_u32, 1..2048_u32, prop::bool::weighted(0.1), 0..14_u32, 0..14_u32);
        (prop::collection::vec(image, 0..20), 0.0..1.2_f64).prop_map(|(images, share)| {
            let chains: Vec<_> = images
                .iter()
                .map(|(width, height, is_pinned, ..)| chain(*width, *height, *is_pinned))
                .collect();
            let wanted = images.iter().map(|image| image.3).collect();
            let resident =
                chains.iter().zip(&images).map(|(chain, image)| image.4.min(chain.coarsest)).collect();
            let whole: u64 = chains.iter().map(|chain| chain.bytes_from(0)).sum();
            let budget = ((whole as f64 * share) as u64).max(least_bytes(&chains));
            (chains, wanted, resident, budget)
        })
    }

    proptest! {
        #[test]
        fn a_plan_fits_and_none_that_fits_is_finer_everywhere((chains, wanted, _, budget) in cases()) {
            let levels = plan(&chains, &wanted, budget);
            prop_assert!(bytes(&chains, &levels) <= budget);
            let finest: Vec<_> = chains.iter().zip(&wanted).map(|(chain, wanted)| (*wanted).min(chain.coarsest)).collect();
            prop_assert!(levels.iter().zip(&finest).all(|(level, finest)| level >= finest));
            let finer: Vec<_> = levels.iter().zip(&finest).map(|(level, finest)| level.saturating_sub(1).max(*finest)).collect();
            prop_assert!(finer == levels || bytes(&chains, &finer) > budget);
        }

        #[test]
        fn changes_lead_to_the_plan_within_the_budget((chains, wanted, mut resident, budget) in cases()) {
            let planned = plan(&chains, &wanted, budget);
            // A budget may have been lowered.
            let bound = budget.max(bytes(&chains, &resident));
            for _ in 0..2 * chains.len() {
                let Some((image, level)) = next_change(&chains, &resident, &planned, budget) else { break };
                resident[image] = level;
                prop_assert!(bytes(&chains, &resident) <= bound);
            }
            prop_assert_eq!(next_change(&chains, &resident, &planned, budget), None);
            prop_assert!(resident.iter().zip(&planned).all(|(resident, planned)| resident <= planned));
        }
    }
}
