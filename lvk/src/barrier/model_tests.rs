//! Tests of the tracker against the naive [`model`](super::model), with random programs.

use std::collections::BTreeMap;

use proptest::prelude::*;

use super::model::{Cell, Command, ModelEvent, Op, any_violation, edges};
use super::resource_state::BarrierScopes;
use super::*;

const BUFFERS: u64 = 2;
const ACCUMULATED: u64 = 2;
const TEXTURES: [(u64, TextureShape); 2] =
    [(3, TextureShape { mips: 1, layers: 1 }), (4, TextureShape { mips: 3, layers: 2 })];

/// Command buffers, and the order in which some of them are submitted.
#[derive(Debug, Clone)]
struct Program {
    commands: Vec<Vec<Command>>,
    recording_order: Vec<usize>,
    submission_order: Vec<usize>,
}

impl Program {
    /// Returns the program reduced to one cell.
    fn only(&self, cell: Cell) -> Self {
        let mut program = self.clone();
        for command in program.commands.iter_mut().flatten() {
            command.retain(|op| op.covers(cell));
            for (_, range) in command.iter_mut().filter_map(|op| op.texture.as_mut()) {
                let (base_mip, base_layer) = (cell.mip, cell.layer);
                *range = Subresources { base_mip, mip_count: 1, base_layer, layer_count: 1 };
            }
        }
        program
    }

    /// Records the command buffers interleaved with the tracker, submits them, and returns the log.
    fn run(&self) -> Vec<ModelEvent> {
        let mut trackers = vec![Tracker::default(); self.commands.len()];
        let mut recorded: Vec<Vec<ModelEvent>> = vec![Vec::new(); self.commands.len()];
        let mut next = vec![0; self.commands.len()];
        for &buffer in &self.recording_order {
            if let Some(command) = self.commands[buffer].get(next[buffer]) {
                record(&mut trackers[buffer], command, &mut recorded[buffer]);
                next[buffer] += 1;
            }
        }
        let mut queue = QueueState::default();
        let mut log = Vec::new();
        for &buffer in &self.submission_order {
            log.push(ModelEvent::Barriers(queue.submit(&trackers[buffer])));
            log.append(&mut recorded[buffer]);
        }
        log
    }
}

fn record_op(op: &Op, tracker: &mut Tracker, out: &mut Barriers) {
    match op.texture {
        Some((shape, range)) => tracker.use_texture(op.id, shape, range, op.touch, out),
        None if op.accumulated => tracker.accumulate_buffer(op.id, op.touch, out),
        None => tracker.use_buffer(op.id, op.touch, out),
    }
}

fn record(tracker: &mut Tracker, command: &Command, log: &mut Vec<ModelEvent>) {
    let mut out = Barriers::default();
    let before = tracker.clone();
    for op in command {
        record_op(op, tracker, &mut out);
    }
    let predicted = command.iter().any(|op| match op.texture {
        Some((_, range)) => before.needs_barrier_texture(op.id, range, op.touch),
        None => !op.accumulated && before.needs_barrier_buffer(op.id, op.touch),
    });
    let surprising = command.iter().any(|op| op.accumulated);
    assert!(predicted != out.is_empty() || surprising, "needs_barrier disagrees with the barriers issued");
    log.push(ModelEvent::Barriers(out));
    log.push(ModelEvent::Command(command.clone()));
}

/// Returns every log that lacks one barrier of `log`, with a description.
fn logs_without_one(log: &[ModelEvent]) -> Vec<(String, Vec<ModelEvent>)> {
    let mut weaker = Vec::new();
    for (at, event) in log.iter().enumerate() {
        let ModelEvent::Barriers(barriers) = event else { continue };
        let mut variants = Vec::new();
        if barriers.memory.is_some() {
            variants.push(Barriers { memory: None, ..barriers.clone() });
        }
        for image in 0..barriers.images.len() {
            let mut variant = barriers.clone();
            variant.images.remove(image);
            variants.push(variant);
        }
        weaker.extend(variants.into_iter().map(|variant| replaced(log, at, barriers, variant)));
    }
    weaker
}

/// Returns every log in which one bit of one barrier of `log` is missing, with a description.
fn logs_without_one_bit(log: &[ModelEvent]) -> Vec<(String, Vec<ModelEvent>)> {
    let mut weaker = Vec::new();
    for (at, event) in log.iter().enumerate() {
        let ModelEvent::Barriers(barriers) = event else { continue };
        let mut variants = Vec::new();
        if let Some(memory) = barriers.memory {
            for memory in weaker_memory(memory) {
                variants.push(Barriers { memory: Some(memory), ..barriers.clone() });
            }
        }
        weaker.extend(variants.into_iter().map(|variant| replaced(log, at, barriers, variant)));
    }
    weaker
}

