//! Ray queries that the library walks itself.

mod corrupt;
mod pictures;
mod queries;
mod seams;
mod short;
mod singular;
