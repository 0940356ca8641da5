//! The candidates along a ray of a random pipeline, in the order of their distance: shaders judge them so that no other order matters.

use super::interpreter::{Invocation, Leave, record};
use super::program::{Ray, Shader};
use super::scene::{GROUP_BEHIND, LAYERS, distance, first_column, instance};

/// What an any-hit or intersection shader judges.
pub enum Candidate<'a> {
    /// Nothing: the shader is of another stage.
    None,
    /// A hit, of an any-hit shader.
    Hit {
        /// True if no other hit can be nearer.
        is_first: bool,
    },
    /// An AABB, of an intersection shader.
    Box(Reports<'a>),
}

/// A hit that its any-hit shader takes.
#[derive(Clone, Copy)]
pub struct Hit<'a> {
    /// Index of the hit group in the shader binding table.
    pub group: usize,
    /// The group's closest-hit shader.
    pub closest_hit: Option<&'a Shader>,
    /// The built-in value of its shaders, without that of the launch.
    pub builtin: u32,
}

/// Hits that an intersection shader reports.
pub struct Reports<'a> {
    ray: Ray,
    payload: u32,
    group: usize,
    closest_hit: &'a Shader,
    any_hit: Option<&'a Shader>,
    /// End of the ray, in eighths.
    limit: u32,
    nearest: Option<Hit<'a>>,
}

impl<'a> Invocation<'a> {
    /// Returns the hit of a ray with a target and a payload.
    pub fn first_hit(&self, target: usize, payload: u32, ray: Ray) -> Result<Option<Hit<'a>>, Leave> {
        let group = &self.pipeline.hits[target];
        let column = first_column(self.pipeline.procedural(), target);
        if let Some(shader) = &group.intersection {
            let (closest_hit, any_hit) = (&group.closest_hit, group.any_hit.as_ref());
            let (limit, nearest) = (u32::MAX, None);
            let reports = Reports { ray, payload, group: target, closest_hit, any_hit, limit, nearest };
            if let Some(hit) = self.box_hit(shader, reports, instance(0, column))? {
                return Ok(Some(hit));
            }
        }
        let first = usize::from(group.intersection.is_some());
        for layer in first..LAYERS {
            let (index, group) = match layer {
                0 => (target, Some(group)),
                1 => (GROUP_BEHIND, self.pipeline.behind.as_ref()),
                _ => (GROUP_BEHIND + layer - 1, None),
            };
            let builtin = instance(layer, column) + distance(layer);
            let hit = Hit { group: index, closest_hit: group.map(|group| &group.closest_hit), builtin };
            let any_hit = group.and_then(|group| group.any_hit.as_ref()).filter(|_| ray != Ray::Opaque);
            let is_first = layer == 0;
            match any_hit.map_or(Ok(()), |shader| self.judge(shader, hit, is_first, payload)) {
                Err(Leave::Ignored) => {}
                Err(Leave::TooLong) => return Err(Leave::TooLong),
                Ok(()) | Err(Leave::Ended) => return Ok(Some(hit)),
            }
        }
        Ok(None)
    }

    /// Runs an intersection shader.
    fn box_hit(
        &self,
        shader: &'a Shader,
        reports: Reports<'a>,
        builtin: u32,
    ) -> Result<Option<Hit<'a>>, Leave> {
        let (builtin, record) = (builtin + self.launch, record(2, reports.group));
        let candidate = Candidate::Box(reports);
        let mut invocation =
            Invocation { shader, builtin, record, global: 17, depth: 0, calls: 0, candidate, ..*self };
        if invocation.shade(builtin.wrapping_add(record)) == Err(Leave::TooLong) {
            return Err(Leave::TooLong);
        }
        Ok(match invocation.candidate {
            Candidate::Box(reports) => reports.nearest,
            _ => None,
        })
    }

    /// Runs an any-hit shader for a ray with a payload.
    fn judge(&self, shader: &'a Shader, hit: Hit<'a>, is_first: bool, payload: u32) -> Result<(), Leave> {
        let (builtin, record) = (hit.builtin.wrapping_add(self.launch), record(2, hit.group));
        let candidate = Candidate::Hit { is_first };
        let mut invocation =
            Invocation { shader, builtin, record, global: 17, depth: 0, calls: 0, candidate, ..*self };
        invocation.shade(payload.wrapping_add(builtin)).map(drop)
    }

    /// Reports a hit at a distance from a value. Returns the new end of the ray, in eighths, if the hit is taken.
    pub fn report(&mut self, value: u32) -> Result<Option<u32>, Leave> {
        let Candidate::Box(reports) = &self.candidate else { return Ok(None) };
        let distance = 4 + value % 8;
        if distance > reports.limit {
            return Ok(None);
        }
        let (ray, payload) = (reports.ray, reports.payload);
        let builtin = self.builtin.wrapping_sub(self.launch).wrapping_add(distance);
        let builtin = builtin.wrapping_add(value % 100).wrapping_add(value);
        let hit = Hit { group: reports.group, closest_hit: Some(reports.closest_hit), builtin };
        let any_hit = reports.any_hit.filter(|_| ray != Ray::Opaque);
        let verdict = any_hit.map_or(Ok(()), |shader| self.judge(shader, hit, true, payload));
        match verdict {
            Err(Leave::Ignored) => return Ok(None),
            Err(Leave::TooLong) => return Err(Leave::TooLong),
            Ok(()) | Err(Leave::Ended) => {}
        }
        if let Candidate::Box(reports) = &mut self.candidate {
            (reports.limit, reports.nearest) = (distance, Some(hit));
        }
        if verdict.is_err() || ray == Ray::Shadow {
            return Err(Leave::Ended);
        }
        Ok(Some(distance))
    }
}
