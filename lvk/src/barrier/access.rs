//! Uses of a resource by a command: pipeline stages, kinds of memory access and the required image layout.

use bitflags::bitflags;

bitflags! {
    /// Groups of Vulkan pipeline stages, as coarse as the library's hazards allow.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub(crate) struct Stages: u16 {
        /// Reads and writes through a mapped pointer.
        const HOST = 1 << 0;
        /// Copies, blits, clears, fills and resolves.
        const TRANSFER = 1 << 1;
        /// Fetch of indirect parameters of draws, dispatches and traces.
        const DRAW_INDIRECT = 1 << 2;
        /// Index and vertex fetch.
        const VERTEX_INPUT = 1 << 3;
        /// Every shader stage before rasterisation: vertex, tessellation, geometry, task and mesh.
        const PRE_RASTER = 1 << 4;
        /// Fragment shader.
        const FRAGMENT = 1 << 5;
        /// Early and late depth and stencil tests.
        const DEPTH = 1 << 6;
        /// Color attachment output.
        const COLOR = 1 << 7;
        /// Compute shader.
        const COMPUTE = 1 << 8;
        /// All shaders of a ray tracing pipeline.
        const RAY_TRACING = 1 << 9;
        /// Builds, refits and copies of acceleration structures.
        const ACCEL_BUILD = 1 << 10;
        /// Fetch of shading rates from an attachment.
        const SHADING_RATE = 1 << 11;

        /// Every stage that runs shaders.
        const SHADERS = Self::PRE_RASTER.bits() | Self::FRAGMENT.bits() | Self::COMPUTE.bits()
            | Self::RAY_TRACING.bits();
    }
}

bitflags! {
    /// Kinds of memory access.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub(crate) struct Access: u32 {
        /// Indirect parameters.
        const INDIRECT_READ = 1 << 0;
        /// Indices of a draw.
        const INDEX_READ = 1 << 1;
        /// Vertex attributes.
        const VERTEX_READ = 1 << 2;
        /// Sampled and storage reads by shaders, and input geometry of acceleration structure builds.
        const SHADER_READ = 1 << 3;
        /// Storage writes by shaders.
        const SHADER_WRITE = 1 << 4;
        /// Load, blend and logic operations.
        const COLOR_READ = 1 << 5;
        /// Color attachment stores.
        const COLOR_WRITE = 1 << 6;
        /// Depth tests.
        const DEPTH_READ = 1 << 7;
        /// Depth stores.
        const DEPTH_WRITE = 1 << 8;
        /// Source of a copy.
        const TRANSFER_READ = 1 << 9;
        /// Destination of a copy, fill or clear.
        const TRANSFER_WRITE = 1 << 10;
        /// Traversal, and acceleration structures that a build reads.
        const ACCEL_READ = 1 << 11;
        /// Acceleration structures that a build writes, and its scratch memory.
        const ACCEL_WRITE = 1 << 12;
        /// Reads through a mapped pointer.
        const HOST_READ = 1 << 13;
        /// Writes through a mapped pointer.
        const HOST_WRITE = 1 << 14;
        /// Input attachment reads by fragment shaders.
        const INPUT_READ = 1 << 15;
        /// Shading rates read from an attachment.
        const SHADING_RATE_READ = 1 << 16;

        /// Every access that changes memory.
        const WRITES = Self::SHADER_WRITE.bits() | Self::COLOR_WRITE.bits() | Self::DEPTH_WRITE.bits()
            | Self::TRANSFER_WRITE.bits() | Self::ACCEL_WRITE.bits() | Self::HOST_WRITE.bits();
    }
}

impl Stages {
    /// Number of single stages.
    pub(crate) const COUNT: usize = 12;

