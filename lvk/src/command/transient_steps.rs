//! Steps of a command buffer through transient heaps: which textures have contents, and the barriers where memory
//! passes from one texture to the next.

use std::sync::Arc;

use super::CommandBuffer;
use super::queue_support::limited_to_queue;
use crate::barrier::Tracker;
use crate::error::{Error, Result};
use crate::resource::transient_heap::{TransientPlace, TransientPlan};
use crate::submit::Recording;

/// The heaps that a command buffer uses, each with its current step.
#[derive(Default)]
pub(super) struct TransientSteps(Vec<(Arc<TransientPlan>, u32)>);

/// Members of a heap that a step ends and begins.
#[derive(Debug, PartialEq, Eq)]
struct StepChange {
    ended: Vec<usize>,
    begun: Vec<usize>,
}

impl StepChange {
    /// Returns the change from step `old`, or from none, to `new`. An earlier step begins a new round: all textures
    /// end.
    fn new(plan: &TransientPlan, old: Option<u32>, new: Option<u32>) -> Self {
        let is_new_round = old.zip(new).is_some_and(|(old, new)| new < old);
        let lives =
            |index: usize, step: Option<u32>| step.is_some_and(|step| plan.members[index].lives_in(step));
        let all = 0..plan.members.len();
        let stays = |index: usize| lives(index, old) && lives(index, new) && !is_new_round;
        Self {
            ended: all.clone().filter(|&index| lives(index, old) && !stays(index)).collect(),
            begun: all.filter(|&index| lives(index, new) && !stays(index)).collect(),
        }
    }
}

impl TransientSteps {
    /// Fails unless the texture has contents in the current step.
    #[inline(never)]
    pub(super) fn check(&self, place: &TransientPlace, texture: &str) -> Result<()> {
        let member = place.member();
        let step = self.step_of(&place.plan);
        if step.is_some_and(|step| member.lives_in(step)) {
            return Ok(());
        }
        let Some(step) = step else { return Err(place.not_begun(texture)) };
        let [first, last] = member.steps;
        let message = format!(
            "its contents exist from step {first} to step {last} of the transient heap '{}', and the command buffer \
             is in step {step}; give it a longer lifetime, or use another texture",
            place.plan.name
        );
        Err(Error::usage(texture, message))
    }

    fn step_of(&self, plan: &Arc<TransientPlan>) -> Option<u32> {
        self.0.iter().find(|(known, _)| Arc::ptr_eq(known, plan)).map(|(_, step)| *step)
    }

    fn set_step(&mut self, plan: &Arc<TransientPlan>, step: u32) {
        match self.0.iter_mut().find(|(known, _)| Arc::ptr_eq(known, plan)) {
            Some((_, current)) => *current = step,
            None => self.0.push((Arc::clone(plan), step)),
        }
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }
}

impl CommandBuffer {
    /// Begins a step of a transient heap: ends and begins the contents of its textures, and records the barriers where
    /// memory passes from one to another.
    pub(crate) fn enter_transient_step(&mut self, plan: &Arc<TransientPlan>, step: u32) -> Result<()> {
        if plan.queue != self.queue {
            let message = format!(
                "the transient heap is for the {:?} queue, and the command buffer for the {:?} queue",
                plan.queue, self.queue
            );
            return Err(Error::usage(&plan.name, message));
        }
        let change = StepChange::new(plan, self.state.accesses.transients.step_of(plan), Some(step));
        self.make_visible();
        self.flush_barriers();
        end_members(&mut self.recording.tracker, plan, &change.ended);
        let queue_index = self.recording.queue_index;
        let begun = change.begun.iter().map(|&member| {
            let member = &plan.members[member];
            (member, limited_to_queue(queue_index, member.first_use))
        });
        for (member, first_use) in begun.clone() {
            for &sharer in &member.sharers {
                self.state.accesses.add_id(plan.members[sharer].bytes, first_use);
            }
        }
        self.flush_barriers();
        for (member, first_use) in begun {
            self.recording.tracker.discard_texture(member.image, member.shape, first_use.stages);
        }
        self.state.accesses.transients.set_step(plan, step);
        Ok(())
    }

    /// Ends the contents of all textures of transient heaps.
    pub(super) fn end_transient_steps(&mut self) {
        let Recording { tracker, .. } = &mut **self.recording;
        for (plan, step) in &self.state.accesses.transients.0 {
            end_members(tracker, plan, &StepChange::new(plan, Some(*step), None).ended);
        }
    }
}

