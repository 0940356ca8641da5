//! The numbers that Kim and Baek published, for comparison: "A Hybrid Approach for Vulkan-Based Ray Tracing
//! Implementations", Revista Internacional de Métodos Numéricos para Cálculo y Diseño en Ingeniería, 2026,
//! doi:10.23967/j.rimni.2026.10.72287, Tables 1 to 8. Images of 1280 x 720, 4000 frames.

use super::times::Times;

/// A scene of the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PublishedScene {
    /// Name in the paper.
    pub(super) name: &'static str,
    /// Number in Table 1.
    pub(super) vertices: u64,
    /// Number in Table 1.
    pub(super) faces: u64,
    index: usize,
}

/// One of the paper's tables of times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TimesTable {
    /// Number of the table.
    pub(super) number: u32,
    /// Name of the GPU.
    pub(super) card: &'static str,
    rows: &'static [[[f64; 3]; 5]; 3],
    means: &'static [[f64; 3]; 3],
}

/// Table 3, averages.
pub(super) const AVERAGE: TimesTable =
    TimesTable { number: 3, card: "RTX 3060", rows: &TABLE_3, means: &MEANS_3 };
/// Table 4, best frames.
pub(super) const BEST: TimesTable =
    TimesTable { number: 4, card: "RTX 3060", rows: &TABLE_4, means: &MEANS_4 };
/// Table 5, worst frames.
pub(super) const WORST: TimesTable =
    TimesTable { number: 5, card: "RTX 3060", rows: &TABLE_5, means: &MEANS_5 };
/// Table 6, averages.
pub(super) const RTX_2080: TimesTable =
    TimesTable { number: 6, card: "RTX 2080", rows: &TABLE_6, means: &MEANS_6 };
/// Table 7, averages.
pub(super) const RX_6600: TimesTable =
    TimesTable { number: 7, card: "RX 6600", rows: &TABLE_7, means: &MEANS_7 };
/// The tables that Table 8 compares.
pub(super) const CARDS: [TimesTable; 3] = [AVERAGE, RTX_2080, RX_6600];

impl PublishedScene {
    /// Finds the paper's scene by `name`. The kitchen replaces the gallery.
    pub(super) fn find(name: &str) -> Option<Self> {
        let index = match name {
            "living_room" => 0,
            "conference" => 1,
            "gallery" | "kitchen" => 2,
            _ => return None,
        };
        Some(SCENES[index])
    }

    /// Returns PSNR in dB and SSIM of Table 2 for a camera, 0 to 4.
    pub(super) fn metrics(&self, camera: usize) -> Option<(f64, f64)> {
        TABLE_2[self.index].get(camera).copied()
    }

    /// Returns the averages of PSNR in dB and SSIM over the cameras.
    pub(super) fn mean_metrics(&self) -> (f64, f64) {
        let rows = &TABLE_2[self.index];
        let mean = |number: fn(&(f64, f64)) -> f64| rows.iter().map(number).sum::<f64>() / rows.len() as f64;
        (mean(|row| row.0), mean(|row| row.1))
    }
}

impl TimesTable {
    /// Returns the row of a camera, 0 to 4.
    pub(super) fn times(&self, scene: &PublishedScene, camera: usize) -> Option<Times> {
        let &[standalone, rays, geometry] = self.rows[scene.index].get(camera)?;
        Some(Times { standalone, rays, geometry, ..Times::default() })
    }

    /// Returns the average over the cameras, as printed in the paper.
    pub(super) fn mean(&self, scene: &PublishedScene) -> Times {
        let [standalone, rays, geometry] = self.means[scene.index];
        Times { standalone, rays, geometry, ..Times::default() }
    }
}

const SCENES: [PublishedScene; 3] = [
    PublishedScene { name: "Living room", vertices: 548_894, faces: 594_167, index: 0 },
    PublishedScene { name: "Conference", vertices: 1_338_208, faces: 1_139_971, index: 1 },
    PublishedScene { name: "Gallery", vertices: 648_417, faces: 998_831, index: 2 },
];

/// PSNR in dB and SSIM by scene and camera.
const TABLE_2: [[(f64, f64); 5]; 3] = [
    [(45.2522, 0.9858), (45.8928, 0.9902), (46.6574, 0.9892), (46.6539, 0.9899), (47.0252, 0.9910)],
    [(61.3537, 0.9996), (60.5829, 0.9994), (50.9742, 0.9954), (48.1698, 0.9892), (54.4251, 0.9986)],
    [(42.1382, 0.9738), (38.4030, 0.9484), (37.5145, 0.9436), (37.6100, 0.9418), (38.0405, 0.9529)],
];

