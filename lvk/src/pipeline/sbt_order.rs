//! Order of the shader groups in a shader binding table.

/// One value for each region of a shader binding table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct PerRegion<T> {
    pub(crate) ray_gen: T,
    pub(crate) miss: T,
    pub(crate) hit: T,
    pub(crate) callable: T,
}

impl<T> PerRegion<T> {
    pub(crate) fn as_ref(&self) -> PerRegion<&T> {
        PerRegion { ray_gen: &self.ray_gen, miss: &self.miss, hit: &self.hit, callable: &self.callable }
    }

    pub(crate) fn map<U>(self, mut change: impl FnMut(T) -> U) -> PerRegion<U> {
        PerRegion {
            ray_gen: change(self.ray_gen),
            miss: change(self.miss),
            hit: change(self.hit),
            callable: change(self.callable),
        }
    }

    /// Returns the values in the order of the table: ray generation, miss, hit, callable.
    pub(crate) fn into_array(self) -> [T; 4] {
        [self.ray_gen, self.miss, self.hit, self.callable]
    }
}

/// Returns the group number of each record of the shader binding table.
///
/// `parts` holds the group counts of the pipeline itself and of each library. Vulkan numbers the groups part by part.
/// The table is ordered by region, and within a region by part.
pub(crate) fn sbt_order(parts: &[PerRegion<usize>]) -> Vec<usize> {
    let mut order: PerRegion<Vec<usize>> = PerRegion::default();
    let mut next = 0;
    for part in parts {
        let PerRegion { ray_gen, miss, hit, callable } = &mut order;
        for (region, count) in [ray_gen, miss, hit, callable].into_iter().zip(part.into_array()) {
            region.extend(next..next + count);
            next += count;
        }
    }
    order.into_array().concat()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn part() -> impl Strategy<Value = PerRegion<usize>> {
        (0..4_usize, 0..4_usize, 0..4_usize, 0..4_usize)
            .prop_map(|(ray_gen, miss, hit, callable)| PerRegion { ray_gen, miss, hit, callable })
    }

    proptest! {
        /// Labels each group with (region, part, index), numbers the groups as Vulkan does, and expects sorted labels.
        #[test]
        fn the_table_has_region_by_region_and_part_by_part(parts in prop::collection::vec(part(), 0..5)) {
            let mut labels = Vec::new();
            for (part, counts) in parts.iter().enumerate() {
                for (region, count) in counts.into_array().into_iter().enumerate() {
                    labels.extend((0..count).map(|place| (region, part, place)));
                }
            }
            let table: Vec<_> = sbt_order(&parts).into_iter().map(|group| labels[group]).collect();
            labels.sort_unstable();
            prop_assert_eq!(table, labels);
        }
    }

    #[test]
    fn a_library_stands_behind_the_pipelines_own() {
        let own = PerRegion { ray_gen: 1, miss: 2, hit: 1, callable: 0 };
        let library = PerRegion { ray_gen: 0, miss: 1, hit: 2, callable: 1 };
        assert_eq!(sbt_order(&[own]), [0, 1, 2, 3]);
        assert_eq!(sbt_order(&[own, library]), [0, 1, 2, 4, 3, 5, 6, 7]);
    }
}
