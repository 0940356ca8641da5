//! Messages of runs with a fault: the command, the object and the cause. The end of a context whose waits fail.

use std::collections::BTreeSet;

use lvk_faults::sweep::clean_program::CleanProgram;
use lvk_faults::sweep::plan::SweepPlan;
use lvk_faults::sweep::run::{Program, fault_layer, run};
use lvk_faults::sweep::verdict::{Ending, Flaw, RunOutcome, flaws};

use crate::{
    assert_reached, assert_told, assert_validated, clean, error_line, in_window, program, validated,
};

/// Fails unless the fault is reached without a flaw, and the line of its error has the expected words.
fn assert_tells(program: &CleanProgram, fault: &str, expected: &str) {
    let outcome = assert_reached(program, fault);
    assert!(error_line(&outcome).contains(expected), "{fault}: {}", outcome.stderr);
}

/// Faults that a whole sweep found once (docs/defects.md).
#[test]
fn faults_that_had_flaws_have_none() {
    assert_told(program("queues"), "vkQueueWaitIdle 1 device-memory stays");
    let blas = clean(program("blas"));
    for fault in ["vkGetQueryPoolResults 1 device-lost once", "vkCreateQueryPool 1 host-memory once"] {
        assert_reached(&blas, fault);
    }
    let Some((_connection, _display, program)) = in_window(program("window")) else { return };
    let program = clean(program);
    for fault in [
        "vkGetFenceStatus 1 device-lost once",
        "vkGetPhysicalDeviceSurfaceSupportKHR 1 host-memory once",
        "vkCreateXcbSurfaceKHR 1 host-memory once",
    ] {
        assert_reached(&program, fault);
    }
}

/// A pipeline that is linked from parts is named, not the part.
#[test]
fn an_error_of_a_part_names_its_pipeline() {
    let pipelines = clean(program("pipelines"));
    let count = pipelines.count("vkCreateGraphicsPipelines");
    assert!(count > 2, "parts, and their link: {count}");
    for number in 1..=count {
        let failed =
            assert_reached(&pipelines, &format!("vkCreateGraphicsPipelines {number} host-memory once"));
        let expected = "out of host memory in vkCreateGraphicsPipelines for 'cover'";
        assert!(error_line(&failed).contains(expected), "{}", failed.stderr);
    }
}

/// A semaphore of a present that failed is destroyed once the work before it has ended. An image that is acquired and not presented gives
/// its semaphore back. The validation layer is silent.
#[test]
fn semaphores_of_windows_outlive_their_work() {
    let Some((_connection, _display, program)) = in_window(validated("another_window")) else { return };
    let program = clean(program);
    assert_validated(&program);
    let told = |fault: &str, expected: &str| assert_tells(&program, fault, expected);
    told("vkQueuePresentKHR 1 host-memory once", "out of host memory in vkQueuePresentKHR for 'swapchain of");
    told("vkCreateSwapchainKHR 2 device-lost once", "lost in vkCreateSwapchainKHR for 'swapchain of");
    // The suspension waits for a present. Later calls of it find the device lost too.
    told("vkWaitForFences 1 device-lost once", "lost in vkWaitForFences for 'swapchain of");
    // At the end, where the fences tell that the presents have ended.
    assert_reached(&program, "vkWaitForFences 1 host-memory stays");
    // One of these submissions is the wait for the image that is never presented.
    let submissions = program.count("vkQueueSubmit2");
    assert!(submissions > 8, "{submissions}");
    for number in 1..=submissions {
        told(
            &format!("vkQueueSubmit2 {number} host-memory once"),
            "out of host memory in vkQueueSubmit2 for '",
        );
    }
}

/// A window that is in use is told, and the surface that was released where that has it.
#[test]
fn a_window_in_use_tells_what_has_it() {
    let Some((_connection, _display, program)) = in_window(validated("kept_surface")) else { return };
    let program = clean(program);
    assert_validated(&program);
    let told = |fault: &str, expected: &str| assert_tells(&program, fault, expected);
    let in_use = "swapchain of the scenario: its window has another swapchain";
    let kept = "swapchain of the scenario: its window has its former surface";
    // The context has a surface first, while it chooses a device.
    told("vkCreateXcbSurfaceKHR 1 window-in-use once", "vkCreateXcbSurfaceKHR failed for 'window'");
    for (number, expected) in [(1, in_use), (2, in_use), (3, kept)] {
        told(&format!("vkCreateXcbSurfaceKHR {} window-in-use once", number + 1), expected);
        told(&format!("vkCreateSwapchainKHR {number} window-in-use once"), expected);
    }
}

/// Staging memory is named with the object that it fills.
#[test]
fn an_error_of_staging_memory_names_what_it_fills() {
    let queues = clean(program("queues"));
    let lines: Vec<_> = (1..=queues.count("vkCreateBuffer"))
        .map(|number| assert_reached(&queues, &format!("vkCreateBuffer {number} host-memory once")))
        .map(|outcome| error_line(&outcome).to_owned())
        .collect();
    let expected = "out of host memory in vkCreateBuffer for 'staging of ";
    assert!(lines.iter().any(|line| line.contains(expected)), "{lines:#?}");
}

