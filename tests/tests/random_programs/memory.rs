//! Memory of the model: the contents of all objects, and the effects of commands on them.

use super::cell::{Cell, known, pattern_byte};
use super::image::{Image, Place, mip_extent, texel_bytes};
use super::numbered::Numbered;
use super::queries::{Pool, Queries, QueryResult};
use lvk::Format;

/// Rays of a trace: [`SLOTS`] instances of [`TRIANGLES`] triangles.
pub const RAYS: usize = SLOTS * TRIANGLES;
/// Most instances of a TLAS.
pub const SLOTS: usize = 4;
/// Most triangles of a mesh.
pub const TRIANGLES: usize = 3;
/// The word of a ray that hits nothing.
pub const MISS: u32 = 0x7e7e_7e7e;

/// Contents of all objects, by their number. Objects keep their number, and destroyed ones their contents.
#[derive(Debug, Default)]
pub struct Memory {
    /// Bytes of the buffers.
    pub buffers: Numbered<Vec<Cell>>,
    /// Images.
    pub images: Numbered<Image>,
    /// Depth of each triangle of the meshes.
    pub meshes: Vec<Vec<u32>>,
    /// BLAS.
    pub blas: Vec<Blas>,
    /// TLAS.
    pub tlas: Vec<Tlas>,
    /// Queries.
    pub queries: Queries,
    /// Rays that must hit a triangle, of all traces so far.
    pub hits: u64,
}

/// Contents of a BLAS.
#[derive(Debug, Default, Clone)]
pub struct Blas {
    /// Number of its mesh.
    pub mesh: usize,
    /// Depth of each triangle when it was built.
    pub depths: Vec<u32>,
    /// Number of builds and refits.
    pub version: u32,
}

/// Contents of a TLAS.
#[derive(Debug, Default, Clone)]
pub struct Tlas {
    /// Instances, each with the version of its BLAS.
    pub instances: Vec<(Instance, u32)>,
}

/// An instance: a BLAS moved to a slot along x, and to a depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instance {
    /// Number of the BLAS.
    pub blas: usize,
    /// Slot; the instance lies at x = 4 slot.
    pub slot: u32,
    /// Movement along z.
    pub depth: u32,
    /// Custom index.
    pub custom: u32,
    /// False if its mask hides it from all rays.
    pub is_visible: bool,
}

/// Effect of a command.
#[derive(Debug, Clone)]
pub enum Effect {
    /// Writes bytes.
    Bytes { buffer: usize, offset: usize, bytes: Vec<u8> },
    /// Copies bytes between buffers.
    CopyBytes { from: (usize, usize), to: (usize, usize), size: usize },
    /// Writes packed texels.
    Texels { place: Place, bytes: Vec<u8> },
    /// Fills texels with one value.
    Fill { place: Place, texel: Vec<u8> },
    /// Copies packed bytes to texels.
    FromBuffer { from: (usize, usize), place: Place },
    /// Copies texels to packed bytes.
    ToBuffer { place: Place, to: (usize, usize) },
    /// Copies texels; both places have the same number.
    CopyTexels { from: Place, to: Place },
    /// Scales texels to the nearest.
    Scale { from: Place, to: Place },
    /// Halves mips, each from the one before.
    Mips { first: Place, mips: u32 },
    /// Moves a triangle of a mesh.
    Move { mesh: usize, triangle: usize, depth: u32 },
    /// Builds or refits a BLAS.
    Build { blas: usize },
    /// Sets the instances of a TLAS.
    Place { tlas: usize, instances: Vec<Instance> },
    /// Traces all rays and writes a word for each.
    Trace { tlas: usize, to: (usize, usize), shading: Shading },
    /// Copies texels to packed bytes, those of these indices.
    Gather { place: Place, texels: Vec<usize>, to: (usize, usize) },
    /// Resets a query.
    Reset { pool: Pool, query: usize },
    /// Writes the result of a query.
    Query { pool: Pool, query: usize, result: QueryResult },
    /// An effect about which the model is wrong on purpose.
    Wrong(Box<Effect>),
}

/// The values that the shaders of a trace give rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shading {
    /// The word of a ray that hits nothing.
    pub miss: u32,
    /// The number that is added to the word of a hit.
    pub hit: u32,
}

impl Default for Shading {
    fn default() -> Self {
        Self { miss: MISS, hit: 0 }
    }
}

/// Lets a byte be another one.
fn falsify_cell(cell: &mut Cell) {
    *cell = Cell::known(if cell.is_known() { cell.low ^ 1 } else { 0 });
}

