//! Traces the same pictures in every way.

use super::super::error::BenchError;
use super::super::measure::{Timed, all_take_turns, median_of};
use super::super::mesh::Mesh;
use super::super::tracer::{Picture, Rays};
use super::agreement::Agreement;
use super::sides::{Shape, Side, Walker};
use lvk_samples::scene::Camera;

/// What pictures.
pub(super) struct Plan {
    pub(super) cameras: Vec<Camera>,
    pub(super) size: [u32; 2],
    /// Frames of each that count.
    pub(super) runs: u32,
}

/// What one way of tracing came to.
pub(super) struct Walked {
    pub(super) name: String,
    pub(super) shape: Shape,
    pub(super) walker: Walker,
    /// Millions of rays a second, of the kinds of [`Rays::BOTH`]: the mean over all cameras.
    pub(super) rates: [f64; 2],
    /// With the driver's pipeline that traces the same shape as given; none for itself, and where there is none.
    pub(super) agreement: Option<Agreement>,
}

/// Traces all pictures in all ways, which take turns.
pub(super) fn walk(sides: &[Side], mesh: &Mesh, plan: &Plan) -> Result<Vec<Walked>, BenchError> {
    let mut walked: Vec<_> = sides.iter().map(Walked::new).collect();
    let mut mesh = mesh.clone();
    for camera in &plan.cameras {
        mesh.camera = *camera;
        let picture = |side: &Side| Picture::new(&side.ctx, &mesh, plan.size, side.scene.tlas.index());
        let pictures = sides.iter().map(picture).collect::<lvk::Result<Vec<_>>>()?;
        for (kind, rays) in Rays::BOTH.into_iter().enumerate() {
            let rates = rates(sides, &pictures, rays, plan.runs)?;
            let share = 1.0 / plan.cameras.len() as f64;
            walked.iter_mut().zip(rates).for_each(|(walked, rate)| walked.rates[kind] += share * rate);
        }
        compare(sides, &pictures, &mut walked)?;
    }
    Ok(walked)
}

impl Walked {
    fn new(side: &Side) -> Self {
        Self {
            name: side.name.clone(),
            shape: side.shape,
            walker: side.walker,
            rates: [0.0; 2],
            agreement: None,
        }
    }
}

/// Millions of rays a second through one camera, by the median of the frames. As an application traces the same structure
/// in every frame, each frame that counts follows another that has filled the caches.
fn rates(sides: &[Side], pictures: &[Picture], rays: Rays, runs: u32) -> Result<Vec<f64>, BenchError> {
    let samples = all_take_turns(sides.len(), runs, |which| {
        let side = &sides[which];
        let frame = || side.stopwatch.time(|cmd| side.tracer.record(cmd, &pictures[which], rays));
        frame()?;
        frame()
    })?;
    let rate = |(picture, samples): (&Picture, Vec<Timed>)| {
        Ok(picture.ray_count(rays)? as f64 / median_of(&samples, |timed| timed.gpu) / 1e3)
    };
    pictures.iter().zip(samples).map(rate).collect()
}

/// Adds how the pictures agree with those by the reference.
fn compare(sides: &[Side], pictures: &[Picture], walked: &mut [Walked]) -> Result<(), BenchError> {
    for (which, side) in sides.iter().enumerate() {
        let first = sides.iter().position(|first| first.shape == side.shape);
        let Some(first) = first.filter(|first| *first != which && sides[*first].walker == Walker::Pipeline)
        else {
            continue;
        };
        let agreement = Agreement::of(&pictures[first], &pictures[which])?;
        walked[which].agreement.get_or_insert_default().add(&agreement);
    }
    Ok(())
}
