//! Objects that all threads use at once.
//!
//! A buffer and a texture have a part for each program that runs, which that program alone writes, and a
//! constant one. All programs build one BLAS and one TLAS anew, always of the same triangles, and trace rays at the TLAS. Other
//! objects are destroyed by any program and made anew with the same contents, while the others use them.

use std::sync::{Mutex, MutexGuard, PoisonError};

use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, BuildMode,
    CommandBuffer, Context, Format, Holder, TextureDesc, TextureHandle, TextureKind, TextureUsage,
    TextureViewDesc, TlasDesc, TlasInstance, Triangles,
};

use super::cell::{known, pattern};
use super::image::{Image, Part};
use super::memory::{MISS, Memory, RAYS, TRIANGLES, hit_word};
use super::plan_rays::triangle_bytes;

/// Most programs that have a part.
const PARTS: usize = 16;
/// Bytes of a part of the buffer, and of the buffer that is replaced.
pub const PART_BYTES: usize = 256;
/// Width and height of a layer.
pub const SIDE: u32 = 4;
/// Bytes of a layer.
pub const LAYER_BYTES: usize = 4 * (SIDE * SIDE) as usize;
/// Seed of the constant parts, and of the objects that are replaced.
const CONSTANT: [u16; 2] = [11, 47];
/// Depths of the triangles of the shared BLAS and of the one that is replaced.
const DEPTHS: [[u32; TRIANGLES]; 2] = [[3, 8, 5], [7, 2, 9]];
/// Custom indices of the instances of both.
const CUSTOM: [u32; 2] = [17, 40];

/// The objects.
pub struct Shared {
    pub buffer: Holder<BufferHandle>,
    pub texture: Holder<TextureHandle>,
    blas: Holder<AccelStructHandle>,
    pub tlas: Holder<AccelStructHandle>,
    _mesh: Holder<BufferHandle>,
    replaced: Mutex<Replaced>,
    /// Numbers of the parts that no program has.
    free: Mutex<Vec<usize>>,
}

/// Objects that any program destroys and makes anew.
struct Replaced {
    version: u64,
    buffer: Holder<BufferHandle>,
    texture: Holder<TextureHandle>,
    blas: Holder<AccelStructHandle>,
    _mesh: Holder<BufferHandle>,
}

/// Handles of the objects that are made anew, of one version.
#[derive(Debug, Clone, Copy)]
pub struct ReplacedHandles {
    pub version: u64,
    pub buffer: BufferHandle,
    pub texture: TextureHandle,
    pub blas: AccelStructHandle,
}

/// The part of a program, and what the program has of its own for it.
pub struct OwnPart<'a> {
    shared: &'a Shared,
    number: usize,
    /// View of the layer.
    pub view: Holder<TextureHandle>,
    /// Gets instances of the BLAS that is replaced.
    pub tlas: Holder<AccelStructHandle>,
    /// Numbers of the bytes in the model: those of the own part, of the constant part and of the buffer that is
    /// replaced.
    pub bytes: [usize; 3],
    /// Numbers of the images in the model, likewise.
    pub images: [usize; 3],
    /// The handles that the program last looked up, which may be stale.
    pub replaced: ReplacedHandles,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Creates the mesh of a BLAS and the BLAS.
fn blas(ctx: &Context, which: usize) -> lvk::Result<(Holder<BufferHandle>, Holder<AccelStructHandle>)> {
    let triangles = DEPTHS[which].iter().enumerate();
    let data: Vec<u8> = triangles.flat_map(|(triangle, depth)| triangle_bytes(triangle, *depth)).collect();
    let mesh = ctx.create_buffer(&BufferDesc {
        usage: BufferUsage::ACCEL_INPUT,
        data: Some(&data),
        debug_name: "shared mesh",
        ..Default::default()
    })?;
    let geometries = [BlasGeometry::Triangles(Triangles::packed(*mesh, 3 * TRIANGLES as u32))];
    let desc = BlasDesc { geometries: &geometries, debug_name: "shared BLAS", ..Default::default() };
    let blas = ctx.create_blas(&desc)?;
    Ok((mesh, blas))
}

/// Creates a texture of some layers of constant texels.
fn texture(ctx: &Context, layers: u32, seed: u16) -> lvk::Result<Holder<TextureHandle>> {
    ctx.create_texture(&TextureDesc {
        kind: TextureKind::D2Array { layers },
        format: Format::R32Uint,
        extent: [SIDE, SIDE],
        usage: TextureUsage::SAMPLED | TextureUsage::STORAGE,
        data: Some(&pattern(seed, LAYER_BYTES).repeat(layers as usize)),
        debug_name: "shared texture",
        ..Default::default()
    })
}

/// Creates a buffer of some parts of constant bytes.
fn buffer(ctx: &Context, parts: usize, seed: u16) -> lvk::Result<Holder<BufferHandle>> {
    ctx.create_buffer(&BufferDesc {
        usage: BufferUsage::STORAGE,
        data: Some(&pattern(seed, PART_BYTES).repeat(parts)),
        debug_name: "shared buffer",
        ..Default::default()
    })
}

impl Replaced {
    fn new(ctx: &Context, version: u64) -> lvk::Result<Self> {
        let (mesh, blas) = blas(ctx, 1)?;
        let (buffer, texture) = (buffer(ctx, 1, CONSTANT[1])?, texture(ctx, 1, CONSTANT[1])?);
        Ok(Self { version, buffer, texture, blas, _mesh: mesh })
    }
}

