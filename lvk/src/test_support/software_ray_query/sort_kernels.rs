//! Runs the sorting kernels without the rest of a build, for tests.

use std::sync::Arc;

use crate::barrier::{Stages, Use};
use crate::command::CommandBuffer;
use crate::error::Result;
use crate::resource::Buffer;
use crate::software_ray_query::gpu_build::layout::{DIGIT_TOTAL_WORDS, DIGITS, SORT_BLOCK};
use crate::software_ray_query::gpu_build::params::GpuBuildParams;
use crate::software_ray_query::gpu_build::steps::sort_steps;

/// Keys as input of the kernels, in memory that starts with the scratch memory of a build.
pub(crate) struct Sorter<'a> {
    keys: &'a [u64],
    job: GpuBuildParams,
}

impl<'a> Sorter<'a> {
    pub(crate) fn new(keys: &'a [u64], low_bits: u32) -> Self {
        let long = low_bits > 0;
        let count = keys.len() as u32;
        let words = count * if long { 3 } else { 2 };
        let job = GpuBuildParams {
            count,
            low_bits,
            keys: 0,
            spare_keys: words,
            digits: 2 * words,
            ..bytemuck::Zeroable::zeroed()
        };
        Self { keys, job }
    }

    fn bytes(&self) -> u64 {
        let blocks = self.job.count.div_ceil(SORT_BLOCK);
        4 * (u64::from(self.job.digits)
            + u64::from(DIGIT_TOTAL_WORDS)
            + u64::from(DIGITS) * u64::from(blocks))
    }

    /// Returns the memory before the sort, with keys at the source of the first pass.
    pub(crate) fn words(&self) -> Vec<u32> {
        let high = self.keys.iter().map(|key| if self.is_long() { (key >> 32) as u32 } else { *key as u32 });
        let low = self.keys.iter().filter(|_| self.is_long()).map(|key| *key as u32);
        let mut words: Vec<u32> = high.chain(0..self.job.count).chain(low).collect();
        if self.job.low_bits.div_ceil(8) % 2 == 1 {
            words.splice(0..0, vec![0; self.job.spare_keys as usize]);
        }
        words.resize((self.bytes() / 4) as usize, 0);
        words
    }

    pub(crate) fn record(&self, cmd: &mut CommandBuffer, target: &Arc<Buffer>, address: u64) -> Result<()> {
        cmd.use_buffer(target, Use::shader_write(Stages::COMPUTE));
        let job = GpuBuildParams { scratch: address, ..self.job };
        let steps = sort_steps(0, job.count, job.low_bits);
        cmd.record_build_steps(&[job], &steps, std::iter::empty())
    }

    /// Returns keys and indices from the memory after the sort.
    pub(crate) fn sorted(&self, words: &[u32]) -> Vec<(u64, u32)> {
        let count = self.keys.len();
        let key = |i: usize| match self.is_long() {
            true => u64::from(words[i]) << 32 | u64::from(words[2 * count + i]),
            false => u64::from(words[i]),
        };
        (0..count).map(|i| (key(i), words[count + i])).collect()
    }

    fn is_long(&self) -> bool {
        self.job.low_bits != 0
    }
}