impl Memory {
    /// Applies the effect of a command.
    pub fn apply(&mut self, effect: &Effect) {
        match effect {
            Effect::Bytes { buffer, offset, bytes } => self.write(*buffer, *offset, &known(bytes)),
            Effect::CopyBytes { from, to, size } => {
                let cells = self.buffers[from.0][from.1..from.1 + size].to_vec();
                self.write(to.0, to.1, &cells);
            }
            Effect::Texels { place, bytes } => self.images[place.image].write(place, &known(bytes)),
            Effect::Fill { place, texel } => {
                let cells = known(&texel.repeat(place.texels()));
                self.images[place.image].write(place, &cells);
            }
            Effect::FromBuffer { from, place } => {
                let size = place.texels() * texel_bytes(self.images[place.image].format);
                let cells = self.buffers[from.0][from.1..from.1 + size].to_vec();
                self.images[place.image].write(place, &cells);
            }
            Effect::ToBuffer { place, to } => {
                let cells = self.images[place.image].read(place);
                self.write(to.0, to.1, &cells);
            }
            Effect::CopyTexels { from, to } => {
                let cells = self.images[from.image].read(from);
                self.images[to.image].write(to, &cells);
            }
            Effect::Scale { from, to } => self.scale(from, to),
            Effect::Mips { first, mips } => (1..*mips).for_each(|mip| self.halve(first, mip)),
            Effect::Move { mesh, triangle, depth } => self.meshes[*mesh][*triangle] = *depth,
            Effect::Build { blas } => {
                let blas = &mut self.blas[*blas];
                blas.depths.clone_from(&self.meshes[blas.mesh]);
                blas.version += 1;
            }
            Effect::Place { tlas, instances } => {
                let seen = |instance: &Instance| (*instance, self.blas[instance.blas].version);
                self.tlas[*tlas].instances = instances.iter().map(seen).collect();
            }
            Effect::Trace { tlas, to, shading } => self.trace(*tlas, *to, *shading),
            Effect::Gather { place, texels, to } => {
                let image = &self.images[place.image];
                let (cells, bytes) = (image.read(place), texel_bytes(image.format));
                let texel = |texel: &usize| &cells[texel * bytes..(texel + 1) * bytes];
                let gathered: Vec<_> = texels.iter().flat_map(texel).copied().collect();
                self.write(to.0, to.1, &gathered);
            }
            Effect::Reset { pool, query } => self.queries.reset(*pool, *query),
            Effect::Query { pool, query, result } => self.queries.write(*pool, *query, *result),
            Effect::Wrong(effect) => {
                self.apply(effect);
                self.falsify(effect);
            }
        }
    }

    /// Changes something that an effect has changed.
    fn falsify(&mut self, effect: &Effect) {
        match effect {
            Effect::Bytes { buffer, offset, bytes } if !bytes.is_empty() => {
                falsify_cell(&mut self.buffers[*buffer][*offset]);
            }
            Effect::CopyBytes { to, .. }
            | Effect::ToBuffer { to, .. }
            | Effect::Gather { to, .. }
            | Effect::Trace { to, .. } => {
                self.buffers[to.0].get_mut(to.1).into_iter().for_each(falsify_cell);
            }
            Effect::Fill { place, .. }
            | Effect::Texels { place, .. }
            | Effect::FromBuffer { place, .. }
            | Effect::CopyTexels { to: place, .. }
            | Effect::Scale { to: place, .. } => self.falsify_texel(place),
            Effect::Mips { first, mips } if *mips > 1 => {
                let mip = first.mip + 1;
                let extent = mip_extent(self.images[first.image].extent, mip);
                self.falsify_texel(&Place { mip, offset: [0, 0], extent, ..*first });
            }
            Effect::Move { mesh, triangle, .. } => self.meshes[*mesh][*triangle] += 1,
            Effect::Build { blas } => self.blas[*blas].depths[0] += 1,
            Effect::Place { tlas, .. } => {
                self.tlas[*tlas].instances.iter_mut().for_each(|(instance, _)| instance.custom += 1);
            }
            Effect::Query { pool, query, .. } => self.queries.reset(*pool, *query),
            _ => {}
        }
    }

    /// Changes the first byte of a place.
    fn falsify_texel(&mut self, place: &Place) {
        let mut cells = self.images[place.image].read(place);
        cells.first_mut().into_iter().for_each(falsify_cell);
        self.images[place.image].write(place, &cells);
    }