    /// Returns the accesses that a single stage can perform. Vulkan forbids masks with any other access.
    pub(crate) const fn possible_access(self) -> Access {
        const SHADER: Access = Access::SHADER_READ.union(Access::SHADER_WRITE).union(Access::ACCEL_READ);
        const ACCEL: Access = Access::SHADER_READ
            .union(Access::INDIRECT_READ)
            .union(Access::ACCEL_READ)
            .union(Access::ACCEL_WRITE)
            .union(Access::TRANSFER_READ)
            .union(Access::TRANSFER_WRITE);
        match self {
            Self::HOST => Access::HOST_READ.union(Access::HOST_WRITE),
            Self::TRANSFER => Access::TRANSFER_READ.union(Access::TRANSFER_WRITE),
            Self::DRAW_INDIRECT => Access::INDIRECT_READ,
            Self::VERTEX_INPUT => Access::INDEX_READ.union(Access::VERTEX_READ),
            Self::PRE_RASTER | Self::COMPUTE | Self::RAY_TRACING => SHADER,
            Self::FRAGMENT => SHADER.union(Access::INPUT_READ),
            Self::DEPTH => Access::DEPTH_READ.union(Access::DEPTH_WRITE),
            Self::COLOR => Access::COLOR_READ.union(Access::COLOR_WRITE),
            Self::ACCEL_BUILD => ACCEL,
            Self::SHADING_RATE => Access::SHADING_RATE_READ,
            _ => Access::empty(),
        }
    }

    /// Returns the accesses that any of these stages can perform.
    pub(crate) fn possible_accesses(self) -> Access {
        self.indices().fold(Access::empty(), |all, row| all | POSSIBLE[row])
    }

    /// Returns the index of a single stage in a table of [`Stages::COUNT`] entries.
    #[cfg(test)]
    fn index(self) -> usize {
        (self.bits().trailing_zeros() as usize).min(Self::COUNT - 1)
    }

    /// Returns the table indices of all these stages, in ascending order.
    fn indices(self) -> impl Iterator<Item = usize> {
        let mut left = self.bits();
        std::iter::from_fn(move || {
            let row = left.trailing_zeros() as usize;
            left &= left.wrapping_sub(1);
            (row < Self::COUNT).then_some(row)
        })
    }
}

/// Possible accesses of each single stage, by its index.
const POSSIBLE: [Access; Stages::COUNT] = {
    let mut possible = [Access::empty(); Stages::COUNT];
    let mut row = 0;
    while row < Stages::COUNT {
        possible[row] = Stages::from_bits_retain(1 << row).possible_access();
        row += 1;
    }
    possible
};

/// Image layouts that the library uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(crate) enum Layout {
    /// Contents are unknown. Also means "no layout" for buffers.
    #[default]
    Undefined,
    /// Storage images, and images that one command both reads and writes.
    General,
    /// Sampled images, and depth targets that are only tested, also both at the same time.
    ShaderRead,
    /// Color attachment.
    ColorTarget,
    /// Depth or depth-stencil attachment.
    DepthTarget,
    /// Source of a copy or blit.
    TransferSrc,
    /// Destination of a copy, blit or clear.
    TransferDst,
    /// Owned by the presentation engine.
    Present,
    /// Attachment that fragment shaders of the same pass read.
    LocalRead,
    /// Shading rate attachment of a pass.
    ShadingRate,
    /// Sampled images of other engines.
    ExternalShaderRead,
    /// Depth-stencil images of other engines, sampled or tested.
    ExternalDepthRead,
}

/// One use of a resource by a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Use {
    /// Pipeline stages.
    pub(crate) stages: Stages,
    /// Memory accesses. Each stage performs those that it supports.
    pub(crate) access: Access,
    /// Required image layout; `Undefined` for buffers.
    pub(crate) layout: Layout,
}

impl Use {
    const fn new(stages: Stages, access: Access, layout: Layout) -> Self {
        Self { stages, access, layout }
    }

    /// Source of a copy or blit.
    pub(crate) const fn transfer_read() -> Self {
        Self::new(Stages::TRANSFER, Access::TRANSFER_READ, Layout::TransferSrc)
    }

