//! Counts calls and live objects of the process, and says which call fails.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ffi::CStr;
use std::fs::File;
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{LazyLock, Mutex, OnceLock, PoisonError};
use std::thread::ThreadId;

use ash::vk;
use ash::vk::Handle;
use lvk::readable_bytes;

use super::command_buffers::CommandBuffers;
use super::commands::{Creates, DATED, IN_USE, LOST, MAPS, SURFACE};
use super::dispatch::{COMMANDS, table_of};
use crate::call_log::{self, NamedObject};
use crate::fault::{Fault, FaultError};

/// Environment variable with the path of the log.
pub const LOG_VARIABLE: &str = "LVK_FAULT_LOG";
/// Environment variable with the [`Fault`].
pub const FAULT_VARIABLE: &str = "LVK_FAULT";

static INJECTOR: LazyLock<Injector> = LazyLock::new(Injector::from_env);

/// Returns the injector of the process.
pub(super) fn injector() -> &'static Injector {
    &INJECTOR
}

/// State of the layer in one process.
pub(super) struct Injector {
    fault: Option<Fault>,
    log: Option<File>,
    reached: AtomicBool,
    /// Thread of the call that has failed.
    thread: OnceLock<ThreadId>,
    counts: Mutex<Counts>,
}

/// Handles of live objects. A driver may give equal objects one handle, so each has a count.
type Handles = HashMap<u64, usize>;

#[derive(Default)]
struct Counts {
    calls: HashMap<&'static str, u32>,
    /// Live objects by the handle of their device or instance, and by kind.
    live: BTreeMap<(u64, &'static str), Handles>,
    command_buffers: CommandBuffers,
    /// Lines with names that are in the log.
    names: BTreeSet<String>,
}

impl Injector {
    fn from_env() -> Self {
        let path = std::env::var_os(LOG_VARIABLE);
        let log = path.and_then(|path| File::options().append(true).create(true).open(path).ok());
        let fault = std::env::var(FAULT_VARIABLE).ok().and_then(|text| text.parse().ok());
        Self {
            fault,
            log,
            reached: AtomicBool::new(false),
            thread: OnceLock::new(),
            counts: Mutex::default(),
        }
    }

    fn write(&self, line: &str) {
        if let Some(mut log) = self.log.as_ref() {
            // The sweep notices a log without an end.
            let _ = log.write_all(format!("{line}\n").as_bytes());
        }
    }

    fn counts(&self) -> std::sync::MutexGuard<'_, Counts> {
        self.counts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts a call of a wrapped command on a handle. Returns the error if the call is to fail.
    pub(super) fn called(&self, number: usize, handle: u64) -> Option<FaultError> {
        let command = &COMMANDS[number];
        let table = table_of(handle);
        let submission = table.as_ref().filter(|_| command.gives_work());
        if let Some(table) = submission {
            table.submissions.fetch_add(1, Ordering::SeqCst);
        }
        let is_lost = table.as_ref().is_some_and(|table| table.lost.load(Ordering::SeqCst));
        let error = self.error_of_call(command.name, command.answers, is_lost);
        if let Some(table) = submission.filter(|_| error.is_some()) {
            table.submissions.fetch_sub(1, Ordering::SeqCst);
        }
        if error == Some(FaultError::DeviceLost) && !is_lost {
            table.inspect(|table| table.lose());
        }
        error
    }

    /// True for a presentation to a surface that is lost or has changed, as Vulkan still executes its waits for semaphores, and for a
    /// mapping without an address, which its owner ends.
    pub(super) fn still_executes(&self, number: usize, fault: FaultError) -> bool {
        let is_of_surface = matches!(fault, FaultError::SurfaceLost | FaultError::OutOfDate);
        fault == FaultError::NoAddress || COMMANDS[number].name == "vkQueuePresentKHR" && is_of_surface
    }

    /// Gives a mapping that is to have no address the one of a failed `mmap`.
    ///
    /// # Safety
    /// `words` are the arguments of the call, which has returned. The last points to an address if `fault` is of one.
    pub(super) unsafe fn maps(&self, words: &[u64], fault: FaultError) {
        if fault == FaultError::NoAddress {
            // SAFETY: by contract.
            unsafe { (words[words.len() - 1] as usize as *mut usize).write(usize::MAX) };
        }
    }

    /// Notes that a call which [`called`](Self::called) let pass has returned.
    pub(super) fn returned(&self, number: usize, handle: u64) {
        if let Some(table) = table_of(handle).filter(|_| COMMANDS[number].gives_work()) {
            table.submissions.fetch_sub(1, Ordering::SeqCst);
        }
    }