// Milliseconds by scene and camera: stand-alone T, ray pass t_a, geometry t_b; and the rows called average.
const MEANS_3: [[f64; 3]; 3] = [[0.653, 0.335, 0.363], [0.709, 0.400, 0.653], [0.755, 0.366, 0.645]];
#[rustfmt::skip]
const TABLE_3: [[[f64; 3]; 5]; 3] = [
    [[0.577, 0.269, 0.326], [0.621, 0.316, 0.348], [0.527, 0.207, 0.411], [0.491, 0.212, 0.363], [1.047, 0.672, 0.366]],
    [[0.546, 0.270, 0.602], [0.530, 0.250, 0.576], [0.915, 0.589, 0.756], [0.845, 0.496, 0.675], [0.708, 0.394, 0.654]],
    [[0.678, 0.392, 0.576], [0.762, 0.354, 0.657], [0.781, 0.400, 0.646], [0.810, 0.350, 0.699], [0.746, 0.333, 0.645]],
];
const MEANS_4: [[f64; 3]; 3] = [[0.642, 0.328, 0.358], [0.700, 0.382, 0.647], [0.749, 0.357, 0.631]];
#[rustfmt::skip]
const TABLE_4: [[[f64; 3]; 5]; 3] = [
    [[0.570, 0.265, 0.322], [0.612, 0.308, 0.345], [0.520, 0.204, 0.405], [0.484, 0.209, 0.356], [1.025, 0.653, 0.362]],
    [[0.539, 0.262, 0.593], [0.523, 0.242, 0.571], [0.904, 0.565, 0.749], [0.834, 0.473, 0.671], [0.699, 0.370, 0.649]],
    [[0.673, 0.384, 0.564], [0.754, 0.350, 0.644], [0.773, 0.385, 0.627], [0.804, 0.338, 0.684], [0.740, 0.330, 0.637]],
];
const MEANS_5: [[f64; 3]; 3] = [[0.780, 0.434, 0.389], [0.769, 0.665, 0.701], [0.785, 0.798, 0.703]];
#[rustfmt::skip]
const TABLE_5: [[[f64; 3]; 5]; 3] = [
    [[0.622, 0.291, 0.347], [0.667, 0.343, 0.372], [0.572, 0.225, 0.450], [0.534, 0.230, 0.388], [1.505, 1.082, 0.390]],
    [[0.598, 0.292, 0.650], [0.580, 0.271, 0.618], [0.978, 1.018, 0.810], [0.917, 0.929, 0.723], [0.773, 0.817, 0.703]],
    [[0.683, 0.845, 0.737], [0.815, 0.795, 0.699], [0.801, 0.833, 0.694], [0.845, 0.722, 0.695], [0.779, 0.795, 0.691]],
];
const MEANS_6: [[f64; 3]; 3] = [[0.580, 0.309, 0.323], [0.692, 0.431, 0.531], [0.771, 0.322, 0.463]];
#[expect(clippy::approx_constant, reason = "milliseconds that are near 1/pi by chance")]
#[rustfmt::skip]
const TABLE_6: [[[f64; 3]; 5]; 3] = [
    [[0.529, 0.261, 0.296], [0.588, 0.310, 0.299], [0.439, 0.189, 0.376], [0.430, 0.195, 0.326], [0.912, 0.591, 0.318]],
    [[0.505, 0.279, 0.502], [0.488, 0.256, 0.473], [0.989, 0.682, 0.559], [0.797, 0.531, 0.564], [0.683, 0.405, 0.557]],
    [[0.593, 0.331, 0.409], [0.792, 0.317, 0.476], [0.806, 0.343, 0.471], [0.885, 0.319, 0.489], [0.777, 0.302, 0.470]],
];
const MEANS_7: [[f64; 3]; 3] = [[2.041, 1.056, 0.523], [2.698, 1.415, 0.832], [2.852, 1.184, 0.876]];
#[rustfmt::skip]
const TABLE_7: [[[f64; 3]; 5]; 3] = [
    [[2.079, 0.924, 0.515], [2.123, 1.069, 0.507], [1.421, 0.590, 0.561], [1.447, 0.612, 0.536], [3.133, 2.085, 0.497]],
    [[1.955, 0.922, 0.797], [1.901, 0.800, 0.793], [3.843, 2.238, 0.874], [3.209, 1.819, 0.865], [2.584, 1.299, 0.833]],
    [[2.313, 1.110, 0.659], [2.910, 1.193, 0.933], [3.016, 1.262, 0.919], [3.157, 1.231, 0.972], [2.866, 1.126, 0.900]],
];

#[cfg(test)]
mod tests {
    use super::*;

    /// The columns t and t/T are not transcribed.
    #[test]
    fn these_numbers_are_consistent_with_the_papers_averages() {
        for table in [AVERAGE, BEST, WORST, RTX_2080, RX_6600] {
            for scene in &SCENES {
                let rows: Vec<Times> = (0..5).filter_map(|camera| table.times(scene, camera)).collect();
                let (found, printed) = (Times::mean(&rows), table.mean(scene));
                for (found, printed) in [
                    (found.standalone, printed.standalone),
                    (found.rays, printed.rays),
                    (found.geometry, printed.geometry),
                ] {
                    assert!((found - printed).abs() < 0.0011, "table {}: {found} {printed}", table.number);
                }
            }
        }
        let ratios =
            [(AVERAGE, 0, 0, 1.031), (WORST, 2, 0, 2.316), (RX_6600, 2, 3, 0.698), (RTX_2080, 1, 0, 1.546)];
        for (table, scene, camera, ratio) in ratios {
            let found = table.times(&SCENES[scene], camera).unwrap().ratio();
            assert!((found - ratio).abs() < 0.0015, "{found} {ratio}");
        }
        for (scene, psnr, ssim) in [(0, 46.2963, 0.9892), (1, 55.1011, 0.9964), (2, 38.7412, 0.9521)] {
            let (found_psnr, found_ssim) = SCENES[scene].mean_metrics();
            assert!(
                (found_psnr - psnr).abs() < 1e-3 && (found_ssim - ssim).abs() < 1e-3,
                "{found_psnr} {found_ssim}"
            );
        }
    }

    #[test]
    fn the_kitchen_replaces_the_gallery_and_other_names_are_unknown() {
        assert_eq!(PublishedScene::find("kitchen").unwrap().name, "Gallery");
        assert_eq!(PublishedScene::find("courtyard"), None);
    }
}