    /// Destination of a copy, blit, fill, clear or resolve.
    pub(crate) const fn transfer_write() -> Self {
        Self::new(Stages::TRANSFER, Access::TRANSFER_WRITE, Layout::TransferDst)
    }

    /// Sampled image, or buffer read by address, in `stages`.
    pub(crate) const fn shader_read(stages: Stages) -> Self {
        Self::new(stages, Access::SHADER_READ, Layout::ShaderRead)
    }

    /// Storage image or buffer that shaders in `stages` read and write.
    pub(crate) const fn shader_write(stages: Stages) -> Self {
        Self::new(stages, Access::SHADER_READ.union(Access::SHADER_WRITE), Layout::General)
    }

    /// Any access of the stages to bytes whose earlier contents are lost.
    pub(crate) fn any_of(stages: Stages) -> Self {
        Self::new(stages, stages.possible_accesses(), Layout::Undefined)
    }

    /// Index buffer of a draw.
    pub(crate) const fn index() -> Self {
        Self::new(Stages::VERTEX_INPUT, Access::INDEX_READ, Layout::Undefined)
    }

    /// Vertex buffer of a draw.
    pub(crate) const fn vertex() -> Self {
        Self::new(Stages::VERTEX_INPUT, Access::VERTEX_READ, Layout::Undefined)
    }

    /// Parameters or count of an indirect command.
    pub(crate) const fn indirect() -> Self {
        Self::new(Stages::DRAW_INDIRECT, Access::INDIRECT_READ, Layout::Undefined)
    }

    /// Color attachment. `load` is true if earlier contents are loaded or blended with.
    pub(crate) const fn color_target(load: bool) -> Self {
        let read = if load { Access::COLOR_READ } else { Access::empty() };
        Self::new(Stages::COLOR, Access::COLOR_WRITE.union(read), Layout::ColorTarget)
    }

    /// Depth attachment, tested and written.
    pub(crate) const fn depth_target() -> Self {
        Self::new(Stages::DEPTH, Access::DEPTH_READ.union(Access::DEPTH_WRITE), Layout::DepthTarget)
    }

    /// Depth attachment that is tested and not written. It merges with a use as sampled image.
    pub(crate) const fn depth_read() -> Self {
        Self::new(Stages::DEPTH, Access::DEPTH_READ, Layout::ShaderRead)
    }

    /// Destination of an acceleration structure build, refit or copy, or its scratch memory.
    pub(crate) const fn accel_build_write() -> Self {
        Self::new(Stages::ACCEL_BUILD, Access::ACCEL_READ.union(Access::ACCEL_WRITE), Layout::Undefined)
    }

    /// Buffer that an acceleration structure is serialised to.
    pub(crate) const fn accel_to_memory() -> Self {
        Self::new(Stages::ACCEL_BUILD, Access::TRANSFER_WRITE, Layout::Undefined)
    }

    /// Buffer that an acceleration structure is deserialised from.
    pub(crate) const fn accel_from_memory() -> Self {
        Self::new(Stages::ACCEL_BUILD, Access::TRANSFER_READ, Layout::Undefined)
    }

    /// Geometry, transforms or instances that a build reads.
    pub(crate) const fn accel_build_input() -> Self {
        Self::new(Stages::ACCEL_BUILD, Access::SHADER_READ, Layout::Undefined)
    }

    /// Acceleration structure that `stages` traverse, or that a build in [`Stages::ACCEL_BUILD`] references.
    pub(crate) const fn accel_read(stages: Stages) -> Self {
        Self::new(stages, Access::ACCEL_READ, Layout::Undefined)
    }

    /// Acceleration structures that shaders in `stages` traverse in software, or by hardware queries on their
    /// behalf.
    pub(crate) const fn software_traversal(stages: Stages) -> Self {
        Self::new(stages, Access::ACCEL_READ.union(Access::SHADER_READ), Layout::Undefined)
    }

    /// Reads through a mapped pointer after the GPU is done.
    pub(crate) const fn host_read() -> Self {
        Self::new(Stages::HOST, Access::HOST_READ, Layout::General)
    }

