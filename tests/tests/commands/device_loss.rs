//! The report of a lost device: unfinished submissions of each queue with their names and labels.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::sync::Arc;

use lvk::ash::vk;
use lvk::test_hooks::{lose_device_after, with_fault_injection};
use lvk::{Context, DeviceLossReport, Error, Label, LabelProgress, Queue, QueueRequest, RawWait};
use lvk_tests::warnings::{capture_warnings, take_warnings};
use lvk_tests::{TestDevice, device_with};

/// A timeline semaphore that work waits for, until the value is dropped.
struct Gate<'a> {
    ctx: &'a Context,
    semaphore: vk::Semaphore,
}

impl<'a> Gate<'a> {
    fn new(ctx: &'a Context) -> Self {
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the device is alive, and timeline semaphores are on.
        let semaphore = unsafe { ctx.raw_device().create_semaphore(&info, None) }.unwrap();
        Self { ctx, semaphore }
    }

    /// Submits a command buffer that does not begin before the gate opens.
    fn submit(&self, cmd: lvk::CommandBuffer) -> u64 {
        let stages = vk::PipelineStageFlags2::ALL_COMMANDS;
        let wait = RawWait { semaphore: self.semaphore, value: 1, stages };
        // SAFETY: the semaphore is signalled when the value is dropped.
        unsafe { self.ctx.submit_with(cmd, &[wait], &[]) }.unwrap().raw_value()
    }
}

impl Drop for Gate<'_> {
    fn drop(&mut self) {
        let device = self.ctx.raw_device();
        let info = vk::SemaphoreSignalInfo::default().semaphore(self.semaphore).value(1);
        // SAFETY: the value rises, and the GPU is done with the semaphore before it is destroyed.
        unsafe {
            device.signal_semaphore(&info).unwrap();
            device.device_wait_idle().unwrap();
            device.destroy_semaphore(self.semaphore, None);
        }
    }
}

fn context(queues: QueueRequest) -> Option<TestDevice> {
    with_fault_injection(|| device_with(|desc| desc.queues = queues))
}

fn lost(answer: lvk::Result<lvk::SubmitHandle>) -> Arc<DeviceLossReport> {
    match answer {
        Err(Error::DeviceLost { report }) => report,
        other => panic!("{other:?}"),
    }
}

/// Submits nothing, which reports that the device is lost.
fn lose(ctx: &Context) -> Arc<DeviceLossReport> {
    let cmd = ctx.acquire_command_buffer().unwrap();
    lose_device_after(0);
    lost(ctx.submit(cmd))
}

#[test]
fn unfinished_command_buffers_are_reported_with_their_names_and_labels() {
    let Some(ctx) = context(QueueRequest::Shared) else { return };
    let mut done = ctx.acquire_command_buffer().unwrap();
    done.set_debug_name("done before");
    done.push_label("not reported");
    ctx.wait(ctx.submit(done).unwrap()).unwrap();
    let gate = Gate::new(&ctx);
    let mut frame = ctx.acquire_command_buffer().unwrap();
    frame.push_label("shadow");
    frame.pop_label();
    frame.push_label(Label::colored("shade", [1.0, 0.5, 0.0]));
    frame.insert_label("a place");
    frame.push_label(&String::from("lights"));
    frame.set_debug_name("frame");
    let values = [gate.submit(frame), gate.submit(ctx.acquire_command_buffer().unwrap())];
    let report = lose(&ctx);
    let [queue] = &report.queues[..] else { panic!("{report:#}") };
    assert_eq!((report.call, queue.queue, queue.submitted), ("vkQueueSubmit2", Queue::Graphics, values[1]));
    assert!(queue.completed < values[0]);
    let found: Vec<_> = queue.unfinished.iter().map(|commands| (commands.value, &*commands.name)).collect();
    assert_eq!(found, [(values[0], "frame"), (values[1], "")]);
    let labels: Vec<_> =
        queue.unfinished[0].labels.iter().map(|label| (&*label.name, label.depth, label.progress)).collect();
    let unknown = LabelProgress::Unknown;
    assert_eq!(
        labels,
        [("shadow", 0, unknown), ("shade", 0, unknown), ("a place", 1, unknown), ("lights", 1, unknown)]
    );
    let text = Error::DeviceLost { report: Arc::clone(&report) }.to_string();
    assert_eq!(
        text,
        format!(
            "the device was lost in vkQueueSubmit2 for 'graphics queue'; the graphics queue had not finished \
             submission {} 'frame' with the labels 'shadow', 'shade', nor 1 after it; create a new context",
            values[0]
        )
    );
    // Later calls repeat the report, also those that the loss did not reach.
    let again = lost(ctx.submit(ctx.acquire_command_buffer().unwrap()));
    assert!(Arc::ptr_eq(&report, &again));
}

