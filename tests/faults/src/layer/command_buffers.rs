//! Command buffers that are not ready for a call, because a call before it was made to fail.

use std::collections::{HashMap, HashSet};

/// Command buffers and their pools, with the failures of earlier calls.
#[derive(Default)]
pub(super) struct CommandBuffers {
    /// Pools by command buffer.
    pools: HashMap<u64, u64>,
    /// Pools whose last reset has failed.
    full: HashSet<u64>,
    /// Command buffers whose last begin has failed.
    unbegun: HashSet<u64>,
}

impl CommandBuffers {
    /// Notes a command buffer that was allocated from a pool.
    pub(super) fn allocated(&mut self, pool: u64, commands: u64) {
        self.pools.insert(commands, pool);
        self.unbegun.remove(&commands);
    }

    /// Notes a call with the handles of its first two arguments. Returns false if it begins a command buffer whose pool was not
    /// reset, or ends one that was not begun.
    pub(super) fn called(&mut self, command: &str, [first, second]: [u64; 2], fails: bool) -> bool {
        match command {
            "vkResetCommandPool" => set(&mut self.full, second, fails),
            "vkBeginCommandBuffer" => {
                set(&mut self.unbegun, first, fails);
                return !self.pools.get(&first).is_some_and(|pool| self.full.contains(pool));
            }
            "vkEndCommandBuffer" => return !self.unbegun.contains(&first),
            "vkDestroyCommandPool" => {
                self.full.remove(&second);
                self.pools.retain(|_, pool| *pool != second);
            }
            _ => {}
        }
        true
    }
}

fn set(handles: &mut HashSet<u64>, handle: u64, is_in: bool) {
    if is_in {
        handles.insert(handle);
    } else {
        handles.remove(&handle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_buffers_are_begun_and_reset_before_use() {
        let mut known = CommandBuffers::default();
        known.allocated(1, 7);
        for (command, handles, fails, is_ready) in [
            ("vkBeginCommandBuffer", [7, 0], false, true),
            ("vkEndCommandBuffer", [7, 0], false, true),
            ("vkResetCommandPool", [5, 1], true, true),
            ("vkBeginCommandBuffer", [7, 0], false, false),
            ("vkResetCommandPool", [5, 1], false, true),
            ("vkBeginCommandBuffer", [7, 0], true, true),
            ("vkEndCommandBuffer", [7, 0], false, false),
            ("vkEndCommandBuffer", [8, 0], false, true),
            ("vkBeginCommandBuffer", [7, 0], false, true),
            ("vkEndCommandBuffer", [7, 0], false, true),
            ("vkResetCommandPool", [5, 1], true, true),
            ("vkDestroyCommandPool", [5, 1], false, true),
        ] {
            assert_eq!(known.called(command, handles, fails), is_ready, "{command} {handles:?} {fails}");
        }
        known.allocated(1, 7);
        assert!(known.called("vkBeginCommandBuffer", [7, 0], false), "a new pool has the same handle");
    }
}
