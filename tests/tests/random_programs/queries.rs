//! Queries: times and counts of samples, what the model knows of them, and what reads must return.

use std::collections::HashMap;

use lvk::{
    Context, Holder, OptionalFeature, QueryKind, QueryPoolDesc, QueryPoolHandle, Queue, RenderPassDesc,
};

use super::kit::Push;
use super::memory::Effect;
use super::plan::{Planned, compute_problems, graphics_problems};
use super::world::{Problem, World, judge};

/// Queries of a pool.
const COUNT: u32 = 4;

/// A pool of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Pool {
    /// Timestamps.
    Times,
    /// Samples that passed.
    Samples,
}

/// The pools.
pub struct QueryPools {
    times: Holder<QueryPoolHandle>,
    samples: Holder<QueryPoolHandle>,
    /// True if samples are counted exactly.
    is_exact: bool,
}

impl QueryPools {
    /// Creates the pools.
    pub fn new(ctx: &Context) -> lvk::Result<Self> {
        let is_exact = ctx.capabilities().has(OptionalFeature::OcclusionQueryPrecise);
        let pool =
            |kind, debug_name| ctx.create_query_pool(&QueryPoolDesc { kind, count: COUNT, debug_name });
        Ok(Self {
            times: pool(QueryKind::Timestamps, "times")?,
            samples: pool(QueryKind::Occlusion { precise: is_exact }, "samples")?,
            is_exact,
        })
    }

    fn handle(&self, pool: Pool) -> QueryPoolHandle {
        match pool {
            Pool::Times => *self.times,
            Pool::Samples => *self.samples,
        }
    }
}

/// What a query wrote.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QueryResult {
    /// A time, on a queue.
    Time(Queue),
    /// A number of samples.
    Samples(u64),
}

/// State of a query after all submissions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum State {
    /// No submission has written or reset it.
    #[default]
    New,
    /// A reset came last.
    Reset,
    /// A write came last. The number grows with each write of any query.
    Written(QueryResult, u64),
}

/// All queries.
#[derive(Debug, Default)]
pub struct Queries {
    states: HashMap<(Pool, usize), State>,
    writes: u64,
}

impl Queries {
    /// Resets a query.
    pub fn reset(&mut self, pool: Pool, query: usize) {
        self.states.insert((pool, query), State::Reset);
    }

    /// Writes the result of a query.
    pub fn write(&mut self, pool: Pool, query: usize, result: QueryResult) {
        self.writes += 1;
        self.states.insert((pool, query), State::Written(result, self.writes));
    }

    fn state(&self, pool: Pool, query: u32) -> State {
        self.states.get(&(pool, query as usize)).copied().unwrap_or_default()
    }
}

/// Queries that a command buffer uses.
#[derive(Debug, Default)]
pub struct OpenQueries(HashMap<(Pool, u32), OpenQuery>);

#[derive(Debug, Default, Clone, Copy)]
struct OpenQuery {
    /// True if the first use is a write, so that the query must have been reset before the command buffer.
    needs_reset: bool,
    was_reset: bool,
    is_written: bool,
}

impl OpenQueries {
    fn is_written(&self, pool: Pool, query: u32) -> bool {
        self.0.get(&(pool, query)).is_some_and(|open| open.is_written)
    }

    /// Notes a reset.
    fn reset(&mut self, pool: Pool, query: u32) {
        let open = self.0.entry((pool, query)).or_default();
        (open.was_reset, open.is_written) = (true, false);
    }

    /// Notes a write, after a reset or without one.
    fn write(&mut self, pool: Pool, query: u32, resets: bool) {
        let open = self.0.entry((pool, query)).or_default();
        open.was_reset |= resets;
        open.needs_reset |= !open.was_reset;
        open.is_written = true;
    }

    /// Returns the problem of a command buffer that writes a query again without a reset.
    pub fn problem(&self, queries: &Queries) -> Option<Problem> {
        let again = |((pool, query), open): (&(Pool, u32), &OpenQuery)| {
            open.needs_reset && matches!(queries.state(*pool, *query), State::Written(..))
        };
        self.0.iter().any(again).then_some(Problem::Usage)
    }
}

