//! Uses of features that devices with `VK_KHR_portability_subset` may lack.

use super::optional_features::{FeatureSet, OptionalFeature};

/// A use of a feature that Vulkan promises, except on devices that implement a subset of Vulkan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PortabilityNeed {
    pub(crate) feature: OptionalFeature,
    /// The use, for the error.
    pub(crate) what: &'static str,
    /// The way around the feature.
    pub(crate) remedy: &'static str,
}

impl PortabilityNeed {
    pub(crate) const fn new(feature: OptionalFeature, what: &'static str, remedy: &'static str) -> Self {
        Self { feature, what, remedy }
    }
}

/// Returns the first use whose feature is not among `enabled`.
pub(crate) fn first_missing(
    needs: impl IntoIterator<Item = PortabilityNeed>,
    enabled: FeatureSet,
) -> Option<PortabilityNeed> {
    needs.into_iter().find(|need| !enabled.contains(need.feature))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_first_use_without_its_feature_is_named(
            enabled in prop::collection::vec(any::<bool>(), 15), used in prop::collection::vec(0..15_usize, 0..8)
        ) {
            let features: Vec<_> = FeatureSet::PORTABILITY.iter().collect();
            let on: FeatureSet =
                features.iter().zip(&enabled).filter(|(_, on)| **on).map(|(feature, _)| *feature).collect();
            let needs = used.iter().map(|index| PortabilityNeed::new(features[*index], "a use", "a remedy"));
            let expected = used.iter().find(|index| !enabled[**index]).map(|index| features[*index]);
            prop_assert_eq!(first_missing(needs, on).map(|need| need.feature), expected);
        }
    }
}