fn weaker_memory(memory: MemoryBarrier) -> Vec<MemoryBarrier> {
    let src =
        memory.src_stages.iter().map(|bit| MemoryBarrier { src_stages: memory.src_stages - bit, ..memory });
    let dst =
        memory.dst_stages.iter().map(|bit| MemoryBarrier { dst_stages: memory.dst_stages - bit, ..memory });
    let flush =
        memory.src_access.iter().map(|bit| MemoryBarrier { src_access: memory.src_access - bit, ..memory });
    let see =
        memory.dst_access.iter().map(|bit| MemoryBarrier { dst_access: memory.dst_access - bit, ..memory });
    let flushes = !memory.src_access.is_empty();
    src.chain(dst).chain(flush).chain(see.filter(move |_| flushes)).collect()
}

fn replaced(log: &[ModelEvent], at: usize, old: &Barriers, new: Barriers) -> (String, Vec<ModelEvent>) {
    let words = format!("at {at}, {new:?} does as well as {old:?}");
    let mut weaker = log.to_vec();
    weaker[at] = ModelEvent::Barriers(new);
    (words, weaker)
}

fn stages_of_shaders() -> impl Strategy<Value = Stages> {
    (1..16_u16).prop_map(|pick| {
        Stages::SHADERS.iter().enumerate().filter(|(bit, _)| pick & (1 << bit) != 0).map(|(_, s)| s).collect()
    })
}

fn buffer_use() -> impl Strategy<Value = Use> {
    prop_oneof![
        Just(Use::transfer_read()),
        Just(Use::transfer_write()),
        stages_of_shaders().prop_map(Use::shader_read),
        stages_of_shaders().prop_map(Use::shader_write),
        Just(Use::index()),
        Just(Use::index().merge(Use::vertex()).unwrap()),
        Just(Use::indirect()),
        Just(Use::accel_build_input()),
        Just(Use::everything_read()),
    ]
    .prop_map(|touch| touch.with_layout(Layout::Undefined))
}

fn texture_use() -> impl Strategy<Value = Use> {
    prop_oneof![
        Just(Use::transfer_read()),
        Just(Use::transfer_write()),
        stages_of_shaders().prop_map(Use::shader_read),
        stages_of_shaders().prop_map(Use::shader_read),
        stages_of_shaders().prop_map(Use::shader_write),
        stages_of_shaders().prop_map(|stages| Use::shader_read(stages).with_layout(Layout::General)),
        any::<bool>().prop_map(Use::color_target),
        Just(Use::depth_target()),
        Just(Use::depth_target().merge(Use::resolve_source()).unwrap()),
        Just(Use::depth_read()),
        Just(Use::color_target(true).with_layout(Layout::LocalRead).merge(Use::local_read()).unwrap()),
        Just(Use::resolve_target()),
        Just(Use::shading_rate()),
    ]
}

fn buffer_op() -> impl Strategy<Value = Op> {
    (0..BUFFERS, buffer_use()).prop_map(|(id, touch)| Op {
        id: ResourceId(id),
        texture: None,
        touch,
        accumulated: false,
    })
}

fn accumulated_op() -> impl Strategy<Value = Op> {
    let write = prop_oneof![
        3 => Just(Use::accel_build_write()),
        1 => Just(Use::shader_write(Stages::COMPUTE).with_layout(Layout::Undefined)),
    ];
    let read = stages_of_shaders().prop_map(|stages| Use::accel_read(stages | Stages::ACCEL_BUILD));
    prop_oneof![
        3 => write.clone().prop_map(|touch| (touch, true)),
        1 => write.prop_map(|touch| (touch, false)),
        2 => stages_of_shaders().prop_map(|stages| (Use::accel_read(stages), false)),
        1 => read.prop_map(|touch| (touch, false)),
    ]
    .prop_map(|(touch, accumulated)| Op {
        id: ResourceId(ACCUMULATED),
        texture: None,
        touch,
        accumulated,
    })
}

fn texture_op() -> impl Strategy<Value = Op> {
    let place = (0..TEXTURES.len(), 0..3_u32, 1..4_u32, 0..2_u32, 1..3_u32, any::<bool>());
    (place, texture_use()).prop_map(|((which, base_mip, mips, base_layer, layers, whole), touch)| {
        let (id, shape) = TEXTURES[which];
        let base_mip = base_mip.min(shape.mips - 1);
        let base_layer = base_layer.min(shape.layers - 1);
        let part = Subresources {
            base_mip,
            mip_count: mips.min(shape.mips - base_mip),
            base_layer,
            layer_count: layers.min(shape.layers - base_layer),
        };
        let range = if whole { shape.all_subresources() } else { part };
        Op { id: ResourceId(id), texture: Some((shape, range)), touch, accumulated: false }
    })
}

