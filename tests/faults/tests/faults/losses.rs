//! Lost devices, and the driver's report of why.

use lvk_faults::fault::{FaultError, PROGRESS, Span};
use lvk_faults::fault_report::{DESCRIPTION, FaultReport, REPORT_VARIABLE};
use lvk_faults::sweep::clean_program::CleanProgram;
use lvk_faults::sweep::plan::SweepPlan;
use lvk_faults::sweep::run::Program;

use crate::{assert_told, error_line, in_window, program, some, varies};

/// Returns a scenario whose device reports why it was lost.
fn reporting(program: Program, report: FaultReport) -> Program {
    let variable = (REPORT_VARIABLE.to_owned(), report.name().to_owned());
    Program { variables: [program.variables, vec![variable]].concat(), ..program }
}

/// Loses the device in each call that may lose it. Each error must have the driver's report, if there was a device.
fn assert_losses_are_explained(line: &str, program: Program, plan: &SweepPlan) {
    let program = reporting(program, FaultReport::Complete);
    let program = CleanProgram::new(program).unwrap();
    let description = DESCRIPTION.to_str().unwrap();
    let (mut explained, faults) = (0, plan.faults(&program.clean.calls));
    for fault in &faults {
        let (outcome, flaws) = program.run_until_reached(fault).unwrap();
        assert_eq!(flaws, [], "{line}, {fault}: {}", outcome.stderr);
        assert!(outcome.reached || varies(line) || fault.command == PROGRESS, "{line}, {fault}: not reached");
        let has_failed = outcome.reached && outcome.result.is_none() && fault.command != "vkCreateDevice";
        if has_failed {
            assert!(error_line(&outcome).contains(description), "{line}, {fault}: {}", outcome.stderr);
            explained += 1;
        }
    }
    println!("{line}: {explained} of {} losses explained", faults.len());
    assert!(explained > 0, "{line}");
}

/// Losses of a device, spread evenly.
fn losses(most: usize) -> SweepPlan {
    SweepPlan { errors: vec![FaultError::DeviceLost], spans: vec![Span::Once], ..some(most) }
}

/// The report has the description, the address, with the name of the buffer there, and the code. What fails in the query
/// of the report hides no loss.
#[test]
fn the_fault_of_a_lost_device_is_told() {
    for report in FaultReport::ALL {
        let program = reporting(program("device_fault"), report);
        let outcome = assert_told(program, "vkQueueSubmit2 1 device-lost once");
        let error = error_line(&outcome);
        let loss = "error: the device was lost in vkQueueSubmit2 for 'graphics queue'";
        let has_report = !matches!(report, FaultReport::NoCounts | FaultReport::NoLists);
        let start = if has_report {
            format!("{loss} (injected page fault; InvalidWrite at 0x")
        } else {
            format!("{loss}; ")
        };
        assert!(error.starts_with(&start), "{}: {error}", report.name());
        assert_eq!(
            error.contains("; injected unit (code 0x1d, data 0xfa))"),
            has_report,
            "{}: {error}",
            report.name()
        );
        let named = error.ends_with("; buffers at these addresses: target of the step");
        assert_eq!(named, has_report, "{}: {error}", report.name());
        let addresses = if report == FaultReport::Many { 8 } else { usize::from(has_report) };
        assert_eq!(error.matches("InvalidWrite").count(), addresses, "{}: {error}", report.name());
    }
}

#[test]
fn losses_are_told_with_their_fault() {
    for line in ["device_fault", "queues", "blas"] {
        assert_losses_are_explained(line, program(line), &losses(8));
    }
    let Some((_connection, _display, program)) = in_window(program("window")) else { return };
    assert_losses_are_explained("window", program, &losses(16));
}

/// Losses whose error once came without the report.
#[test]
fn losses_that_lacked_their_fault_have_it() {
    let assert_explained = |program: Program, fault| {
        let outcome = assert_told(reporting(program, FaultReport::Complete), fault);
        assert!(error_line(&outcome).contains("injected page fault"), "{fault}: {}", outcome.stderr);
    };
    assert_explained(program("blas"), "vkGetQueryPoolResults 2 device-lost once");
    let Some((_connection, _display, program)) = in_window(program("window")) else { return };
    assert_explained(program, "vkCreateSwapchainKHR 1 device-lost once");
}

#[test]
#[ignore = "minutes: .ci/slow faults"]
fn whole_losses_are_told_with_their_fault() {
    for line in ["device_fault", "queues", "threads", "blas", "blas_software", "hot_reload"] {
        assert_losses_are_explained(line, program(line), &losses(usize::MAX));
    }
    let Some((_connection, _display, program)) = in_window(program("window")) else { return };
    assert_losses_are_explained("window", program, &losses(usize::MAX));
}
