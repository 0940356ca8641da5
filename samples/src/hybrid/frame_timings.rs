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

/// The stamps of a frame: one before and one after the geometry pass, and a pair around each band.
pub(super) struct Stamps {
    pool: Holder<QueryPoolHandle>,
    band_count: u32,
}

impl Stamps {
    pub(super) fn new(ctx: &Context, band_count: u32) -> lvk::Result<Self> {
        let count = 2 + 2 * band_count;
        let pool = ctx.create_query_pool(&QueryPoolDesc { count, debug_name: "frame stamps" })?;
        Ok(Self { pool, band_count })
    }

    pub(super) fn reset(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        cmd.reset_queries(*self.pool, 0..2 + 2 * self.band_count)
    }

    /// Stamps the beginning (`end` false) or the end of the geometry pass.
    pub(super) fn geometry(&self, cmd: &mut CommandBuffer, end: bool) -> lvk::Result<()> {
        cmd.write_timestamp(*self.pool, u32::from(end))
    }

    /// Stamps the beginning (`end` false) or the end of a band.
    pub(super) fn band(&self, cmd: &mut CommandBuffer, band: u32, end: bool) -> lvk::Result<()> {
        cmd.write_timestamp(*self.pool, 2 + 2 * band + u32::from(end))
    }

    /// What the frame took; the GPU must be done with it.
    pub(super) fn read(&self, ctx: &Context, has_geometry: bool) -> lvk::Result<FrameTimings> {
        let stamps = ctx.timestamps_ms(*self.pool, 0, 2 + 2 * self.band_count)?;
        let spans: Vec<f64> = stamps
            .chunks_exact(2)
            .map(|pair| match *pair {
                [Some(begin), Some(end)] => end - begin,
                _ => 0.0,
            })
            .collect();
        let (geometry, bands) = spans.split_at(1);
        Ok(FrameTimings { geometry_ms: geometry.iter().sum(), rays_ms: bands.iter().sum(), has_geometry })
    }
}
