//! Pipelines that draw triangles of items, by vertices and by mesh shaders, and those with depth and with samples.

use lvk::{
    CompareOp, Context, DepthTest, Format, Holder, RenderPipelineDesc, RenderPipelineHandle, ShaderStage,
    TextureDesc, TextureUsage, VertexAttribute, VertexBinding, VertexFormat,
};
use lvk_tests::raster::staged_pipeline;

use super::kit::{HEAD, TARGETS};

/// Columns of a target: a triangle paints the column of its item, and covers all others.
pub const COLUMNS: u32 = 8;
/// Samples of a pixel of the pipelines with several.
pub const SAMPLES: u32 = 4;

/// A triangle over all pixels, of the item of its vertices and two more for each instance.
const ITEMS: &str = "
    layout(location = 0) in uint own;
    layout(location = 0) flat out uint item;
    void main() {
        int corner = gl_VertexIndex % 3;
        gl_Position = vec4(corner == 1 ? 3.0 : -1.0, corner == 2 ? 3.0 : -1.0, 0.5, 1.0);
        item = own + 2 * gl_InstanceIndex;
    }";

/// Paints the column of the item, with the word of the pattern that belongs to it.
const PAINT_ITEM: &str = "
    layout(location = 0) flat in uint item;
    layout(location = 0) out TYPE result;
    void main() {
        if (uint(gl_FragCoord.x) != item % 8) discard;
        uint own = 0;
        for (uint i = 0; i < 4; ++i) own |= (0x21 + (number + item + 7 * i) % 0x5d) << (8 * i);
        result = VALUE;
    }";

/// One triangle over all pixels for each workgroup.
const MESH_OUT: &str = "
    layout(local_size_x = 1) in;
    layout(triangles, max_vertices = 3, max_primitives = 1) out;
    layout(location = 0) flat out uint item[];
    void cover(uint of) {
        SetMeshOutputsEXT(3, 1);
        for (uint i = 0; i < 3; ++i) {
            gl_MeshVerticesEXT[i].gl_Position = vec4(i == 1 ? 3.0 : -1.0, i == 2 ? 3.0 : -1.0, 0.5, 1.0);
            item[i] = of;
        }
        gl_PrimitiveTriangleIndicesEXT[0] = uvec3(0, 1, 2);
    }";

/// The item of a workgroup, from the number of those along x and y.
const GROUP_ITEM: &str = "
    uint groupItem() {
        return gl_WorkGroupID.x + gl_NumWorkGroups.x * gl_WorkGroupID.y + 8 * gl_NumWorkGroups.y;
    }";

/// A task workgroup starts two mesh workgroups, of its own item and of the one four columns on.
const TASK: &str = "
    layout(local_size_x = 1) in;
    struct Payload { uint item; };
    taskPayloadSharedEXT Payload payload;
    void main() {
        payload.item = groupItem();
        EmitMeshTasksEXT(2, 1, 1);
    }";

/// A triangle over all pixels, at the depth `index / 64`.
const DEEP: &str = "
    void main() {
        int corner = gl_VertexIndex % 3;
        gl_Position = vec4(corner == 1 ? 3.0 : -1.0, corner == 2 ? 3.0 : -1.0, float(index) / 64.0, 1.0);
    }";

/// Paints the word in the push constants, or the one that they point to if their number is 1.
const PAINT_WORD: &str = "
    layout(location = 0) out TYPE result;
    void main() {
        uint own = word;
        if (number == 1) own = from.at[0];
        result = VALUE;
    }";

/// One pipeline for each of [`TARGETS`].
type OfTargets = Vec<Holder<RenderPipelineHandle>>;

/// The pipelines, those that the device can have.
pub struct DrawKit {
    items: OfTargets,
    mesh: OfTargets,
    task: OfTargets,
    depth: OfTargets,
    samples: OfTargets,
    /// Format of the depth targets.
    depth_format: Format,
}

/// Way in which a pipeline gets its triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrontEnd {
    /// From vertices.
    Vertices,
    /// From mesh shaders.
    Mesh,
    /// From mesh shaders that task shaders start.
    Task,
}