    /// Counts a call of a command that may give `answers`. Returns the error if the call is to fail.
    pub(super) fn called_by_name(&self, name: &'static str, answers: u8) -> Option<FaultError> {
        self.error_of_call(name, answers, false)
    }

    /// Counts and logs a call. Returns its error: that of the fault, or the loss where the device is lost.
    fn error_of_call(&self, name: &'static str, answers: u8, is_lost: bool) -> Option<FaultError> {
        let injected = self.injected(name, answers);
        let told = (is_lost && answers & LOST != 0).then_some(FaultError::DeviceLost);
        let error = injected.or(told);
        if injected.is_none() && error.is_some() && self.thread.get() != Some(&std::thread::current().id()) {
            self.write(&call_log::told_line(name));
        }
        match (error, &self.fault) {
            (Some(_), _) => self.write(&call_log::fails_line(name)),
            (None, Some(_)) => self.write(&call_log::call_line(name, &[])),
            (None, None) => self.write(&call_log::call_line(name, &errors_of(answers))),
        }
        error
    }

    /// Counts a call. Returns the error of the fault, if the call is one of those that it makes fail.
    fn injected(&self, name: &'static str, answers: u8) -> Option<FaultError> {
        let count = {
            let mut counts = self.counts();
            let count = counts.calls.entry(name).or_default();
            *count += 1;
            *count
        };
        let fault = self.fault.as_ref().filter(|fault| errors_of(answers).contains(&fault.error))?;
        if fault.command == name && fault.call == count {
            self.reached.store(true, Ordering::Relaxed);
            let _ = self.thread.set(std::thread::current().id());
            self.write(&call_log::fault_line(name));
            return Some(fault.error);
        }
        let goes_on =
            self.reached.load(Ordering::Relaxed) && fault.span.goes_on(fault.error, &fault.command, name);
        goes_on.then_some(fault.error)
    }

    /// Logs a call that uses a command buffer which is not ready for it. `fails` says that the call is made to fail.
    pub(super) fn uses(&self, number: usize, words: &[u64], fails: bool) {
        let (command, second) = (COMMANDS[number].name, words.get(1).copied().unwrap_or_default());
        if !self.counts().command_buffers.called(command, [words[0], second], fails) {
            self.write(&call_log::unready_line(command));
        }
    }

    /// Logs the name that a call is about to give an object.
    ///
    /// # Safety
    /// `words` are the arguments of the call.
    pub(super) unsafe fn names(&self, number: usize, words: &[u64]) {
        if COMMANDS[number].name != "vkSetDebugUtilsObjectNameEXT" {
            return;
        }
        // SAFETY: the second argument of the command points to a structure with kind and name.
        let (kind, name) = unsafe {
            let info = words[1] as usize as *const vk::DebugUtilsObjectNameInfoEXT<'_>;
            (format!("{:?}", (*info).object_type), (*info).object_name_as_c_str())
        };
        if let Some(name) = name {
            self.log_name(&call_log::name_line(&NamedObject { kind, name: readable(name) }));
        }
    }

