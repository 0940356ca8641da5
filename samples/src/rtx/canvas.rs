//! The picture that a sample draws, pass by pass, each of them timed.

use lvk::{
    CommandBuffer, Context, Format, Holder, QueryPoolDesc, QueryPoolHandle, TextureDesc, TextureHandle,
    TextureRegion, TextureUsage,
};

use super::{RtxConfig, RtxError};
use crate::app::sample::PassTimes;

/// Most passes of a frame.
const MOST_PASSES: u32 = 8;

/// A pass of a frame: its name, and what records it.
pub(crate) type Pass<'a> = (&'static str, &'a dyn Fn(&mut CommandBuffer) -> lvk::Result<()>);

/// The picture that a sample draws.
pub(crate) struct Canvas {
    ctx: Context,
    picture: Holder<TextureHandle>,
    stamps: Option<Holder<QueryPoolHandle>>,
}

impl Canvas {
    /// A picture of 8 bits a channel, sRGB as far as shaders encode it, for which `config` is checked.
    pub(crate) fn new(ctx: &Context, config: &RtxConfig) -> Result<Self, RtxError> {
        config.check(ctx.capabilities())?;
        let picture = ctx.create_texture(&TextureDesc {
            format: Format::Rgba8Unorm,
            extent: config.extent(),
            usage: TextureUsage::STORAGE,
            debug_name: "picture",
            ..TextureDesc::default()
        })?;
        let stamps =
            QueryPoolDesc { count: MOST_PASSES + 1, debug_name: "pass stamps", ..Default::default() };
        let has_stamps = ctx.capabilities().limits.timestamp_bits > 0;
        let stamps = has_stamps.then(|| ctx.create_query_pool(&stamps)).transpose()?;
        Ok(Self { ctx: ctx.clone(), picture, stamps })
    }

    /// Where shaders store their pixels.
    pub(crate) fn picture(&self) -> &Holder<TextureHandle> {
        &self.picture
    }

    /// Records the passes, submits them, waits for them and answers what they took.
    pub(crate) fn render(&self, passes: &[Pass<'_>]) -> lvk::Result<PassTimes> {
        debug_assert!(passes.len() as u32 <= MOST_PASSES);
        let mut cmd = self.ctx.acquire_command_buffer()?;
        if let Some(stamps) = &self.stamps {
            cmd.reset_queries(**stamps, 0..MOST_PASSES + 1)?;
            cmd.write_timestamp(**stamps, 0)?;
        }
        for (number, (name, record)) in (1..).zip(passes) {
            cmd.push_label(name);
            record(&mut cmd)?;
            cmd.pop_label();
            self.stamps.as_ref().map_or(Ok(()), |stamps| cmd.write_timestamp(**stamps, number))?;
        }
        let submitted = self.ctx.submit(cmd)?;
        self.ctx.wait(submitted)?;
        self.times(passes)
    }

    /// Red, green, blue and alpha of each pixel, 8 bits each, rows from the top.
    pub(crate) fn read(&self) -> lvk::Result<Vec<u8>> {
        self.ctx.download_texture(*self.picture, &TextureRegion::default())
    }

    fn times(&self, passes: &[Pass<'_>]) -> lvk::Result<PassTimes> {
        let Some(stamps) = &self.stamps else { return Ok(PassTimes::new()) };
        let stamps = self.ctx.timestamps_ms(**stamps, 0, passes.len() as u32 + 1)?;
        let took = |pair: &[Option<f64>]| Some(pair[1]? - pair[0]?);
        let times = passes.iter().zip(stamps.windows(2));
        Ok(times.filter_map(|((name, _), pair)| Some((*name, took(pair)?))).collect())
    }
}
