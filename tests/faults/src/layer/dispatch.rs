//! The functions of the next layer, for each instance and device.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError, RwLock};

use ash::vk;

use super::commands::{Command, commands};

/// Every command that the layer wraps.
pub(super) static COMMANDS: LazyLock<Vec<Command>> = LazyLock::new(commands);
static NUMBERS: LazyLock<HashMap<&'static str, usize>> = LazyLock::new(|| {
    let names = COMMANDS.iter().enumerate();
    names
        .flat_map(|(number, command)| {
            [Some((command.name, number)), command.alias.map(|name| (name, number))]
        })
        .flatten()
        .collect()
});
static TABLES: LazyLock<RwLock<HashMap<usize, Arc<Table>>>> = LazyLock::new(RwLock::default);

/// The functions below the layer for one instance or one device.
pub(super) struct Table {
    /// Addresses by number of the command; 0 where there is none.
    next: Vec<usize>,
    /// `vkGetInstanceProcAddr` or `vkGetDeviceProcAddr` of the next layer.
    pub(super) proc_addr: usize,
    /// `vkDestroyInstance` or `vkDestroyDevice` of the next layer.
    pub(super) destroy: usize,
    /// `vkDeviceWaitIdle` of the next layer, and the device.
    pub(super) finish: Option<(vk::PFN_vkDeviceWaitIdle, vk::Device)>,
    /// `vkGetPhysicalDeviceFeatures2` of the next layer, for an instance.
    pub(super) features: usize,
    /// `vkGetPhysicalDeviceProperties` of the next layer, for an instance.
    pub(super) properties: usize,
    /// `vkGetBufferDeviceAddress` of the next layer, for a device.
    pub(super) buffer_address: usize,
    /// True for a device that a fault has lost.
    pub(super) lost: AtomicBool,
    /// Calls under way that give a queue work.
    pub(super) submissions: AtomicUsize,
    /// True if the work of the lost device has ended. Locked by the thread that waits for it.
    finished: Mutex<bool>,
}

/// What a [`Table`] has the functions of.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Level {
    Instance,
    Device,
}

impl Level {
    /// True if a command is of this level: the validation layer warns of a device that is asked for commands of an instance.
    fn has(self, command: &str) -> bool {
        let of_instance =
            ["vkEnumerate", "vkGetPhysicalDevice", "SurfaceKHR", "SurfaceEXT", "DebugUtilsMessenger"];
        let is_of_instance = of_instance.iter().any(|part| command.contains(part));
        is_of_instance == (self == Self::Instance)
    }
}

impl Table {
    /// Collects the functions by name.
    pub(super) fn new(level: Level, find: impl Fn(&str) -> usize, proc_addr: usize, destroy: &str) -> Self {
        let of_level = |name: &str| if level.has(name) { find(name) } else { 0 };
        let next = COMMANDS
            .iter()
            .map(|command| match (of_level(command.name), command.alias) {
                (0, Some(alias)) => of_level(alias),
                (found, _) => found,
            })
            .collect();
        Self {
            next,
            proc_addr,
            destroy: find(destroy),
            finish: None,
            features: of_level("vkGetPhysicalDeviceFeatures2"),
            properties: of_level("vkGetPhysicalDeviceProperties"),
            buffer_address: of_level("vkGetBufferDeviceAddress"),
            lost: AtomicBool::new(false),
            submissions: AtomicUsize::new(0),
            finished: Mutex::new(false),
        }
    }

    /// Loses the device: it takes no more work, and has finished the work that it has when this returns.
    ///
    /// The caller's own submission does not count as one under way.
    pub(super) fn lose(&self) {
        self.lost.store(true, Ordering::SeqCst);
        // Two threads may lose a device at the same time, and a wait wants its queues for itself.
        let mut finished = self.finished.lock().unwrap_or_else(PoisonError::into_inner);
        if std::mem::replace(&mut *finished, true) {
            return;
        }
        while self.submissions.load(Ordering::SeqCst) > 0 {
            std::thread::yield_now();
        }
        if let Some((wait, device)) = self.finish {
            // SAFETY: the device is alive, as a command of it is being called.
            let _ = unsafe { wait(device) };
        }
    }
}

/// Returns the number of a wrapped command.
pub(super) fn number_of(name: &str) -> Option<usize> {
    NUMBERS.get(name).copied()
}

/// Returns the key of a dispatchable handle.
pub(super) fn key_of(handle: u64) -> usize {
    // SAFETY: the loader and applications pass handles that are alive.
    unsafe { lvk_layer::key_of(handle) }
}

/// Keeps the functions for a new instance or device.
pub(super) fn insert(handle: u64, table: Table) {
    let mut tables = TABLES.write().unwrap_or_else(PoisonError::into_inner);
    tables.insert(key_of(handle), Arc::new(table));
}

/// Returns the functions for a dispatchable handle.
pub(super) fn table_of(handle: u64) -> Option<Arc<Table>> {
    TABLES.read().unwrap_or_else(PoisonError::into_inner).get(&key_of(handle)).cloned()
}

/// Removes and returns the functions of an instance or a device that ends.
pub(super) fn remove(handle: u64) -> Option<Arc<Table>> {
    TABLES.write().unwrap_or_else(PoisonError::into_inner).remove(&key_of(handle))
}

/// Returns the address of command `number` in the layer below, for a dispatchable handle.
pub(super) fn next(number: usize, handle: u64) -> Option<usize> {
    table_of(handle).map(|table| table.next[number]).filter(|address| *address != 0)
}
