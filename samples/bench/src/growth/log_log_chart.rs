//! A chart of curves with logarithmic axes as SVG.

use plotters::prelude::*;

use super::curve::{Curve, Unit};
use crate::error::BenchError;

/// Size of the picture, and width of the legend at its right, in pixels.
const SIZE: (u32, u32) = (1120, 420);
const LEGEND: u32 = 430;
/// Pixels between the lines of the legend.
const LINE: i32 = 24;

/// A colour-blind-safe palette (after Okabe and Ito).
const COLORS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(213, 94, 0),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
    RGBColor(160, 140, 20),
];

/// Curves over the same sizes.
pub(super) struct LogLogChart<'a> {
    pub(super) title: String,
    /// Label of the x axis.
    pub(super) sizes: &'a str,
    pub(super) unit: Unit,
    pub(super) curves: Vec<&'a Curve>,
}

impl LogLogChart<'_> {
    /// Renders the chart as SVG.
    pub(super) fn svg(&self) -> Result<String, BenchError> {
        let mut text = String::new();
        self.draw(&mut text).map_err(|what| BenchError::Plot { name: self.title.clone(), what })?;
        Ok(text)
    }

    fn draw(&self, text: &mut String) -> Result<(), String> {
        let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
        root.fill(&WHITE).map_err(|error| error.to_string())?;
        let (area, legend) = root.split_horizontally(SIZE.0 - LEGEND);
        let area = area.titled(&self.title, ("sans-serif", 17)).map_err(|error| error.to_string())?;
        let [xs, ys] = [self.range(|point| point.0), self.range(|point| point.1)];
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .y_label_area_size(70)
            .x_label_area_size(40)
            .build_cartesian_2d((xs.0..xs.1).log_scale(), (ys.0..ys.1).log_scale())
            .map_err(|error| error.to_string())?;
        let mut mesh = chart.configure_mesh();
        mesh.max_light_lines(0).x_desc(self.sizes).y_desc(self.unit.axis());
        let cost = |y: &f64| self.cost_label(*y);
        mesh.x_label_formatter(&|x| label(*x)).y_label_formatter(&cost);
        mesh.draw().map_err(|error| error.to_string())?;
        for (curve, color) in self.curves.iter().zip(COLORS.iter().cycle()) {
            let points = || usable(curve);
            let line = LineSeries::new(points(), color.stroke_width(2));
            chart.draw_series(line).map_err(|error| error.to_string())?;
            let dots = points().map(|point| Circle::new(point, 3, color.filled()));
            chart.draw_series(dots).map_err(|error| error.to_string())?;
        }
        self.draw_legend(&legend)?;
        root.present().map_err(|error| error.to_string())
    }

    fn draw_legend(
        &self,
        legend: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    ) -> Result<(), String> {
        for (number, (curve, color)) in self.curves.iter().zip(COLORS.iter().cycle()).enumerate() {
            let y = 44 + LINE * number as i32;
            let patch = Rectangle::new([(4, y), (16, y + 12)], color.filled());
            legend.draw(&patch).map_err(|error| error.to_string())?;
            let exponent = curve.exponent().map_or_else(String::new, |e| format!(" (exponent {e:.2})"));
            let name = Text::new(format!("{}{exponent}", curve.name), (22, y), ("sans-serif", 13));
            legend.draw(&name).map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    /// Returns a label of the y axis.
    fn cost_label(&self, cost: f64) -> String {
        match self.unit {
            Unit::Milliseconds => {
                let units = [(1e3, "s"), (1.0, "ms"), (1e-3, "us"), (1e-6, "ns")];
                let (factor, unit) =
                    units.into_iter().find(|unit| cost >= 0.999 * unit.0).unwrap_or((1e-6, "ns"));
                format!("{} {unit}", rounded(cost / factor))
            }
            _ => label(cost),
        }
    }

    /// Returns the powers of ten around all numbers.
    fn range(&self, number: fn(&(f64, f64)) -> f64) -> (f64, f64) {
        let logs = self.curves.iter().flat_map(|curve| usable(curve)).map(|point| number(&point).log10());
        let (low, high) =
            logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        if low > high {
            return (1.0, 10.0);
        }
        let (low, high) = (low.floor(), high.ceil());
        (10_f64.powf(low), 10_f64.powf(high.max(low + 1.0)))
    }
}

/// Returns the points that have a logarithm.
fn usable(curve: &Curve) -> impl Iterator<Item = (f64, f64)> {
    let is_usable = |point: &(f64, f64)| [point.0, point.1].iter().all(|x| x.is_finite() && *x > 0.0);
    curve.points.iter().copied().filter(is_usable)
}

/// Returns a number with a prefix for thousands.
fn label(number: f64) -> String {
    match number {
        n if n >= 999_999.0 => format!("{} M", rounded(n * 1e-6)),
        n if n >= 999.9 => format!("{} k", rounded(n * 1e-3)),
        n => rounded(n),
    }
}

/// Returns at most one digit that is not zero behind the point.
fn rounded(number: f64) -> String {
    let digits = (-number.log10()).ceil().max(0.0) as usize;
    format!("{number:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::growth::curve::Expected;

    #[test]
    fn a_chart_has_a_dot_for_each_point_and_names_the_exponents() {
        let mut linear = Curve::new("linear & <large>", Unit::Milliseconds, Expected::Constant);
        [1, 10, 100, 1000].into_iter().for_each(|size| linear.push(size, 1e-3 * size as f64));
        let mut flawed = Curve::new("flawed", Unit::Milliseconds, Expected::Constant);
        [(1, 0.0), (10, f64::NAN), (100, 5.0)].into_iter().for_each(|(size, cost)| flawed.push(size, cost));
        let curves = vec![&linear, &flawed];
        let unit = Unit::Milliseconds;
        let chart = LogLogChart { title: "costs".to_owned(), sizes: "sizes", unit, curves };
        let svg = chart.svg().unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{svg}");
        assert_eq!(svg.matches("<circle").count(), 5);
        assert!(svg.contains("linear &amp; &lt;large&gt; (exponent 1.00)") && !svg.contains("NaN"), "{svg}");
    }

    #[test]
    fn a_chart_without_points_is_empty() {
        let chart = LogLogChart { title: String::new(), sizes: "n", unit: Unit::Count, curves: Vec::new() };
        assert_eq!(chart.svg().unwrap().matches("<circle").count(), 0);
    }

    #[test]
    fn labels_are_short() {
        let labels = [1e-5, 0.01, 1.0, 100.0, 1e3, 1e5, 1e6, 1e7].map(label);
        assert_eq!(labels, ["0.00001", "0.01", "1", "100", "1 k", "100 k", "1 M", "10 M"]);
        let unit = Unit::Milliseconds;
        let chart = LogLogChart { title: String::new(), sizes: "n", unit, curves: Vec::new() };
        let times = [1e-7, 1e-5, 1e-3, 0.1, 10.0, 1e5].map(|cost| chart.cost_label(cost));
        assert_eq!(times, ["0.1 ns", "10 ns", "1 us", "100 us", "10 ms", "100 s"]);
    }
}
