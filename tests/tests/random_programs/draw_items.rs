//! Triangles of items, draws of them, and the buffer of vertices, indices and arguments that the draws read.

use lvk::{BufferHandle, CommandBuffer, Dependencies};
use lvk_tests::random::Random;

use super::environment::Environment;
use super::kit::{Kernel, Push};

/// Bytes of the buffer of vertices, indices and arguments: 24 vertices, 12 indices, and arguments of [`MOST_DRAWS`] draws.
pub const INPUT_BYTES: u64 = 4 * WORDS as u64;
const WORDS: usize = 64;
pub const INDICES: u64 = 24 * 4;
pub const ARGUMENTS: u64 = INDICES + 12 * 4;
/// Most draws of one command.
pub const MOST_DRAWS: u32 = 3;
/// Number in the buffer for draws that do not read it. Lavapipe 25.0 reads it for indirect draws behind one with a number
/// in the same command buffer.
const ALL_DRAWS: u32 = MOST_DRAWS;

/// Triangles that vertices and indices describe.
#[derive(Debug, Clone, Copy)]
pub struct Triangles {
    /// Item of each triangle of the vertices.
    pub items: [u32; 8],
    /// Triangle of the vertices that each triangle of the indices has.
    pub order: [u32; 4],
}

impl Triangles {
    pub fn random(random: &mut Random) -> Self {
        Self {
            items: [(); 8].map(|()| (random.bits() % 16) as u32),
            order: [(); 4].map(|()| (random.bits() % 4) as u32),
        }
    }

    pub fn vertices(&self) -> Vec<u32> {
        self.items.iter().flat_map(|item| [*item; 3]).collect()
    }

    pub fn indices(&self) -> Vec<u32> {
        self.order.iter().flat_map(|triangle| (3 * triangle)..(3 * triangle + 3)).collect()
    }
}

/// A draw of triangles.
#[derive(Debug, Clone, Copy)]
pub struct Draw {
    /// First triangle, and their number.
    pub first: u32,
    pub count: u32,
    /// Triangles that are added to those of the indices.
    pub base: u32,
    /// First instance, and their number.
    pub first_instance: u32,
    pub instances: u32,
}

impl Draw {
    pub fn random(random: &mut Random, may_offset_instances: bool) -> Self {
        let mut number = |most: u32| (random.bits() % u64::from(most + 1)) as u32;
        let first = number(2);
        Self {
            first,
            count: number(4 - first),
            base: number(3),
            first_instance: if may_offset_instances { number(2) } else { 0 },
            instances: number(2),
        }
    }

    /// Returns the arguments of an indirect draw.
    pub fn arguments(&self, is_indexed: bool) -> Vec<u32> {
        let Self { first, count, base, first_instance, instances } = *self;
        let mut words = vec![3 * count, instances, 3 * first];
        words.extend(is_indexed.then_some(3 * base));
        words.push(first_instance);
        words
    }

    /// Returns the items that are painted, in their order.
    pub fn items(&self, triangles: &Triangles, is_indexed: bool) -> Vec<u32> {
        let triangle = |at: u32| match is_indexed {
            true => (triangles.order[at as usize] + self.base) as usize,
            false => at as usize,
        };
        let of_instance = |instance: u32| {
            (self.first..self.first + self.count).map(move |at| triangles.items[triangle(at)] + 2 * instance)
        };
        (self.first_instance..self.first_instance + self.instances).flat_map(of_instance).collect()
    }
}

/// Buffers that draws read.
#[derive(Debug, Clone, Copy)]
pub struct DrawBuffers {
    /// Vertices, indices and arguments.
    pub inputs: BufferHandle,
    /// Number of draws.
    pub number: BufferHandle,
}

/// What draws read.
#[derive(Debug, Clone)]
pub struct Inputs {
    words: [u32; WORDS],
    /// Number of draws, which a copy writes.
    number: u32,
    /// True if a dispatch writes them, otherwise a copy does.
    by_dispatch: bool,
    /// True if the pass lists the buffer, which it need not for what copies have written.
    is_listed: bool,
}

