//! Tests of queue synchronisation against the naive [`model`](super::queue_sync_model), with random programs on one to
//! three queues of arbitrary families.

use proptest::prelude::*;

use super::last_access::{QUEUE_COUNT, QueueAccess, TimelineVector};
use super::queue::stages_of;
use super::queue_sync::{QueueCaps, QueueSync, SubmitRequest};
use super::queue_sync_model::{History, SubmittedWork as Logged, external_stages, weaker};
use crate::barrier::model::{Cell, Command, ModelEvent, Op};
use crate::barrier::{Barriers, Layout, ResourceId, Stages, Subresources, TextureShape, Tracker, Use};
use crate::queue::Queue;

const ONE: TextureShape = TextureShape { mips: 1, layers: 1 };
/// Resources: two buffers, of which one is written concurrently, and three textures. The last two textures belong to
/// one domain at a time.
const TEXTURES: [(u64, TextureShape); 3] = [(3, ONE), (4, ONE), (5, TextureShape { mips: 2, layers: 2 })];
const ACCUMULATED: u64 = 2;

fn is_exclusive(id: ResourceId) -> bool {
    id.0 >= 4
}

#[derive(Debug, Clone)]
struct QueueProgram {
    domains: [u32; QUEUE_COUNT],
    /// Queue and commands of each command buffer, in the order of submission.
    buffers: Vec<(usize, Vec<Command>)>,
}

impl QueueProgram {
    fn run(&self) -> History {
        let queue_caps_of = |queue_index: usize| QueueCaps {
            domain: self.domains[queue_index],
            stages: stages_of(Queue::ALL[queue_index]),
        };
        let queue_caps = [queue_caps_of(0), queue_caps_of(1), queue_caps_of(2)];
        let mut queue_sync = QueueSync::new(queue_caps, true);
        let mut sent = Vec::new();
        for (queue_index, commands) in &self.buffers {
            let (tracker, mut recorded) = record(commands);
            if *queue_index != 0 {
                queue_sync.begin_multi_queue();
            }
            if !queue_sync.is_multi_queue() {
                let barriers = queue_sync.submit_single_queue(&tracker);
                recorded.insert(0, ModelEvent::Barriers(barriers));
                let value = queue_sync.next_signal_value();
                queue_sync.mark_submitted(0, value);
                sent.push(logged(0, value, TimelineVector::default(), recorded));
                continue;
            }
            let step = queue_sync.submit(&plain(*queue_index, &tracker), is_exclusive);
            queue_sync.mark_submitted(*queue_index, step.value);
            for release in step.releases {
                let releases = release.parts;
                let log = logged(release.queue_index, release.value, release.waits, Vec::new());
                sent.push(Logged { releases, ..log });
            }
            recorded.insert(0, ModelEvent::Barriers(step.barriers));
            sent.push(Logged {
                acquires: step.acquires,
                ..logged(*queue_index, step.value, step.waits, recorded)
            });
        }
        History { queue_caps, sent }
    }
}

fn plain(queue_index: usize, tracker: &Tracker) -> SubmitRequest<'_> {
    SubmitRequest {
        queue_index,
        tracker,
        references: &[],
        after: TimelineVector::default(),
        is_prelude: false,
        exchanges: false,
    }
}

fn logged(queue_index: usize, value: u64, waits: TimelineVector, events: Vec<ModelEvent>) -> Logged {
    Logged {
        queue_index,
        value,
        waits: waits.values().collect(),
        releases: Vec::new(),
        acquires: Vec::new(),
        events,
    }
}

fn record(commands: &[Command]) -> (Tracker, Vec<ModelEvent>) {
    let (mut tracker, mut log) = (Tracker::default(), Vec::new());
    for command in commands {
        let mut out = Barriers::default();
        for op in command {
            match op.texture {
                Some((shape, range)) => tracker.use_texture(op.id, shape, range, op.touch, &mut out),
                None if op.accumulated => tracker.accumulate_buffer(op.id, op.touch, &mut out),
                None => tracker.use_buffer(op.id, op.touch, &mut out),
            }
        }
        log.push(ModelEvent::Barriers(out));
        log.push(ModelEvent::Command(command.clone()));
    }
    (tracker, log)
}

fn cells() -> Vec<Cell> {
    let cell = |id, mip, layer| Cell { id: ResourceId(id), mip, layer };
    let textures = TEXTURES.into_iter().flat_map(|(id, shape)| {
        (0..shape.mips).flat_map(move |mip| (0..shape.layers).map(move |layer| cell(id, mip, layer)))
    });
    (0..3).map(|id| cell(id, 0, 0)).chain(textures).collect()
}

