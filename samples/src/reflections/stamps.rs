//! When the passes of a frame began and ended on the GPU.

use lvk::{CommandBuffer, Context, Holder, QueryPoolDesc, QueryPoolHandle};

/// The passes that are timed, in their order.
pub(super) const PASSES: [&str; 6] = [
    "skinning and its builds",
    "TLAS build",
    "g-buffers",
    "opaque rays",
    "transparent rays",
    "filters to picture",
];
/// Of those, the build of the top-level structure and the ray passes.
pub(super) const TLAS_BUILD: usize = 1;
pub(super) const RAYS: [usize; 2] = [3, 4];

/// A stamp before the first pass of a submission, and one after each pass.
pub(super) struct Stamps {
    pool: Holder<QueryPoolHandle>,
}

const COUNT: u32 = PASSES.len() as u32 + 1;

impl Stamps {
    pub(super) fn new(ctx: &Context) -> lvk::Result<Self> {
        Ok(Self {
            pool: ctx.create_query_pool(&QueryPoolDesc {
                count: COUNT,
                debug_name: "pass stamps",
                ..Default::default()
            })?,
        })
    }

    pub(super) fn reset(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        cmd.reset_queries(*self.pool, 0..COUNT)?;
        self.after(cmd, 0)
    }

    /// Stamps the end of so many passes.
    pub(super) fn after(&self, cmd: &mut CommandBuffer, passes: u32) -> lvk::Result<()> {
        cmd.write_timestamp(*self.pool, passes)
    }

    /// Adds what the submission took; the GPU must be done with it.
    pub(super) fn add_to(&self, ctx: &Context, times: &mut [f64; PASSES.len()]) -> lvk::Result<()> {
        let stamps = ctx.timestamps_ms(*self.pool, 0, COUNT)?;
        for (sum, pair) in times.iter_mut().zip(stamps.windows(2)) {
            if let [Some(begin), Some(end)] = *pair {
                *sum += end - begin;
            }
        }
        Ok(())
    }
}
