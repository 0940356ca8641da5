//! Tests of the lock order, with real locks and with all schedules of simulated threads.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use proptest::prelude::*;

use super::held::Ranks;
use super::*;

/// Kind of lock operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    Lock,
    Read,
    Write,
}

const WAYS: [Way; 3] = [Way::Lock, Way::Read, Way::Write];

/// One lock of each kind, all of one rank.
struct Locks {
    mutex: Mutex<()>,
    shared: RwLock<()>,
}

/// A guard of either lock.
enum TakenLock<'a> {
    Lock { _guard: Guard<'a, ()> },
    Read { _guard: ReadGuard<'a, ()> },
    Write { _guard: WriteGuard<'a, ()> },
}

impl Locks {
    fn new(rank: Rank) -> Self {
        Self { mutex: Mutex::new(rank, ()), shared: RwLock::new(rank, ()) }
    }

    fn take(&self, way: Way) -> TakenLock<'_> {
        match way {
            Way::Lock => TakenLock::Lock { _guard: self.mutex.lock() },
            Way::Read => TakenLock::Read { _guard: self.shared.read() },
            Way::Write => TakenLock::Write { _guard: self.shared.write() },
        }
    }
}

/// Returns true if the documentation of [`Rank`] allows `second` after `first`.
fn may_follow(first: Rank, second: Rank) -> bool {
    let is_leaf = |rank: Rank| rank as u8 >= Rank::Frames as u8;
    match second {
        Rank::LoaderLists | Rank::ValidationMessages => (first as u8) < second as u8,
        second if is_leaf(second) => !is_leaf(first),
        second => (first as u8) < second as u8,
    }
}

fn panics(work: impl FnOnce()) -> bool {
    catch_unwind(AssertUnwindSafe(work)).is_err()
}

#[test]
fn locks_are_taken_in_their_order_alone() {
    for first in Rank::ALL {
        for second in Rank::ALL {
            for (way, next) in WAYS.iter().flat_map(|way| WAYS.map(|next| (*way, next))) {
                let (outer, inner) = (Locks::new(first), Locks::new(second));
                let refused = panics(|| {
                    let _outer = outer.take(way);
                    let _inner = inner.take(next);
                });
                assert_eq!(!refused, may_follow(first, second), "{first:?} {way:?}, {second:?} {next:?}");
            }
        }
    }
}

#[test]
fn one_lock_is_not_read_twice_at_once() {
    let lock = RwLock::new(Rank::Store, ());
    assert!(panics(|| {
        let _first = lock.read();
        let _second = lock.read();
    }));
    drop(lock.read());
    drop(lock.read());
}

#[test]
fn the_whole_chain_may_be_held_and_let_go_in_any_order() {
    let chain = Rank::ALL.iter().filter(|rank| (**rank as u8) < Rank::Frames as u8);
    let chain = chain.chain([&Rank::Memory, &Rank::ValidationMessages]).map(|rank| Locks::new(*rank));
    let chain: Vec<_> = chain.collect();
    let mut taken: Vec<_> =
        chain.iter().zip(WAYS.iter().cycle()).map(|(lock, way)| lock.take(*way)).collect();
    while !taken.is_empty() {
        drop(taken.swap_remove(taken.len() / 2));
    }
    let _first = chain[0].take(Way::Write);
}

#[test]
fn the_message_names_what_is_held() {
    let (pending, staging) = (Locks::new(Rank::Pending), Locks::new(Rank::Staging));
    let message = catch_unwind(AssertUnwindSafe(|| {
        let _inner = staging.take(Way::Lock);
        let _outer = pending.take(Way::Lock);
    }));
    let message = *message.unwrap_err().downcast::<String>().unwrap();
    assert_eq!(message, "the lock of Pending is taken while [Staging] are held");
}

#[test]
fn a_thread_that_panicked_leaves_its_locks_open() {
    let locks = Locks::new(Rank::Store);
    for way in [Way::Lock, Way::Write] {
        assert!(panics(|| {
            let _taken = locks.take(way);
            panic!("on purpose");
        }));
    }
    WAYS.into_iter().for_each(|way| drop(locks.take(way)));
}

#[test]
fn threads_that_work_for_another_do_not_take_what_it_holds() {
    let (store, memory) = (Locks::new(Rank::Store), Locks::new(Rank::ValidationMessages));
    let _held = store.take(Way::Read);
    let waiting = HeldLocks::of_current_thread();
    let other =
        |work: &(dyn Fn() + Sync)| std::thread::scope(|scope| scope.spawn(|| panics(work)).join().unwrap());
    assert!(!other(&|| drop(store.take(Way::Read))), "what is not waited for is free");
    assert!(other(&|| waiting.run_with(|| drop(store.take(Way::Read)))));
    assert!(!other(&|| waiting.run_with(|| drop(memory.take(Way::Lock)))));
    assert!(!other(&|| {
        waiting.run_with(|| {});
        drop(store.take(Way::Read));
    }));
}

#[test]
fn locks_are_free_of_the_check_where_a_thread_ends() {
    struct AtEnd(Arc<Locks>);
    impl Drop for AtEnd {
        fn drop(&mut self) {
            WAYS.into_iter().for_each(|way| drop(self.0.take(way)));
        }
    }
    thread_local! {
        static LAST: std::cell::OnceCell<AtEnd> = const { std::cell::OnceCell::new() };
    }
    let locks = Arc::new(Locks::new(Rank::Memory));
    let given = Arc::clone(&locks);
    std::thread::spawn(move || LAST.with(|last| assert!(last.set(AtEnd(given)).is_ok()))).join().unwrap();
    assert_eq!(Arc::strong_count(&locks), 1);
}

/// One step of a simulated thread: the index of the lock, and the operation.
type LockStep = (usize, Way);

/// Locks that each thread will take and holds. A waiting writer blocks readers, as real locks may do.
struct Threads {
    wanted: Vec<Vec<LockStep>>,
    held: Vec<Vec<LockStep>>,
    waiting: Vec<Option<LockStep>>,
}

impl Threads {
    /// Lets a thread take its next lock, or release all locks at the end. Returns false if it has to wait.
    fn step(&mut self, thread: usize) -> bool {
        let Some(&next) = self.wanted[thread].get(self.held[thread].len()) else {
            self.held[thread].clear();
            self.wanted[thread].clear();
            return true;
        };
        if !self.is_free(thread, next) {
            self.waiting[thread] = Some(next);
            return false;
        }
        self.waiting[thread] = None;
        self.held[thread].push(next);
        true
    }

    fn is_free(&self, thread: usize, (lock, way): LockStep) -> bool {
        let taken = self.held.iter().flatten().filter(|(other, _)| *other == lock);
        let mut queue = self.waiting.iter().enumerate().filter(|(other, _)| *other != thread);
        match way {
            Way::Read => {
                let writers = queue.any(|(_, step)| *step == Some((lock, Way::Write)));
                !writers && taken.into_iter().all(|(_, way)| *way == Way::Read)
            }
            Way::Lock | Way::Write => taken.into_iter().next().is_none(),
        }
    }

    fn is_done(&self) -> bool {
        self.wanted.iter().all(Vec::is_empty)
    }
}

/// True if the check lets a thread take all these locks, each while it holds the previous ones.
fn is_allowed(list: &[LockStep]) -> bool {
    let mut held = Ranks::NONE;
    list.iter().all(|(place, _)| {
        let rank = Rank::ALL[*place];
        let may = held.may_take(rank);
        held = held.union(Ranks::from_rank(rank));
        may
    })
}

/// Generates lists in which most pairs are in order, which is rare for uniformly random indices.
fn lists() -> impl Strategy<Value = Vec<Vec<LockStep>>> {
    let way = prop::sample::select(&WAYS[..]);
    let step = (0..Rank::ALL.len(), way);
    let list = (prop::collection::vec(step, 0..6), prop::bool::weighted(0.9));
    let sorted = list.prop_map(|(mut list, sorted)| {
        if sorted {
            list.sort_by_key(|(place, _)| *place);
        }
        list
    });
    prop::collection::vec(sorted, 1..6)
}

proptest! {
    /// Any schedule of threads whose every step passes the check runs to its end.
    #[test]
    fn orders_that_the_check_allows_never_deadlock(
        lists in lists(),
        schedule in prop::collection::vec(any::<prop::sample::Index>(), 0..60)
    ) {
        let wanted: Vec<_> = lists.into_iter().filter(|list| is_allowed(list)).collect();
        let count = wanted.len();
        let mut threads = Threads { wanted, held: vec![Vec::new(); count], waiting: vec![None; count] };
        for which in schedule {
            if count > 0 {
                threads.step(which.index(count));
            }
        }
        while !threads.is_done() {
            let open: Vec<_> = (0..count).filter(|thread| !threads.wanted[*thread].is_empty()).collect();
            let moved = open.into_iter().any(|thread| threads.step(thread));
            prop_assert!(moved, "all wait: {:?} have {:?}", threads.wanted, threads.held);
        }
    }

    /// Real locks and sets of ranks give the same results.
    #[test]
    fn guards_and_sets_agree(list in lists().prop_map(|lists| lists.concat())) {
        let locks = Rank::ALL.map(Locks::new);
        let refused = panics(|| {
            let _taken: Vec<_> = list.iter().map(|(place, way)| locks[*place].take(*way)).collect();
        });
        prop_assert_eq!(!refused, is_allowed(&list));
    }
}
