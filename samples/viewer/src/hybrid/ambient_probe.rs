//! The probe of the surfaces around the eye: what they reflect, and how much of the sky they see. The ambient term depends on both.

use lvk::{BufferHandle, CommandBuffer, Context, Dependencies, Holder};
use lvk_samples::app::array_buffer::buffer;
use lvk_samples::hybrid::RayPath;

use crate::gpu::FrameScene;
use crate::gpu::layout::Push;
use crate::launch::RayLaunch;
use crate::pipelines::AMBIENT_PROBE;

/// Invocations along each side of the launch.
const SIDE: u32 = 64;
/// Bytes of the sums of `shaders/viewer/ambient_term.glsl`.
const SUM_BYTES: u64 = 5 * 4;

/// The pass, and the sums that its rays leave.
pub(crate) struct AmbientProbe {
    rays: RayLaunch,
    sums: Holder<BufferHandle>,
}

impl AmbientProbe {
    pub(crate) fn new(ctx: &Context, path: RayPath) -> lvk::Result<Self> {
        Ok(Self {
            rays: RayLaunch::new(ctx, path, &AMBIENT_PROBE)?,
            sums: buffer(ctx, "ambient sums", SUM_BYTES)?,
        })
    }

    /// The buffer of the sums.
    pub(crate) fn sums(&self) -> BufferHandle {
        *self.sums
    }

    /// Address of the sums.
    pub(crate) fn address(&self) -> lvk::Result<u64> {
        self.sums.address()
    }

    /// Records the rays of the probe. `frame`: address of the frame's constants.
    pub(crate) fn record(
        &self,
        cmd: &mut CommandBuffer,
        frame: u64,
        scene: FrameScene<'_>,
    ) -> lvk::Result<()> {
        cmd.fill_buffer(*self.sums, 0, SUM_BYTES, 0)?;
        self.rays.bind(cmd)?;
        cmd.push_constants(&Push { frame, argument: SIDE, _padding: 0 })?;
        let dependencies = Dependencies {
            buffers: &scene.buffers(&[*self.sums]),
            read_buffers: scene.written,
            ..Dependencies::default()
        };
        self.rays.record(cmd, [SIDE; 2], &dependencies)
    }
}