impl DrawKit {
    /// Creates the pipelines.
    pub fn new(ctx: &Context) -> lvk::Result<Self> {
        let depth_format = ctx.depth_format(false).unwrap_or(Format::D16Unorm);
        let vertices = RenderPipelineDesc {
            vertex_bindings: &[VertexBinding { stride: 4, ..Default::default() }],
            vertex_attributes: &[VertexAttribute { format: VertexFormat::U32, ..Default::default() }],
            ..Default::default()
        };
        let depth = DepthTest { format: depth_format, compare: CompareOp::Less, write: true };
        let deep = RenderPipelineDesc { depth: Some(depth), ..Default::default() };
        let many = RenderPipelineDesc { samples: SAMPLES, ..Default::default() };
        let mesh =
            [(ShaderStage::Mesh, format!("{MESH_OUT}{GROUP_ITEM} void main() {{ cover(groupItem()); }}"))];
        let task = [
            (ShaderStage::Task, format!("{GROUP_ITEM}{TASK}")),
            (
                ShaderStage::Mesh,
                format!(
                    "{MESH_OUT} struct Payload {{ uint item; }}; taskPayloadSharedEXT Payload payload;
                     void main() {{ cover(payload.item + 4 * gl_WorkGroupID.x); }}"
                ),
            ),
        ];
        let vertex = |text: &str| [(ShaderStage::Vertex, text.to_owned())];
        let plain = RenderPipelineDesc::default();
        let has_mesh = ctx.capabilities().mesh_shader;
        let of_mesh = |stages: &[(ShaderStage, String)]| {
            if has_mesh { of_targets(ctx, stages, PAINT_ITEM, &plain) } else { Ok(Vec::new()) }
        };
        Ok(Self {
            items: of_targets(ctx, &vertex(ITEMS), PAINT_ITEM, &vertices)?,
            mesh: of_mesh(&mesh)?,
            task: of_mesh(&task)?,
            depth: of_targets(ctx, &vertex(DEEP), PAINT_WORD, &deep)?,
            samples: if has_samples(ctx) {
                of_targets(ctx, &vertex(DEEP), PAINT_WORD, &many)?
            } else {
                Vec::new()
            },
            depth_format,
        })
    }

    /// Number of its objects.
    pub fn object_count(&self) -> usize {
        [&self.items, &self.mesh, &self.task, &self.depth, &self.samples].map(Vec::len).iter().sum()
    }

    /// Returns the pipeline of items for a format of [`TARGETS`], if the device can have it.
    pub fn items(&self, front_end: FrontEnd, format: Format) -> Option<RenderPipelineHandle> {
        let pipelines = match front_end {
            FrontEnd::Vertices => &self.items,
            FrontEnd::Mesh => &self.mesh,
            FrontEnd::Task => &self.task,
        };
        of_format(pipelines, format)
    }

    /// Returns the pipeline with a depth test, for a format of [`TARGETS`].
    pub fn depth(&self, format: Format) -> Option<RenderPipelineHandle> {
        of_format(&self.depth, format)
    }

    /// Returns the pipeline with [`SAMPLES`] samples for a format of [`TARGETS`], if the device can have it.
    pub fn samples(&self, format: Format) -> Option<RenderPipelineHandle> {
        of_format(&self.samples, format)
    }

    /// Returns the format of depth targets.
    pub fn depth_format(&self) -> Format {
        self.depth_format
    }
}

fn of_format(pipelines: &OfTargets, format: Format) -> Option<RenderPipelineHandle> {
    let index = TARGETS.iter().position(|target| *target == format)?;
    pipelines.get(index).map(Holder::handle)
}

/// True if every format of [`TARGETS`] can have several samples.
fn has_samples(ctx: &Context) -> bool {
    TARGETS.iter().all(|format| {
        let usage = TextureUsage::TARGET;
        ctx.supports_texture(&TextureDesc { format: *format, samples: SAMPLES, usage, ..Default::default() })
            .is_ok()
    })
}

/// Creates a pipeline for each of [`TARGETS`].
fn of_targets(
    ctx: &Context,
    stages: &[(ShaderStage, String)],
    fragment: &str,
    desc: &RenderPipelineDesc<'_>,
) -> lvk::Result<OfTargets> {
    let pipeline = |format: &Format| {
        let (kind, value) = match format {
            Format::R32Uint => ("uvec4", "uvec4(own)"),
            Format::R32Float => ("vec4", "vec4(uintBitsToFloat(own))"),
            _ => ("vec4", "unpackUnorm4x8(own)"),
        };
        let fragment = format!("{HEAD}{}", fragment.replace("TYPE", kind).replace("VALUE", value));
        let mut texts: Vec<(ShaderStage, String)> =
            stages.iter().map(|(stage, text)| (*stage, format!("{HEAD}{text}"))).collect();
        texts.push((ShaderStage::Fragment, fragment));
        let stages: Vec<(ShaderStage, &str)> =
            texts.iter().map(|(stage, text)| (*stage, text.as_str())).collect();
        staged_pipeline(ctx, &stages, &RenderPipelineDesc { color: &[(*format).into()], ..*desc })
    };
    TARGETS.iter().map(pipeline).collect()
}