    fn trace(&mut self, tlas: usize, (buffer, offset): (usize, usize), shading: Shading) {
        let cells: Vec<_> = (0..RAYS).flat_map(|ray| self.hit(tlas, ray, shading)).collect();
        let miss = shading.miss.to_le_bytes().map(Cell::known);
        let is_hit = |word: &&[Cell]| **word != miss && word[0].is_known();
        self.hits += cells.chunks(4).filter(is_hit).count() as u64;
        self.write(buffer, offset, &cells);
    }

    fn write(&mut self, buffer: usize, offset: usize, cells: &[Cell]) {
        self.buffers[buffer][offset..offset + cells.len()].copy_from_slice(cells);
    }

    fn scale(&mut self, from: &Place, to: &Place) {
        let image = &self.images[from.image];
        let bytes = texel_bytes(image.format);
        let cells = image.read(from);
        let mut scaled = Vec::with_capacity(to.texels() * bytes);
        for layer in 0..to.layers {
            for y in 0..to.extent[1] {
                for x in 0..to.extent[0] {
                    let [x, y] =
                        [(0, x), (1, y)].map(|(axis, at)| nearest(at, from.extent[axis], to.extent[axis]));
                    let texel = ((layer * from.extent[1] + y) * from.extent[0] + x) as usize * bytes;
                    scaled.extend_from_slice(&cells[texel..texel + bytes]);
                }
            }
        }
        self.images[to.image].write(to, &scaled);
    }

    /// Halves a mip. The mean is known of texels along even sides and along sides of one texel, else only the range of
    /// the whole mip.
    fn halve(&mut self, first: &Place, step: u32) {
        let image = &self.images[first.image];
        let at = |mip| Place { mip, offset: [0, 0], extent: mip_extent(image.extent, mip), ..*first };
        let (from, to) = (at(first.mip + step - 1), at(first.mip + step));
        let cells = image.read(&from);
        let bytes = texel_bytes(image.format);
        let steps = [0, 1].map(|axis| from.extent[axis] / to.extent[axis]);
        let is_mean =
            (0..2).all(|axis| steps[axis] <= 2 && steps[axis] * to.extent[axis] == from.extent[axis]);
        let mut halved = Vec::with_capacity(to.texels() * bytes);
        for texel in 0..to.texels() as u32 {
            let [width, height] = to.extent;
            let (x, y, layer) = (texel % width, texel / width % height, texel / (width * height));
            let source =
                |x: u32, y: u32| ((layer * from.extent[1] + y) * from.extent[0] + x) as usize * bytes;
            let (low, size) =
                if is_mean { ([steps[0] * x, steps[1] * y], steps) } else { ([0, 0], from.extent) };
            let columns = low[0]..low[0] + size[0];
            let rows = low[1]..low[1] + size[1];
            let sources: Vec<usize> = rows.flat_map(|y| columns.clone().map(move |x| source(x, y))).collect();
            halved.extend(mean(&cells, &sources, is_mean, image.format));
        }
        self.images[first.image].write(&to, &halved);
    }

    /// Returns the word that a ray writes.
    fn hit(&self, tlas: usize, ray: usize, shading: Shading) -> [Cell; 4] {
        let (slot, triangle) = ((ray / TRIANGLES) as u32, ray % TRIANGLES);
        let mut nearest: Option<(u32, u32)> = None;
        for (instance, version) in &self.tlas[tlas].instances {
            let blas = &self.blas[instance.blas];
            if blas.version != *version {
                return [Cell::UNKNOWN; 4];
            }
            let depth = blas.depths.get(triangle).map(|depth| depth + instance.depth);
            let hit = depth.filter(|_| instance.is_visible && instance.slot == slot);
            if let Some(depth) = hit {
                nearest =
                    Some(nearest.map_or((depth, instance.custom), |best| best.min((depth, instance.custom))));
            }
        }
        let hit = |(depth, custom)| hit_word(custom, triangle as u32, depth) + shading.hit;
        let word = nearest.map_or(shading.miss, hit);
        word.to_le_bytes().map(Cell::known)
    }
}

/// Returns the word of a hit: custom index, triangle and depth, each above 0x20.
pub fn hit_word(custom: u32, triangle: u32, depth: u32) -> u32 {
    0x2121_2121 + custom + (triangle << 8) + (depth << 16)
}

/// Returns the source of a scaled texel along one axis.
fn nearest(at: u32, from: u32, to: u32) -> u32 {
    (2 * at + 1) * from / (2 * to)
}

