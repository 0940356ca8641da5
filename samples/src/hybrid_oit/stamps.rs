//! When the passes of a frame began and ended on the GPU.

use lvk::{CommandBuffer, Context, Holder, QueryPoolDesc, QueryPoolHandle};

use crate::app::sample::PassTimes;

/// Names of the passes, in the order in which they run.
pub(super) const PASSES: [&str; 7] =
    ["animate", "build", "depth", "g-buffer", "shadows", "glass lists", "composite"];

/// A stamp before the first pass, and one after each.
pub(super) struct Stamps {
    pool: Option<Holder<QueryPoolHandle>>,
}

impl Stamps {
    const COUNT: u32 = PASSES.len() as u32 + 1;

    /// Stamps, which do nothing where the device has none.
    pub(super) fn new(ctx: &Context) -> lvk::Result<Self> {
        let has_stamps = ctx.capabilities().limits.timestamp_bits > 0;
        let desc = QueryPoolDesc { count: Self::COUNT, debug_name: "frame stamps", ..Default::default() };
        Ok(Self { pool: has_stamps.then(|| ctx.create_query_pool(&desc)).transpose()? })
    }

    /// Before the first pass.
    pub(super) fn begin(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        let Some(pool) = &self.pool else { return Ok(()) };
        cmd.reset_queries(**pool, 0..Self::COUNT)?;
        cmd.write_timestamp(**pool, 0)
    }

    /// After the pass at this place in [`PASSES`].
    pub(super) fn end_of(&self, cmd: &mut CommandBuffer, pass: u32) -> lvk::Result<()> {
        let Some(pool) = &self.pool else { return Ok(()) };
        cmd.write_timestamp(**pool, pass + 1)
    }

    /// What the passes took; the GPU must be done with the frame.
    pub(super) fn read(&self, ctx: &Context) -> lvk::Result<PassTimes> {
        let Some(pool) = &self.pool else { return Ok(Vec::new()) };
        let stamps = ctx.timestamps_ms(**pool, 0, Self::COUNT)?;
        let span = |(name, pair): (&'static str, &[Option<f64>])| match *pair {
            [Some(begin), Some(end)] => Some((name, end - begin)),
            _ => None,
        };
        Ok(PASSES.into_iter().zip(stamps.windows(2)).filter_map(span).collect())
    }
}
