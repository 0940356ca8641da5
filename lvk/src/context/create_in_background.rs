//! Creation of pipelines in the background.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;

use super::Context;
use super::destroy::Destroy;
use super::holder::Holder;
use super::pending_pipeline::{Finish, PendingPipeline};
use crate::device_state::DeviceState;
use crate::error::Result;
use crate::handle::{ComputePipelineHandle, RayTracingPipelineHandle, RenderPipelineHandle};
use crate::pipeline::compute::ComputePipelineDesc;
use crate::pipeline::graphics_desc::RenderPipelineDesc;
use crate::pipeline::owned_desc::{OwnedComputeDesc, OwnedModules, OwnedRayTracingDesc, OwnedRenderDesc};
use crate::pipeline::ray_tracing_desc::RayTracingPipelineDesc;
use crate::pipeline::{ComputePipeline, PipelineBase, RayTracingPipeline, RenderPipeline};

impl Context {
    /// Creates a graphics pipeline in the background. The call returns at once; until the pipeline is ready, draw with a
    /// placeholder: a pipeline that is created first, and has the same targets and push constants.
    ///
    /// Pipelines are compiled on at most half of the CPU cores, in the order of the calls, each on one thread. Modules
    /// may be destroyed after the call. The end of the context waits for the pipelines that are being compiled, and
    /// discards those that are not.
    ///
    /// ```no_run
    /// use lvk::*;
    ///
    /// # fn example(ctx: &Context, cmd: &mut CommandBuffer, targets: &RenderPassDesc<'_>, grey: RenderPipelineHandle,
    /// #     desc: &RenderPipelineDesc<'_>) -> Result<()> {
    /// let mut water = ctx.create_render_pipeline_in_background(desc)?;
    /// // In each frame:
    /// let pipeline = water.handle_or(grey).unwrap_or_else(|error| {
    ///     eprintln!("the water stays grey: {error}");
    ///     grey
    /// });
    /// let mut pass = cmd.begin_rendering(targets)?;
    /// pass.bind_render_pipeline(pipeline)?;
    /// pass.draw(0..3, 0..1)?;
    /// # Ok(()) }
    /// ```
    ///
    /// # Errors
    /// [`StaleHandle`](crate::Error::StaleHandle) for a module. The other errors of
    /// [`create_render_pipeline`](Self::create_render_pipeline) are those of [`PendingPipeline`].
    pub fn create_render_pipeline_in_background(
        &self,
        desc: &RenderPipelineDesc<'_>,
    ) -> Result<PendingPipeline<RenderPipelineHandle>> {
        let find = |handle| self.device_state().store.shader_modules.get(handle);
        let (owned, modules) = (OwnedRenderDesc::new(desc), OwnedModules::of_render(desc, &find)?);
        let create = move |shared: &DeviceState, base| {
            let find = |handle| modules.get(handle);
            RenderPipeline::new(&shared.gpu, base, &owned.desc(), &find, &shared.graphics_parts)
        };
        Ok(self.create_in_background(desc.debug_name, create, Self::add_render_pipeline))
    }

    /// Creates a compute pipeline in the background, as
    /// [`create_render_pipeline_in_background`](Self::create_render_pipeline_in_background) does.
    ///
    /// # Errors
    /// [`StaleHandle`](crate::Error::StaleHandle) for the module, [`InvalidUsage`](crate::Error::InvalidUsage) without
    /// one. The other errors of [`create_compute_pipeline`](Self::create_compute_pipeline) are those of
    /// [`PendingPipeline`].
    pub fn create_compute_pipeline_in_background(
        &self,
        desc: &ComputePipelineDesc<'_>,
    ) -> Result<PendingPipeline<ComputePipelineHandle>> {
        let module = self.required_module(desc.module, desc.debug_name, "compute")?;
        let owned = OwnedComputeDesc::new(desc);
        let create =
            move |shared: &DeviceState, base| ComputePipeline::new(&shared.gpu, base, &owned.desc(), &module);
        Ok(self.create_in_background(desc.debug_name, create, Self::add_compute_pipeline))
    }

    /// Creates a ray tracing pipeline in the background, as
    /// [`create_render_pipeline_in_background`](Self::create_render_pipeline_in_background) does. Its shader binding
    /// table is uploaded by the call that finds the pipeline ready.
    ///
    /// # Errors
    /// [`StaleHandle`](crate::Error::StaleHandle) for a module or a library. The other errors of
    /// [`create_ray_tracing_pipeline`](Self::create_ray_tracing_pipeline) are those of [`PendingPipeline`].
    pub fn create_ray_tracing_pipeline_in_background(
        &self,
        desc: &RayTracingPipelineDesc<'_>,
    ) -> Result<PendingPipeline<RayTracingPipelineHandle>> {
        let owned =
            OwnedRayTracingDesc::new(desc, &|handle| self.device_state().store.shader_modules.get(handle))?;
        let libraries = self.ray_tracing_libraries(desc.libraries)?;
        let create = move |shared: &DeviceState, base| {
            let find = |handle| owned.modules.get(handle);
            owned.with_desc(|desc| RayTracingPipeline::new(&shared.gpu, base, desc, &find, &libraries))
        };
        Ok(self.create_in_background(desc.debug_name, create, Self::add_ray_tracing_pipeline))
    }

    /// Runs `create` in the background. `add` makes the result an object of the context.
    fn create_in_background<H: Destroy, P: Send + 'static>(
        &self,
        name: &str,
        create: impl FnOnce(&DeviceState, PipelineBase) -> Result<P> + Send + 'static,
        add: fn(&Self, P) -> Result<Holder<H>>,
    ) -> PendingPipeline<H> {
        let (sender, receiver) = channel::<Result<Finish<H>>>();
        let cancelled = Arc::new(AtomicBool::new(false));
        let (shared, skip) = (Arc::clone(self.device_state()), Arc::clone(&cancelled));
        self.inner.background.submit(Box::new(move || {
            if skip.load(Ordering::Relaxed) {
                return;
            }
            let base = PipelineBase { max_threads: 1, ..shared.pipeline_base() };
            let made = create(&shared, base);
            let finish = made.map(|pipeline| -> Finish<H> { Box::new(move |ctx| add(ctx, pipeline)) });
            // Nothing waits for a result that cannot be sent.
            let _ = sender.send(finish);
        }));
        PendingPipeline::new(self, name.into(), cancelled, receiver)
    }
}
