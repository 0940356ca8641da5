//! The resources that the shaders name.

use blade_graphics as gpu;
use blade_graphics::{ShaderBindable as _, ShaderBinding};

/// Constants of [`Row::Draws`](lvk_bench::peers::Row::Draws).
pub(super) struct Constants {
    pub(super) push: [u32; 16],
}

impl gpu::ShaderData for Constants {
    fn layout() -> gpu::ShaderDataLayout {
        gpu::ShaderDataLayout { bindings: vec![("push", ShaderBinding::Plain { size: 64 })] }
    }

    fn fill(&self, mut context: gpu::PipelineContext<'_>) {
        self.push.bind_to(&mut context, 0);
    }
}

/// A texture and the cell of it.
pub(super) struct Cell {
    pub(super) push: [u32; 2],
    pub(super) picture: gpu::TextureView,
}

impl gpu::ShaderData for Cell {
    fn layout() -> gpu::ShaderDataLayout {
        let push = ("push", ShaderBinding::Plain { size: 8 });
        gpu::ShaderDataLayout { bindings: vec![push, ("picture", ShaderBinding::Texture)] }
    }

    fn fill(&self, mut context: gpu::PipelineContext<'_>) {
        self.push.bind_to(&mut context, 0);
        self.picture.bind_to(&mut context, 1);
    }
}

/// The buffer that dispatches write.
pub(super) struct Numbers {
    pub(super) numbers: gpu::BufferPiece,
}

impl gpu::ShaderData for Numbers {
    fn layout() -> gpu::ShaderDataLayout {
        gpu::ShaderDataLayout { bindings: vec![("numbers", ShaderBinding::Buffer)] }
    }

    fn fill(&self, mut context: gpu::PipelineContext<'_>) {
        self.numbers.bind_to(&mut context, 0);
    }
}

/// The camera, the scene and the hits.
pub(super) struct Rays {
    pub(super) view: [f32; 16],
    pub(super) scene: gpu::AccelerationStructure,
    pub(super) hits: gpu::BufferPiece,
}

impl gpu::ShaderData for Rays {
    fn layout() -> gpu::ShaderDataLayout {
        gpu::ShaderDataLayout {
            bindings: vec![
                ("view", ShaderBinding::Plain { size: 64 }),
                ("scene", ShaderBinding::AccelerationStructure),
                ("hits", ShaderBinding::Buffer),
            ],
        }
    }

    fn fill(&self, mut context: gpu::PipelineContext<'_>) {
        self.view.bind_to(&mut context, 0);
        self.scene.bind_to(&mut context, 1);
        self.hits.bind_to(&mut context, 2);
    }
}