/// Shader stages of a queue.
fn shaders(queue_index: usize) -> impl Strategy<Value = Stages> {
    let by_queue = [
        vec![Stages::COMPUTE, Stages::FRAGMENT, Stages::FRAGMENT | Stages::PRE_RASTER],
        vec![Stages::COMPUTE, Stages::RAY_TRACING, Stages::COMPUTE | Stages::RAY_TRACING],
        vec![Stages::TRANSFER],
    ];
    prop::sample::select(by_queue[queue_index].clone())
}

/// Uses of a buffer or a texture by commands of a queue.
fn touch(queue_index: usize, texture: bool) -> BoxedStrategy<Use> {
    let copies = prop_oneof![Just(Use::transfer_read()), Just(Use::transfer_write())];
    let uses = match (queue_index, texture) {
        (2, _) => copies.boxed(),
        (0, true) => prop_oneof![
            2 => copies,
            3 => shaders(0).prop_map(Use::shader_read),
            2 => shaders(0).prop_map(Use::shader_write),
            1 => any::<bool>().prop_map(Use::color_target),
        ]
        .boxed(),
        (queue_index, _) => prop_oneof![
            2 => copies,
            3 => shaders(queue_index).prop_map(Use::shader_read),
            2 => shaders(queue_index).prop_map(Use::shader_write),
        ]
        .boxed(),
    };
    uses.prop_map(move |touch| if texture { touch } else { touch.with_layout(Layout::Undefined) }).boxed()
}

fn op(queue_index: usize, simple: bool) -> BoxedStrategy<Op> {
    let buffer = (0..2_u64, touch(queue_index, false)).prop_map(|(id, touch)| Op {
        id: ResourceId(id),
        texture: None,
        touch,
        accumulated: false,
    });
    let texture =
        (0..if simple { 2 } else { 3_usize }, touch(queue_index, true), 0..2_u32, 0..2_u32, any::<bool>());
    let texture = texture.prop_map(|(which, touch, mip, layer, whole)| {
        let (id, shape) = TEXTURES[which];
        let part = Subresources {
            base_mip: mip.min(shape.mips - 1),
            mip_count: 1,
            base_layer: layer.min(shape.layers - 1),
            layer_count: 1,
        };
        let part = if whole { shape.all_subresources() } else { part };
        Op { id: ResourceId(id), texture: Some((shape, part)), touch, accumulated: false }
    });
    if simple || queue_index == 2 {
        return prop_oneof![buffer, texture].boxed();
    }
    let write = Use::shader_write(Stages::COMPUTE).with_layout(Layout::Undefined);
    let accumulated = any::<bool>().prop_map(move |accumulated| Op {
        id: ResourceId(ACCUMULATED),
        texture: None,
        touch: if accumulated { write } else { Use::accel_read(Stages::COMPUTE) },
        accumulated,
    });
    prop_oneof![2 => buffer, 2 => texture, 1 => accumulated].boxed()
}

fn command_buffer(queue_index: usize, simple: bool) -> impl Strategy<Value = (usize, Vec<Command>)> {
    // Each command uses a resource at most once.
    let command = prop::collection::vec(op(queue_index, simple), 1..3).prop_map(|mut ops| {
        ops.sort_by_key(|op| op.id);
        ops.dedup_by_key(|op| op.id);
        ops
    });
    prop::collection::vec(command, 1..4).prop_map(move |commands| (queue_index, commands))
}

/// Queue families: all the same, two different, three different.
fn domains() -> impl Strategy<Value = [u32; QUEUE_COUNT]> {
    prop::sample::select(vec![[0, 0, 0], [0, 1, 1], [0, 1, 0], [0, 0, 2], [0, 1, 2]])
}