#[test]
fn each_queue_has_a_list_of_its_own() {
    let Some(ctx) = context(QueueRequest::Emulated) else { return };
    for queue in Queue::ALL {
        ctx.wait(ctx.submit(ctx.acquire_command_buffer_on(queue).unwrap()).unwrap()).unwrap();
    }
    let gate = Gate::new(&ctx);
    let mut cmd = ctx.acquire_command_buffer_on(Queue::Compute).unwrap();
    cmd.set_debug_name("simulation");
    cmd.push_label("step");
    let value = gate.submit(cmd);
    let report = lose(&ctx);
    let [queue] = &report.queues[..] else { panic!("{report:#}") };
    assert_eq!((queue.queue, queue.submitted, queue.unfinished.len()), (Queue::Compute, value, 1));
    assert_eq!(queue.unfinished[0].name, "simulation");
    assert!(report.to_string().contains("the compute queue had not finished"), "{report}");
    let lines = format!("{report:#}");
    assert!(lines.contains("\ncompute queue: done up to ") && lines.ends_with("step"), "{lines}");
}

#[test]
fn names_and_labels_end_with_their_command_buffer() {
    let Some(ctx) = context(QueueRequest::Shared) else { return };
    for _ in 0..4 {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.set_debug_name("of an earlier frame");
        cmd.push_label("earlier");
        ctx.wait(ctx.submit(cmd).unwrap()).unwrap();
    }
    let gate = Gate::new(&ctx);
    gate.submit(ctx.acquire_command_buffer().unwrap());
    let report = lose(&ctx);
    let commands = &report.queues[0].unfinished[0];
    assert!(commands.name.is_empty() && commands.labels.is_empty(), "{report:#}");
}

#[test]
fn a_loss_without_unfinished_work_names_the_call_and_its_queue_alone() {
    let Some(ctx) = context(QueueRequest::Shared) else { return };
    ctx.wait_idle().unwrap();
    let report = lose(&ctx);
    assert_eq!(report.to_string(), "the device was lost in vkQueueSubmit2 for 'graphics queue'");
    assert!(report.queues.is_empty());
}

/// Labels of queues are balanced, whatever a program pops.
#[test]
fn queues_take_labels_with_colours() {
    let Some(ctx) = device_with(|desc| desc.debug_names = Some(true)) else { return };
    capture_warnings();
    for queue in Queue::ALL {
        ctx.pop_queue_label(queue);
        let told = take_warnings("pop_queue_label");
        assert!(told.len() == 1 && told[0].contains("push a label before"), "{queue:?}: {told:?}");
        ctx.push_queue_label(queue, Label::colored("frame", [0.0, 0.5, 1.0]));
        ctx.insert_queue_label(queue, "a place");
        ctx.submit(ctx.acquire_command_buffer_on(queue).unwrap()).unwrap();
        ctx.pop_queue_label(queue);
        assert_eq!(take_warnings("pop_queue_label"), [""; 0], "{queue:?}");
        ctx.pop_queue_label(queue);
        assert_eq!(take_warnings("pop_queue_label").len(), 1, "{queue:?}");
    }
    ctx.wait_idle().unwrap();
}
