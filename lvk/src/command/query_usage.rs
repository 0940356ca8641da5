//! Query usage of a command buffer, for checks during the recording and at the submission.

use std::sync::Arc;

use crate::barrier::ResourceId;
use crate::error::{Error, Result};
use crate::resource::QueryPool;
use crate::resource::query_pool::QueryKind;
use crate::resource::query_reset_state::QueryResetState;

/// The queries a command buffer writes and resets, and those it has begun.
#[derive(Default)]
pub(super) struct QueryUsage {
    pools: Vec<(Arc<QueryPool>, QueryResetState)>,
    open: Vec<OpenQuery>,
    /// The error for a query that was begun in a render pass and left open at its end.
    unended_error: Option<Error>,
}

/// A query that was begun and not ended.
pub(super) struct OpenQuery {
    pub(super) pool: Arc<QueryPool>,
    pub(super) query: u32,
    /// True if the query was begun in a render pass, and must be ended there.
    pub(super) in_pass: bool,
}

impl QueryUsage {
    /// Fails unless `count` queries from `query` on may be written.
    pub(super) fn check_ready(&mut self, pool: &Arc<QueryPool>, query: u32, count: u32) -> Result<()> {
        let marks = self.reset_state(pool);
        match (query..query + count).find(|query| !marks.is_ready(*query)) {
            None => Ok(()),
            Some(query) => Err(pool.not_reset_error(query)),
        }
    }

    /// Records that `count` queries from `query` on are written.
    pub(super) fn record_write(&mut self, pool: &Arc<QueryPool>, query: u32, count: u32) {
        let marks = self.reset_state(pool);
        (query..query + count).for_each(|query| marks.write(query));
    }

    /// Fails if one of the queries is open.
    pub(super) fn check_reset(&self, pool: &Arc<QueryPool>, queries: std::ops::Range<u32>) -> Result<()> {
        let open = |open: &&OpenQuery| Arc::ptr_eq(&open.pool, pool) && queries.contains(&open.query);
        match self.open.iter().find(open) {
            None => Ok(()),
            Some(open) => {
                let message = format!("query {} is open; end it before it is reset", open.query);
                Err(Error::usage(&pool.name, message))
            }
        }
    }

    /// Records that queries are reset.
    pub(super) fn record_reset(&mut self, pool: &Arc<QueryPool>, queries: std::ops::Range<u32>) {
        let marks = self.reset_state(pool);
        queries.for_each(|query| marks.reset(query));
    }

    /// Fails if a query of the same kind is open.
    pub(super) fn check_begin(&self, pool: &QueryPool) -> Result<()> {
        match self.open.iter().find(|open| open.pool.kind.raw() == pool.kind.raw()) {
            None => Ok(()),
            Some(open) => {
                let (query, name, kind) = (open.query, &open.pool.name, pool.kind.label());
                let message = format!(
                    "queries of {kind} cannot be nested: query {query} of '{name}' is open, end it first"
                );
                Err(Error::usage(&pool.name, message))
            }
        }
    }

    /// Fails if an open query counts stages that pipelines with mesh shaders do not have.
    pub(super) fn check_mesh_draw(&self) -> Result<()> {
        match self.open.iter().find(|open| open.pool.kind == QueryKind::PipelineStatistics) {
            None => Ok(()),
            Some(open) => {
                let message = format!(
                    "query {} is open and counts stages that pipelines with mesh shaders do not have; count with \
                     QueryKind::MeshStatistics",
                    open.query
                );
                Err(Error::usage(&open.pool.name, message))
            }
        }
    }

    /// Records that a query is open from now on. It uses `count` queries of its pool.
    pub(super) fn record_begin(&mut self, pool: Arc<QueryPool>, query: u32, count: u32, in_pass: bool) {
        self.record_write(&pool, query, count);
        self.open.push(OpenQuery { pool, query, in_pass });
    }

    /// Records the end of a query.
    pub(super) fn record_end(&mut self, pool: &Arc<QueryPool>, query: u32, in_pass: bool) -> Result<()> {
        let same = |open: &OpenQuery| Arc::ptr_eq(&open.pool, pool) && open.query == query;
        let Some(place) = self.open.iter().position(same) else {
            return Err(Error::usage(&pool.name, format!("query {query} was not begun; begin it first")));
        };
        if self.open[place].in_pass != in_pass {
            let place = if in_pass { "before the render pass" } else { "in a render pass" };
            let message = format!("query {query} was begun {place} and must be ended on the same side");
            return Err(Error::usage(&pool.name, message));
        }
        self.open.swap_remove(place);
        Ok(())
    }

    /// Removes and returns the queries that were begun in the pass that ends now. They should have been ended, so their
    /// error is kept for the submission.
    pub(super) fn take_pass_queries(&mut self) -> Vec<OpenQuery> {
        let open: Vec<_> = self.open.extract_if(.., |open| open.in_pass).collect();
        if let Some(first) = open.first() {
            self.unended_error.get_or_insert_with(|| not_ended_error(first));
        }
        open
    }

    /// Removes and returns all open queries.
    pub(super) fn take_open_queries(&mut self) -> Vec<OpenQuery> {
        std::mem::take(&mut self.open)
    }

    /// Fails if the command buffer cannot be submitted after those before it.
    pub(super) fn check_submit(&self) -> Result<()> {
        if let Some(error) = self.unended_error.clone().or_else(|| self.open.first().map(not_ended_error)) {
            return Err(error);
        }
        self.pools.iter().try_for_each(|(pool, marks)| pool.check_submit(marks))
    }

    /// Applies the writes and resets to the pools, once the command buffer is submitted.
    pub(super) fn apply_submission(&self) {
        self.pools.iter().for_each(|(pool, marks)| pool.mark_submitted(marks));
    }

    /// Clears everything and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.pools.clear();
        self.open.clear();
        self.unended_error = None;
    }

    /// Returns the pools that the command buffer writes or resets.
    pub(super) fn pools(&self) -> impl Iterator<Item = ResourceId> {
        self.pools.iter().map(|(pool, _)| pool.id)
    }

    fn reset_state(&mut self, pool: &Arc<QueryPool>) -> &mut QueryResetState {
        let known = self.pools.iter().position(|(known, _)| Arc::ptr_eq(known, pool));
        let place = known.unwrap_or(self.pools.len());
        if known.is_none() {
            self.pools.push((Arc::clone(pool), QueryResetState::new(pool.count)));
        }
        &mut self.pools[place].1
    }
}

fn not_ended_error(open: &OpenQuery) -> Error {
    let place = if open.in_pass { "render pass" } else { "command buffer" };
    let message = format!("query {} was begun and not ended in its {place}", open.query);
    Error::usage(&open.pool.name, message)
}
