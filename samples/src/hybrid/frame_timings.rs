//! When the passes of a frame began and ended on the GPU.

use lvk::{CommandBuffer, Context, Holder, QueryPoolDesc, QueryPoolHandle};

use crate::app::sample::PassTimes;

/// GPU milliseconds of one frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrameTimings {
    /// The geometry pass; 0 where the method has none.
    pub geometry_ms: f64,
    /// The ray pass, all bands together.
    pub rays_ms: f64,
    /// Whether the method has a geometry pass.
    pub has_geometry: bool,
}

impl FrameTimings {
    /// Both passes together.
    pub fn total_ms(&self) -> f64 {
        self.geometry_ms + self.rays_ms
    }

    /// The passes by name.
    #[must_use]
    pub fn passes(&self) -> PassTimes {
        let geometry = self.has_geometry.then_some(("geometry pass", self.geometry_ms));
        geometry.into_iter().chain([("ray pass", self.rays_ms)]).collect()
    }
}

/// The stamps of a frame, for each sample one before and one after the geometry pass, and a pair around each band.
pub(super) struct Stamps {
    pool: Holder<QueryPoolHandle>,
    band_count: u32,
    sample_count: u32,
}

impl Stamps {
    pub(super) fn new(ctx: &Context, band_count: u32, sample_count: u32) -> lvk::Result<Self> {
        let count = sample_count * (2 + 2 * band_count);
        let pool = ctx.create_query_pool(&QueryPoolDesc { count, debug_name: "frame stamps" })?;
        Ok(Self { pool, band_count, sample_count })
    }

    /// Where the stamps of a sample begin.
    fn first(&self, sample: u32) -> u32 {
        sample * (2 + 2 * self.band_count)
    }

    pub(super) fn reset(&self, cmd: &mut CommandBuffer, sample: u32) -> lvk::Result<()> {
        cmd.reset_queries(*self.pool, self.first(sample)..self.first(sample + 1))
    }

    /// Stamps the beginning (`end` false) or the end of a sample's geometry pass.
    pub(super) fn geometry(&self, cmd: &mut CommandBuffer, sample: u32, end: bool) -> lvk::Result<()> {
        cmd.write_timestamp(*self.pool, self.first(sample) + u32::from(end))
    }

    /// Stamps the beginning (`end` false) or the end of a band of a sample.
    pub(super) fn band(&self, cmd: &mut CommandBuffer, sample: u32, band: u32, end: bool) -> lvk::Result<()> {
        cmd.write_timestamp(*self.pool, self.first(sample) + 2 + 2 * band + u32::from(end))
    }

    /// Milliseconds of the geometry pass alone, where no band was stamped; the GPU must be done with it.
    pub(super) fn read_geometry(&self, ctx: &Context) -> lvk::Result<f64> {
        let stamps = ctx.timestamps_ms(*self.pool, 0, 2)?;
        Ok(match stamps[..] {
            [Some(begin), Some(end)] => end - begin,
            _ => 0.0,
        })
    }

    /// What the frame took; the GPU must be done with it.
    pub(super) fn read(&self, ctx: &Context, has_geometry: bool) -> lvk::Result<FrameTimings> {
        let stamps = ctx.timestamps_ms(*self.pool, 0, self.first(self.sample_count))?;
        let mut timings = FrameTimings { has_geometry, ..FrameTimings::default() };
        for (number, pair) in stamps.chunks_exact(2).enumerate() {
            let [Some(begin), Some(end)] = *pair else { continue };
            let is_geometry = number % (1 + self.band_count as usize) == 0;
            *(if is_geometry { &mut timings.geometry_ms } else { &mut timings.rays_ms }) += end - begin;
        }
        Ok(timings)
    }
}
