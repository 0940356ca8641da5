//! Texture accesses of one command: disjoint subresources, each with one use.

use crate::barrier::{ResourceId, Subresources, Use};

/// Subresources of images with their uses, and with their owners for error messages.
///
/// Entries of one image never overlap: subresources used twice have one entry, with both uses merged.
#[derive(Debug)]
pub(super) struct SubresourceAccesses<T> {
    accesses: Vec<SubresourceAccess<T>>,
}

/// Subresources of an image and their use by a command.
#[derive(Debug, Clone)]
pub(super) struct SubresourceAccess<T> {
    pub(super) id: ResourceId,
    pub(super) part: Subresources,
    pub(super) next: Use,
    pub(super) owner: T,
}

impl<T: Clone> SubresourceAccesses<T> {
    /// Adds a use. Fails with the owner of an earlier use of the same texels that conflicts with this one.
    #[inline]
    pub(super) fn add(&mut self, id: ResourceId, part: Subresources, next: Use, owner: T) -> Result<(), T> {
        // Most commands use one image. Its entry is written directly to the list, without a copy in memory between.
        if self.accesses.is_empty() {
            self.accesses.push(SubresourceAccess { id, part, next, owner });
            return Ok(());
        }
        self.add_to_others(SubresourceAccess { id, part, next, owner })
    }

    fn add_to_others(&mut self, new: SubresourceAccess<T>) -> Result<(), T> {
        let overlaps =
            |old: &SubresourceAccess<T>| old.id == new.id && old.part.intersection(new.part).is_some();
        match self.accesses.iter().position(overlaps) {
            None => {
                self.accesses.push(new);
                Ok(())
            }
            Some(index) => self.merge_at(index, new),
        }
    }

    /// Adds a use of texels. The entry at `index` is the first that overlaps them.
    fn merge_at(&mut self, index: usize, new: SubresourceAccess<T>) -> Result<(), T> {
        let first = &mut self.accesses[index];
        if first.part == new.part {
            first.next = first.next.merge(new.next).ok_or_else(|| first.owner.clone())?;
            return Ok(());
        }
        self.split_and_merge(index, new)
    }

    /// Adds a use of texels that overlap entries from `first` on. Splits entries whose use differs.
    fn split_and_merge(&mut self, first: usize, new: SubresourceAccess<T>) -> Result<(), T> {
        let mut rest = vec![new.part];
        for index in first..self.accesses.len() {
            let old = self.accesses[index].clone();
            let Some(both) = old.part.intersection(new.part).filter(|_| old.id == new.id) else { continue };
            let next = old.next.merge(new.next).ok_or_else(|| old.owner.clone())?;
            rest = rest.into_iter().flat_map(|piece| piece.without(both)).collect();
            if next != old.next {
                let kept = old.part.without(both).map(|part| SubresourceAccess { part, ..old.clone() });
                self.accesses.extend(kept);
                self.accesses[index] = SubresourceAccess { part: both, next, ..old };
            }
        }
        self.accesses.extend(rest.into_iter().map(|part| SubresourceAccess { part, ..new.clone() }));
        Ok(())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.accesses.is_empty()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &SubresourceAccess<T>> {
        self.accesses.iter()
    }

    pub(super) fn clear(&mut self) {
        self.accesses.clear();
    }
}

impl<T> Default for SubresourceAccesses<T> {
    fn default() -> Self {
        Self { accesses: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;
    use crate::barrier::Stages;

    fn uses() -> [Use; 4] {
        [
            Use::shader_read(Stages::COMPUTE),
            Use::shader_read(Stages::FRAGMENT),
            Use::shader_write(Stages::COMPUTE),
            Use::transfer_read(),
        ]
    }

    fn part() -> impl Strategy<Value = Subresources> {
        (0..4_u32, 1..4_u32, 0..4_u32, 1..4_u32).prop_map(|(base_mip, mip_count, base_layer, layer_count)| {
            Subresources { base_mip, mip_count, base_layer, layer_count }
        })
    }

    fn cells(part: Subresources) -> impl Iterator<Item = (u32, u32)> {
        let layers = part.base_layer..part.base_layer + part.layer_count;
        let mips = part.base_mip..part.base_mip + part.mip_count;
        layers.flat_map(move |layer| mips.clone().map(move |mip| (mip, layer)))
    }

    proptest! {
        /// Compares with a map that has one entry for each mip of each layer.
        #[test]
        fn every_subresource_has_the_merged_use_of_all_who_name_it(
            added in prop::collection::vec((0..2_u64, part(), 0..4_usize), 1..8)
        ) {
            let mut found = SubresourceAccesses::default();
            let mut expected: BTreeMap<(u64, u32, u32), (Use, usize)> = BTreeMap::new();
            for (owner, (id, part, kind)) in added.into_iter().enumerate() {
                let next = uses()[kind];
                let excluded = |cell: &(u64, u32, u32)| {
                    expected.get(cell).is_some_and(|(present, _)| present.merge(next).is_none())
                };
                let keys: Vec<_> = cells(part).map(|(mip, layer)| (id, mip, layer)).collect();
                let conflict = keys.iter().any(excluded);
                let answer = found.add(ResourceId(id), part, next, owner);
                prop_assert_eq!(answer.is_err(), conflict);
                if conflict {
                    return Ok(());
                }
                for key in keys {
                    let (present, _) = expected.entry(key).or_insert((next, owner));
                    *present = present.merge(next).unwrap();
                }
            }
            let mut seen = BTreeMap::new();
            for SubresourceAccess { id, part, next, owner } in found.iter().cloned() {
                for (mip, layer) in cells(part) {
                    prop_assert!(seen.insert((id.0, mip, layer), (next, owner)).is_none(), "parts overlap");
                }
            }
            prop_assert_eq!(seen, expected);
        }
    }

    #[test]
    fn a_conflict_names_the_owner_of_the_first_use() {
        let whole = Subresources { base_mip: 0, mip_count: 4, base_layer: 0, layer_count: 1 };
        let tail = Subresources { base_mip: 2, mip_count: 2, ..whole };
        let mut found = SubresourceAccesses::default();
        let id = ResourceId(1);
        found.add(id, tail, Use::shader_write(Stages::COMPUTE), "tail").unwrap();
        assert_eq!(found.add(id, whole, Use::shader_read(Stages::COMPUTE), "whole"), Err("tail"));
    }
}
