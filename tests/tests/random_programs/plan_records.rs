//! Plans of updates of TLAS with instances in a buffer, and of commands that get a structure of the wrong level.

use lvk::{AccelStructHandle, BuildMode, DeviceInstances, Queue, TlasDesc, TlasInstance};

use super::memory::SLOTS;
use super::plan::{Planned, compute_problems};
use super::plan_rays::mode;
use super::world::{Problem, World};

/// Bytes of the record of an instance.
const RECORD: u64 = 64;
/// Bytes of the buffer of instances.
pub const RECORD_BYTES: u64 = RECORD * SLOTS as u64 + 16;

/// Returns the record of an instance that refers to element `blas` of the list of BLAS.
fn record(transform: &[f32; 12], custom_index: u32, mask: u8, blas: u64) -> Vec<u8> {
    let mut bytes = bytemuck::cast_slice(transform).to_vec();
    bytes.extend((custom_index | u32::from(mask) << 24).to_le_bytes());
    bytes.extend([0; 4]);
    bytes.extend(blas.to_le_bytes());
    bytes
}

impl World<'_> {
    /// Plans an update with instances that the same command buffer writes into a buffer, after other bytes or not.
    pub(super) fn update_tlas_from_buffer(&mut self, n: [u16; 6], at: usize) -> Option<Planned> {
        let tlas = self.pick_tlas(n[0])?;
        let (raw, known, others) = self.instances([n[1], n[2], n[3]], SLOTS);
        let mut problems = compute_problems(self.open[at].queue, [tlas.problem]);
        problems.extend(others);
        let mut buffer = *self.records;
        let (mut offset, count) = (16 * u64::from(n[5] / 16 % 2), raw.len() as u32);
        match n[5] % 16 {
            0 => {
                let other = self.pick_buffer(n[4])?;
                // No buffer of a program holds an instance behind so many bytes.
                (buffer, offset) = (other.handle, 256);
                problems.push(other.problem.unwrap_or(Problem::Usage));
            }
            1 => {
                offset = 8;
                problems.push(Problem::Usage);
            }
            _ => {}
        }
        let mode = mode(n[4]);
        let effects = match tlas.live {
            Some(number) => self.place_instances(number, at, (known, count), mode, &mut problems),
            None => Vec::new(),
        };
        let blas: Vec<AccelStructHandle> = raw.iter().map(|instance| instance.blas).collect();
        let bytes: Vec<u8> = (0..)
            .zip(&raw)
            .flat_map(|(at, of)| record(&of.transform, of.custom_index, of.mask, at))
            .collect();
        let (handle, own) = (tlas.handle, *self.records);
        Some(Planned::new(problems, effects, move |_, cmd| {
            cmd.update_buffer(own, offset & 16, &bytes)?;
            cmd.update_tlas_from_buffer(handle, &DeviceInstances { buffer, offset, count, blas: &blas }, mode)
        }))
    }

    /// Plans a command or a call that gets a TLAS in place of a BLAS, or a BLAS in place of a TLAS.
    pub(super) fn wrong_structure(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let (tlas, blas) = (self.pick_tlas(n[0])?, self.pick_blas(n[1])?);
        let of_context = n[2] % 5 > 2;
        let mut problems = vec![Problem::Usage];
        if !of_context {
            problems.extend(compute_problems(queue, [None]));
        }
        problems.extend([tlas.problem, blas.problem].into_iter().flatten());
        let is_full = tlas.live.is_some_and(|number| self.tlas[number].info.capacity == 0);
        problems.extend((is_full && n[2] % 5 == 1).then_some(Problem::Limit));
        let has_mesh = |number: usize| self.meshes[self.blas[number].info.mesh].holder.is_some();
        let is_stale = n[2] % 5 == 2 && blas.live.is_some_and(|number| !has_mesh(number));
        problems.extend(is_stale.then_some(Problem::Stale));
        let (tlas, blas) = (tlas.handle, blas.handle);
        Some(Planned::new(problems, Vec::new(), move |env, cmd| {
            let instances = [TlasInstance::new(blas), TlasInstance::new(tlas)];
            let desc = TlasDesc { instances: &instances, debug_name: "wrong TLAS", ..Default::default() };
            match n[2] % 5 {
                0 => cmd.update_tlas(blas, &instances[..1], BuildMode::Rebuild),
                1 => cmd.update_tlas(tlas, &instances[1..], BuildMode::Rebuild),
                2 => cmd.build_blas(&[blas, tlas], BuildMode::Rebuild),
                3 => env.ctx().create_tlas(&desc).map(drop),
                _ => env.ctx().compact(&[blas, tlas]),
            }
        }))
    }
}

#[test]
fn a_record_has_the_fields_of_vulkan() {
    let bytes = record(&[1.0; 12], 0x02_0304, 0x7f, 5);
    assert_eq!(bytes.len() as u64, RECORD);
    assert_eq!(bytes[44..52], [0, 0, 0x80, 0x3f, 4, 3, 2, 0x7f]);
    assert_eq!(bytes[56..], [5, 0, 0, 0, 0, 0, 0, 0]);
}