impl World<'_> {
    /// Chooses a query and whether it is reset before its write, in three of four cases. Also returns the problem of
    /// the write.
    fn query_write(&self, at: usize, pool: Pool, [query, n]: [u16; 2]) -> (u32, bool, Vec<Problem>) {
        let (query, resets) = (u32::from(query) % (COUNT + 1), !n.is_multiple_of(4));
        let is_again = !resets && self.open[at].queries.is_written(pool, query);
        let is_wrong = query >= COUNT || is_again;
        (query, resets, is_wrong.then_some(Problem::Usage).into_iter().collect())
    }

    /// Returns the effect of a write of a query, and notes the write, if it has no problems.
    fn query_effects(
        &mut self,
        at: usize,
        (pool, query, resets): (Pool, u32, bool),
        result: QueryResult,
        problems: &[Problem],
    ) -> Vec<Effect> {
        if !problems.is_empty() {
            return Vec::new();
        }
        self.open[at].queries.write(pool, query, resets);
        vec![Effect::Query { pool, query: query as usize, result }]
    }

    pub(super) fn timestamp(&mut self, n: [u16; 6], at: usize) -> Option<Planned> {
        if self.open[at].queue != Queue::Graphics {
            return None;
        }
        self.write_time([n[0], 1, 31, 0, 0, 0], at)
    }

    /// Plans a reset of up to three queries, of which the last may not exist, or may come before the first.
    fn reset_times(&mut self, n: [u16; 6], at: usize) -> Planned {
        let (first, count) = (u32::from(n[0]) % COUNT, u32::from(n[1]) % 4);
        let is_reversed = n[4] % 16 == 15 && first > 0;
        let mut problems = compute_problems(self.open[at].queue, [None]);
        problems.extend((is_reversed || first + count > COUNT).then_some(Problem::Usage));
        let queries = if is_reversed { first..0 } else { first..first + count };
        let mut effects = Vec::new();
        if problems.is_empty() {
            for query in queries.clone() {
                self.open[at].queries.reset(Pool::Times, query);
                effects.push(Effect::Reset { pool: Pool::Times, query: query as usize });
            }
        }
        let handle = self.queries.handle(Pool::Times);
        Planned::new(problems, effects, move |_, cmd| cmd.reset_queries(handle, queries))
    }

    /// Plans a write of a time, with or without a reset before it, or resets alone.
    pub(super) fn write_time(&mut self, n: [u16; 6], at: usize) -> Option<Planned> {
        match n[3] % 8 {
            6 => return self.write_time_in_pass(n, at),
            7 => return Some(self.reset_times(n, at)),
            _ => {}
        }
        let queue = self.open[at].queue;
        let (query, mut resets, mut problems) = self.query_write(at, Pool::Times, [n[0], n[1]]);
        let (mut handle, number) = (self.queries.handle(Pool::Times), n[2] % 32);
        if number < 3 {
            let (other, problem) = self.wrong_pool(number, Pool::Samples);
            handle = other;
            problems.push(problem);
        }
        let has_times = self.ctx().capabilities().queue(queue).timestamp_bits > 0;
        problems.extend((!has_times).then_some(Problem::Unsupported));
        // Where only the write is refused, a reset before it would be done.
        resets &= has_times && number != 2;
        if resets {
            problems.extend(compute_problems(queue, [None]));
        }
        let effects =
            self.query_effects(at, (Pool::Times, query, resets), QueryResult::Time(queue), &problems);
        Some(Planned::new(problems, effects, move |_, cmd| {
            if resets {
                cmd.reset_queries(handle, query..query + 1)?;
            }
            cmd.write_timestamp(handle, query)
        }))
    }

    /// Plans a pass without draws that writes a time.
    fn write_time_in_pass(&mut self, n: [u16; 6], at: usize) -> Option<Planned> {
        let pass = self.pass([n[4], n[5], n[2]], None)?;
        let queue = self.open[at].queue;
        let (query, resets, mut problems) = self.query_write(at, Pool::Times, [n[0], n[1]]);
        problems.extend(graphics_problems(queue, []));
        problems.extend(&pass.problems);
        let has_times = self.ctx().capabilities().queue(queue).timestamp_bits > 0;
        problems.extend((!has_times).then_some(Problem::Unsupported));
        let resets = resets && problems.is_empty();
        let effects =
            self.query_effects(at, (Pool::Times, query, resets), QueryResult::Time(queue), &problems);
        let handle = self.queries.handle(Pool::Times);
        Some(Planned::new(problems, effects, move |_, cmd| {
            if resets {
                cmd.reset_queries(handle, query..query + 1)?;
            }
            let desc = RenderPassDesc { color: &[pass.target], ..Default::default() };
            let mut drawn = cmd.begin_rendering(&desc)?;
            drawn.write_timestamp(handle, query)
        }))
    }

    /// Returns a pool that a call must refuse: a stale, a foreign, or one of another kind.
    fn wrong_pool(&self, number: u16, other: Pool) -> (QueryPoolHandle, Problem) {
        match number {
            0 => (self.env.stale_queries, Problem::Stale),
            1 => (self.env.foreign.queries(), Problem::Foreign),
            _ => (self.queries.handle(other), Problem::Usage),
        }
    }

    /// Plans a pass that counts the samples of a rectangle, between begin and end inside of the pass or around it.
    pub(super) fn count_samples(&mut self, n: [u16; 6], at: usize) -> Option<Planned> {
        let pass = self.pass([n[0], n[1], n[2]], None)?;
        let (query, resets, mut problems) = self.query_write(at, Pool::Samples, [n[3], n[4]]);
        problems.extend(graphics_problems(self.open[at].queue, []));
        problems.extend(&pass.problems);
        let resets = resets && problems.is_empty();
        let result = QueryResult::Samples(pass.place.map_or(0, |place| place.texels() as u64));
        let mut effects = self.query_effects(at, (Pool::Samples, query, resets), result, &problems);
        let word = pass.word(n[5]);
        if problems.is_empty() {
            effects.extend(pass.fill(n[5]));
        }
        let handle = self.queries.handle(Pool::Samples);
        let is_inside = n[4] & 4 == 0;
        Some(Planned::new(problems, effects, move |env, cmd| {
            if resets {
                cmd.reset_queries(handle, query..query + 1)?;
            }
            // A target that is refused must not leave a query open, which the submission would refuse.
            let desc = RenderPassDesc { color: &[pass.target], ..Default::default() };
            if !is_inside {
                drop(cmd.begin_rendering(&desc)?);
                cmd.begin_query(handle, query)?;
            }
            let mut drawn = cmd.begin_rendering(&desc)?;
            drawn.bind_render_pipeline(env.kit.draw(pass.format))?;
            drawn.push_constants(&Push { word, ..Default::default() })?;
            drawn.scissor(pass.offset, pass.extent)?;
            if is_inside {
                drawn.begin_query(handle, query)?;
            }
            drawn.draw(0..3, 0..1)?;
            if is_inside {
                return drawn.end_query(handle, query);
            }
            drop(drawn);
            cmd.end_query(handle, query)
        }))
    }

    /// Reads queries: of times in milliseconds or in ticks, or of samples, after a wait or without one.
    pub(super) fn read_queries(&mut self, n: [u16; 6]) -> Result<bool, String> {
        let (first, count) = (u32::from(n[0]) % (COUNT + 1), u32::from(n[1]) % (COUNT + 1));
        let waits = n[2] % 4 != 3;
        if waits {
            judge(self.ctx().wait_idle(), &[])?;
        }
        let mut problems: Vec<_> = (first + count > COUNT).then_some(Problem::Usage).into_iter().collect();
        let pool = if n[3] % 3 == 2 { Pool::Samples } else { Pool::Times };
        let mut handle = self.queries.handle(pool);
        if n[4] % 16 < 2 {
            let (other, problem) = self.wrong_pool(n[4] % 16, pool);
            handle = other;
            problems.push(problem);
        }
        if n[5].is_multiple_of(16) {
            // No pool of a program holds statistics, and only one holds times.
            problems.push(Problem::Usage);
            judge(self.ctx().statistics(handle, first), &problems)?;
            if pool == Pool::Samples {
                judge(self.ctx().timestamps_ms(handle, first, count), &problems)?;
            }
            self.record_problems(&problems);
            return Ok(true);
        }
        self.record_problems(&problems);
        let mut numbers = vec![None; count as usize];
        if judge(self.ctx().read_queries(handle, first, &mut numbers), &problems)?.is_some() {
            let numbers = numbers.iter().map(|number| number.map(|number| number as f64)).collect();
            self.compare_queries(pool, first, numbers, waits)?;
        }
        if pool == Pool::Times
            && let Some(times) = judge(self.ctx().timestamps_ms(handle, first, count), &problems)?
        {
            self.compare_queries(pool, first, times.clone(), waits)?;
            self.compare_with_clock(&times)?;
        }
        Ok(true)
    }

    /// Compares results of queries with the model: there are those of written queries, samples are counted, and times
    /// of a queue grow in the order of the writes.
    fn compare_queries(
        &self,
        pool: Pool,
        first: u32,
        found: Vec<Option<f64>>,
        is_idle: bool,
    ) -> Result<(), String> {
        let mut times = Vec::new();
        for (query, found) in (first..).zip(found) {
            let state = self.memory.queries.state(pool, query);
            let fits = match (state, found) {
                (State::New, found) => found.is_none(),
                // A write before the reset may be what is there, until the reset is done.
                (State::Reset, found) => found.is_none() || !is_idle,
                (State::Written(..), None) => !is_idle,
                (State::Written(QueryResult::Samples(samples), _), Some(number)) if is_idle => {
                    let is_exact = self.queries.is_exact;
                    if is_exact { number == samples as f64 } else { (number > 0.0) == (samples > 0) }
                }
                (State::Written(..), Some(_)) => true,
            };
            if !fits {
                return Err(format!("query {query} of {pool:?} is {found:?}, expected {state:?}"));
            }
            if let (State::Written(QueryResult::Time(queue), order), Some(time), true) =
                (state, found, is_idle)
            {
                times.push((order, queue, time));
            }
        }
        times.sort_by_key(|(order, ..)| *order);
        for (at, (_, queue, time)) in times.iter().enumerate() {
            let later = times[at..].iter().find(|(_, other, later)| other == queue && later < time);
            if let Some(later) = later {
                return Err(format!("the time {time} on {queue:?} comes before {later:?}"));
            }
        }
        Ok(())
    }

    /// Fails if the GPU's clock shows an earlier time than one that was written.
    fn compare_with_clock(&self, times: &[Option<f64>]) -> Result<(), String> {
        let is_supported = self.ctx().capabilities().has(OptionalFeature::CalibratedTimestamps);
        let problems: &[_] = if is_supported { &[] } else { &[Problem::Unsupported] };
        let Some(now) = judge(self.ctx().calibrated_timestamps(), problems)? else { return Ok(()) };
        let now_ms = now.gpu_ms + now.deviation.as_secs_f64() * 1e3;
        match times.iter().flatten().find(|time| **time > now_ms) {
            Some(later) => {
                Err(format!("the time {later} ms was written, and the GPU's clock is at {now_ms} ms"))
            }
            None => Ok(()),
        }
    }
}

#[test]
fn a_query_is_written_once_after_each_reset() {
    let (mut open, mut queries) = (OpenQueries::default(), Queries::default());
    open.write(Pool::Times, 1, false);
    assert!(open.is_written(Pool::Times, 1) && !open.is_written(Pool::Samples, 1));
    assert_eq!(open.problem(&queries), None);
    queries.write(Pool::Times, 1, QueryResult::Time(Queue::Graphics));
    assert_eq!(open.problem(&queries), Some(Problem::Usage));
    queries.reset(Pool::Times, 1);
    assert_eq!(open.problem(&queries), None);
    let mut open = OpenQueries::default();
    open.reset(Pool::Times, 1);
    assert!(!open.is_written(Pool::Times, 1));
    open.write(Pool::Times, 1, false);
    queries.write(Pool::Times, 1, QueryResult::Time(Queue::Graphics));
    assert_eq!(open.problem(&queries), None);
}
