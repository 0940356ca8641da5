//! Traces the same images with every tracer under test.

use super::hit_agreement::HitAgreement;
use super::tracers::{Backend, Layout, TracerCase};
use crate::error::BenchError;
use crate::measure::{SubmissionTimes, interleave_all, median_of};
use crate::mesh::Mesh;
use crate::tracer::{RayKind, TracedImage};
use lvk_samples::scene::Camera;

/// Cameras, image size and run count.
pub(super) struct TraversalPlan {
    pub(super) cameras: Vec<Camera>,
    pub(super) size: [u32; 2],
    /// Measured frames per camera.
    pub(super) runs: u32,
}

/// Results of one tracer.
pub(super) struct TraversalResult {
    pub(super) name: String,
    pub(super) layout: Layout,
    pub(super) backend: Backend,
    /// Millions of rays per second for each of [`RayKind::ALL`]: the mean over all cameras.
    pub(super) rates: [f64; 3],
    /// Agreement with the driver's pipeline on the same layout in the given order; `None` for that pipeline itself, and without
    /// ray tracing pipelines.
    pub(super) agreement: Option<HitAgreement>,
}

/// Traces all images with all tracers, interleaved.
pub(super) fn measure_traversal(
    cases: &[TracerCase],
    mesh: &Mesh,
    plan: &TraversalPlan,
) -> Result<Vec<TraversalResult>, BenchError> {
    let mut results: Vec<_> = cases.iter().map(TraversalResult::new).collect();
    let mut mesh = mesh.clone();
    for camera in &plan.cameras {
        mesh.camera = *camera;
        let image =
            |case: &TracerCase| TracedImage::new(&case.ctx, &mesh, plan.size, case.scene.tlas.index());
        let mut images = cases.iter().map(image).collect::<lvk::Result<Vec<_>>>()?;
        for (kind, rays) in RayKind::ALL.into_iter().enumerate() {
            if rays == RayKind::Bounce {
                // Of the whole mesh, whose primitives are those of the file.
                let whole = images.iter().zip(cases).find(|(_, case)| case.layout == Layout::SingleInstance);
                let bounces =
                    whole.map(|(image, _)| image.bounce_rays(&mesh)).transpose()?.unwrap_or_default();
                images.iter_mut().try_for_each(|image| image.set_bounce_rays(&bounces))?;
            }
            let rates = measure_rates(cases, &images, rays, plan.runs)?;
            let share = 1.0 / plan.cameras.len() as f64;
            results.iter_mut().zip(rates).for_each(|(results, rate)| results.rates[kind] += share * rate);
        }
        add_agreement(cases, &images, &mut results)?;
    }
    Ok(results)
}

impl TraversalResult {
    fn new(case: &TracerCase) -> Self {
        Self {
            name: case.name.clone(),
            layout: case.layout,
            backend: case.backend,
            rates: [0.0; 3],
            agreement: None,
        }
    }
}

/// Returns millions of rays per second for one camera, by the median of the frames. An application traces the same TLAS in
/// every frame, so each measured frame follows one that fills the caches.
fn measure_rates(
    cases: &[TracerCase],
    images: &[TracedImage],
    rays: RayKind,
    runs: u32,
) -> Result<Vec<f64>, BenchError> {
    let samples = interleave_all(cases.len(), runs, |which| {
        let case = &cases[which];
        let frame = || case.stopwatch.time(|cmd| case.tracer.record(cmd, &images[which], rays));
        frame()?;
        frame()
    })?;
    let rate = |(image, samples): (&TracedImage, Vec<SubmissionTimes>)| {
        Ok(image.ray_count(rays)? as f64 / median_of(&samples, |timed| timed.gpu) / 1e3)
    };
    images.iter().zip(samples).map(rate).collect()
}

/// Adds the agreement of the images with those of the reference tracer.
fn add_agreement(
    cases: &[TracerCase],
    images: &[TracedImage],
    results: &mut [TraversalResult],
) -> Result<(), BenchError> {
    for (which, case) in cases.iter().enumerate() {
        let first = cases.iter().position(|first| first.layout == case.layout);
        let Some(first) = first.filter(|first| *first != which && cases[*first].backend == Backend::Pipeline)
        else {
            continue;
        };
        let agreement = HitAgreement::compare(&images[first], &images[which])?;
        results[which].agreement.get_or_insert_default().add(&agreement);
    }
    Ok(())
}