fn command() -> impl Strategy<Value = Command> {
    let op = prop_oneof![2 => buffer_op(), 2 => accumulated_op(), 3 => texture_op()];
    prop::collection::vec(op, 1..4).prop_map(|ops| {
        let by_id: BTreeMap<ResourceId, Op> = ops.into_iter().map(|op| (op.id, op)).collect();
        by_id.into_values().collect()
    })
}

fn program() -> impl Strategy<Value = Program> {
    let commands = prop::collection::vec(prop::collection::vec(command(), 0..7), 1..5);
    commands.prop_flat_map(|commands| {
        let turns: Vec<usize> =
            commands.iter().enumerate().flat_map(|(at, list)| list.iter().map(move |_| at)).collect();
        let all: Vec<usize> = (0..commands.len()).collect();
        let submitted = (Just(all).prop_shuffle(), 1..=commands.len())
            .prop_map(|(order, count)| order.into_iter().take(count).collect());
        (Just(commands), Just(turns).prop_shuffle(), submitted).prop_map(
            |(commands, recording_order, submission_order)| Program {
                commands,
                recording_order,
                submission_order,
            },
        )
    })
}

fn buffer_cells() -> impl Iterator<Item = Cell> {
    (0..=ACCUMULATED).map(|id| Cell { id: ResourceId(id), mip: 0, layer: 0 })
}

fn texture_cells() -> impl Iterator<Item = Cell> {
    TEXTURES.into_iter().flat_map(|(id, shape)| {
        let place = move |at| Cell { id: ResourceId(id), mip: at % shape.mips, layer: at / shape.mips };
        (0..shape.mips * shape.layers).map(place)
    })
}

/// Returns the layout transitions of one cell in the barriers of one event.
fn relayouts(barriers: &Barriers, cell: Cell) -> Vec<(Layout, Layout)> {
    edges(barriers, cell).iter().filter_map(|edge| edge.relayout).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_hazard_is_separated_and_every_layout_is_right(program in program()) {
        prop_assert_eq!(any_violation(&program.run()), None);
    }

    /// A resource must be safe without the barriers of other resources.
    #[test]
    fn every_cell_is_safe_by_its_own_barriers(program in program()) {
        for cell in buffer_cells().chain(texture_cells()) {
            prop_assert_eq!(any_violation(&program.only(cell).run()), None);
        }
    }

    /// Every barrier of a cell prevents a hazard or a wrong layout: none is redundant, and none stands
    /// between reads. Accumulated resources may get one wait too many if ordinary writes are mixed in, which
    /// the library never does.
    #[test]
    fn no_barrier_can_be_left_out(program in program()) {
        let plain = buffer_cells().filter(|cell| cell.id.0 < BUFFERS);
        for cell in plain.chain(texture_cells()) {
            for (words, weaker) in logs_without_one(&program.only(cell).run()) {
                prop_assert!(any_violation(&weaker).is_some(), "{}", words);
            }
        }
    }

    /// No barrier has a stage or access bit that is not needed.
    #[test]
    fn no_bit_of_a_memory_barrier_can_be_left_out(program in program()) {
        let plain = buffer_cells().filter(|cell| cell.id.0 < BUFFERS);
        for cell in plain.chain(texture_cells()) {
            for (words, weaker) in logs_without_one_bit(&program.only(cell).run()) {
                prop_assert!(any_violation(&weaker).is_some(), "{}", words);
            }
        }
    }

    /// Resources do not influence each other's barriers. Neither do the subresources of a texture.
    #[test]
    fn barriers_are_the_sum_over_cells(program in program()) {
        let cells: Vec<Cell> = buffer_cells().chain(texture_cells()).collect();
        let alone: Vec<Vec<ModelEvent>> = cells.iter().map(|cell| program.only(*cell).run()).collect();
        for (at, event) in program.run().iter().enumerate() {
            let ModelEvent::Barriers(barriers) = event else { continue };
            let mut sum = Barriers::default();
            for (cell, log) in cells.iter().zip(&alone) {
                let ModelEvent::Barriers(part) = &log[at] else { panic!("logs differ in shape") };
                prop_assert_eq!(relayouts(barriers, *cell), relayouts(part, *cell));
                if let Some(MemoryBarrier { src_stages, src_access, dst_stages, dst_access }) = part.memory {
                    let (old_layout, new_layout) = (Layout::General, Layout::General);
                    sum.push_memory(&BarrierScopes { src_stages, src_access, dst_stages, dst_access, old_layout, new_layout });
                }
            }
            prop_assert_eq!(barriers.memory, sum.memory);
        }
    }
}