/// Makes the next uses of the members' bytes wait for the members' last uses.
fn end_members(tracker: &mut Tracker, plan: &TransientPlan, ended: &[usize]) {
    for &index in ended {
        let member = &plan.members[index];
        let last = tracker.unfinished_texture(member.image);
        for &sharer in &member.sharers {
            tracker.extend_write(plan.members[sharer].bytes, last);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::barrier::{Access, Barriers, Layout, QueueState, ResourceId, Stages, TextureShape, Use};
    use crate::queue::Queue;
    use crate::resource::transient_heap::TransientMember;

    const SHAPE: TextureShape = TextureShape { mips: 1, layers: 1 };

    /// Color targets with these steps, all on the same bytes.
    fn plan(steps: &[[u32; 2]]) -> TransientPlan {
        let member = |steps: &[u32; 2]| TransientMember {
            image: ResourceId::next(),
            shape: SHAPE,
            bytes: ResourceId::next(),
            steps: *steps,
            sharers: Vec::new(),
            first_use: Use::any_of(Stages::COLOR | Stages::TRANSFER),
        };
        let mut members: Vec<_> = steps.iter().map(member).collect();
        let all = members.len();
        members.iter_mut().for_each(|member| member.sharers = (0..all).collect());
        TransientPlan { name: "heap".to_owned(), queue: Queue::Graphics, members }
    }

    fn change(plan: &TransientPlan, old: Option<u32>, new: u32) -> [Vec<usize>; 2] {
        let StepChange { ended, begun } = StepChange::new(plan, old, Some(new));
        [ended, begun]
    }

    #[test]
    fn steps_end_and_begin_what_their_lifetimes_say() {
        let plan = plan(&[[0, 1], [1, 2], [4, 6]]);
        assert_eq!(change(&plan, None, 0), [vec![], vec![0]]);
        assert_eq!(change(&plan, Some(0), 1), [vec![], vec![1]]);
        assert_eq!(change(&plan, Some(1), 1), [vec![], vec![]]);
        assert_eq!(change(&plan, Some(1), 2), [vec![0], vec![]]);
        assert_eq!(change(&plan, Some(2), 5), [vec![1], vec![2]]);
        assert_eq!(change(&plan, Some(2), 1), [vec![1], vec![0, 1]]);
        assert_eq!(change(&plan, Some(7), 0), [vec![], vec![0]]);
        assert_eq!(StepChange::new(&plan, Some(1), None).ended, [0, 1]);
    }

    proptest! {
        /// Follows the live set through any order of steps.
        #[test]
        fn live_textures_are_those_whose_lifetime_contains_the_step(
            lifetimes in prop::collection::vec((0..8_u32, 0..4_u32), 0..8),
            steps in prop::collection::vec(0..12_u32, 1..12),
        ) {
            let lifetimes: Vec<_> = lifetimes.into_iter().map(|(first, more)| [first, first + more]).collect();
            let plan = plan(&lifetimes);
            let (mut live, mut old) = (vec![false; lifetimes.len()], None);
            for step in steps {
                let [ended, begun] = change(&plan, old, step);
                for index in ended {
                    prop_assert!(std::mem::replace(&mut live[index], false));
                }
                for index in begun {
                    prop_assert!(!std::mem::replace(&mut live[index], true));
                }
                for (index, [first, last]) in lifetimes.iter().enumerate() {
                    prop_assert_eq!(live[index], (*first..=*last).contains(&step));
                }
                old = Some(step);
            }
        }
    }

    /// Draws to a member, and returns the barriers in front.
    fn draw(tracker: &mut Tracker, plan: &TransientPlan, member: usize) -> [Barriers; 2] {
        let TransientMember { bytes, image, first_use, .. } = plan.members[member];
        let [mut begin, mut first] = [(); 2].map(|()| Barriers::default());
        tracker.use_buffer(bytes, first_use, &mut begin);
        tracker.discard_texture(image, SHAPE, first_use.stages);
        tracker.use_texture(image, SHAPE, SHAPE.all_subresources(), Use::color_target(false), &mut first);
        end_members(tracker, plan, &[member]);
        [begin, first]
    }

    #[test]
    fn memory_that_passes_on_is_waited_for_in_and_across_command_buffers() {
        let mut plan = plan(&[[0, 0], [1, 1]]);
        let bytes = plan.members[0].bytes;
        plan.members.iter_mut().for_each(|member| member.bytes = bytes);
        let mut queue = QueueState::default();
        for submission in 0..2 {
            let mut tracker = Tracker::default();
            let [begin, first] = draw(&mut tracker, &plan, 0);
            assert!(begin.is_empty(), "earlier command buffers are waited for at the submission");
            assert_eq!(first.images[0].scopes.old_layout, Layout::Undefined);
            let [begin, first] = draw(&mut tracker, &plan, 1);
            let memory = begin.memory.unwrap_or_default();
            assert!(
                memory.src_stages.contains(Stages::COLOR) && memory.src_access.contains(Access::COLOR_WRITE)
            );
            assert!(
                memory.dst_stages.contains(first.images[0].scopes.src_stages),
                "the transition is chained"
            );
            let front = queue.submit(&tracker);
            assert!(front.images.is_empty(), "no layout from before is kept");
            let written = front.memory.is_some_and(|memory| memory.src_access.contains(Access::COLOR_WRITE));
            assert_eq!(written, submission > 0);
        }
    }
}