/// A structure that a compaction replaces stays until a copy of it has ended, though the wait for the copy fails.
#[test]
fn a_structure_outlives_its_serialisation() {
    let program = clean(validated("serialize"));
    assert_validated(&program);
    // A program waits for what the device has not ended yet, so the number of waits differs from run to run.
    let mut reached = 0;
    for number in 1..=program.count("vkWaitSemaphores") {
        let fault = format!("vkWaitSemaphores {number} host-memory once");
        let (outcome, flaws) = program.run(&fault.parse().unwrap()).unwrap();
        assert_eq!(flaws, [], "{fault}: {}", outcome.stderr);
        reached += usize::from(outcome.reached);
    }
    assert!(reached > 0, "no wait is reached");
}

/// Shortages in questions about what a driver supports are no lack of support.
#[test]
fn shortages_in_questions_are_no_lack_of_support() {
    let interop = clean(program("interop"));
    for command in
        ["vkGetPhysicalDeviceImageFormatProperties2", "vkGetPhysicalDeviceCalibrateableTimeDomainsKHR"]
    {
        let count = interop.count(command);
        assert!(count > 1, "{command}: {count}");
        for number in 1..=count {
            // The verdict asks for the command where the run fails.
            assert_reached(&interop, &format!("{command} {number} host-memory once"));
        }
    }
}

/// A driver that lacks address space answers success without an address. The allocator asks for a smaller block, and then reports
/// the shortage.
#[test]
fn mappings_without_an_address_are_shortages() {
    let raw = clean(program("raw_device"));
    let smaller = assert_reached(&raw, "vkMapMemory 1 no-address once");
    assert_eq!(smaller.ending, Ending::Status(0), "{}", smaller.stderr);
    let none = assert_reached(&raw, "vkMapMemory 1 no-address stays");
    assert!(error_line(&none).contains("out of host memory in vkMapMemory for '"), "{}", none.stderr);
}

/// Every fault of commands that few programs call: handles of shader groups, sizes of fragments, modifiers of shared images.
#[test]
fn commands_of_few_programs_fail_as_others_do() {
    let hybrid = "hybrid --width 64 --height 36 --frames 1 --rt hardware --scene SCENE";
    let few = [
        "vkGetRayTracingShaderGroupHandlesKHR",
        "vkGetPhysicalDeviceFragmentShadingRatesKHR",
        "vkGetImageDrmFormatModifierPropertiesEXT",
    ];
    let mut reached = BTreeSet::new();
    for line in [hybrid, "interop"] {
        let program = clean(program(line));
        let of_few = SweepPlan::full().faults(&program.clean.calls).into_iter();
        for fault in of_few.filter(|fault| few.contains(&&*fault.command)) {
            assert_reached(&program, &fault.to_string());
            reached.insert(fault.command);
        }
    }
    println!("reached: {reached:?}");
    assert!(reached.contains(few[0]), "{reached:?}");
}

/// Returns the scenario whose context ends before its work. The C library overwrites memory that is freed, so that a driver
/// that works on destroyed objects crashes.
fn slow_work() -> Program {
    let overwrite = ("MALLOC_PERTURB_".to_owned(), "165".to_owned());
    Program { variables: vec![overwrite], ..program("slow_work") }
}

/// The end of a context asks the timelines where the queue cannot be waited for. The context destroys nothing before its work
/// has ended: else lavapipe would execute a command buffer that is freed.
#[test]
fn objects_in_use_outlive_waits_that_fail() {
    let outcome = assert_told(slow_work(), "vkQueueWaitIdle 1 device-memory command");
    assert!(outcome.result.is_some() && !leaks(&outcome), "{}", outcome.stderr);
}

/// Where questions about the timelines fail too, the context is leaked.
#[test]
fn objects_that_may_be_in_use_are_leaked() {
    let outcome = assert_told(slow_work(), "vkQueueWaitIdle 1 device-memory unanswered");
    assert!(outcome.result.is_some() && leaks(&outcome), "{}", outcome.stderr);
    let said = "warning: the end of a context: out of device memory in vkQueueWaitIdle for 'graphics queue'; its objects are";
    assert!(outcome.stderr.contains(said), "{}", outcome.stderr);
}

/// True if objects are alive at the end.
fn leaks(outcome: &RunOutcome) -> bool {
    outcome.live.values().any(|count| *count != 0)
}

/// The path tracer reads the number of its rays after the picture.
#[test]
fn shortages_after_the_picture_are_errors() {
    let line = "viewer SCENE --width 64 --height 36 --frames 1 --rt query --samples 2 --method pathtrace";
    let program = clean(program(line));
    let last = program.count("vkQueueSubmit2");
    let outcome = assert_reached(&program, &format!("vkQueueSubmit2 {last} device-memory once"));
    assert!(outcome.result.is_some() && outcome.ending == Ending::Status(1), "{}", outcome.stderr);
}

