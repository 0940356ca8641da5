//! Devices whose queues run late and interleaved in a random order: what a submission does not wait for may run after it.
//!
//! A software driver has one Vulkan queue, which runs submissions soon and in order, and so hides a missing wait. Here the
//! submissions that signal one timeline semaphore are a queue of their own. A thread hands them to the real queue one by one, as
//! their waits and chance allow, and lets the caller run ahead.

#![expect(clippy::disallowed_types, reason = "no lock is taken while another is held")]

use std::cell::Cell;
use std::collections::{HashMap, VecDeque};
use std::ffi::{CStr, c_char};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use ash::vk;

use super::fault_injection::injects_faults;

/// Longest pause before a submission is handed on, in microseconds.
const LONGEST_PAUSE: u64 = 400;

thread_local! {
    static SEED: Cell<Option<u64>> = const { Cell::new(None) };
    static REAL: Cell<Option<vk::PFN_vkGetDeviceProcAddr>> = const { Cell::new(None) };
}

static DEVICES: Mutex<Vec<(vk::Device, Arc<Device>)>> = Mutex::new(Vec::new());
static QUEUES: Mutex<Vec<(vk::Queue, Arc<Device>)>> = Mutex::new(Vec::new());

/// Runs `make`. Queues of devices that it creates on this thread run late and in a random order.
pub(crate) fn with_unordered_queues<T>(seed: u64, make: impl FnOnce() -> T) -> T {
    /// Sets the seed of before, also after a panic.
    struct Restore(Option<u64>);
    impl Drop for Restore {
        fn drop(&mut self) {
            SEED.set(self.0);
        }
    }
    let _restore = Restore(SEED.replace(Some(seed)));
    make()
}

/// Returns the instance unchanged, or one whose devices have such queues. Faults are injected on the thread that submits, so devices that can
/// fail have none.
pub(crate) fn wrap_unordered_queues(raw: ash::Instance) -> ash::Instance {
    if SEED.get().is_none() || injects_faults() {
        return raw;
    }
    let mut functions = raw.fp_v1_0().clone();
    REAL.set(Some(functions.get_device_proc_addr));
    functions.get_device_proc_addr = look_up;
    ash::Instance::from_parts_1_3(raw.handle(), functions, raw.fp_v1_1().clone(), raw.fp_v1_3().clone())
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The functions of the driver.
#[derive(Clone, Copy)]
struct Functions {
    look_up: vk::PFN_vkGetDeviceProcAddr,
    submit: vk::PFN_vkQueueSubmit2,
    wait_queue: vk::PFN_vkQueueWaitIdle,
    wait_device: vk::PFN_vkDeviceWaitIdle,
    get_queue: vk::PFN_vkGetDeviceQueue,
    destroy: vk::PFN_vkDestroyDevice,
    /// Labels of queues, where the instance has them.
    begin_label: Option<vk::PFN_vkQueueBeginDebugUtilsLabelEXT>,
    end_label: Option<vk::PFN_vkQueueEndDebugUtilsLabelEXT>,
    insert_label: Option<vk::PFN_vkQueueInsertDebugUtilsLabelEXT>,
    /// Presentation, where the device has swapchains.
    present: Option<vk::PFN_vkQueuePresentKHR>,
}

/// A device, and the submissions that it has not got yet.
struct Device {
    real: Functions,
    state: Mutex<State>,
    has_changed: Condvar,
    /// Held by the thread that uses a queue of the driver.
    queue_use: Mutex<()>,
}

#[derive(Default)]
struct State {
    /// Submissions in order, by the timeline semaphore that they signal.
    lanes: Vec<(vk::Semaphore, VecDeque<Held>)>,
    /// Values that the driver's submissions signal.
    signalled: HashMap<vk::Semaphore, u64>,
    random: u64,
    /// True while a submission is handed to the driver.
    is_busy: bool,
    has_ended: bool,
}

/// A submission.
struct Held {
    queue: vk::Queue,
    batches: Vec<Batch>,
    fence: vk::Fence,
}

/// A batch of a submission.
struct Batch {
    waits: Vec<vk::SemaphoreSubmitInfo<'static>>,
    commands: Vec<vk::CommandBufferSubmitInfo<'static>>,
    signals: Vec<vk::SemaphoreSubmitInfo<'static>>,
}

// SAFETY: none of the Vulkan structures has a `pNext` pointer; the library sets none.
unsafe impl Send for Batch {}

impl Held {
    fn signals(&self) -> impl Iterator<Item = &vk::SemaphoreSubmitInfo<'static>> {
        self.batches.iter().flat_map(|batch| &batch.signals)
    }
}

impl Batch {
    fn info(&self) -> vk::SubmitInfo2<'_> {
        vk::SubmitInfo2::default()
            .wait_semaphore_infos(&self.waits)
            .command_buffer_infos(&self.commands)
            .signal_semaphore_infos(&self.signals)
    }
}

