//! Shrinks images row by row, by a triangle filter as wide as two texels of the result.
//!
//! A filtered texel is the mean of the source texels up to one texel of the result away from its centre, each weighted by how
//! close it is. Rows are filtered along themselves when they come, and added to the rows of the result that they reach. These
//! are three at a time at most, so that the filter needs the memory of a few rows.

use std::collections::VecDeque;

/// The source texels of a texel of the result along one axis: the first, and the weight of each.
struct Reach {
    first: usize,
    weights: Vec<f32>,
}

/// A filter that takes the rows of an image from the top and gives those of a smaller one.
pub struct Shrink {
    channels: usize,
    columns: Vec<Reach>,
    rows: Vec<Reach>,
    /// Rows taken.
    taken: usize,
    /// Rows given.
    given: usize,
    /// The last row taken, filtered along itself.
    filtered: Vec<f32>,
    /// Sums of the rows after those given.
    sums: VecDeque<Vec<f32>>,
    finished: Vec<u8>,
}

impl Shrink {
    /// Starts with no row of an image of `from` texels, which becomes one of `to`, no side of which is 0 or longer.
    /// Texels have `channels` samples.
    #[must_use]
    pub fn new(from: [u32; 2], to: [u32; 2], channels: usize) -> Self {
        let samples = to[0] as usize * channels;
        Self {
            channels,
            columns: reaches(from[0], to[0]),
            rows: reaches(from[1], to[1]),
            taken: 0,
            given: 0,
            filtered: vec![0.0; samples],
            sums: VecDeque::new(),
            finished: Vec::with_capacity(samples),
        }
    }

    /// Takes the next row, and gives those of the result that it completes, from the top. A row of the result is complete
    /// when at least as large a share of the source is taken.
    pub fn push(&mut self, row: &[u8], mut give: impl FnMut(&[u8])) {
        match self.channels {
            1 => filter_row::<1>(&self.columns, row, &mut self.filtered),
            2 => filter_row::<2>(&self.columns, row, &mut self.filtered),
            3 => filter_row::<3>(&self.columns, row, &mut self.filtered),
            _ => filter_row::<4>(&self.columns, row, &mut self.filtered),
        }
        for (place, reach) in self.rows.iter().enumerate().skip(self.given) {
            let Some(weight) = self.taken.checked_sub(reach.first) else { break };
            if place - self.given == self.sums.len() {
                self.sums.push_back(vec![0.0; self.filtered.len()]);
            }
            let weight = reach.weights.get(weight).copied().unwrap_or_default();
            let sum = &mut self.sums[place - self.given];
            sum.iter_mut().zip(&self.filtered).for_each(|(sum, sample)| *sum += weight * sample);
        }
        self.taken += 1;
        while self.rows.get(self.given).is_some_and(|reach| reach.first + reach.weights.len() <= self.taken) {
            let Some(sum) = self.sums.pop_front() else { break };
            self.finished.clear();
            self.finished.extend(sum.iter().map(|sample| sample.round().clamp(0.0, 255.0) as u8));
            give(&self.finished);
            self.given += 1;
        }
    }
}

/// Shrinks an image of `from` texels of 4 samples to `to`, in its own memory.
pub fn shrink_in_place(rgba: &mut Vec<u8>, from: [u32; 2], to: [u32; 2]) {
    let mut shrink = Shrink::new(from, to, 4);
    let length = 4 * from[0] as usize;
    let mut written = 0;
    let mut row = Vec::with_capacity(length);
    for start in (0..rgba.len()).step_by(length.max(1)) {
        row.clear();
        row.extend_from_slice(&rgba[start..rgba.len().min(start + length)]);
        // What is written lies in front of the rows that are still to be read.
        shrink.push(&row, |finished| {
            rgba[written..written + finished.len()].copy_from_slice(finished);
            written += finished.len();
        });
    }
    rgba.truncate(written);
    rgba.shrink_to_fit();
}

fn filter_row<const CHANNELS: usize>(columns: &[Reach], row: &[u8], filtered: &mut [f32]) {
    let texels = row.as_chunks::<CHANNELS>().0;
    for (reach, filtered) in columns.iter().zip(filtered.as_chunks_mut::<CHANNELS>().0) {
        let mut sum = [0.0; CHANNELS];
        for (texel, weight) in texels[reach.first..].iter().zip(&reach.weights) {
            for channel in 0..CHANNELS {
                sum[channel] += weight * f32::from(texel[channel]);
            }
        }
        *filtered = sum;
    }
}

/// The reach of each texel of the result along an axis.
fn reaches(from: u32, to: u32) -> Vec<Reach> {
    let ratio = f64::from(from) / f64::from(to.max(1));
    let width = ratio.max(1.0);
    (0..to)
        .map(|place| {
            let centre = (f64::from(place) + 0.5) * ratio;
            let first = ((centre - width).floor().max(0.0) as u32).min(from.saturating_sub(1));
            let end = ((centre + width).ceil() as u32).clamp(first + 1, from.max(first + 1));
            let weight = |i: u32| (1.0 - ((f64::from(i) + 0.5 - centre) / width).abs()).max(0.0);
            let sum: f64 = (first..end).map(weight).sum();
            let weights = (first..end).map(|i| (weight(i) / sum) as f32).collect();
            Reach { first: first as usize, weights }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use image::imageops::{self, FilterType};
    use proptest::prelude::*;

    use super::*;

    fn shrunk(rgba: &[u8], from: [u32; 2], to: [u32; 2]) -> Vec<u8> {
        let mut pixels = rgba.to_vec();
        shrink_in_place(&mut pixels, from, to);
        pixels
    }

    proptest! {
        #[test]
        fn results_are_those_of_the_triangle_filter_of_whole_images(
            from in prop::array::uniform2(1..40_u32),
            share in prop::array::uniform2(0.01..1.0_f64),
            seed: u32,
        ) {
            let to = [0, 1].map(|axis| ((f64::from(from[axis]) * share[axis]) as u32).max(1));
            let mut state = seed;
            let mut next = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            };
            let rgba: Vec<u8> = (0..from[0] * from[1] * 4).map(|_| next()).collect();
            let image = image::RgbaImage::from_raw(from[0], from[1], rgba.clone()).unwrap();
            let expected = imageops::resize(&image, to[0], to[1], FilterType::Triangle).into_raw();
            let found = shrunk(&rgba, from, to);
            prop_assert_eq!(found.len(), expected.len());
            for (found, expected) in found.iter().zip(expected) {
                prop_assert!(found.abs_diff(expected) <= 1, "{} and {}", found, expected);
            }
        }

        #[test]
        fn an_image_of_one_colour_keeps_it(from in prop::array::uniform2(1..300_u32), side in 1..50_u32) {
            let to = from.map(|length| length.min(side));
            let color = [10, 200, 30, 255];
            let found = shrunk(&color.repeat((from[0] * from[1]) as usize), from, to);
            prop_assert_eq!(found, color.repeat((to[0] * to[1]) as usize));
        }
    }

    #[test]
    fn few_lines_are_in_memory() {
        for (from, to) in [([9, 1_000], [3, 999]), ([9, 1_000], [9, 7]), ([1, 500], [1, 250])] {
            let mut shrink = Shrink::new(from, to, 1);
            let mut count = 0;
            for _ in 0..from[1] {
                shrink.push(&vec![7; from[0] as usize], |_| count += 1);
                assert!(shrink.sums.len() <= 3, "{}", shrink.sums.len());
            }
            assert_eq!((count, shrink.sums.len()), (to[1], 0));
        }
    }
}
