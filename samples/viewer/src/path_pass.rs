//! Paths of all pixels by a ray tracing pipeline, or by a compute shader with ray queries.

use lvk::{BufferHandle, CommandBuffer, Context, Dependencies, Holder, TextureHandle};
use lvk_samples::app::array_buffer::buffer;

use crate::config::ViewerConfig;
use crate::gpu::FrameScene;
use crate::gpu::layout::{GpuStoredPath, Push};
use crate::launch::{RayLaunch, RayStages};

/// Surfaces that each launch leads its paths on by, before the last, which has all that are left. More launches keep more of a GPU's
/// invocations at work; on a CPU each costs more.
const GPU_STEPS: &[u32] = &[1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 4, 4];
const CPU_STEPS: &[u32] = &[2, 2, 4, 4];
/// The same with a radiance cache, where most paths end at their second surface.
const GPU_CACHE_STEPS: &[u32] = &[1, 1, 1, 2, 4];
/// The same with ambient occlusion, where paths have four surfaces at most.
const GPU_OCCLUSION_STEPS: &[u32] = &[1, 1];
/// Bytes of a path between launches.
const PATH_BYTES: u64 = size_of::<GpuStoredPath>() as u64;
/// Bytes before the lists of paths (`kListHead` in `shaders/viewer/path_launch.glsl`).
const LIST_HEAD_BYTES: u64 = 16;

/// Launches that follow the paths of all pixels, and the paths between them.
pub(crate) struct PathPass {
    rays: RayLaunch,
    paths: Holder<BufferHandle>,
    extent: [u32; 2],
    steps: &'static [u32],
}

/// The work of a frame for paths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PathWork {
    /// Address of the frame's constants.
    pub(crate) frame: u64,
    /// Samples of each pixel.
    pub(crate) samples: u32,
    /// Surfaces of a path at most.
    pub(crate) bounces: u32,
}

/// Addresses of the lists of paths, and of the paths.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PathAddresses {
    pub(crate) lists: u64,
    pub(crate) paths: u64,
}

impl PathPass {
    pub(crate) fn new(ctx: &Context, config: &ViewerConfig, stages: &RayStages) -> lvk::Result<Self> {
        let rays = RayLaunch::new(ctx, config.path, stages)?;
        let [width, height] = config.extent();
        let size_bytes = list_bytes(config.extent()) + PATH_BYTES * u64::from(width) * u64::from(height);
        let paths = buffer(ctx, "paths", size_bytes)?;
        let steps = match ctx.capabilities().is_cpu {
            true => CPU_STEPS,
            false if config.occludes_ambient() => GPU_OCCLUSION_STEPS,
            false if config.caches() => GPU_CACHE_STEPS,
            false => GPU_STEPS,
        };
        Ok(Self { rays, paths, extent: config.extent(), steps })
    }

    pub(crate) fn addresses(&self) -> lvk::Result<PathAddresses> {
        let lists = self.paths.address()?;
        Ok(PathAddresses { lists, paths: lists + list_bytes(self.extent) })
    }

    /// Records the samples of all pixels, whose shaders use the buffers of the scene and `own`.
    pub(crate) fn record(
        &self,
        cmd: &mut CommandBuffer,
        work: PathWork,
        own: &[BufferHandle],
        (visible, scene): (&[TextureHandle], FrameScene<'_>),
    ) -> lvk::Result<()> {
        let mut buffers = scene.buffers(own);
        buffers.push(*self.paths);
        let dependencies = Dependencies {
            buffers: &buffers,
            read_buffers: scene.written,
            sampled_images: visible,
            ..Dependencies::default()
        };
        cmd.fill_buffer(*self.paths, 0, LIST_HEAD_BYTES, 0)?;
        self.rays.bind(cmd)?;
        for argument in launches(self.steps, work) {
            cmd.push_constants(&Push { frame: work.frame, argument, _padding: 0 })?;
            self.rays.record(cmd, self.extent, &dependencies)?;
        }
        Ok(())
    }
}

/// Bytes of the numbers of listed paths, and of two lists.
fn list_bytes([width, height]: [u32; 2]) -> u64 {
    LIST_HEAD_BYTES + 2 * 4 * u64::from(width) * u64::from(height)
}

/// Arguments of all launches (`shaders/viewer/path_launch.glsl`).
fn launches(steps: &[u32], work: PathWork) -> impl Iterator<Item = u32> {
    let steps = steps_of_launches(steps, work.bounces);
    let count = steps.len() as u32;
    (0..work.samples * count).map(move |number| {
        let (sample, launch) = (number / count, number % count);
        (number % 6) | (u32::from(launch == 0) << 3) | (steps[launch as usize] << 8) | (sample << 16)
    })
}

/// Surfaces of each launch for paths of at most `bounces`; 0 for the last, which goes on to the end.
fn steps_of_launches(steps: &[u32], bounces: u32) -> Vec<u32> {
    let mut led = 0;
    let is_before_end = |steps: &u32| {
        led += steps;
        led < bounces
    };
    steps.iter().copied().take_while(is_before_end).chain([0]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn launches_have_all_surfaces_of_a_path_and_the_last_is_not_idle() {
        for (bounces, steps) in [(1, vec![0]), (2, vec![0]), (3, vec![2, 0]), (9, vec![2, 2, 4, 0])] {
            assert_eq!(steps_of_launches(CPU_STEPS, bounces), steps, "{bounces}");
        }
        assert_eq!(steps_of_launches(CPU_STEPS, u32::MAX - 1), [2, 2, 4, 4, 0]);
        assert_eq!(steps_of_launches(GPU_STEPS, 3), [1, 1, 0]);
        assert_eq!(steps_of_launches(GPU_OCCLUSION_STEPS, 32), [1, 1, 0]);
    }

    #[test]
    fn launches_take_turns_from_one_sample_to_the_next() {
        let work = PathWork { frame: 0, samples: 3, bounces: 5 };
        let all: Vec<_> = launches(CPU_STEPS, work).collect();
        let turns: Vec<_> = all.iter().map(|argument| argument & 7).collect();
        assert_eq!(turns, [0, 1, 2, 3, 4, 5, 0, 1, 2]);
        let begins: Vec<_> = all.iter().map(|argument| argument & 8 != 0).collect();
        assert_eq!(begins, [true, false, false].repeat(3));
        let samples: Vec<_> = all.iter().map(|argument| argument >> 16).collect();
        assert_eq!(samples, [0, 0, 0, 1, 1, 1, 2, 2, 2]);
    }
}