impl Inputs {
    /// Returns inputs with these triangles, and arguments `stride` bytes apart. `n` chooses who writes them.
    pub fn new(
        n: u16,
        triangles: &Triangles,
        (arguments, stride): (&[Vec<u32>], u32),
        number: Option<u32>,
        is_unlisted: bool,
    ) -> Self {
        let mut words = [0; WORDS];
        let mut write = |offset: u64, from: &[u32]| {
            let at = offset as usize / 4;
            words[at..at + from.len()].copy_from_slice(from);
        };
        write(0, &triangles.vertices());
        write(INDICES, &triangles.indices());
        for (at, arguments) in (0..).zip(arguments) {
            write(ARGUMENTS + u64::from(at * stride), arguments);
        }
        let by_dispatch = is_unlisted || n.is_multiple_of(4);
        let number = number.unwrap_or(ALL_DRAWS);
        Self { words, number, by_dispatch, is_listed: !is_unlisted && (by_dispatch || n % 4 == 1) }
    }

    /// True if a dispatch writes all but the number. They need a buffer of their own then: version 1.4.364 of the validation layer finds
    /// a hazard where a copy follows such a write, which it does not see, and the barriers of both are chained.
    pub fn by_dispatch(&self) -> bool {
        self.by_dispatch
    }

    /// Writes them into the buffers. Returns those that the pass lists.
    pub fn write<'a>(
        &self,
        env: &Environment,
        cmd: &mut CommandBuffer,
        buffers: &'a DrawBuffers,
    ) -> lvk::Result<&'a [BufferHandle]> {
        let to = &buffers.inputs;
        cmd.update_buffer(buffers.number, 0, &self.number.to_le_bytes())?;
        if self.by_dispatch {
            let from = cmd.upload(&self.words)?;
            cmd.bind_compute_pipeline(env.kit.kernel(Kernel::Copy))?;
            let push = Push { to: env.ctx().buffer_address(*to)?, from, ..Default::default() };
            cmd.push_constant_bytes(0, bytemuck::bytes_of(&push))?;
            let writes = Dependencies { buffers: &[*to], ..Default::default() };
            cmd.dispatch([WORDS as u32, 1, 1], &writes)?;
        } else {
            cmd.update_buffer(*to, 0, bytemuck::cast_slice(&self.words))?;
        }
        Ok(if self.is_listed { std::slice::from_ref(to) } else { &[] })
    }
}

/// Returns the items that the workgroups of a mesh draw paint, each in a column of its own.
pub fn mesh_items([x, y, _]: [u32; 3], is_task: bool) -> Vec<u32> {
    let of_groups = (0..x * y).map(|group| group + 8 * y);
    match is_task {
        true => of_groups.flat_map(|item| [item, item + 4]).collect(),
        false => of_groups.collect(),
    }
}

#[test]
fn draws_paint_the_items_of_their_triangles_and_instances() {
    let triangles = Triangles { items: [0, 10, 20, 30, 40, 50, 60, 70], order: [3, 0, 1, 2] };
    let draw = Draw { first: 1, count: 2, base: 3, first_instance: 1, instances: 2 };
    assert_eq!(draw.items(&triangles, false), [12, 22, 14, 24]);
    assert_eq!(draw.items(&triangles, true), [32, 42, 34, 44]);
    assert_eq!(draw.arguments(true), [6, 2, 3, 9, 1]);
    assert_eq!(triangles.indices()[..4], [9, 10, 11, 0]);
}

#[test]
fn no_two_workgroups_of_a_mesh_draw_paint_one_column() {
    for (x, y, is_task) in
        (0..5).flat_map(|x| [(x, 1, false), (x, 2, false), (x.min(2), 1, true), (x.min(2), 2, true)])
    {
        let mut columns: Vec<u32> =
            mesh_items([x, y, 1], is_task).iter().map(|item| item % super::kit_draws::COLUMNS).collect();
        let count = columns.len();
        columns.sort_unstable();
        columns.dedup();
        assert_eq!(columns.len(), count, "{x} {y} {is_task}");
    }
}
