//! The rows of the comparison.

use super::workload::Workload;

/// Work that every peer does, if it can.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Row {
    /// Submission of nothing, and the wait for it.
    EmptySubmit,
    /// Creation and destruction of buffers with memory.
    Buffers,
    /// Creation and destruction of sampled textures with memory and a view.
    Textures,
    /// A render pass of many draws, each after 64 bytes of new constants.
    Draws,
    /// Dispatches, each of which reads what the one before has written.
    Dispatches,
    /// Uploads of 4 KiB into one buffer.
    Uploads,
    /// Creation and first build of the BLAS of many meshes.
    BlasBuilds,
    /// Instances written by the host, and the build of their TLAS.
    TlasBuild,
    /// Primary rays of an image by ray queries in a compute shader.
    RayQueryFrame,
    /// Primary rays of an image by a ray tracing pipeline.
    RayPipelineFrame,
    /// A render pass of many draws, each of which reads another texture.
    TexturedFrame,
}

impl Row {
    /// All rows in the order of the table.
    pub const ALL: [Self; 11] = [
        Self::EmptySubmit,
        Self::Buffers,
        Self::Textures,
        Self::Draws,
        Self::Dispatches,
        Self::Uploads,
        Self::BlasBuilds,
        Self::TlasBuild,
        Self::RayQueryFrame,
        Self::RayPipelineFrame,
        Self::TexturedFrame,
    ];

    /// Returns the name on the command line.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::EmptySubmit => "submit",
            Self::Buffers => "buffers",
            Self::Textures => "textures",
            Self::Draws => "draws",
            Self::Dispatches => "dispatches",
            Self::Uploads => "uploads",
            Self::BlasBuilds => "blas",
            Self::TlasBuild => "tlas",
            Self::RayQueryFrame => "ray-query",
            Self::RayPipelineFrame => "ray-pipeline",
            Self::TexturedFrame => "textured",
        }
    }

    /// Returns the row with this name on the command line.
    #[must_use]
    pub fn from_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|row| row.key() == key)
    }

    /// Returns the name in the table.
    pub(super) fn title(self, work: &Workload) -> String {
        let [width, height] = work.image;
        match self {
            Self::EmptySubmit => "empty submission and wait".to_owned(),
            Self::Buffers => "buffer created + destroyed".to_owned(),
            Self::Textures => "texture created + destroyed".to_owned(),
            Self::Draws => format!("{} draws, each with 64 B of constants", work.draws),
            Self::Dispatches => format!("{} dispatches in sequence", work.dispatches),
            Self::Uploads => format!("{} uploads of 4 KiB", work.uploads),
            Self::BlasBuilds => {
                format!("BLAS of {} meshes of {} triangles", work.meshes, work.mesh_triangles)
            }
            Self::TlasBuild => format!("TLAS of {} instances", work.instances),
            Self::RayQueryFrame => format!("{width}x{height} rays by query"),
            Self::RayPipelineFrame => format!("{width}x{height} rays by pipeline"),
            Self::TexturedFrame => format!("frame with {} textures", work.textures),
        }
    }

    /// Returns the number of equal items in a sample; times are printed for one item.
    pub(super) fn items(self, work: &Workload) -> u32 {
        match self {
            Self::EmptySubmit => work.submits,
            Self::Buffers | Self::Textures => work.objects,
            _ => self.frames(work),
        }
    }

    /// Returns the number of times that a sample does the work, one after the other: a frame of a loop finds what the frame before it has left in
    /// caches, and a single one behind a pause does not.
    pub(super) const fn frames(self, work: &Workload) -> u32 {
        match self {
            Self::RayQueryFrame | Self::RayPipelineFrame | Self::TexturedFrame => work.frames,
            _ => 1,
        }
    }

    /// True if every sample ends before anything is submitted, or has no time of its own on the GPU.
    pub(super) const fn is_cpu_only(self) -> bool {
        matches!(self, Self::EmptySubmit | Self::Buffers | Self::Textures)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_name_one_row_each() {
        for row in Row::ALL {
            assert_eq!(Row::from_key(row.key()), Some(row));
        }
        assert_eq!(Row::from_key("everything"), None);
    }

    #[test]
    fn times_of_objects_and_submissions_are_those_of_one() {
        let work = Workload::QUICK;
        assert_eq!(Row::Buffers.items(&work), work.objects);
        assert_eq!(Row::Draws.items(&work), 1);
        assert_eq!(Row::TexturedFrame.items(&work), work.frames);
        assert!(Row::TlasBuild.title(&work).contains(&work.instances.to_string()));
    }
}
