//! The faults of a sweep, as plain values.

use std::collections::HashMap;
use std::str::FromStr;

use crate::call_log::Call;
use crate::fault::{Fault, FaultError, Span};

/// Selection of faults.
#[derive(Clone, Debug)]
pub struct SweepPlan {
    /// Most faults to try. If there are more, those tried are spread evenly over the calls, for each error and each span.
    pub most: usize,
    /// Part of these faults to try, so that several runs share a sweep.
    pub part: Part,
    /// Commands that fail; all where there is none.
    pub commands: Vec<String>,
    /// Errors to inject.
    pub errors: Vec<FaultError>,
    /// Spans of the faults.
    pub spans: Vec<Span>,
    /// True if swapchains stay out of date, too: a program must give up at some frame, as none is shown.
    pub stays_out_of_date: bool,
}

/// One of several parts of a list: every `count`-th element, from the one numbered `index`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Number of the part, less than `count`.
    pub index: usize,
    /// Number of parts, at least 1.
    pub count: usize,
}

impl Part {
    /// The whole list.
    pub const WHOLE: Self = Self { index: 0, count: 1 };
}

impl FromStr for Part {
    type Err = String;

    /// Parses `2/3`, the second of three parts.
    fn from_str(text: &str) -> Result<Self, String> {
        let numbers =
            text.split_once('/').and_then(|(n, count)| Some((n.parse().ok()?, count.parse().ok()?)));
        match numbers {
            Some((number, count)) if (1..=count).contains(&number) => Ok(Self { index: number - 1, count }),
            _ => Err(format!("'{text}' is no part: write 2/3 for the second of three")),
        }
    }
}

impl SweepPlan {
    /// Every fault.
    #[must_use]
    pub fn full() -> Self {
        Self {
            most: usize::MAX,
            part: Part::WHOLE,
            commands: Vec::new(),
            errors: FaultError::ALL.to_vec(),
            spans: vec![Span::Once, Span::Stays],
            stays_out_of_date: false,
        }
    }

    /// Returns the faults for the calls of a run without fault.
    #[must_use]
    pub fn faults(&self, calls: &[Call]) -> Vec<Fault> {
        let mut counts: HashMap<&str, u32> = HashMap::new();
        let mut faults = Vec::new();
        for Call { command, errors, .. } in calls {
            let call = counts.entry(command).or_default();
            *call += 1;
            if !self.commands.is_empty() && !self.commands.contains(command) {
                continue;
            }
            for &error in errors.iter().filter(|error| self.errors.contains(error)) {
                let of = |&span| Fault { command: command.clone(), call: *call, error, span };
                let may_stay = self.stays_out_of_date || error != FaultError::OutOfDate;
                let spans = self.spans.iter().filter(|span| **span == Span::Once || may_stay);
                faults.extend(spans.map(of));
            }
        }
        let stride = faults.len().div_ceil(self.most.max(1)).max(1);
        if stride > 1 {
            // The errors and spans of a call follow each other: a stride could meet the same ones at every call.
            faults.sort_by_key(|fault| (fault.span, fault.error));
        }
        let chosen = faults.into_iter().step_by(stride);
        chosen.skip(self.part.index).step_by(self.part.count.max(1)).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
    use super::*;

    fn call(command: &str, errors: &[FaultError]) -> Call {
        Call { command: command.into(), errors: errors.to_vec(), fails: false }
    }

    fn texts_of(plan: &SweepPlan, calls: &[Call]) -> Vec<String> {
        plan.faults(calls).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn each_call_fails_with_each_of_its_errors_once_and_for_good() {
        let memory = [FaultError::HostMemory, FaultError::DeviceMemory];
        let submit = [FaultError::HostMemory, FaultError::DeviceLost];
        let calls = [call("a", &memory), call("b", &submit), call("a", &memory)];
        let texts = |plan: &SweepPlan| texts_of(plan, &calls).join(", ");
        let lost = SweepPlan { errors: vec![FaultError::DeviceLost], ..SweepPlan::full() };
        assert_eq!(texts(&lost), "b 1 device-lost once, b 1 device-lost stays");
        let once =
            SweepPlan { spans: vec![Span::Once], errors: vec![FaultError::HostMemory], ..SweepPlan::full() };
        assert_eq!(texts(&once), "a 1 host-memory once, b 1 host-memory once, a 2 host-memory once");
        assert_eq!(
            texts(&SweepPlan { most: 2, ..once.clone() }),
            "a 1 host-memory once, a 2 host-memory once"
        );
        assert_eq!(SweepPlan::full().faults(&calls).len(), 12);
        let of_b = SweepPlan { commands: vec!["b".to_owned()], ..once.clone() };
        assert_eq!(texts(&of_b), "b 1 host-memory once");
        let second = SweepPlan { part: "2/3".parse().unwrap(), ..once.clone() };
        assert_eq!(texts(&second), "b 1 host-memory once");
        // Half of the faults have half of those of each span.
        let half: Vec<Fault> = SweepPlan { most: 6, ..SweepPlan::full() }.faults(&calls);
        for span in [Span::Once, Span::Stays] {
            assert_eq!(half.iter().filter(|fault| fault.span == span).count(), 3, "{half:?}");
        }
        for bad in ["0/3", "4/3", "1", "/", "-1/2"] {
            assert!(bad.parse::<Part>().is_err(), "{bad}");
        }
        let dated = [call("c", &[FaultError::OutOfDate])];
        assert_eq!(texts_of(&SweepPlan::full(), &dated), ["c 1 out-of-date once"]);
        let stays = SweepPlan { stays_out_of_date: true, ..SweepPlan::full() };
        assert_eq!(texts_of(&stays, &dated), ["c 1 out-of-date once", "c 1 out-of-date stays"]);
    }
}
