//! The faults of a sweep, as plain values.

use std::collections::HashMap;

use crate::call_log::Call;
use crate::fault::{Fault, FaultError};

/// Selection of faults.
#[derive(Clone, Debug)]
pub struct SweepPlan {
    /// Most faults to try. If there are more, those tried are spread evenly.
    pub most: usize,
    /// Errors to inject.
    pub errors: Vec<FaultError>,
    /// Faults of one call, and faults that stay.
    pub stays: Vec<bool>,
}

impl SweepPlan {
    /// Every fault.
    #[must_use]
    pub fn full() -> Self {
        Self { most: usize::MAX, errors: FaultError::ALL.to_vec(), stays: vec![false, true] }
    }

    /// Returns the faults for the calls of a run without fault.
    #[must_use]
    pub fn faults(&self, calls: &[Call]) -> Vec<Fault> {
        let mut counts: HashMap<&str, u32> = HashMap::new();
        let mut faults = Vec::new();
        for Call { command, errors } in calls {
            let call = counts.entry(command).or_default();
            *call += 1;
            for &error in errors.iter().filter(|error| self.errors.contains(error)) {
                let of = |&stays| Fault { command: command.clone(), call: *call, error, stays };
                // A swapchain that stays out of date shows nothing, which is no defect.
                let stays = self.stays.iter().filter(|stays| !**stays || error != FaultError::OutOfDate);
                faults.extend(stays.map(of));
            }
        }
        let stride = faults.len().div_ceil(self.most.max(1)).max(1);
        faults.into_iter().step_by(stride).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn call(command: &str, errors: &[FaultError]) -> Call {
        Call { command: command.into(), errors: errors.to_vec() }
    }

    #[test]
    fn each_call_fails_with_each_of_its_errors_once_and_for_good() {
        let memory = [FaultError::HostMemory, FaultError::DeviceMemory];
        let submit = [FaultError::HostMemory, FaultError::DeviceLost];
        let calls = [call("a", &memory), call("b", &submit), call("a", &memory)];
        let texts = |plan: &SweepPlan| {
            plan.faults(&calls).iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
        };
        let lost = SweepPlan { errors: vec![FaultError::DeviceLost], ..SweepPlan::full() };
        assert_eq!(texts(&lost), "b 1 device-lost once, b 1 device-lost stays");
        let once = SweepPlan { stays: vec![false], errors: vec![FaultError::HostMemory], most: 9 };
        assert_eq!(texts(&once), "a 1 host-memory once, b 1 host-memory once, a 2 host-memory once");
        assert_eq!(texts(&SweepPlan { most: 2, ..once }), "a 1 host-memory once, a 2 host-memory once");
        assert_eq!(SweepPlan::full().faults(&calls).len(), 12);
        let dated = [call("c", &[FaultError::OutOfDate])];
        assert_eq!(SweepPlan::full().faults(&dated).len(), 1, "it does not stay");
    }
}