    /// Every read of a buffer that a device stage can perform, for commands that do not declare their reads.
    pub(crate) fn everything_read() -> Self {
        let stages = Stages::SHADERS
            | Stages::TRANSFER
            | Stages::DRAW_INDIRECT
            | Stages::VERTEX_INPUT
            | Stages::ACCEL_BUILD;
        let attachments =
            Access::COLOR_READ | Access::DEPTH_READ | Access::INPUT_READ | Access::SHADING_RATE_READ;
        Self::new(stages, !Access::WRITES - attachments - Access::HOST_READ, Layout::Undefined)
    }

    /// True if memory changes.
    pub(crate) fn is_write(self) -> bool {
        self.access.intersects(Access::WRITES)
    }

    /// Returns the part of the use in the given stages.
    pub(crate) fn limited_to(self, stages: Stages) -> Self {
        let stages = self.stages & stages;
        Self { stages, access: self.access & stages.possible_accesses(), ..self }
    }

    /// Returns the same accesses in another layout.
    pub(crate) const fn with_layout(self, layout: Layout) -> Self {
        Self { layout, ..self }
    }

    /// Returns both uses combined in one command. `None` if no layout supports both, because descriptors
    /// expect one layout for each image. Examples are an attachment that is sampled in the same pass, and a
    /// storage image that is also sampled.
    pub(crate) fn merge(self, other: Self) -> Option<Self> {
        let layout = match (self.layout, other.layout) {
            (a, b) if a == b => a,
            (Layout::Undefined, layout) | (layout, Layout::Undefined) => layout,
            _ => return None,
        };
        Some(Self { stages: self.stages | other.stages, access: self.access | other.access, layout })
    }
}

/// Uses by render passes beyond plain targets, and by presentation.
impl Use {
    /// Attachment that fragment shaders of the same pass read. It merges with a target in the same layout.
    pub(crate) const fn local_read() -> Self {
        Self::new(Stages::FRAGMENT, Access::INPUT_READ, Layout::LocalRead)
    }

    /// Multisampled target, colour or depth, that is resolved at the end of its pass. It merges with the
    /// target.
    pub(crate) const fn resolve_source() -> Self {
        Self::new(Stages::COLOR, Access::COLOR_READ, Layout::Undefined)
    }

    /// Resolve target of a colour target. Vulkan resolves depth in the same stage, in
    /// [`Layout::DepthTarget`].
    pub(crate) const fn resolve_target() -> Self {
        Self::new(Stages::COLOR, Access::COLOR_WRITE, Layout::ColorTarget)
    }

    /// Attachment from which a pass reads its shading rates.
    pub(crate) const fn shading_rate() -> Self {
        Self::new(Stages::SHADING_RATE, Access::SHADING_RATE_READ, Layout::ShadingRate)
    }

    /// Presentation of an image. The presentation engine waits for a semaphore.
    #[cfg_attr(not(any(feature = "window", test)), expect(dead_code, reason = "only swapchains present"))]
    pub(crate) const fn present() -> Self {
        Self::new(Stages::empty(), Access::empty(), Layout::Present)
    }
}

/// A set of accesses for each single stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct StageAccess([Access; Stages::COUNT]);

impl StageAccess {
    /// Adds the accesses of `touch` at each of its stages.
    #[inline(never)]
    pub(crate) fn insert(&mut self, touch: Use) {
        for row in touch.stages.indices() {
            self.0[row] |= touch.access & POSSIBLE[row];
        }
    }

    /// Returns the accesses of `other` that `self` lacks.
    pub(crate) fn missing(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|row| other.0[row] - self.0[row]))
    }

    /// Returns the accesses of a single stage.
    #[cfg(test)]
    pub(crate) fn at(&self, stage: Stages) -> Access {
        self.0[stage.index()]
    }

    /// Returns the stages with at least one access.
    pub(crate) fn stages(&self) -> Stages {
        let bit = |(row, access): (usize, &Access)| u16::from(!access.is_empty()) << row;
        Stages::from_bits_retain(self.0.iter().enumerate().map(bit).fold(0, |all, bit| all | bit))
    }

    /// Returns the accesses of all stages together.
    pub(crate) fn access(&self) -> Access {
        self.0.iter().fold(Access::empty(), |all, access| all | *access)
    }
}

