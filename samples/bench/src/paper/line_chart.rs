//! A line chart of values per frame as SVG.

use plotters::prelude::*;

use super::error::PaperError;
use super::legend::{Rgb, draw_title_and_legend};

/// Curves over the same frames, with a gap between segments.
pub(super) struct LineChart {
    pub(super) title: String,
    /// Label of the y axis.
    pub(super) axis: &'static str,
    /// Name, colour, and the values of each segment of frames.
    pub(super) curves: Vec<(String, Rgb, Vec<Vec<f64>>)>,
    /// Names of the segments.
    pub(super) segments: Vec<String>,
}

/// Maximum number of points per curve. A longer curve shows the minimum and maximum of each interval.
const POINTS: usize = 1000;

impl LineChart {
    /// Renders the chart as SVG.
    pub(super) fn svg(&self) -> Result<String, PaperError> {
        let mut text = String::new();
        self.draw(&mut text).map_err(|what| PaperError::Plot { name: self.title.clone(), what })?;
        Ok(text)
    }

    fn draw(&self, text: &mut String) -> Result<(), String> {
        let root = SVGBackend::with_string(text, (960, 400)).into_drawing_area();
        let legend: Vec<_> = self.curves.iter().map(|(name, hue, _)| (name.clone(), *hue)).collect();
        let area = draw_title_and_legend(&root, &self.title, &legend)?;
        let starts = self.starts();
        let count = starts.last().copied().unwrap_or(0).max(2);
        let top = self.top();
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .y_label_area_size(56)
            .x_label_area_size(36)
            .build_cartesian_2d(0.0..(count - 1) as f64, 0.0..top)
            .map_err(|error| error.to_string())?;
        let mut mesh = chart.configure_mesh();
        mesh.disable_x_mesh().light_line_style(WHITE).x_desc("frame, cameras in sequence").y_desc(self.axis);
        mesh.x_label_formatter(&|frame| format!("{frame:.0}"));
        mesh.draw().map_err(|error| error.to_string())?;
        for (_, (r, g, b), segments) in &self.curves {
            let style = RGBColor(*r, *g, *b).stroke_width(1);
            for (values, start) in segments.iter().zip(&starts) {
                let points = downsample(values, POINTS / segments.len().max(1));
                let points = points.into_iter().map(|(frame, value)| (frame + *start as f64, value));
                chart.draw_series(LineSeries::new(points, style)).map_err(|error| error.to_string())?;
            }
        }
        for (name, start) in self.segments.iter().zip(&starts) {
            let x = *start as f64;
            let line = PathElement::new([(x, 0.0), (x, top)], RGBColor(190, 190, 190).stroke_width(1));
            chart.draw_series(std::iter::once(line)).map_err(|error| error.to_string())?;
            let (left, high) = chart.backend_coord(&(x, top));
            let name = Text::new(name.clone(), (left + 4, high + 2), ("sans-serif", 12));
            root.draw(&name).map_err(|error| error.to_string())?;
        }
        root.present().map_err(|error| error.to_string())
    }

    /// Returns the first frame of each segment, then the end.
    fn starts(&self) -> Vec<usize> {
        let lengths = self.curves.first().into_iter().flat_map(|curve| curve.2.iter().map(Vec::len));
        let mut starts = vec![0];
        for length in lengths {
            starts.push(starts.last().copied().unwrap_or(0) + length);
        }
        starts
    }

    /// Returns the upper end of the y axis.
    fn top(&self) -> f64 {
        let values = self.curves.iter().flat_map(|curve| curve.2.iter().flatten()).copied();
        1.15 * values.filter(|value| value.is_finite()).fold(1e-6, f64::max)
    }
}

/// Reduces the values to about `most` points that include the extremes.
fn downsample(values: &[f64], most: usize) -> Vec<(f64, f64)> {
    if values.len() <= most {
        return values.iter().enumerate().map(|(frame, value)| (frame as f64, *value)).collect();
    }
    let interval = values.len().div_ceil((most / 2).max(1));
    let extremes = values.chunks(interval).enumerate().flat_map(|(number, chunk)| {
        let least = chunk.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = chunk.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let start = (number * interval) as f64;
        [(start, least), (start + 0.5 * chunk.len() as f64, largest)]
    });
    extremes.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn downsampling_keeps_the_extremes() {
        let mut values = vec![1.0; 20_000];
        values[12_345] = 9.0;
        values[77] = 0.5;
        let points = downsample(&values, 1000);
        assert!(points.len() <= 1000);
        assert!(points.iter().any(|point| point.1 == 9.0) && points.iter().any(|point| point.1 == 0.5));
        assert!(points.is_sorted_by(|a, b| a.0 < b.0));
        assert_eq!(downsample(&[1.0, 2.0], 1000), [(0.0, 1.0), (1.0, 2.0)]);
    }
}