fn program(simple: bool) -> impl Strategy<Value = QueueProgram> {
    (domains(), 1..=QUEUE_COUNT).prop_flat_map(move |(domains, queue_sync)| {
        let buffer = (0..queue_sync).prop_flat_map(move |queue_index| command_buffer(queue_index, simple));
        prop::collection::vec(buffer, 0..9).prop_map(move |buffers| QueueProgram { domains, buffers })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// No hazard, no wrong layout, no use by another queue than the owner, no wait for later work, and no stage that a
    /// queue does not support.
    #[test]
    fn everything_between_queues_is_waited_for_and_moved(program in program(false)) {
        let history = program.run();
        prop_assert_eq!(history.violation(&cells(), &|cell| is_exclusive(cell.id)), None);
        for sent in &history.sent {
            prop_assert_eq!(external_stages(&history.queue_caps, sent), Stages::empty());
        }
    }

    /// No wait can be omitted, and none can be for earlier work of its queue. No wait repeats what another implies, and
    /// no wait is for the latest value of a queue where an earlier one is sufficient. This holds once the queues are
    /// tracked separately: earlier work of a queue counts as one.
    #[test]
    fn no_wait_is_longer_than_it_must_be(mut program in program(true)) {
        program.buffers.insert(0, (1, Vec::new()));
        let history = program.run();
        for (words, weaker) in weaker(&history) {
            let violation = weaker.violation(&cells(), &|cell| is_exclusive(cell.id));
            prop_assert!(violation.is_some(), "{}", words);
        }
    }

    /// While only the first queue is used, there are no waits and no transfers.
    #[test]
    fn one_queue_waits_for_nothing(program in program(false)) {
        let mut program = program;
        program.buffers.retain(|(queue_index, _)| *queue_index == 0);
        let history = program.run();
        prop_assert!(history.sent.iter().all(|sent| sent.waits.is_empty() && sent.releases.is_empty()));
        let values: Vec<_> = history.sent.iter().map(|sent| sent.value).collect();
        prop_assert!(values.is_sorted());
    }
}

fn buffer_op(id: u64, touch: Use) -> Command {
    let touch = touch.with_layout(Layout::Undefined);
    vec![Op { id: ResourceId(id), texture: None, touch, accumulated: false }]
}

fn texture_op(id: u64, touch: Use) -> Command {
    let texture = Some((ONE, ONE.all_subresources()));
    vec![Op { id: ResourceId(id), texture, touch, accumulated: false }]
}

fn run(buffers: Vec<(usize, Command)>) -> History {
    let buffers = buffers.into_iter().map(|(queue_index, command)| (queue_index, vec![command])).collect();
    QueueProgram { domains: [0, 1, 2], buffers }.run()
}

/// The model detects each kind of violation.
#[test]
fn the_model_finds_what_is_wrong() {
    let write = Use::shader_write(Stages::COMPUTE);
    let violation = |history: &History| history.violation(&cells(), &|cell| is_exclusive(cell.id));
    let good = run(vec![(1, texture_op(4, write)), (0, texture_op(4, write)), (1, buffer_op(0, write))]);
    assert_eq!(violation(&good), None);
    let last = good.sent.len() - 2;
    let mut bad = good.clone();
    bad.sent[last].waits.clear();
    assert!(violation(&bad).is_some(), "a wait is missing");
    let mut bad = good.clone();
    bad.sent[last].acquires.clear();
    assert!(violation(&bad).unwrap().contains("owner"));
    let mut bad = good.clone();
    bad.sent[last - 1].releases[0].layout = Layout::ShaderRead;
    assert!(violation(&bad).unwrap().contains("moves"));
    let mut bad = good.clone();
    bad.sent[last].waits[0].1 += 30;
    assert!(violation(&bad).unwrap().contains("waits for"));
    let mut bad = good;
    bad.sent[last].waits[0].0 = 0;
    assert!(violation(&bad).is_some(), "a queue waits for itself");
}

#[test]
fn compute_waits_for_what_it_reads_and_not_for_the_latest_of_graphics() {
    let (write, read) = (Use::shader_write(Stages::FRAGMENT), Use::shader_read(Stages::COMPUTE));
    let history = run(vec![
        (1, Vec::new()),
        (0, buffer_op(0, write)),
        (0, buffer_op(1, write)),
        (1, buffer_op(0, read)),
        (1, buffer_op(7, read)),
    ]);
    let [_, wanted, latest, reader, other] = &history.sent[..] else { panic!("five submissions") };
    assert_eq!(reader.waits, [(0, wanted.value)]);
    assert!(latest.value > wanted.value && other.waits.is_empty());
}

#[test]
fn reads_run_side_by_side() {
    let (write, read) = (Use::transfer_write(), Use::transfer_read());
    let readers = |queue_index| (queue_index, buffer_op(0, read));
    let mut order = vec![(2, Vec::new()), (0, buffer_op(0, write)), readers(1), readers(2), readers(0)];
    order.extend([readers(1), readers(2), (1, buffer_op(0, write))]);
    let history = run(order);
    let values: Vec<_> = history.sent.iter().map(|sent| sent.value).collect();
    let waits: Vec<_> = history.sent.iter().map(|sent| sent.waits.clone()).collect();
    let first = (0, values[1]);
    assert_eq!(waits[2..4], [[first], [first]]);
    assert!(waits[4..7].iter().all(Vec::is_empty));
    assert_eq!(waits[7], [(0, values[4]), (2, values[6])]);
}

#[test]
fn images_of_one_domain_move_once_and_keep_their_layout() {
    let store = Use::shader_write(Stages::COMPUTE);
    let sample = Use::shader_read(Stages::FRAGMENT);
    let history =
        run(vec![(1, texture_op(4, store)), (0, texture_op(4, sample)), (0, texture_op(4, sample))]);
    let [writer, release, reader, again] = &history.sent[..] else { panic!("four submissions") };
    assert_eq!((release.queue_index, release.releases.len()), (1, 1));
    assert_eq!(release.releases, reader.acquires);
    assert_eq!(release.releases[0].layout, Layout::General);
    assert_eq!(reader.waits, [(1, release.value)]);
    assert!(writer.value < release.value && again.acquires.is_empty() && again.waits.is_empty());
    let shared = run(vec![(1, texture_op(3, store)), (0, texture_op(3, sample))]);
    assert_eq!(shared.sent.len(), 2);
}

#[test]
fn every_queue_waits_once_for_the_prelude() {
    let queue_caps_of =
        |queue_index: usize| QueueCaps { domain: 0, stages: stages_of(Queue::ALL[queue_index]) };
    let mut queue_sync = QueueSync::new([queue_caps_of(0), queue_caps_of(1), queue_caps_of(2)], true);
    queue_sync.begin_multi_queue();
    let nothing = Tracker::default();
    let prelude =
        queue_sync.submit(&SubmitRequest { is_prelude: true, ..plain(0, &nothing) }, |_| false).value;
    let latest = queue_sync.submit(&plain(0, &nothing), |_| false).value;
    let waits = |queue_sync: &mut QueueSync, queue_index| {
        queue_sync.submit(&plain(queue_index, &nothing), |_| false).waits
    };
    assert_eq!(waits(&mut queue_sync, 1).values().collect::<Vec<_>>(), [(0, prelude)]);
    assert_eq!(waits(&mut queue_sync, 1).values().count(), 0);
    assert_eq!(waits(&mut queue_sync, 2).values().count(), 0);
    let mut after = TimelineVector::default();
    after.max_with_value(0, latest);
    let told = queue_sync.submit(&SubmitRequest { after, ..plain(1, &nothing) }, |_| false);
    assert_eq!(told.waits.values().collect::<Vec<_>>(), [(0, latest)]);
}

#[test]
fn references_are_waited_for_without_barriers() {
    let queue_caps_of =
        |queue_index: usize| QueueCaps { domain: 0, stages: stages_of(Queue::ALL[queue_index]) };
    let mut queue_sync = QueueSync::new([queue_caps_of(0), queue_caps_of(1), queue_caps_of(2)], true);
    queue_sync.begin_multi_queue();
    let id = ResourceId(9);
    let (built, _) = record(&[buffer_op(9, Use::accel_build_write())]);
    let built = queue_sync.submit(&plain(1, &built), |_| false).value;
    let nothing = Tracker::default();
    let sent = SubmitRequest { references: &[(id, QueueAccess::Read)], ..plain(0, &nothing) };
    let step = queue_sync.submit(&sent, |_| false);
    assert_eq!(step.waits.values().collect::<Vec<_>>(), [(1, built)]);
    assert!(step.barriers.is_empty());
    assert_eq!(queue_sync.submit(&sent, |_| false).waits.values().count(), 0);
}

#[test]
fn external_reads_and_writes_order_later_submissions() {
    let queue_caps_of =
        |queue_index: usize| QueueCaps { domain: 0, stages: stages_of(Queue::ALL[queue_index]) };
    let (id, all) = (ResourceId(3), ONE);
    let reader = |stages| record(&[texture_op(3, Use::shader_read(stages))]).0;
    let (computed, drawn) = (reader(Stages::COMPUTE), reader(Stages::FRAGMENT));
    let waits = |step: super::queue_sync::SubmitPlan| step.waits.values().collect::<Vec<_>>();
    let fresh = || {
        let mut queue_sync = QueueSync::new([queue_caps_of(0), queue_caps_of(1), queue_caps_of(2)], true);
        queue_sync.begin_multi_queue();
        queue_sync.import_image(id, all, Layout::ShaderRead);
        queue_sync
    };
    // External code signals the first reader, on another queue. The next reader does not wait for that semaphore.
    let mut queue_sync = fresh();
    let taken = queue_sync.submit(&SubmitRequest { exchanges: true, ..plain(1, &computed) }, |_| false).value;
    assert_eq!(waits(queue_sync.submit(&plain(0, &drawn), |_| false)), [(1, taken)]);
    // External code writes after the last reader signals, or after the release to it is done.
    let given: [&[_]; 2] = [&[], &[(id, QueueAccess::Write)]];
    for references in given {
        let mut queue_sync = fresh();
        let read = queue_sync.submit(&plain(1, &computed), |_| false).value;
        let sent = SubmitRequest { exchanges: references.is_empty(), references, ..plain(0, &drawn) };
        assert_eq!(waits(queue_sync.submit(&sent, |_| false)), [(1, read)]);
    }
    // No other queue waits for it: reads run concurrently.
    let mut queue_sync = fresh();
    queue_sync.submit(&plain(1, &computed), |_| false);
    assert_eq!(waits(queue_sync.submit(&plain(0, &drawn), |_| false)), []);
}

#[test]
fn deferred_objects_wait_for_every_busy_queue_and_for_nothing_before() {
    let queue_caps_of =
        |queue_index: usize| QueueCaps { domain: 0, stages: stages_of(Queue::ALL[queue_index]) };
    let mut queue_sync = QueueSync::new([queue_caps_of(0), queue_caps_of(1), queue_caps_of(2)], true);
    let nothing = Tracker::default();
    let alone = [(); 2].map(|()| queue_sync.next_signal_value());
    queue_sync.mark_submitted(0, alone[1]);
    queue_sync.begin_multi_queue();
    let send = |queue_sync: &mut QueueSync, queue_index| {
        let value = queue_sync.submit(&plain(queue_index, &nothing), |_| false).value;
        queue_sync.mark_submitted(queue_index, value);
        value
    };
    let [a, b, c] = [0, 1, 0].map(|queue_index| send(&mut queue_sync, queue_index));
    assert!(alone[1] < a && a < b && b < c);
    assert_eq!([a, b, c].map(|value| QueueSync::queue_of(value, true)), [0, 1, 0]);
    // Submissions from before the queues were tracked separately are not recorded one by one.
    assert_eq!(queue_sync.completed_up_to(&[0, 0, 0]), 0);
    assert_eq!(queue_sync.completed_up_to(&[alone[0], b, 0]), alone[0]);
    // The result ends right before the first unfinished value, even if the other queue has been idle for long.
    assert_eq!(queue_sync.completed_up_to(&[alone[1], 0, 0]), a - 1);
    assert_eq!(queue_sync.completed_up_to(&[a, 0, 0]), b - 1);
    assert_eq!(queue_sync.completed_up_to(&[c, 0, 0]), b - 1);
    assert_eq!(queue_sync.completed_up_to(&[a, b, 0]), c - 1);
    assert_eq!(queue_sync.completed_up_to(&[c, b, 0]), c);
    queue_sync.mark_completed(&[c, 0, 0]);
    assert_eq!(queue_sync.completed_up_to(&[c, 0, 0]), b - 1);
    let mut one = QueueSync::new([queue_caps_of(0), queue_caps_of(1), queue_caps_of(2)], false);
    assert_eq!([one.next_value(0), one.next_value(0)], [1, 2]);
    one.mark_submitted(0, 2);
    assert_eq!((one.completed_up_to(&[1, 0, 0]), QueueSync::queue_of(2, false)), (1, 0));
}

/// A value whose submission failed is never signalled, so no work waits for it.
#[test]
fn refused_submissions_are_not_among_the_last_values() {
    let queue_caps_of =
        |queue_index: usize| QueueCaps { domain: 0, stages: stages_of(Queue::ALL[queue_index]) };
    let mut queue_sync = QueueSync::new([queue_caps_of(0), queue_caps_of(1), queue_caps_of(2)], true);
    queue_sync.begin_multi_queue();
    let nothing = Tracker::default();
    let sent = queue_sync.submit(&plain(1, &nothing), |_| false).value;
    queue_sync.mark_submitted(1, sent);
    let refused = queue_sync.submit(&plain(1, &nothing), |_| false).value;
    assert!(refused > sent);
    assert_eq!((*queue_sync.last_values(), queue_sync.completed_up_to(&[0, sent, 0])), ([0, sent, 0], sent));
}
