//! What top-level structures show once a command buffer is submitted.

use std::sync::Arc;

use super::AccelStruct;
use super::build_run::BuildRun;
use super::shown::Marks;
use super::tlas::TlasContents;
use crate::error::{Error, Result};

/// What a top-level structure shows once the command buffer is submitted.
pub(crate) struct TlasUpdate {
    pub(crate) target: Arc<AccelStruct>,
    pub(crate) contents: TlasContents,
    /// Moves what is shown when the command buffer is submitted, so that must have as many instances.
    pub(crate) refits_submitted: bool,
}

impl TlasUpdate {
    /// Fails if another submission changed the number of instances since the refit was recorded.
    fn check(&self) -> Result<()> {
        let tlas = self.target.tlas()?;
        if !self.refits_submitted || tlas.contents().counts() == self.contents.counts() {
            return Ok(());
        }
        let message =
            "a refit was recorded, but a submission since then changed the number of instances; rebuild";
        Err(Error::usage(&self.target.name, message))
    }

    /// Makes it so. Answers the structure, and what has to stay until the GPU is done with it: what was shown before,
    /// unless that is still shown.
    pub(crate) fn apply(self) -> (Arc<AccelStruct>, Option<TlasContents>) {
        let Self { target, contents, .. } = self;
        let Ok(tlas) = target.tlas() else { return (target, None) };
        let mut place = tlas.contents();
        let shows_the_same = Arc::ptr_eq(&place.shown, &contents.shown);
        let before = std::mem::replace(&mut *place, contents);
        drop(place);
        let garbage = (!shows_the_same || before.source.is_some()).then_some(before);
        (target, garbage)
    }
}

/// The updates of one command buffer in their order, with memory that is used again.
#[derive(Default)]
pub(crate) struct TlasUpdates {
    list: Vec<TlasUpdate>,
    /// A bit for each target, which several may share.
    targets: u64,
    /// Those that run side by side, while they are recorded.
    pub(crate) run: BuildRun,
    pub(crate) marks: Marks,
    /// The place of what each instance refers to.
    pub(crate) refers: Vec<u32>,
}

impl TlasUpdates {
    const ROOM: usize = 8;
    /// Lists for more instances are let go.
    const MOST_KEPT: usize = 1 << 16;

    /// The last one of a structure.
    #[inline]
    pub(crate) fn last_of(&self, target: &AccelStruct) -> Option<&TlasUpdate> {
        if self.targets & target.id.bit() == 0 {
            return None;
        }
        self.list.iter().rev().find(|update| update.target.id == target.id)
    }

    #[inline(always)]
    pub(crate) fn push(&mut self, update: TlasUpdate) {
        if self.list.capacity() == 0 {
            self.list.reserve(Self::ROOM);
        }
        self.targets |= update.target.id.bit();
        self.list.push(update);
    }

    /// Whether the memory is not too much to keep for what is recorded next.
    pub(crate) fn is_worth_keeping(&self) -> bool {
        self.refers.capacity() <= Self::MOST_KEPT
    }

    /// Fails if what was recorded no longer fits what was submitted since.
    pub(crate) fn check(&self) -> Result<()> {
        self.list.iter().try_for_each(TlasUpdate::check)
    }

    /// Takes them all, and keeps the memory; whoever gets that next waits for what is under way.
    pub(crate) fn drain(&mut self) -> impl Iterator<Item = TlasUpdate> + '_ {
        self.targets = 0;
        self.run.stop();
        self.list.drain(..)
    }
}
