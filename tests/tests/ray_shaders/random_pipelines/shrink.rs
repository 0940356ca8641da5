//! Makes a random pipeline smaller, while it still fails.

use super::program::{Pipeline, Statement};

/// Most pipelines that are tried.
const MOST_TRIALS: u32 = 100;

/// Removes statements, and puts bodies in place of what they are in, while `fails`.
pub fn shrunk(mut pipeline: Pipeline, fails: &dyn Fn(&Pipeline) -> bool) -> Pipeline {
    let mut trials = 0;
    let mut has_changed = true;
    while has_changed {
        has_changed = false;
        let mut at = 0;
        while at < count(&mut pipeline) && trials < MOST_TRIALS {
            let keep_bodies = |keeps: bool| {
                let mut smaller = pipeline.clone();
                let mut left = at;
                for list in lists(&mut smaller) {
                    if replace(list, &mut left, keeps) {
                        break;
                    }
                }
                smaller
            };
            let found = [false, true].into_iter().map(keep_bodies).find(|smaller| {
                trials += 1;
                fails(smaller)
            });
            match found {
                Some(smaller) => (pipeline, has_changed) = (smaller, true),
                None => at += 1,
            }
        }
    }
    pipeline
}

/// The bodies of all functions.
fn lists(pipeline: &mut Pipeline) -> Vec<&mut Vec<Statement>> {
    let shaders = pipeline.shaders_mut().into_iter();
    let functions = shaders.flat_map(|(_, _, shader)| &mut shader.functions);
    functions.map(|function| &mut function.body).collect()
}

fn count(pipeline: &mut Pipeline) -> usize {
    fn inner(list: &mut [Statement]) -> usize {
        let within = |statement: &mut Statement| {
            statement.bodies_mut().into_iter().map(|body| inner(body)).sum::<usize>()
        };
        list.iter_mut().map(|statement| 1 + within(statement)).sum()
    }
    lists(pipeline).into_iter().map(|body| inner(body)).sum()
}

/// Replaces the statement that `left` others precede by nothing or by its bodies. Returns true if the list has it.
fn replace(list: &mut Vec<Statement>, left: &mut usize, keeps_bodies: bool) -> bool {
    for at in 0..list.len() {
        if *left == 0 {
            let bodies = list[at].bodies_mut().into_iter().flat_map(std::mem::take);
            let kept: Vec<_> = bodies.filter(|_| keeps_bodies).collect();
            list.splice(at..=at, kept);
            return true;
        }
        *left -= 1;
        if list[at].bodies_mut().into_iter().any(|body| replace(body, left, keeps_bodies)) {
            return true;
        }
    }
    false
}
