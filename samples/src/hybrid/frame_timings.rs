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
    /// The whole frame as one span, from the first stamp of its first sample to the last stamp of its last: what lies
    /// between the passes counts too, and between bands and samples the wait for the host.
    pub span_ms: f64,
    /// Whether the method has a geometry pass.
    pub has_geometry: bool,
}

impl FrameTimings {
    /// From the stamps of a frame, in pairs: for each sample that of the geometry pass and those of its bands. A pair of
    /// which a stamp is missing counts as no time.
    fn from_stamps(stamps: &[Option<f64>], band_count: u32, has_geometry: bool) -> Self {
        let mut timings = Self { span_ms: span(stamps), has_geometry, ..Self::default() };
        for (number, pair) in stamps.chunks_exact(2).enumerate() {
            let is_geometry = number % (1 + band_count as usize) == 0;
            *(if is_geometry { &mut timings.geometry_ms } else { &mut timings.rays_ms }) += span(pair);
        }
        timings
    }

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
        let pool = ctx.create_query_pool(&QueryPoolDesc {
            count,
            debug_name: "frame stamps",
            ..Default::default()
        })?;
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
        Ok(span(&ctx.timestamps_ms(*self.pool, 0, 2)?))
    }

    /// What the frame took; the GPU must be done with it.
    pub(super) fn read(&self, ctx: &Context, has_geometry: bool) -> lvk::Result<FrameTimings> {
        let stamps = ctx.timestamps_ms(*self.pool, 0, self.first(self.sample_count))?;
        Ok(FrameTimings::from_stamps(&stamps, self.band_count, has_geometry))
    }
}

/// From the first stamp that is there to the last one, in milliseconds; 0 where there is no second one.
fn span(stamps: &[Option<f64>]) -> f64 {
    let mut known = stamps.iter().flatten();
    known.next().zip(known.next_back()).map_or(0.0, |(begin, end)| end - begin)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame whose samples begin every 100 ms: geometry of 4 ms, a gap of 1 ms, then bands of 10 ms, 2 ms apart.
    fn stamps(samples: u32, bands: u32) -> Vec<Option<f64>> {
        let pairs = (0..samples).flat_map(|sample| {
            let start = 100.0 * f64::from(sample);
            let band = move |band| start + 5.0 + 12.0 * f64::from(band);
            let bands = (0..bands).map(band).flat_map(|begin| [begin, begin + 10.0]);
            [start, start + 4.0].into_iter().chain(bands)
        });
        pairs.map(Some).collect()
    }

    #[test]
    fn the_span_holds_what_lies_between_the_passes() {
        let found = FrameTimings::from_stamps(&stamps(1, 1), 1, true);
        let expected = FrameTimings { geometry_ms: 4.0, rays_ms: 10.0, span_ms: 15.0, has_geometry: true };
        assert_eq!(found, expected);
        assert_eq!(found.total_ms(), 14.0);
    }

    #[test]
    fn the_span_goes_from_the_first_sample_to_the_last() {
        for (samples, bands, span_ms) in [(1, 3, 39.0), (3, 1, 215.0), (3, 2, 227.0)] {
            let found = FrameTimings::from_stamps(&stamps(samples, bands), bands, true);
            let [geometry_ms, rays_ms] = [4.0, 10.0 * f64::from(bands)].map(|ms| ms * f64::from(samples));
            assert_eq!(found, FrameTimings { geometry_ms, rays_ms, span_ms, has_geometry: true });
            assert!(found.span_ms > found.total_ms());
        }
    }

    #[test]
    fn missing_stamps_make_no_time() {
        assert_eq!(FrameTimings::from_stamps(&[], 1, false), FrameTimings::default());
        assert_eq!(FrameTimings::from_stamps(&[None; 12], 2, false), FrameTimings::default());
        for missing in 0..12 {
            let mut stamps = stamps(2, 2);
            stamps[missing] = None;
            let found = FrameTimings::from_stamps(&stamps, 2, true);
            let lost = if missing % 6 < 2 { 4.0 } else { 10.0 };
            assert_eq!(found.total_ms(), 48.0 - lost, "without stamp {missing}");
            assert!(found.span_ms >= found.total_ms(), "without stamp {missing}: {found:?}");
        }
        let alone = FrameTimings::from_stamps(&[None, Some(7.0), None, None], 1, true);
        assert_eq!((alone.total_ms(), alone.span_ms), (0.0, 0.0));
    }
}
