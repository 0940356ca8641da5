//! Numbers of many frames as curves, as SVG.

use plotters::prelude::*;

use super::bar_chart::Hue;
use super::error::PaperError;

/// Curves over the same frames.
pub(super) struct LineChart {
    pub(super) title: String,
    /// What is drawn upwards.
    pub(super) axis: &'static str,
    pub(super) curves: Vec<(String, Hue, Vec<f64>)>,
    /// Where something new begins: a frame, and its name.
    pub(super) marks: Vec<(usize, String)>,
}

/// Most points of a curve; of more frames, the least and the largest of each stretch are drawn.
const POINTS: usize = 1000;

impl LineChart {
    /// Draws it.
    pub(super) fn svg(&self) -> Result<String, PaperError> {
        let mut text = String::new();
        self.draw(&mut text).map_err(|what| PaperError::Plot { name: self.title.clone(), what })?;
        Ok(text)
    }

    fn draw(&self, text: &mut String) -> Result<(), String> {
        let root = SVGBackend::with_string(text, (960, 400)).into_drawing_area();
        root.fill(&WHITE).map_err(|error| error.to_string())?;
        let count = self.curves.iter().map(|curve| curve.2.len()).max().unwrap_or(0).max(2);
        let values = self.curves.iter().flat_map(|curve| &curve.2).copied().filter(|value| value.is_finite());
        let top = values.fold(0.0, f64::max).max(1e-6) * 1.15;
        let mut chart = ChartBuilder::on(&root)
            .caption(&self.title, ("sans-serif", 17))
            .margin(12)
            .y_label_area_size(56)
            .x_label_area_size(36)
            .build_cartesian_2d(0.0..(count - 1) as f64, 0.0..top)
            .map_err(|error| error.to_string())?;
        let mut mesh = chart.configure_mesh();
        mesh.disable_x_mesh()
            .light_line_style(WHITE)
            .x_desc("frame, one camera after the other")
            .y_desc(self.axis);
        mesh.x_label_formatter(&|frame| format!("{frame:.0}"));
        mesh.draw().map_err(|error| error.to_string())?;
        for (name, (r, g, b), values) in &self.curves {
            let color = RGBColor(*r, *g, *b);
            let curve = LineSeries::new(thinned(values), color.stroke_width(1));
            let drawn = chart.draw_series(curve).map_err(|error| error.to_string())?;
            drawn
                .label(name.clone())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2)));
        }
        for (frame, name) in &self.marks {
            let x = *frame as f64;
            let line = PathElement::new([(x, 0.0), (x, top)], RGBColor(190, 190, 190).stroke_width(1));
            chart.draw_series(std::iter::once(line)).map_err(|error| error.to_string())?;
            let (left, high) = chart.backend_coord(&(x, top));
            root.draw(&Text::new(name.clone(), (left + 4, high + 2), ("sans-serif", 12)))
                .map_err(|error| error.to_string())?;
        }
        let mut labels = chart.configure_series_labels();
        labels.background_style(WHITE.mix(0.8)).position(SeriesLabelPosition::LowerRight);
        labels.draw().map_err(|error| error.to_string())?;
        root.present().map_err(|error| error.to_string())
    }
}

/// At most [`POINTS`] points, the extremes among them.
fn thinned(values: &[f64]) -> Vec<(f64, f64)> {
    if values.len() <= POINTS {
        return values.iter().enumerate().map(|(frame, value)| (frame as f64, *value)).collect();
    }
    let stretch = values.len().div_ceil(POINTS / 2);
    let extremes = values.chunks(stretch).enumerate().flat_map(|(number, chunk)| {
        let least = chunk.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = chunk.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let start = (number * stretch) as f64;
        [(start, least), (start + 0.5 * chunk.len() as f64, largest)]
    });
    extremes.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_extremes() {
        let mut values = vec![1.0; 20_000];
        values[12_345] = 9.0;
        values[77] = 0.5;
        let points = thinned(&values);
        assert!(points.len() <= POINTS);
        assert!(points.iter().any(|point| point.1 == 9.0) && points.iter().any(|point| point.1 == 0.5));
        assert!(points.is_sorted_by(|a, b| a.0 < b.0));
        assert_eq!(thinned(&[1.0, 2.0]), [(0.0, 1.0), (1.0, 2.0)]);
    }
}