/// Returns the mean of texels, as far as it is known: exactly of equal texels, within one of bytes, not of floats.
fn mean(cells: &[Cell], sources: &[usize], is_mean: bool, format: Format) -> Vec<Cell> {
    let bytes = texel_bytes(format);
    let texel = |start: usize| &cells[start..start + bytes];
    let first = texel(sources[0]);
    let alike =
        sources.iter().all(|start| texel(*start) == first && first.iter().all(|cell| cell.is_known()));
    if alike {
        return first.to_vec();
    }
    if format != Format::Rgba8Unorm {
        return vec![Cell::UNKNOWN; bytes];
    }
    let count = is_mean.then_some(sources.len() as u32);
    (0..bytes).map(|byte| mean_byte(sources.iter().map(|start| cells[start + byte]), count)).collect()
}

/// Returns the range of the mean of `count` cells, or without a count that of the cells.
fn mean_byte(cells: impl Iterator<Item = Cell> + Clone, count: Option<u32>) -> Cell {
    let (low, high) = if let Some(count) = count {
        let sum = |end: fn(Cell) -> u8| cells.clone().map(|cell| u32::from(end(cell))).sum::<u32>();
        (sum(|cell| cell.low) / count, sum(|cell| cell.high).div_ceil(count))
    } else {
        let ends = cells.fold((u8::MAX, 0), |(low, high), cell| (low.min(cell.low), high.max(cell.high)));
        (ends.0.into(), ends.1.into())
    };
    Cell { low: low.saturating_sub(1) as u8, high: (high + 1).min(255) as u8 }
}

/// Returns the word that the shader of dispatches writes at an index: one byte of the pattern, four times.
pub fn pattern_word(seed: u16, index: usize) -> [u8; 4] {
    [pattern_byte(seed, index); 4]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_hit_the_nearest_visible_triangle_and_nothing_where_a_blas_is_newer() {
        let instance = |blas, depth, custom| Instance { blas, slot: 1, depth, custom, is_visible: true };
        let blas = |depths: &[u32]| Blas { mesh: 0, depths: depths.to_vec(), version: 1 };
        let mut memory = Memory {
            blas: vec![blas(&[5, 9]), blas(&[3])],
            tlas: vec![Tlas::default()],
            ..Default::default()
        };
        memory.meshes = vec![vec![5, 9]];
        let hidden = Instance { is_visible: false, ..instance(1, 0, 3) };
        memory
            .apply(&Effect::Place { tlas: 0, instances: vec![instance(0, 2, 1), hidden, instance(1, 6, 2)] });
        let word = |word: u32| word.to_le_bytes().map(Cell::known);
        let plain = Shading::default();
        assert_eq!(memory.hit(0, 3, plain), word(hit_word(1, 0, 7)));
        assert_eq!(memory.hit(0, 4, plain), word(hit_word(1, 1, 11)));
        assert_eq!(memory.hit(0, 5, plain), word(MISS));
        assert_eq!(memory.hit(0, 0, plain), word(MISS));
        let other = Shading { miss: 7, hit: 3 << 24 };
        assert_eq!(memory.hit(0, 3, other), word(hit_word(1, 0, 7) + (3 << 24)));
        assert_eq!(memory.hit(0, 5, other), word(7));
        memory.apply(&Effect::Build { blas: 0 });
        assert_eq!(memory.hit(0, 3, plain), [Cell::UNKNOWN; 4]);
    }

    #[test]
    fn means_are_exact_of_equal_texels_and_within_one_of_others() {
        let cells = known(&[8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 9, 8, 8, 12]);
        let found = mean(&cells, &[0, 4, 8], true, Format::Rgba8Unorm);
        assert_eq!(found, known(&[8; 4]));
        let found = mean(&cells, &[0, 4, 8, 12], true, Format::Rgba8Unorm);
        assert_eq!(found[0], Cell { low: 7, high: 10 });
        assert_eq!(found[3], Cell { low: 8, high: 10 });
        let found = mean(&cells, &[0, 4, 12], false, Format::Rgba8Unorm);
        assert_eq!(found[3], Cell { low: 7, high: 13 });
    }

    #[test]
    fn nearest_texels_are_those_of_whole_factors() {
        assert_eq!([0, 1, 2, 3].map(|at| nearest(at, 2, 4)), [0, 0, 1, 1]);
        assert_eq!([0, 1].map(|at| nearest(at, 6, 2)), [1, 4]);
    }
}
