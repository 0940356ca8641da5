//! The sample as a type: say the moment, get a picture.

use bytemuck::{Pod, Zeroable};
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferHandle, BufferUsage, BuildFlags, BuildMode, Context,
    Dependencies, Holder, TlasDesc, TlasInstance, Triangles, transform_rows,
};

use super::instances::{CORNERS, places};
use super::pipelines::RAYS;
use crate::app::array_buffer::array;
use crate::app::sample::{Moment, PassTimes, Sample};
use crate::rtx::{Canvas, RtxConfig, RtxError, Tracer};

/// Refits of the top-level structure between two rebuilds.
const MAX_REFITS: u32 = 32;

/// Renders the triangles.
pub struct RtxHello {
    canvas: Canvas,
    config: RtxConfig,
    tracer: Tracer,
    tlas: Holder<AccelStructHandle>,
    instances: Vec<TlasInstance>,
    _held: (Holder<AccelStructHandle>, Holder<BufferHandle>),
}

/// `Push` in `shaders/rtx_hello/view.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Push {
    size: [u32; 2],
    tlas: u32,
    image: u32,
}

impl RtxHello {
    /// Makes the triangle, its structures and the pipeline. The animation stands at its beginning.
    ///
    /// # Errors
    /// [`RtxError`] when the configuration is beyond the device, or the device fails.
    pub fn new(ctx: &Context, config: &RtxConfig) -> Result<Self, RtxError> {
        let canvas = Canvas::new(ctx, config)?;
        let vertices = array(ctx, "triangle", BufferUsage::ACCEL_INPUT, &CORNERS)?;
        let blas = ctx.create_blas(&BlasDesc {
            geometries: &[BlasGeometry::Triangles(Triangles::packed(*vertices, 3))],
            ..BlasDesc::default()
        })?;
        let instances = instances(*blas, 0.0);
        let tlas = ctx.create_tlas(&TlasDesc {
            instances: &instances,
            flags: BuildFlags::ALLOW_UPDATE,
            ..TlasDesc::default()
        })?;
        let tracer = Tracer::new(ctx, config.path, &RAYS)?;
        Ok(Self { canvas, config: *config, tracer, tlas, instances, _held: (blas, vertices) })
    }

    /// How many triangles there are.
    pub fn triangle_count(&self) -> usize {
        self.instances.len()
    }
}

impl Sample for RtxHello {
    type Error = RtxError;

    fn update(&mut self, moment: Moment) -> Result<(), RtxError> {
        self.instances = instances(self.instances[0].blas, moment.phase());
        Ok(())
    }

    fn render(&mut self, after_step: &mut dyn FnMut(u64)) -> Result<PassTimes, RtxError> {
        let (size, image) = (self.config.extent(), self.canvas.picture());
        let push = Push { size, tlas: self.tlas.index(), image: image.index() };
        let mode = BuildMode::Auto { max_refits: MAX_REFITS };
        let writes = Dependencies { storage_images: &[**image], ..Dependencies::default() };
        let times = self.canvas.render(&[
            ("TLAS update", &|cmd| cmd.update_tlas(*self.tlas, &self.instances, mode)),
            ("rays", &|cmd| self.tracer.record(cmd, &push, size, &writes)),
        ])?;
        after_step(1);
        Ok(times)
    }

    fn picture(&self) -> Result<Vec<u8>, RtxError> {
        Ok(self.canvas.read()?)
    }
}

fn instances(blas: AccelStructHandle, phase: f32) -> Vec<TlasInstance> {
    let instance = |place| TlasInstance { transform: transform_rows(&place), ..TlasInstance::new(blas) };
    places(phase).into_iter().map(instance).collect()
}