impl State {
    /// Returns a random number below `end`.
    fn random(&mut self, end: u64) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random % end.max(1)
    }

    /// True if the driver has every submission that signals what this one waits for.
    fn is_ready(&self, held: &Held) -> bool {
        let is_held = |semaphore| {
            let mut others =
                self.lanes.iter().flat_map(|(_, lane)| lane).filter(|other| !std::ptr::eq(*other, held));
            others.any(|other| other.signals().any(|signal| signal.semaphore == semaphore))
        };
        let has = |wait: &vk::SemaphoreSubmitInfo<'_>| {
            let value = self.signalled.get(&wait.semaphore).copied().unwrap_or(0);
            (wait.value > 0 && value >= wait.value) || !is_held(wait.semaphore)
        };
        held.batches.iter().flat_map(|batch| &batch.waits).all(has)
    }

    /// Takes the first submission of a random lane.
    fn take(&mut self) -> Option<Held> {
        let is_ready = |lane: &usize| self.lanes[*lane].1.front().is_some_and(|held| self.is_ready(held));
        let ready: Vec<usize> = (0..self.lanes.len()).filter(is_ready).collect();
        let chosen = *ready.get(self.random(ready.len() as u64) as usize)?;
        self.lanes[chosen].1.pop_front()
    }

    fn is_empty(&self) -> bool {
        !self.is_busy && self.lanes.iter().all(|(_, lane)| lane.is_empty())
    }
}

impl Device {
    /// Adds a submission.
    fn push(&self, held: Held) {
        let mut state = lock(&self.state);
        let timeline = held.signals().filter(|signal| signal.value > 0).last();
        let timeline = timeline.map_or(vk::Semaphore::null(), |signal| signal.semaphore);
        match state.lanes.iter_mut().find(|(lane, _)| *lane == timeline) {
            Some((_, lane)) => lane.push_back(held),
            None => state.lanes.push((timeline, VecDeque::from([held]))),
        }
        self.has_changed.notify_all();
    }

