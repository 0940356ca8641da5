//! Panels of samples that recreate targets and pipelines: after a change the image equals that of a new sample.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fmt::Debug;

use lvk::Context;
use lvk_samples::app::headless;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::hybrid::{Bounces, Geometry, HybridConfig, HybridRenderer, HybridSequence, Method, RayPath};
use lvk_samples::hybrid_oit::{HybridOit, HybridOitConfig, HybridOitSequence, OitScene};
use lvk_samples::reflections::{Reflections, ReflectionsConfig, SkinUpdate};
use lvk_tests::device;
use lvk_tests::hybrid::paths;
use lvk_tests::scene_obj::obj_scene;

const SIZE: [u32; 2] = [40, 24];

fn render_image<S: Sample>(sample: &mut S) -> Vec<u8> {
    sample.update(FrameTime::from_frame(3, 10));
    headless::picture(sample).unwrap()
}

/// Asks a sample made by the first of `configs` for all others, for the first again, and for `impossible`.
fn check<S: Sample, C: Copy + PartialEq + Debug>(
    make: impl Fn(&C) -> S,
    wanted: fn(&mut S) -> &mut C,
    configs: &[C],
    impossible: C,
) {
    let mut sample = make(&configs[0]);
    let first = render_image(&mut sample);
    for config in configs[1..].iter().chain(&configs[..1]) {
        *wanted(&mut sample) = *config;
        assert!(render_image(&mut sample) == render_image(&mut make(config)), "{config:?}");
        assert_eq!(*wanted(&mut sample), *config, "it was refused");
    }
    *wanted(&mut sample) = impossible;
    assert!(render_image(&mut sample) == first, "{impossible:?}");
    assert_eq!(*wanted(&mut sample), configs[0], "what cannot be is wanted no more");
}

/// The path that is not `paths(ctx)[0]`, if there are two.
fn other_path(ctx: &Context) -> RayPath {
    paths(ctx)[paths(ctx).len() - 1]
}

#[test]
fn hybrid_changes_method_bounces_depth_and_samples() {
    let Some(ctx) = device() else { return };
    let scene = obj_scene();
    let make = |config: &HybridConfig| {
        HybridSequence::new(HybridRenderer::new(&ctx, &scene, config).unwrap(), &scene, 0, false)
    };
    let [width, height] = SIZE;
    let (path, bounces) = (paths(&ctx)[0], Some(Bounces::Inline));
    let first = HybridConfig { path, width, height, bounces, max_depth: 2, ..HybridConfig::default() };
    let configs = [
        first,
        HybridConfig { max_depth: 0, ..first },
        HybridConfig { samples: 3, ..first },
        HybridConfig { method: Method::Standalone, path: other_path(&ctx), ..first },
        HybridConfig { geometry: Geometry::Paper, ..first },
        HybridConfig { bounces: Some(Bounces::Queued), path: RayPath::Query, ..first },
        HybridConfig { bounces: Some(Bounces::First), ..first },
    ];
    check(make, HybridSequence::wanted, &configs, HybridConfig { samples: 0, ..first });
}

#[test]
fn hybrid_oit_changes_samples_shadows_and_nodes() {
    let Some(ctx) = device() else { return };
    let make = |config: &HybridOitConfig| {
        HybridOitSequence::new(HybridOit::new(&ctx, &OitScene::default(), config).unwrap(), 1.0)
    };
    let first =
        HybridOitConfig { supersampling: 1, ..HybridOitConfig::new(paths(&ctx)[0], SIZE[0], SIZE[1]) };
    let configs = [
        first,
        HybridOitConfig { supersampling: 3, ..first },
        HybridOitConfig { shadow_rays: 1, ..first },
        HybridOitConfig { path: other_path(&ctx), ..first },
        HybridOitConfig { node_capacity: Some(0), ..first },
    ];
    let impossible = HybridOitConfig { supersampling: 9, ..first };
    check(make, HybridOitSequence::wanted, &configs, impossible);
}

#[test]
fn reflections_change_samples_angle_and_the_update_of_the_skin() {
    let Some(ctx) = device() else { return };
    let make = |config: &ReflectionsConfig| Reflections::new(&ctx, config).unwrap();
    let first = ReflectionsConfig { samples: 1, ..ReflectionsConfig::new(paths(&ctx)[0], SIZE[0], SIZE[1]) };
    let configs = [
        first,
        ReflectionsConfig { samples: 3, ..first },
        ReflectionsConfig { min_angle: 0.2, path: other_path(&ctx), ..first },
        ReflectionsConfig { skin_update: SkinUpdate::Rebuild, ..first },
    ];
    check(make, Reflections::wanted, &configs, ReflectionsConfig { samples: 0, ..first });
}