/// Returns the instance of the shared BLAS, or of the one that is replaced, in a slot of its own.
pub fn instance(which: usize, blas: AccelStructHandle) -> TlasInstance {
    let x = 4.0 * which as f32;
    TlasInstance {
        transform: [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        custom_index: CUSTOM[which],
        ..TlasInstance::new(blas)
    }
}

/// Returns the words that rays write which meet that instance alone.
pub fn answers(which: usize) -> Vec<u8> {
    let word = |ray: usize| {
        let (slot, triangle) = (ray / TRIANGLES, ray % TRIANGLES);
        let hit = || hit_word(CUSTOM[which], triangle as u32, DEPTHS[which][triangle]);
        if slot == which { hit() } else { MISS }
    };
    (0..RAYS).flat_map(|ray| word(ray).to_le_bytes()).collect()
}

impl Shared {
    /// Number of objects.
    pub const COUNT: usize = 9;

    /// Creates the objects. The BLAS and the TLAS are built once more at once, as a rebuild may take more memory.
    pub fn new(ctx: &Context) -> lvk::Result<Self> {
        let (mesh, blas) = blas(ctx, 0)?;
        let instances = [instance(0, *blas)];
        let desc = TlasDesc { instances: &instances, debug_name: "shared TLAS", ..Default::default() };
        let shared = Self {
            buffer: buffer(ctx, PARTS + 1, CONSTANT[0])?,
            texture: texture(ctx, PARTS as u32 + 1, CONSTANT[0])?,
            tlas: ctx.create_tlas(&desc)?,
            blas,
            _mesh: mesh,
            replaced: Mutex::new(Replaced::new(ctx, 0)?),
            free: Mutex::new((0..PARTS).collect()),
        };
        let mut cmd = ctx.acquire_command_buffer()?;
        shared.build(&mut cmd)?;
        ctx.wait(ctx.submit(cmd)?)?;
        Ok(shared)
    }

    /// Builds the BLAS and the TLAS anew.
    pub fn build(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        cmd.build_blas(&[*self.blas], BuildMode::Rebuild)?;
        cmd.update_tlas(*self.tlas, &[instance(0, *self.blas)], BuildMode::Rebuild)
    }

    /// Destroys the objects that are replaced, and makes them anew.
    pub fn replace(&self, ctx: &Context) -> lvk::Result<()> {
        let mut replaced = lock(&self.replaced);
        *replaced = Replaced::new(ctx, replaced.version + 1)?;
        Ok(())
    }

    /// Returns the handles that are right now.
    pub fn replaced(&self) -> ReplacedHandles {
        let Replaced { version, buffer, texture, blas, .. } = &*lock(&self.replaced);
        ReplacedHandles { version: *version, buffer: **buffer, texture: **texture, blas: **blas }
    }

    /// True if the objects of a version are alive.
    pub fn is_current(&self, version: u64) -> bool {
        lock(&self.replaced).version == version
    }

    /// Gives a program a part, and the model what it holds. `None` if all are taken.
    pub fn take_part(&self, ctx: &Context, memory: &mut Memory) -> lvk::Result<Option<OwnPart<'_>>> {
        let Some(number) = lock(&self.free).pop() else { return Ok(None) };
        let part = self.own_part(ctx, memory, number);
        if part.is_err() {
            lock(&self.free).push(number);
        }
        part.map(Some)
    }

    fn own_part(&self, ctx: &Context, memory: &mut Memory, number: usize) -> lvk::Result<OwnPart<'_>> {
        let view = ctx.create_texture_view(&TextureViewDesc {
            texture: Some(*self.texture),
            kind: Some(TextureKind::D2),
            base_layer: number as u32,
            debug_name: "view of a shared texture",
            ..Default::default()
        })?;
        let desc = TlasDesc { capacity: 1, debug_name: "TLAS of a part", ..Default::default() };
        let tlas = ctx.create_tlas(&desc)?;
        ctx.upload_buffer(*self.buffer, (number * PART_BYTES) as u64, &pattern(CONSTANT[0], PART_BYTES))?;
        let layer = lvk::TextureRegion { layer: number as u32, layers: 1, ..Default::default() };
        ctx.upload_texture(*self.texture, &layer, &pattern(CONSTANT[0], LAYER_BYTES))?;
        let seeds = [CONSTANT[0], CONSTANT[0], CONSTANT[1]];
        let bytes = seeds.map(|seed| memory.buffers.push_shared(known(&pattern(seed, PART_BYTES))));
        let images = seeds.map(|seed| {
            let mut image = Image::new(Format::R32Uint, [SIDE, SIDE], 1, 1);
            image.write(&layer_part(0).whole(0), &known(&pattern(seed, LAYER_BYTES)));
            memory.images.push_shared(image)
        });
        Ok(OwnPart { shared: self, number, view, tlas, bytes, images, replaced: self.replaced() })
    }
}

/// Returns the part of an image that is one layer.
pub fn layer_part(image: usize) -> Part {
    Part { image, base_mip: 0, mips: 1, base_layer: 0, layers: 1, extent: [SIDE, SIDE] }
}

impl OwnPart<'_> {
    /// Returns the first byte and the layer of the own part, or of the constant one.
    pub fn place(&self, is_own: bool) -> (u64, u32) {
        let number = if is_own { self.number } else { PARTS };
        ((number * PART_BYTES) as u64, number as u32)
    }
}

impl Drop for OwnPart<'_> {
    fn drop(&mut self) {
        lock(&self.shared.free).push(self.number);
    }
}
