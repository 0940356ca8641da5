//! The sample's pipelines as data, with the texts that their stages use: six draws, each in two ways.

use lvk::{
    Blend, ColorTarget, CompareOp, Context, CullMode, DepthTest, Format, Holder, RenderPipelineDesc,
    RenderPipelineHandle, Topology,
};

use super::Passes;
use crate::pipelines::{SamplePipeline, SampleStage, shader};

/// The sample's folder of `shaders/`.
const SAMPLE: &str = "deferred";
/// Formats of the targets: colour and roughness, normal and metalness, light, and the picture.
pub(super) const COLORS: [Format; 4] =
    [Format::Rgba8Unorm, Format::Rgba16Float, Format::Rgba16Float, Format::Rgba8Unorm];
/// Reversed: 1 near, 0 far away.
pub(super) const DEPTH: Format = Format::D32Float;
/// Macros of shaders that read the targets of their own pass.
const ONE_PASS: &[(&str, &str)] = &[("ONE_PASS", "1")];
/// Macros of the shine around lights.
const GLOW: &[(&str, &str)] = &[("GLOW", "1")];

/// The draws of a frame, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Draw {
    /// Material of all solid surfaces.
    Surfaces,
    /// The lights themselves.
    Orbs,
    /// Light from nowhere in particular.
    Ambient,
    /// Light of the lamps on surfaces.
    Lights,
    /// The shine around them.
    Glow,
    /// The pass from light to the picture.
    Resolve,
}

impl Draw {
    const ALL: [Self; 6] =
        [Self::Surfaces, Self::Orbs, Self::Ambient, Self::Lights, Self::Glow, Self::Resolve];

    fn name(self, passes: Passes) -> &'static str {
        match (self, passes) {
            (Self::Surfaces, Passes::One) => "deferred: surfaces in one pass",
            (Self::Surfaces, Passes::Several) => "deferred: surfaces",
            (Self::Orbs, Passes::One) => "deferred: orbs in one pass",
            (Self::Orbs, Passes::Several) => "deferred: orbs",
            (Self::Ambient, Passes::One) => "deferred: ambient light in one pass",
            (Self::Ambient, Passes::Several) => "deferred: ambient light",
            (Self::Lights, Passes::One) => "deferred: lights in one pass",
            (Self::Lights, Passes::Several) => "deferred: lights",
            (Self::Glow, Passes::One) => "deferred: glow in one pass",
            (Self::Glow, Passes::Several) => "deferred: glow",
            (Self::Resolve, Passes::One) => "deferred: resolve in one pass",
            (Self::Resolve, Passes::Several) => "deferred: resolve",
        }
    }

    fn stages(self, passes: Passes) -> [SampleStage; 2] {
        let screen = shader!("deferred", "screen.vert");
        let orbs = shader!("deferred", "orbs.vert");
        let [vertex, fragment] = match self {
            Self::Surfaces => [shader!("deferred", "surfaces.vert"), shader!("deferred", "surfaces.frag")],
            Self::Orbs => [orbs, shader!("deferred", "orbs.frag")],
            Self::Ambient => [screen, shader!("deferred", "ambient.frag")],
            Self::Lights => [shader!("deferred", "light.vert"), shader!("deferred", "light.frag")],
            Self::Glow => [SampleStage { defines: GLOW, ..orbs }, shader!("deferred", "glow.frag")],
            Self::Resolve => [screen, shader!("deferred", "resolve.frag")],
        };
        let defines = if passes == Passes::One { ONE_PASS } else { &[] };
        [vertex, SampleStage { defines, ..fragment }]
    }

    /// Places in [`COLORS`] of what its pass draws to.
    fn colors(self, passes: Passes) -> std::ops::Range<usize> {
        match (passes, self) {
            (Passes::One, _) => 0..4,
            (_, Self::Surfaces | Self::Orbs) => 0..3,
            (_, Self::Ambient | Self::Lights | Self::Glow) => 2..3,
            (_, Self::Resolve) => 3..4,
        }
    }

    /// Light adds up; everything else takes the place of what was there.
    fn targets(self, passes: Passes) -> Vec<ColorTarget> {
        let adds = matches!(self, Self::Ambient | Self::Lights | Self::Glow);
        let target = |place: usize| match adds && place == 2 {
            true => ColorTarget::blended(COLORS[place], Blend::ADDITIVE),
            false => ColorTarget::new(COLORS[place]),
        };
        self.colors(passes).map(target).collect()
    }

    fn depth(self, passes: Passes) -> Option<DepthTest> {
        let (compare, write) = match self {
            Self::Surfaces | Self::Orbs => (CompareOp::Greater, true),
            // The far side of what a light reaches is behind the surface.
            Self::Lights => (CompareOp::Less, false),
            Self::Glow => (CompareOp::GreaterOrEqual, false),
            Self::Ambient => (CompareOp::Always, false),
            Self::Resolve if passes == Passes::Several => return None,
            Self::Resolve => (CompareOp::Always, false),
        };
        Some(DepthTest { format: DEPTH, compare, write })
    }

    fn topology(self) -> Topology {
        match self {
            Self::Orbs | Self::Glow => Topology::TriangleStrip,
            _ => Topology::Triangles,
        }
    }

    fn cull(self) -> CullMode {
        match self {
            Self::Surfaces => CullMode::Back,
            Self::Lights => CullMode::Front,
            _ => CullMode::None,
        }
    }

    fn data(self, passes: Passes) -> SamplePipeline {
        SamplePipeline {
            name: self.name(passes),
            stages: self.stages(passes).to_vec(),
            color: self.targets(passes).iter().map(|target| target.format).collect(),
            depth: self.depth(passes).map(|depth| depth.format),
        }
    }

    fn create(self, ctx: &Context, passes: Passes) -> lvk::Result<Holder<RenderPipelineHandle>> {
        let [vertex, fragment] = self.stages(passes);
        let (vertex, fragment) = (vertex.create(ctx, SAMPLE)?, fragment.create(ctx, SAMPLE)?);
        ctx.create_render_pipeline(&RenderPipelineDesc {
            vertex: Some(*vertex),
            fragment: Some(*fragment),
            color: &self.targets(passes),
            depth: self.depth(passes),
            topology: self.topology(),
            cull: self.cull(),
            debug_name: self.name(passes),
            ..RenderPipelineDesc::default()
        })
    }
}

/// The pipelines of one way.
pub(super) struct Pipelines([Holder<RenderPipelineHandle>; 6]);

impl Pipelines {
    pub(super) fn new(ctx: &Context, passes: Passes) -> lvk::Result<Self> {
        let [surfaces, orbs, ambient, lights, glow, resolve] = Draw::ALL.map(|draw| draw.create(ctx, passes));
        Ok(Self([surfaces?, orbs?, ambient?, lights?, glow?, resolve?]))
    }

    pub(super) fn get(&self, draw: Draw) -> RenderPipelineHandle {
        *self.0[draw as usize]
    }
}

/// Returns every pipeline of the sample.
pub(super) fn pipelines() -> Vec<SamplePipeline> {
    let ways = [Passes::One, Passes::Several];
    ways.into_iter().flat_map(|passes| Draw::ALL.map(|draw| draw.data(passes))).collect()
}