/// Objects of calls that create nothing: recording, submission and waits.
#[test]
fn errors_of_recording_submission_and_waits_name_the_object() {
    let (layer, caches) = (fault_layer().unwrap(), tempfile::tempdir().unwrap());
    for (command, object) in [
        ("vkResetCommandPool", "command buffer of the graphics queue"),
        ("vkBeginCommandBuffer", "command buffer of the graphics queue"),
        ("vkEndCommandBuffer", "uploads and builds"),
        ("vkQueueSubmit2", "graphics queue"),
        ("vkWaitSemaphores", "timeline semaphore of the graphics queue"),
        ("vkEnumeratePhysicalDevices", "instance"),
    ] {
        let fault = format!("{command} 1 host-memory stays").parse().unwrap();
        let outcome = run(&program("hot_reload"), &layer, caches.path(), Some(&fault)).unwrap();
        let expected = format!("error: out of host memory in {command} for '{object}'\n");
        assert!(outcome.reached && outcome.stderr.contains(&expected), "{fault}: {}", outcome.stderr);
    }
}

/// The layer sees objects that are not destroyed, and the process what else it holds.
#[test]
fn what_a_scenario_forgets_is_seen() {
    let (layer, caches) = (fault_layer().unwrap(), tempfile::tempdir().unwrap());
    let ran = |line| run(&program(line), &layer, caches.path(), None).unwrap();
    let (clean, forgetful) = (ran("leak remembers"), ran("leak forgets"));
    assert_eq!(flaws(None, &clean, &clean), [], "{}", clean.stderr);
    let found = flaws(None, &forgetful, &clean);
    let [Flaw::Leak(leak), Flaw::Held(held)] = &*found else { panic!("{found:?}") };
    assert_eq!(leak, "1 VkFence", "{}", forgetful.stderr);
    assert!(held.starts_with("1 file descriptors, 1 threads, 6"), "{held}");
    let calls = &forgetful.calls;
    assert!(calls.len() > 50 && calls.iter().any(|call| call.command == "vkCreateFence"));
}

/// The layer of the faults lies above the validation layer, which sees what the library does.
#[test]
fn a_mistake_of_a_scenario_is_a_validation_message() {
    let (layer, caches) = (fault_layer().unwrap(), tempfile::tempdir().unwrap());
    let outcome = run(&validated("leak forgets"), &layer, caches.path(), None).unwrap();
    let found = flaws(None, &outcome, &outcome);
    let is_message =
        |flaw: &Flaw| matches!(flaw, Flaw::Validation(text) if text.contains("VUID-vkDestroyDevice"));
    assert!(found.iter().any(is_message), "{found:?}");
}

/// Faults are injected, and told by the name of the call; a library that goes on without ray tracing needs a device, too.
#[test]
fn a_fault_at_the_creation_of_the_device_is_told() {
    let (layer, caches) = (fault_layer().unwrap(), tempfile::tempdir().unwrap());
    for (error, text) in [("host-memory", "out of host memory"), ("device-lost", "lost")] {
        let fault = format!("vkCreateDevice 1 {error} stays").parse().unwrap();
        let outcome = run(&program("queues"), &layer, caches.path(), Some(&fault)).unwrap();
        assert!(outcome.reached && outcome.stderr.contains(text), "{}", outcome.stderr);
        assert!(outcome.stderr.contains("vkCreateDevice"), "{}", outcome.stderr);
    }
}

/// The layer stays loaded, so that a fault that is to happen once does not hit the second try.
#[test]
fn a_fault_happens_once_in_a_process() {
    let program = clean(program("queues"));
    let outcome = assert_reached(&program, "vkQueueSubmit2 2 device-lost once");
    assert_eq!((outcome.result, outcome.second_result), (None, program.clean.result));
}

/// Shortages in questions about formats, tools and cached pipelines are errors too: none is an answer that the program goes on with.
#[test]
fn shortages_in_other_questions_are_no_answers() {
    for (line, command) in [
        ("interop", "vkGetPhysicalDeviceImageFormatProperties"),
        ("interop", "vkGetPhysicalDeviceToolProperties"),
        ("yuv --width 64 --height 36 --frames 1", "vkGetPhysicalDeviceImageFormatProperties2"),
        ("yuv --width 64 --height 36 --frames 1", "vkCreatePipelineCache"),
    ] {
        let program = clean(program(line));
        let count = program.count(command);
        assert!(count > 0, "{line}: {command}");
        for number in 1..=count {
            let outcome = assert_reached(&program, &format!("{command} {number} host-memory once"));
            let start = format!("error: out of host memory in {command} for '");
            assert!(error_line(&outcome).starts_with(&start), "{line}: {}", outcome.stderr);
        }
    }
}
