//! Writes all results as CSV.

use std::fmt::Write as _;

use super::measure::SceneResult;
use super::times::{Statistic, Times};

/// Names of the statistics in CSV files.
const STATISTICS: [(&str, Statistic); 5] = [
    ("average", Statistic::Average),
    ("best", Statistic::BEST),
    ("median", Statistic::MEDIAN),
    ("p99", Statistic::PERCENTILE_99),
    ("worst", Statistic::WORST),
];

/// Columns that [`numbers`] writes.
const NUMBERS: &str = "T_ms,t_a_ms,t_b_ms,t_ms,T_span_ms,t_span_ms";

/// Writes one line per scene, path, camera and statistic.
pub(super) fn times(scenes: &[SceneResult]) -> String {
    let mut text = format!("scene,path,camera,statistic,{NUMBERS},t_over_T,t_span_over_T_span,rasteriser\n");
    for scene in scenes {
        for cell in &scene.cells {
            for (name, statistic) in STATISTICS {
                let times = statistic.evaluate(&cell.frames);
                let (path, camera) = (cell.path.name(), cell.camera + 1);
                let numbers = numbers(&times);
                let _ = writeln!(
                    text,
                    "{},{path},{camera},{name},{numbers},{:.5},{:.5},{}",
                    quoted(&scene.name),
                    times.ratio(),
                    times.span_ratio(),
                    quoted(scene.rasteriser(cell.path))
                );
            }
        }
    }
    text
}

/// Writes one line per frame.
pub(super) fn frames(scenes: &[SceneResult]) -> String {
    let mut text = format!("scene,path,camera,frame,{NUMBERS}\n");
    for scene in scenes {
        let name = quoted(&scene.name);
        for cell in &scene.cells {
            let (path, camera) = (cell.path.name(), cell.camera + 1);
            for (frame, times) in cell.frames.iter().enumerate() {
                let _ = writeln!(text, "{name},{path},{camera},{frame},{}", numbers(times));
            }
        }
    }
    text
}

/// Writes one line per scene, path and camera.
pub(super) fn image_metrics(scenes: &[SceneResult]) -> String {
    let mut text = "scene,path,camera,psnr_db,lowest_psnr_db,ssim,differing_share\n".to_owned();
    for scene in scenes {
        for cell in &scene.cells {
            let metrics = &cell.metrics;
            let (name, path, camera) = (quoted(&scene.name), cell.path.name(), cell.camera + 1);
            let _ = writeln!(
                text,
                "{name},{path},{camera},{:.4},{:.4},{:.6},{:.8}",
                metrics.psnr, metrics.lowest_psnr, metrics.ssim, metrics.differing_share
            );
        }
    }
    text
}

fn numbers(times: &Times) -> String {
    let passes = [times.standalone, times.rays, times.geometry, times.hybrid()];
    let spans = [times.standalone_span, times.hybrid_span];
    passes.into_iter().chain(spans).map(|ms| format!("{ms:.6}")).collect::<Vec<_>>().join(",")
}

/// Quotes a name if it contains a CSV separator: names come from files.
fn quoted(name: &str) -> String {
    match name.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn names_with_commas_stay_one_value() {
        assert_eq!(super::quoted("a,\"b\""), "\"a,\"\"b\"\"\"");
        assert_eq!(super::quoted("living_room"), "living_room");
    }
}
