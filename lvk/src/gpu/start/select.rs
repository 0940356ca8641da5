//! Selects the physical device to use.

use std::cmp::Reverse;
use std::fmt;

use crate::error::{Error, Result};

/// Kind of a device, in order of preference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum DeviceKind {
    /// Graphics card.
    Discrete,
    /// Integrated GPU, which shares memory with the CPU.
    Integrated,
    /// Virtual GPU: part of a device, inside a virtual machine.
    Virtual,
    /// Software driver.
    Cpu,
    /// Anything else.
    Other,
}

impl fmt::Display for DeviceKind {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Cpu => "CPU",
            Self::Other => "other",
        })
    }
}

/// One device, reduced to the properties that the selection depends on.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    /// Name reported by the driver.
    pub(crate) name: String,
    /// Kind of the device.
    pub(crate) kind: DeviceKind,
    /// Bytes of device-local memory.
    pub(crate) local_memory_bytes: u64,
    /// Required features that the device lacks. Empty if the device is usable.
    pub(crate) missing: Vec<String>,
    /// Number of optional features that the device has.
    pub(crate) optional_score: u32,
}

impl Candidate {
    fn describe(&self, index: usize) -> String {
        let verdict = if self.missing.is_empty() {
            "usable".to_owned()
        } else {
            format!("lacks {}", self.missing.join(", "))
        };
        format!("[{index}] {} ({}): {verdict}", self.name, self.kind)
    }

    fn rank(&self) -> (Reverse<DeviceKind>, u32, u64) {
        (Reverse(self.kind), self.optional_score, self.local_memory_bytes)
    }
}

/// Returns the index of the device to use.
///
/// `requested` is an index or a part of a name in any letter case. Without it, the best usable device is
/// chosen: by kind, then by optional features, then by memory, then by index.
///
/// # Errors
/// [`Error::NoDevice`], which lists every device, if no device is usable, or if `requested` matches no
/// device, several devices, or a device that lacks a required feature.
pub(crate) fn choose(candidates: &[Candidate], requested: Option<&str>) -> Result<usize> {
    match requested.map(str::trim).filter(|requested| !requested.is_empty()) {
        Some(requested) => choose_named(candidates, requested),
        None => choose_best(candidates),
    }
}

fn choose_best(candidates: &[Candidate]) -> Result<usize> {
    let usable = candidates.iter().enumerate().filter(|(_, candidate)| candidate.missing.is_empty());
    // `max_by_key` returns the last of equal elements, so the list is reversed.
    let best = usable.rev().max_by_key(|(_, candidate)| candidate.rank());
    best.map(|(index, _)| index).ok_or_else(|| no_device(candidates, None))
}

fn choose_named(candidates: &[Candidate], requested: &str) -> Result<usize> {
    match matches(candidates, requested).as_slice() {
        [index] if candidates[*index].missing.is_empty() => Ok(*index),
        [index] => Err(no_device(
            candidates,
            Some(format!("'{requested}' names device {index}, which cannot be used")),
        )),
        [] => Err(no_device(candidates, Some(format!("'{requested}' names no device")))),
        _ => Err(no_device(candidates, Some(format!("'{requested}' names several devices, give an index")))),
    }
}

/// Returns the indices of the matching devices. A number in range is an index. Names may contain numbers too,
/// so any other number is matched as part of a name.
fn matches(candidates: &[Candidate], requested: &str) -> Vec<usize> {
    if let Some(index) = requested.parse().ok().filter(|index| *index < candidates.len()) {
        return vec![index];
    }
    let requested = requested.to_lowercase();
    let named = |candidate: &Candidate| candidate.name.to_lowercase().contains(&requested);
    (0..candidates.len()).filter(|index| named(&candidates[*index])).collect()
}

fn no_device(candidates: &[Candidate], headline: Option<String>) -> Error {
    let none = candidates.is_empty().then(|| "the driver reports no device".to_owned());
    let lines = candidates.iter().enumerate().map(|(index, candidate)| candidate.describe(index));
    let reasons: Vec<String> = headline.into_iter().chain(none).chain(lines).collect();
    Error::NoDevice { reasons: reasons.join("; ") }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn device(name: &str, kind: DeviceKind, missing: &[&str]) -> Candidate {
        let missing = missing.iter().map(|what| (*what).to_owned()).collect();
        Candidate { name: name.to_owned(), kind, local_memory_bytes: 1 << 30, missing, optional_score: 0 }
    }

    fn reasons(result: Result<usize>) -> String {
        match result {
            Err(Error::NoDevice { reasons }) => reasons,
            other => panic!("expected NoDevice, not {other:?}"),
        }
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
    fn wish_that_cannot_be_met_lists_every_device() {
        for (requested, headline) in [
            ("voodoo", "'voodoo' names no device"),
            ("radeon", "'radeon' names several devices, give an index"),
            ("2", "'2' names device 2, which cannot be used"),
            ("580", "'580' names device 2, which cannot be used"),
        ] {
            let text = reasons(choose(&machine(), Some(requested)));
            let parts: Vec<&str> = text.split("; ").collect();
            assert_eq!(parts[0], headline);
            assert_eq!(parts[1], "[0] llvmpipe (CPU): usable");
            assert_eq!(parts[3], "[2] Radeon RX 580 (discrete): lacks ray query, mesh shaders");
        }
    }

    #[test]
    fn machine_without_devices_says_so() {
        assert_eq!(reasons(choose(&[], None)), "the driver reports no device");
        assert!(reasons(choose(&[], Some("0"))).contains("names no device"));
    }

    fn candidate() -> impl Strategy<Value = Candidate> {
        use DeviceKind::{Cpu, Discrete, Integrated, Other, Virtual};
        let kind = prop::sample::select(vec![Discrete, Integrated, Virtual, Cpu, Other]);
        ("[ab]{1,3}", kind, 0..4_u64, prop::bool::weighted(0.4), 0..3_u32).prop_map(
            |(name, kind, local_memory_bytes, lacks, optional_score)| Candidate {
                name,
                kind,
                local_memory_bytes,
                missing: if lacks { vec!["ray query".to_owned()] } else { Vec::new() },
                optional_score,
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
                    prop_assert!(list[index].missing.is_empty());
                    let better = |other: &&Candidate| other.missing.is_empty() && other.rank() > list[index].rank();
                    prop_assert!(requested.is_some_and(|requested| !requested.is_empty()) || !list.iter().any(|c| better(&c)));
                }
                Err(error) => {
                    let text = error.to_string();
                    prop_assert!(!text.contains('\n'));
                    for (index, candidate) in list.iter().enumerate() {
                        prop_assert!(text.contains(&candidate.describe(index)));
                    }
                    let open = requested.is_none_or(|requested| requested.is_empty());
                    prop_assert!(!open || list.iter().all(|candidate| !candidate.missing.is_empty()));
                }
            }
        }
    }
}