fn buffer(touch: Use) -> Op {
    Op { id: ResourceId(0), texture: None, touch: touch.with_layout(Layout::Undefined), accumulated: false }
}

fn log_of(ops: &[Op]) -> Vec<ModelEvent> {
    let commands = vec![ops.iter().map(|op| vec![*op]).collect()];
    Program { commands, recording_order: vec![0; ops.len()], submission_order: vec![0] }.run()
}

/// Checks that the model can detect errors.
#[test]
fn model_finds_a_missing_barrier_of_each_kind() {
    let write = buffer(Use::shader_write(Stages::COMPUTE));
    let read = buffer(Use::shader_read(Stages::FRAGMENT));
    for pair in [[write, read], [read, write], [write, write]] {
        let log = log_of(&pair);
        assert_eq!(any_violation(&log), None);
        let bare: Vec<ModelEvent> =
            log.into_iter().filter(|event| matches!(event, ModelEvent::Command(_))).collect();
        assert!(any_violation(&bare).is_some(), "{pair:?}");
    }
    assert_eq!(any_violation(&[ModelEvent::Command(vec![read]), ModelEvent::Command(vec![read])]), None);
}

/// An earlier command buffer reads in another stage than the reads in front of a write. The write waits for
/// both.
#[test]
fn write_behind_reads_waits_for_readers_of_earlier_command_buffers() {
    let compute = buffer(Use::shader_read(Stages::COMPUTE));
    let commands = vec![
        vec![vec![buffer(Use::shader_read(Stages::FRAGMENT))]],
        vec![vec![compute], vec![buffer(Use::transfer_write())]],
    ];
    let program = Program { commands, recording_order: vec![0, 1, 1], submission_order: vec![0, 1] };
    let log = program.run();
    assert_eq!(any_violation(&log), None);
    let ModelEvent::Barriers(before_second) = &log[3] else { panic!("a submission starts with barriers") };
    assert_eq!(before_second.memory.unwrap().src_stages, Stages::FRAGMENT);
}

#[test]
fn whole_texture_is_one_barrier_and_parts_join_into_ranges() {
    let (id, shape) = (ResourceId(9), TextureShape { mips: 4, layers: 6 });
    let mut tracker = Tracker::default();
    let mut out = Barriers::default();
    tracker.use_texture(id, shape, shape.all_subresources(), Use::transfer_write(), &mut out);
    assert!(out.is_empty());
    let upper = Subresources { base_mip: 1, mip_count: 3, ..shape.all_subresources() };
    tracker.use_texture(id, shape, upper, Use::shader_read(Stages::FRAGMENT), &mut out);
    assert_eq!(out.images.iter().map(|image| image.subresources).collect::<Vec<_>>(), [upper]);
    out.clear();
    tracker.use_texture(id, shape, shape.all_subresources(), Use::transfer_read(), &mut out);
    let ranges: Vec<_> = out.images.iter().map(|image| image.subresources).collect();
    assert_eq!(ranges, [Subresources { mip_count: 1, ..shape.all_subresources() }, upper]);
    out.clear();
    tracker.use_texture(id, shape, shape.all_subresources(), Use::color_target(true), &mut out);
    assert_eq!(out.images.len(), 1);
    assert_eq!(out.images[0].subresources, shape.all_subresources());
}

#[test]
fn ranges_outside_a_texture_are_ignored() {
    let shape = TextureShape { mips: 0, layers: 2 };
    let huge = Subresources { base_mip: 7, mip_count: u32::MAX, base_layer: u32::MAX, layer_count: u32::MAX };
    let mut tracker = Tracker::default();
    let mut out = Barriers::default();
    tracker.use_texture(ResourceId(1), shape, huge, Use::transfer_write(), &mut out);
    assert!(!tracker.needs_barrier_texture(ResourceId(1), huge, Use::transfer_read()));
    assert!(out.is_empty() && QueueState::default().submit(&tracker).is_empty());
}

#[test]
fn forgotten_resource_is_fresh_again() {
    let id = ResourceId(6);
    let mut tracker = Tracker::default();
    let mut out = Barriers::default();
    tracker.use_buffer(id, Use::shader_write(Stages::COMPUTE), &mut out);
    let mut states = QueueState::default();
    assert!(states.submit(&tracker).is_empty());
    assert!(!states.submit(&tracker).is_empty());
    states.forget(id);
    assert!(states.submit(&tracker).is_empty());
}