impl From<Use> for StageAccess {
    fn from(touch: Use) -> Self {
        let mut table = Self::default();
        table.insert(touch);
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_single_stage_has_a_table_entry_and_an_access() {
        let rows: Vec<usize> = Stages::all().iter().map(Stages::index).collect();
        assert_eq!(rows, (0..Stages::COUNT).collect::<Vec<_>>());
        assert!(Stages::all().iter().all(|stage| !stage.possible_access().is_empty()));
    }

    #[test]
    fn constructors_only_name_accesses_that_each_stage_can_perform() {
        let uses = [
            Use::transfer_read(),
            Use::transfer_write(),
            Use::shader_read(Stages::SHADERS),
            Use::shader_write(Stages::SHADERS),
            Use::index(),
            Use::vertex(),
            Use::indirect(),
            Use::color_target(true),
            Use::depth_target(),
            Use::accel_build_write(),
            Use::accel_build_input(),
            Use::accel_to_memory(),
            Use::accel_from_memory(),
            Use::accel_read(Stages::SHADERS | Stages::ACCEL_BUILD),
            Use::host_read(),
            Use::everything_read(),
            Use::depth_read(),
            Use::local_read(),
            Use::resolve_source(),
            Use::resolve_target(),
            Use::shading_rate(),
            Use::present(),
        ];
        for touch in uses {
            let table = StageAccess::from(touch);
            assert_eq!(table.stages(), touch.stages, "{touch:?}");
            assert_eq!(table.access(), touch.access, "{touch:?}");
        }
    }

    #[test]
    fn only_uses_that_change_memory_are_writes() {
        assert!(Use::shader_write(Stages::COMPUTE).is_write());
        assert!(Use::color_target(false).is_write());
        assert!(!Use::everything_read().is_write());
    }

    #[test]
    fn reads_of_two_stages_merge() {
        let both = Use::shader_read(Stages::FRAGMENT).merge(Use::shader_read(Stages::COMPUTE)).unwrap();
        assert_eq!(both, Use::shader_read(Stages::FRAGMENT | Stages::COMPUTE));
    }

    #[test]
    fn attachments_merge_with_what_their_own_pass_does_with_them() {
        let sampled = Use::shader_read(Stages::FRAGMENT);
        let tested = Use::depth_read().merge(sampled).unwrap();
        assert_eq!(StageAccess::from(tested).at(Stages::DEPTH), Access::DEPTH_READ);
        assert_eq!(StageAccess::from(tested).at(Stages::FRAGMENT), Access::SHADER_READ);
        assert!(!tested.is_write());
        let target = Use::color_target(true).with_layout(Layout::LocalRead);
        let local = StageAccess::from(target.merge(Use::local_read()).unwrap());
        assert_eq!(local.at(Stages::COLOR), Access::COLOR_READ | Access::COLOR_WRITE);
        assert_eq!(local.at(Stages::FRAGMENT), Access::INPUT_READ);
        let resolved = Use::depth_target().merge(Use::resolve_source()).unwrap();
        assert_eq!(resolved.layout, Layout::DepthTarget);
        assert_eq!(StageAccess::from(resolved).at(Stages::COLOR), Access::COLOR_READ);
        assert_eq!(Use::color_target(true).merge(Use::local_read()), None);
    }

    #[test]
    fn feedback_loops_do_not_merge() {
        assert_eq!(Use::color_target(true).merge(Use::shader_read(Stages::FRAGMENT)), None);
        assert_eq!(Use::transfer_read().merge(Use::transfer_write()), None);
        assert_eq!(Use::shader_read(Stages::COMPUTE).merge(Use::shader_write(Stages::COMPUTE)), None);
    }
}