    /// Hands submissions to the driver until the device ends.
    fn run(&self) {
        let mut state = lock(&self.state);
        loop {
            if !state.is_empty() {
                // Others may come meanwhile, and be chosen.
                let pause = state.random(2 * LONGEST_PAUSE).saturating_sub(LONGEST_PAUSE);
                drop(state);
                std::thread::sleep(Duration::from_micros(pause));
                state = lock(&self.state);
            }
            let Some(held) = state.take() else {
                if state.has_ended {
                    return;
                }
                state = self.has_changed.wait(state).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            state.is_busy = true;
            drop(state);
            let result = self.submit(&held);
            if result != vk::Result::SUCCESS {
                // The caller has its answer already, and would wait for ever.
                eprintln!("a submission that was held back failed: {result:?}");
                std::process::abort();
            }
            state = lock(&self.state);
            state.is_busy = false;
            for signal in held.signals() {
                state.signalled.insert(signal.semaphore, signal.value);
            }
            self.has_changed.notify_all();
        }
    }

    fn submit(&self, held: &Held) -> vk::Result {
        let infos: Vec<_> = held.batches.iter().map(Batch::info).collect();
        let _using = lock(&self.queue_use);
        // SAFETY: the caller has submitted these; calls of other threads to functions that this module replaces wait for this one to end.
        unsafe { (self.real.submit)(held.queue, infos.len() as u32, infos.as_ptr(), held.fence) }
    }

    /// Waits until the driver has all submissions.
    fn drain(&self) {
        let mut state = lock(&self.state);
        while !state.is_empty() {
            state = self.has_changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// Returns the driver's function of a name, if the device has it.
macro_rules! driver_function {
    ($look_up:expr, $device:expr, $name:literal, $kind:ty) => {
        // SAFETY: the device is the caller's; a function of this name has this type, and all have the size of a pointer.
        unsafe {
            std::mem::transmute::<vk::PFN_vkVoidFunction, Option<$kind>>($look_up($device, $name.as_ptr()))
        }
    };
}

/// Returns a function of this module for that of the driver.
macro_rules! own_function {
    ($own:ident, $kind:ty) => {
        // SAFETY: all functions have the size of a pointer, and the caller calls this one by its type.
        Some(unsafe { std::mem::transmute::<$kind, unsafe extern "system" fn()>($own) })
    };
}

impl Functions {
    fn new(look_up: vk::PFN_vkGetDeviceProcAddr, device: vk::Device) -> Option<Self> {
        Some(Self {
            look_up,
            submit: driver_function!(look_up, device, c"vkQueueSubmit2", vk::PFN_vkQueueSubmit2)?,
            wait_queue: driver_function!(look_up, device, c"vkQueueWaitIdle", vk::PFN_vkQueueWaitIdle)?,
            wait_device: driver_function!(look_up, device, c"vkDeviceWaitIdle", vk::PFN_vkDeviceWaitIdle)?,
            get_queue: driver_function!(look_up, device, c"vkGetDeviceQueue", vk::PFN_vkGetDeviceQueue)?,
            destroy: driver_function!(look_up, device, c"vkDestroyDevice", vk::PFN_vkDestroyDevice)?,
            begin_label: driver_function!(
                look_up,
                device,
                c"vkQueueBeginDebugUtilsLabelEXT",
                vk::PFN_vkQueueBeginDebugUtilsLabelEXT
            ),
            end_label: driver_function!(
                look_up,
                device,
                c"vkQueueEndDebugUtilsLabelEXT",
                vk::PFN_vkQueueEndDebugUtilsLabelEXT
            ),
            insert_label: driver_function!(
                look_up,
                device,
                c"vkQueueInsertDebugUtilsLabelEXT",
                vk::PFN_vkQueueInsertDebugUtilsLabelEXT
            ),
            present: driver_function!(look_up, device, c"vkQueuePresentKHR", vk::PFN_vkQueuePresentKHR),
        })
    }
}

/// Adds a new device, and starts its thread.
fn add_device(device: vk::Device, real: Functions, seed: u64) {
    let state = Mutex::new(State { random: seed | 1, ..State::default() });
    let made = Arc::new(Device { real, state, has_changed: Condvar::new(), queue_use: Mutex::new(()) });
    lock(&DEVICES).push((device, Arc::clone(&made)));
    std::thread::spawn(move || made.run());
}

/// # Safety
/// As `vkGetDeviceProcAddr`.
unsafe extern "system" fn look_up(device: vk::Device, name: *const c_char) -> vk::PFN_vkVoidFunction {
    let known = find_device(device);
    let real = known.as_ref().map(|known| known.real.look_up).or_else(|| REAL.get())?;
    if known.is_none() {
        match SEED.get() {
            Some(seed) => add_device(device, Functions::new(real, device)?, seed),
            // SAFETY: the caller's device and name are passed on.
            None => return unsafe { real(device, name) },
        }
    }
    // SAFETY: the name ends with a zero.
    match unsafe { CStr::from_ptr(name) }.to_bytes() {
        b"vkQueueSubmit2" => own_function!(submit, vk::PFN_vkQueueSubmit2),
        b"vkQueueWaitIdle" => own_function!(wait_queue, vk::PFN_vkQueueWaitIdle),
        b"vkDeviceWaitIdle" => own_function!(wait_device, vk::PFN_vkDeviceWaitIdle),
        b"vkGetDeviceQueue" => own_function!(get_queue, vk::PFN_vkGetDeviceQueue),
        b"vkQueueBeginDebugUtilsLabelEXT" => {
            own_function!(begin_label, vk::PFN_vkQueueBeginDebugUtilsLabelEXT)
        }
        b"vkQueueEndDebugUtilsLabelEXT" => own_function!(end_label, vk::PFN_vkQueueEndDebugUtilsLabelEXT),
        b"vkQueueInsertDebugUtilsLabelEXT" => {
            own_function!(insert_label, vk::PFN_vkQueueInsertDebugUtilsLabelEXT)
        }
        b"vkQueuePresentKHR" => own_function!(present, vk::PFN_vkQueuePresentKHR),
        b"vkDestroyDevice" => own_function!(destroy, vk::PFN_vkDestroyDevice),
        // SAFETY: the caller's device and name are passed on.
        _ => unsafe { real(device, name) },
    }
}

fn device_of(queue: vk::Queue) -> Option<Arc<Device>> {
    let queues = lock(&QUEUES);
    queues.iter().find(|(known, _)| *known == queue).map(|(_, device)| Arc::clone(device))
}

fn find_device(device: vk::Device) -> Option<Arc<Device>> {
    let devices = lock(&DEVICES);
    devices.iter().find(|(known, _)| *known == device).map(|(_, found)| Arc::clone(found))
}

/// # Safety
/// As `vkGetDeviceQueue`.
unsafe extern "system" fn get_queue(device: vk::Device, family: u32, index: u32, queue: *mut vk::Queue) {
    let Some(found) = find_device(device) else { return };
    // SAFETY: the caller upholds the contract of `vkGetDeviceQueue`, which writes the handle.
    let queue = unsafe {
        (found.real.get_queue)(device, family, index, queue);
        *queue
    };
    lock(&QUEUES).retain(|(known, _)| *known != queue);
    lock(&QUEUES).push((queue, found));
}

/// # Safety
/// As `vkQueueSubmit2`.
unsafe extern "system" fn submit(
    queue: vk::Queue,
    count: u32,
    infos: *const vk::SubmitInfo2<'_>,
    fence: vk::Fence,
) -> vk::Result {
    let Some(device) = device_of(queue) else { return vk::Result::ERROR_UNKNOWN };
    /// # Safety
    /// As [`std::slice::from_raw_parts`], but no elements may have any address.
    unsafe fn list<T: Copy>(start: *const T, count: u32) -> Vec<T> {
        if count == 0 {
            return Vec::new();
        }
        // SAFETY: the caller's promise.
        unsafe { std::slice::from_raw_parts(start, count as usize) }.to_vec()
    }
    // SAFETY: the caller passes valid lists.
    let batches = unsafe { list(infos, count) }.into_iter().map(|info| unsafe {
        Batch {
            waits: list(info.p_wait_semaphore_infos.cast(), info.wait_semaphore_info_count),
            commands: list(info.p_command_buffer_infos.cast(), info.command_buffer_info_count),
            signals: list(info.p_signal_semaphore_infos.cast(), info.signal_semaphore_info_count),
        }
    });
    device.push(Held { queue, batches: batches.collect(), fence });
    vk::Result::SUCCESS
}

/// # Safety
/// As `vkQueueWaitIdle`.
unsafe extern "system" fn wait_queue(queue: vk::Queue) -> vk::Result {
    let Some(device) = device_of(queue) else { return vk::Result::ERROR_UNKNOWN };
    device.drain();
    let _using = lock(&device.queue_use);
    // SAFETY: the caller upholds the contract of `vkQueueWaitIdle`.
    unsafe { (device.real.wait_queue)(queue) }
}

/// # Safety
/// As `vkDeviceWaitIdle`.
unsafe extern "system" fn wait_device(device: vk::Device) -> vk::Result {
    let Some(found) = find_device(device) else { return vk::Result::ERROR_UNKNOWN };
    found.drain();
    let _using = lock(&found.queue_use);
    // SAFETY: the caller upholds the contract of `vkDeviceWaitIdle`.
    unsafe { (found.real.wait_device)(device) }
}

/// Calls functions of the driver while no other thread uses a queue.
fn use_queue(queue: vk::Queue, call: impl FnOnce(&Functions)) {
    if let Some(device) = device_of(queue) {
        let _using = lock(&device.queue_use);
        call(&device.real);
    }
}

/// # Safety
/// As `vkQueueBeginDebugUtilsLabelEXT`.
unsafe extern "system" fn begin_label(queue: vk::Queue, label: *const vk::DebugUtilsLabelEXT<'_>) {
    // SAFETY: the caller upholds the contract of `vkQueueBeginDebugUtilsLabelEXT`.
    use_queue(queue, |real| real.begin_label.into_iter().for_each(|begin| unsafe { begin(queue, label) }));
}

/// # Safety
/// As `vkQueueEndDebugUtilsLabelEXT`.
unsafe extern "system" fn end_label(queue: vk::Queue) {
    // SAFETY: the caller upholds the contract of `vkQueueEndDebugUtilsLabelEXT`.
    use_queue(queue, |real| real.end_label.into_iter().for_each(|end| unsafe { end(queue) }));
}

/// # Safety
/// As `vkQueueInsertDebugUtilsLabelEXT`.
unsafe extern "system" fn insert_label(queue: vk::Queue, label: *const vk::DebugUtilsLabelEXT<'_>) {
    // SAFETY: the caller upholds the contract of `vkQueueInsertDebugUtilsLabelEXT`.
    use_queue(queue, |real| real.insert_label.into_iter().for_each(|insert| unsafe { insert(queue, label) }));
}

/// # Safety
/// As `vkQueuePresentKHR`.
unsafe extern "system" fn present(queue: vk::Queue, info: *const vk::PresentInfoKHR<'_>) -> vk::Result {
    let Some(device) = device_of(queue) else { return vk::Result::ERROR_UNKNOWN };
    let Some(present) = device.real.present else { return vk::Result::ERROR_UNKNOWN };
    // The submissions that signal what the presentation waits for come before.
    device.drain();
    let _using = lock(&device.queue_use);
    // SAFETY: the caller upholds the contract of `vkQueuePresentKHR`.
    unsafe { present(queue, info) }
}

/// # Safety
/// As `vkDestroyDevice`.
unsafe extern "system" fn destroy(device: vk::Device, callbacks: *const vk::AllocationCallbacks<'_>) {
    let Some(found) = find_device(device) else { return };
    found.drain();
    lock(&found.state).has_ended = true;
    found.has_changed.notify_all();
    lock(&DEVICES).retain(|(known, _)| *known != device);
    lock(&QUEUES).retain(|(_, of)| !Arc::ptr_eq(of, &found));
    // SAFETY: the caller upholds the contract of `vkDestroyDevice`.
    unsafe { (found.real.destroy)(device, callbacks) }
}
