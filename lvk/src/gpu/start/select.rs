//! Selects the physical device to use.

use std::cmp::Reverse;

use crate::error::device_candidate::{DeviceCandidate, DeviceKind};

/// One device, reduced to the properties that the selection depends on.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    /// Name, kind and missing requirements.
    pub(crate) device: DeviceCandidate,
    /// Bytes of device-local memory.
    pub(crate) local_memory_bytes: u64,
    /// Number of optional features that the device has.
    pub(crate) optional_score: u32,
}

impl Candidate {
    fn is_usable(&self) -> bool {
        self.device.missing.is_empty()
    }

    fn rank(&self) -> (Reverse<DeviceKind>, u32, u64) {
        (Reverse(self.device.kind), self.optional_score, self.local_memory_bytes)
    }
}

/// No device can be chosen. Holds the problem with the requested device, if one was requested.
#[derive(Debug, PartialEq)]
pub(crate) struct NoMatch(pub(crate) Option<String>);

/// Returns the index of the device to use.
///
/// `requested` is an index or a part of a name in any letter case. Without it, the best usable device is
/// chosen: by kind, then by optional features, then by memory, then by index.
///
/// # Errors
/// [`NoMatch`] if no device is usable, or if `requested` matches no device, several devices, or a device that lacks a
/// required feature.
pub(crate) fn choose(candidates: &[Candidate], requested: Option<&str>) -> Result<usize, NoMatch> {
    match requested.map(str::trim).filter(|requested| !requested.is_empty()) {
        Some(requested) => choose_named(candidates, requested).map_err(|problem| NoMatch(Some(problem))),
        None => choose_best(candidates).ok_or(NoMatch(None)),
    }
}

fn choose_best(candidates: &[Candidate]) -> Option<usize> {
    let usable = candidates.iter().enumerate().filter(|(_, candidate)| candidate.is_usable());
    // `max_by_key` returns the last of equal elements, so the list is reversed.
    usable.rev().max_by_key(|(_, candidate)| candidate.rank()).map(|(index, _)| index)
}

fn choose_named(candidates: &[Candidate], requested: &str) -> Result<usize, String> {
    match matches(candidates, requested).as_slice() {
        [index] if candidates[*index].is_usable() => Ok(*index),
        [index] => Err(format!("'{requested}' names device {index}, which cannot be used")),
        [] => Err(format!("'{requested}' names no device")),
        _ => Err(format!("'{requested}' names several devices, give an index")),
    }
}

/// Returns the indices of the matching devices. A number in range is an index. Names may contain numbers too,
/// so any other number is matched as part of a name.
fn matches(candidates: &[Candidate], requested: &str) -> Vec<usize> {
    if let Some(index) = requested.parse().ok().filter(|index| *index < candidates.len()) {
        return vec![index];
    }
    let requested = requested.to_lowercase();
    let named = |candidate: &Candidate| candidate.device.name.to_lowercase().contains(&requested);
    (0..candidates.len()).filter(|index| named(&candidates[*index])).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn device(name: &str, kind: DeviceKind, missing: &[&str]) -> Candidate {
        let missing = missing.iter().map(|what| (*what).to_owned()).collect();
        let (name, driver) = (name.to_owned(), String::new());
        let device = DeviceCandidate { index: 0, name, kind, api_version: (1, 3, 0), driver, missing };
        Candidate { device, local_memory_bytes: 1 << 30, optional_score: 0 }
    }

    fn machine() -> Vec<Candidate> {
        vec![
            device("llvmpipe", DeviceKind::Cpu, &[]),
            device("Radeon 780M", DeviceKind::Integrated, &[]),
            device("Radeon RX 580", DeviceKind::Discrete, &["ray query", "mesh shaders"]),
        ]
    }

    #[test]
    fn best_kind_that_lacks_nothing_wins() {
        assert_eq!(choose(&machine(), None).unwrap(), 1);
        assert_eq!(choose(&machine(), Some("  ")).unwrap(), 1);
    }

    #[test]
    fn optional_features_count_before_memory_and_ties_go_to_the_first() {
        let mut list = vec![device("a", DeviceKind::Discrete, &[]); 3];
        assert_eq!(choose(&list, None).unwrap(), 0);
        list[2].local_memory_bytes *= 2;
        assert_eq!(choose(&list, None).unwrap(), 2);
        list[1].optional_score = 1;
        assert_eq!(choose(&list, None).unwrap(), 1);
    }

    #[test]
    fn wish_is_an_index_or_part_of_a_name() {
        assert_eq!(choose(&machine(), Some("0")).unwrap(), 0);
        assert_eq!(choose(&machine(), Some("LLVM")).unwrap(), 0);
        assert_eq!(choose(&machine(), Some("780")).unwrap(), 1);
    }

    #[test]
    fn wish_that_cannot_be_met_is_a_problem() {
        for (requested, headline) in [
            ("voodoo", "'voodoo' names no device"),
            ("radeon", "'radeon' names several devices, give an index"),
            ("2", "'2' names device 2, which cannot be used"),
            ("580", "'580' names device 2, which cannot be used"),
        ] {
            assert_eq!(choose(&machine(), Some(requested)), Err(NoMatch(Some(headline.to_owned()))));
        }
    }

    #[test]
    fn machine_without_devices_says_so() {
        assert_eq!(choose(&[], None), Err(NoMatch(None)));
        assert_eq!(choose(&[], Some("0")), Err(NoMatch(Some("'0' names no device".to_owned()))));
    }

    fn candidate() -> impl Strategy<Value = Candidate> {
        use DeviceKind::{Cpu, Discrete, Integrated, Other, Virtual};
        let kind = prop::sample::select(vec![Discrete, Integrated, Virtual, Cpu, Other]);
        ("[ab]{1,3}", kind, 0..4_u64, prop::bool::weighted(0.4), 0..3_u32).prop_map(
            |(name, kind, local_memory_bytes, lacks, optional_score)| {
                let missing: &[&str] = if lacks { &["ray query"] } else { &[] };
                Candidate { local_memory_bytes, optional_score, ..device(&name, kind, missing) }
            },
        )
    }

    proptest! {
        #[test]
        fn chosen_device_lacks_nothing_and_none_is_better(
            list in prop::collection::vec(candidate(), 0..6), requested in prop::option::of("[abAB0-9]{0,2}")
        ) {
            match choose(&list, requested.as_deref()) {
                Ok(index) => {
                    prop_assert!(list[index].is_usable());
                    let better = |other: &&Candidate| other.is_usable() && other.rank() > list[index].rank();
                    prop_assert!(requested.is_some_and(|requested| !requested.is_empty()) || !list.iter().any(|c| better(&c)));
                }
                Err(NoMatch(problem)) => {
                    let open = requested.is_none_or(|requested| requested.is_empty());
                    prop_assert_eq!(problem.is_none(), open);
                    prop_assert!(!open || list.iter().all(|candidate| !candidate.is_usable()));
                }
            }
        }
    }
}
