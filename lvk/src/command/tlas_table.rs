//! The table of all TLAS: the addresses of their hit remap tables and of their software TLAS.

use std::sync::Arc;

use ash::vk;

use super::CommandBuffer;
use crate::accel::blas_refs::BlasRefSet;
use crate::accel::tlas::Tlas;
use crate::barrier::Use;
use crate::bindless::layout::TLAS_TABLE_ENTRY_BYTES;
use crate::software_ray_query::tlas::SoftwareTlas;

impl CommandBuffer {
    /// Writes the entry of a TLAS in the TLAS table, unless it is up to date. Returns the address of the hit remap
    /// table that it writes, 0 for none.
    #[inline(always)]
    pub(super) fn write_hit_table_entry(
        &mut self,
        tlas: &Tlas,
        is_built: bool,
        blas_refs: &BlasRefSet,
    ) -> Option<u64> {
        // Before the first build, the entry is that of the slot's previous owner.
        if is_built && tlas.hit_table.get().is_none() {
            return None;
        }
        let hit_table_address =
            tlas.hit_table.get().filter(|_| blas_refs.needs_hit_remap).map_or(0, |table| table.address);
        self.write_tlas_table(tlas.slot, tlas_table_entry(tlas, hit_table_address));
        Some(hit_table_address)
    }

    /// Returns the slots and table entries of TLAS that this command buffer expects to have no hit remap table,
    /// although a submission since its recording has added one. The entries must be written before the command buffer
    /// runs.
    pub(crate) fn entries_without_hit_table(&self) -> Vec<(u32, [u64; 2])> {
        let Some(updates) = &self.state.tlas_trackers else { return Vec::new() };
        updates.with_unexpected_hit_table().map(|tlas| (tlas.slot, tlas_table_entry(tlas, 0))).collect()
    }

    /// Writes an entry of the TLAS table: the addresses of the hit remap table and of the software TLAS, 0 for none.
    pub(crate) fn write_tlas_table(&mut self, slot: u32, entry: [u64; 2]) {
        let shared = Arc::clone(&self.shared);
        let Some(table) = shared.tlas_table.as_ref() else { return };
        self.state.accesses.add_id(shared.hit_tables_id, Use::transfer_write());
        self.flush_barriers();
        let offset = u64::from(slot) * TLAS_TABLE_ENTRY_BYTES;
        // SAFETY: the table has an entry for every slot.
        unsafe {
            shared.gpu.device.cmd_update_buffer(self.raw(), table.raw, offset, bytemuck::bytes_of(&entry));
        }
    }

    /// Clears the table entries of slots whose TLAS were destroyed.
    pub(crate) fn clear_tlas_entries(&mut self, slots: &[u32]) {
        slots.iter().for_each(|slot| self.write_tlas_table(*slot, [0; 2]));
    }

    /// Clears the whole TLAS table.
    pub(crate) fn clear_tlas_table(&mut self) {
        let shared = Arc::clone(&self.shared);
        let Some(table) = shared.tlas_table.as_ref() else { return };
        self.state.accesses.add_id(shared.hit_tables_id, Use::transfer_write());
        self.flush_barriers();
        // SAFETY: the whole buffer is filled.
        unsafe { shared.gpu.device.cmd_fill_buffer(self.raw(), table.raw, 0, vk::WHOLE_SIZE, 0) };
    }
}

/// Returns the table entry of a TLAS whose hit remap table is at the address `hit_table_address`.
fn tlas_table_entry(tlas: &Tlas, hit_table_address: u64) -> [u64; 2] {
    [hit_table_address, tlas.software.as_ref().map_or(0, SoftwareTlas::address)]
}
