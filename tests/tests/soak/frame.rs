//! One frame: uploads on a queue, a refit, a TLAS update, rays, draws, and readbacks whose bytes are known.

use std::collections::VecDeque;

use lvk::{
    BufferHandle, BuildMode, ColorAttachment, Context, Dependencies, Queue, Readback, RenderPassDesc, Result,
    TextureRegion,
};

use super::run::Tally;
use super::scene::{CYCLE, FrameConstants, Scene, WORDS, extent_of, instances, sheet};

/// The streamed texture that a frame samples, from [`Churn`](super::churn::Churn).
#[derive(Debug, Clone, Copy)]
pub struct Sampled {
    /// The texture.
    pub texture: lvk::TextureHandle,
    /// Bindless index.
    pub index: u32,
    /// Finest mip that is there.
    pub finest_mip: u32,
}

/// Frames of the cycle whose pictures are compared.
const PICTURES: [u32; 5] = [3, 61, 124, 187, 248];
/// Readbacks that may be unfinished.
const MOST_PENDING: usize = 4;

/// Readbacks of earlier frames, and the pictures of the first whole cycle.
#[derive(Default)]
pub struct Frames {
    words: VecDeque<(Readback, Vec<u8>)>,
    pictures: VecDeque<(Readback, usize)>,
    first: [Option<Vec<u8>>; PICTURES.len()],
}

/// Returns the words that a frame writes.
fn words_of(phase: u32) -> Vec<u32> {
    (0..WORDS).map(|i| (phase * 13 + i * 7) ^ (i << 16)).collect()
}

impl Frames {
    /// Records and submits a frame.
    pub fn frame(
        &mut self,
        ctx: &Context,
        scene: &mut Scene,
        sampled: Sampled,
        number: u32,
        tally: &mut Tally,
    ) -> Result<()> {
        let phase = number % CYCLE;
        ctx.next_frame()?;
        if scene.extent != extent_of(phase) {
            scene.resize(ctx, extent_of(phase))?;
            tally.count("resizes of targets");
        }
        self.upload_words(ctx, *scene.words, phase, tally)?;
        if phase.is_multiple_of(2) {
            ctx.upload_buffer(*scene.vertices, 0, bytemuck::cast_slice(&sheet(phase)))?;
            tally.count("buffer uploads by the context");
        }
        draw(ctx, scene, sampled, phase, tally)?;
        if let Some(index) = PICTURES.iter().position(|picture| *picture == phase)
            && number >= CYCLE
        {
            let readback = ctx.read_texture_later(*scene.target, &TextureRegion::default())?;
            self.pictures.push_back((readback, index));
        }
        self.finish(MOST_PENDING, tally)
    }

    /// Writes the words by the queue whose turn it is, and reads them back later.
    fn upload_words(
        &mut self,
        ctx: &Context,
        words: BufferHandle,
        phase: u32,
        tally: &mut Tally,
    ) -> Result<()> {
        // Not the remainder by three, which is no divisor of the cycle.
        let queue = Queue::ALL[(phase % 10) as usize % 3];
        let bytes: Vec<u8> = bytemuck::cast_slice(&words_of(phase)).to_vec();
        let mut cmd = ctx.acquire_command_buffer_on(queue)?;
        cmd.update_buffer(words, 0, &bytes)?;
        match queue {
            Queue::Graphics => ctx.submit(cmd)?,
            _ if phase.is_multiple_of(2) => ctx.submit_in_background(cmd)?,
            _ => ctx.submit(cmd)?,
        };
        tally.count(match queue {
            Queue::Graphics => "uploads on the graphics queue",
            Queue::Compute => "uploads on the compute queue",
            Queue::Transfer => "uploads on the transfer queue",
        });
        let readback = ctx.read_buffer_later(words, 0..bytes.len() as u64)?;
        self.words.push_back((readback, bytes));
        Ok(())
    }

    /// Finishes readbacks until at most `most` of each kind are pending, and compares their bytes.
    pub fn finish(&mut self, most: usize, tally: &mut Tally) -> Result<()> {
        while self.words.len() > most
            && let Some((readback, expected)) = self.words.pop_front()
        {
            assert_eq!(readback.wait()?, expected, "the words of a frame");
            tally.count("readbacks compared");
        }
        while self.pictures.len() > most
            && let Some((readback, index)) = self.pictures.pop_front()
        {
            let picture = readback.wait()?;
            assert!(picture.chunks(4).any(|texel| texel != &picture[..4]), "a picture has one colour");
            let first = self.first[index].get_or_insert_with(|| picture.clone());
            assert_eq!(*first, picture, "picture {index} of the cycle has changed");
            tally.count("pictures compared with the first");
        }
        Ok(())
    }
}

/// Records refit, TLAS update, rays and draws in one command buffer.
fn draw(ctx: &Context, scene: &Scene, sampled: Sampled, phase: u32, tally: &mut Tally) -> Result<()> {
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.push_label("frame");
    if phase.is_multiple_of(2) {
        cmd.build_blas(&[*scene.moving], BuildMode::Refit)?;
        tally.count("BLAS refits");
    }
    let list = instances(phase, [*scene.moving, *scene.fixed]);
    cmd.update_tlas(*scene.tlas, &list, BuildMode::Auto { max_refits: 8 })?;
    tally.count("TLAS updates");
    let constants = FrameConstants {
        words: ctx.buffer_address(*scene.words)?,
        tlas: scene.tlas.index(),
        image: scene.traced.index(),
        texture: sampled.index,
        sampler: scene.sampler.index(),
        finest_mip: sampled.finest_mip,
        phase,
    };
    let address = cmd.upload(&constants)?;
    cmd.bind_compute_pipeline(*scene.trace)?;
    cmd.push_constants(&address)?;
    let [width, height] = scene.extent;
    let uses = Dependencies {
        acceleration_structures: &[*scene.tlas],
        storage_images: &[*scene.traced],
        sampled_images: &[sampled.texture],
        read_buffers: &[*scene.words],
        ..Default::default()
    };
    cmd.dispatch([width.div_ceil(8), height.div_ceil(4), 1], &uses)?;
    tally.count("dispatches that trace rays");
    let color = [ColorAttachment::clear(*scene.target, [0.1, 0.0, 0.0, 1.0])];
    let dependencies = Dependencies { sampled_images: &[*scene.traced], ..Default::default() };
    let desc = RenderPassDesc { color: &color, dependencies, debug_name: "soak", ..Default::default() };
    let mut pass = cmd.begin_rendering(&desc)?;
    pass.bind_render_pipeline(*scene.draw)?;
    for instance in 0..3 {
        let address = pass.upload(&FrameConstants { phase: phase + 20 * instance, ..constants })?;
        pass.push_constants(&address)?;
        pass.draw(0..3, instance..instance + 1)?;
        tally.count("draws");
    }
    drop(pass);
    cmd.pop_label();
    ctx.submit(cmd)?;
    tally.count("frames");
    Ok(())
}
