//! The picture of both libraries against shadows that the CPU computes, without a message of the validation layer.
//! wgpu switches on core and synchronization validation, and reports a missing layer by a warning.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::sync::Mutex;

use lvk_wgpu_guest::{Guest, TRIANGLE};

const SIDE: u32 = 256;

/// Warnings and errors of this process.
static MESSAGES: Mutex<Vec<String>> = Mutex::new(Vec::new());

struct Log;

impl log::Log for Log {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.level() <= log::Level::Warn
    }

    fn log(&self, record: &log::Record<'_>) {
        if self.enabled(record.metadata()) {
            MESSAGES.lock().unwrap().push(format!("{}: {}", record.target(), record.args()));
        }
    }

    fn flush(&self) {}
}

/// Returns the distance of a point of the plane to the edge of the shadow, negative outside.
fn depth_in_shadow(point: [f64; 2], light: [f32; 3]) -> f64 {
    let corners = TRIANGLE.map(|corner| {
        let t = f64::from(corner[2]) / f64::from(light[2]);
        [0, 1].map(|axis| f64::from(corner[axis]) - t * f64::from(light[axis]))
    });
    let edge = |from: [f64; 2], to: [f64; 2]| {
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]);
        (along[0] * (point[1] - from[1]) - along[1] * (point[0] - from[0])) / length
    };
    (0..3).map(|i| edge(corners[i], corners[(i + 1) % 3])).fold(f64::INFINITY, f64::min)
}

/// Returns the pixel that the fragment shader of the sample writes.
fn expected(x: u32, y: u32, lit: bool) -> [u8; 3] {
    let tile = (x / 16 + y / 16) & 1 == 1;
    let color = if tile { [0.8, 0.8, 0.6] } else { [0.2, 0.4, 0.6] };
    color.map(|part: f64| (part * if lit { 1.0 } else { 0.25 } * 255.0).round() as u8)
}

/// Returns how many pixels are in the shadow.
fn compare(pixels: &[u8], light: [f32; 3]) -> usize {
    let mut shadowed = 0;
    assert_eq!(pixels.len(), (SIDE * SIDE * 4) as usize);
    for (index, pixel) in pixels.chunks(4).enumerate() {
        let (x, y) = (index as u32 % SIDE, index as u32 / SIDE);
        let ground = [x, y].map(|at| (f64::from(at) + 0.5) / f64::from(SIDE) * 2.0 - 1.0);
        let depth = depth_in_shadow(ground, light);
        shadowed += usize::from(depth > 0.0);
        if depth.abs() < 1e-4 {
            continue;
        }
        for (found, wanted) in pixel.iter().zip(expected(x, y, depth < 0.0)) {
            assert!(found.abs_diff(wanted) <= 1, "{light:?}, pixel {x}, {y}: {pixel:?}, depth {depth}");
        }
    }
    shadowed
}

#[test]
fn wgpu_draws_the_shadows_that_lvk_traces() {
    log::set_logger(&Log).unwrap();
    log::set_max_level(log::LevelFilter::Warn);
    let mut guest = Guest::new(SIDE, true).unwrap();
    for light in [[0.4, 0.3, 1.0], [-0.6, 0.2, 1.0], [0.0, 0.0, 1.0]] {
        let shadowed = compare(&guest.frame(light).unwrap(), light);
        assert!(shadowed > 5000, "{shadowed}");
    }
    drop(guest);
    assert_eq!(*MESSAGES.lock().unwrap(), [""; 0]);
}