    /// Notes the pool of the command buffers that a successful call has allocated.
    ///
    /// # Safety
    /// `words` are the arguments of the call.
    pub(super) unsafe fn allocated(&self, number: usize, words: &[u64]) {
        if COMMANDS[number].name != "vkAllocateCommandBuffers" {
            return;
        }
        // SAFETY: the command has read its second argument, and has written as many handles to the third as that says.
        unsafe {
            let info = &*(words[1] as usize as *const vk::CommandBufferAllocateInfo<'_>);
            let handles = words[2] as usize as *const u64;
            for index in 0..info.command_buffer_count as usize {
                self.counts()
                    .command_buffers
                    .allocated(info.command_pool.as_raw(), handles.add(index).read());
            }
        }
    }

    /// Logs the names of the physical devices that a successful call has listed.
    ///
    /// # Safety
    /// `words` are the arguments of the call.
    pub(super) unsafe fn listed(&self, number: usize, words: &[u64]) {
        if COMMANDS[number].name != "vkEnumeratePhysicalDevices" || words[2] == 0 {
            return;
        }
        let Some(table) = table_of(words[0]).filter(|table| table.properties != 0) else { return };
        // SAFETY: the command has written the devices and their number, and the address is that of the next layer's function.
        unsafe {
            let devices = words[2] as usize as *const vk::PhysicalDevice;
            let properties_of =
                std::mem::transmute::<usize, vk::PFN_vkGetPhysicalDeviceProperties>(table.properties);
            for index in 0..*(words[1] as usize as *const u32) as usize {
                let mut properties = vk::PhysicalDeviceProperties::default();
                properties_of(devices.add(index).read(), &mut properties);
                if let Ok(name) = properties.device_name_as_c_str() {
                    self.log_name(&call_log::device_line(&readable(name)));
                }
            }
        }
    }

    /// Logs a line with a name, the first time.
    fn log_name(&self, line: &str) {
        if self.counts().names.insert(line.to_owned()) {
            self.write(line);
        }
    }

    /// Counts the objects that a successful call has created.
    ///
    /// # Safety
    /// `words` are the arguments of the call; where the command creates objects, the last points to their handles.
    pub(super) unsafe fn created(&self, number: usize, words: &[u64]) {
        let (kind, count) = match COMMANDS[number].creates {
            Creates::Nothing => return,
            Creates::One(kind) => (kind, 1),
            Creates::Many(kind, argument) => (kind, words[argument] as usize),
        };
        let handles = words[words.len() - 1] as usize as *const u64;
        for index in 0..count {
            // SAFETY: by contract there are `count` handles.
            let handle = unsafe { handles.add(index).read() };
            if handle != 0 {
                self.count(words[0], kind, handle);
            }
        }
    }

    /// Counts no longer the object that a call is about to destroy, of the device or instance `owner`.
    pub(super) fn destroys(&self, number: usize, owner: u64, object: u64) {
        if let Some(kind) = COMMANDS[number].destroys.filter(|_| object != 0) {
            self.uncount(owner, kind, object);
        }
    }

    /// Counts a new object. Devices and instances have the owner 0.
    pub(super) fn count(&self, owner: u64, kind: &'static str, handle: u64) {
        *self.counts().live.entry((owner, kind)).or_default().entry(handle).or_default() += 1;
    }

    /// Counts an object no longer. Logs an object that is not alive.
    pub(super) fn uncount(&self, owner: u64, kind: &'static str, handle: u64) {
        let is_alive = {
            let mut counts = self.counts();
            let handles = counts.live.entry((owner, kind)).or_default();
            let count = handles.get_mut(&handle).filter(|count| **count > 0);
            count.map(|count| *count -= 1).is_some()
        };
        if !is_alive {
            self.write(&call_log::dead_line(kind));
        }
    }

    /// Logs the objects of a device or instance that is being destroyed before them, and counts them no longer.
    pub(super) fn count_orphans(&self, owner: u64) {
        let mut orphans = BTreeMap::new();
        self.counts().live.retain(|&(of, kind), handles| {
            if of == owner {
                orphans.insert(kind, handles.values().sum());
            }
            of != owner
        });
        if orphans.values().any(|count| *count != 0) {
            self.write(&call_log::orphans_line(&orphans));
        }
    }

    /// Logs the number of all live objects.
    pub(super) fn log_live(&self) {
        let mut live = BTreeMap::new();
        for (&(_, kind), handles) in &self.counts().live {
            *live.entry(kind).or_default() += handles.values().sum::<usize>();
        }
        self.write(&call_log::live_line(&live));
    }
}

/// Returns a name as errors show it.
fn readable(name: &CStr) -> String {
    readable_bytes(name.to_bytes())
}

/// Returns the errors that a command with these bits may answer.
fn errors_of(answers: u8) -> Vec<FaultError> {
    let mut errors = vec![FaultError::HostMemory, FaultError::DeviceMemory];
    for (bit, error) in [
        (LOST, FaultError::DeviceLost),
        (SURFACE, FaultError::SurfaceLost),
        (DATED, FaultError::OutOfDate),
        (IN_USE, FaultError::WindowInUse),
        (MAPS, FaultError::NoAddress),
    ] {
        if answers & bit != 0 {
            errors.push(error);
        }
    }
    errors
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
    use super::*;

    #[test]
    fn objects_are_counted_by_handle_and_owner() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let injector = Injector { log: Some(file.reopen().unwrap()), ..Injector::from_env() };
        let lines = || std::fs::read_to_string(file.path()).unwrap();
        for handle in [7, 7, 8] {
            injector.count(1, "VkSampler", handle);
        }
        injector.uncount(1, "VkSampler", 7);
        injector.uncount(1, "VkSampler", 7);
        injector.log_live();
        assert_eq!(lines(), "live VkSampler=1\n", "a driver may give equal objects one handle");
        injector.uncount(1, "VkSampler", 7);
        injector.uncount(2, "VkSampler", 8);
        assert_eq!(lines(), "live VkSampler=1\ndead VkSampler\ndead VkSampler\n");
        injector.count_orphans(1);
        injector.log_live();
        assert!(lines().ends_with("orphans VkSampler=1\nlive\n"), "{}", lines());
    }
}
