//! A grouped bar chart as SVG.

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::error::PaperError;
use super::legend::{Area, Rgb, draw_title_and_legend};

/// A grouped bar chart.
pub(super) struct BarChart {
    pub(super) title: String,
    /// Label of the y axis.
    pub(super) axis: &'static str,
    /// Names of the colours.
    pub(super) legend: Vec<(String, Rgb)>,
    /// Horizontal reference lines.
    pub(super) levels: Vec<(f64, Rgb)>,
    pub(super) groups: Vec<Group>,
}

/// A group of bars.
pub(super) struct Group {
    /// Label below the group.
    pub(super) name: String,
    pub(super) bars: Vec<Bar>,
}

/// A stacked bar: its segments from the bottom.
pub(super) type Bar = Vec<(f64, Rgb)>;

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Height of the chart in pixels.
const HEIGHT: u32 = 460;
const MARGIN: u32 = 150;
const BAR_WIDTH: u32 = 11;
const GROUP_GAP: u32 = 16;

impl BarChart {
    /// Renders the chart as SVG.
    pub(super) fn svg(&self) -> Result<String, PaperError> {
        let mut text = String::new();
        self.draw(&mut text).map_err(|what| PaperError::Plot { name: self.title.clone(), what })?;
        Ok(text)
    }

    fn draw(&self, text: &mut String) -> Result<(), String> {
        let slots: usize = self.groups.iter().map(|group| group.bars.len()).sum();
        let width = MARGIN + slots as u32 * BAR_WIDTH + self.groups.len() as u32 * GROUP_GAP;
        let root = SVGBackend::with_string(text, (width.max(640), HEIGHT)).into_drawing_area();
        let area = draw_title_and_legend(&root, &self.title, &self.legend)?;
        let across = slots as f64 * f64::from(BAR_WIDTH) + self.groups.len() as f64 * f64::from(GROUP_GAP);
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .y_label_area_size(56)
            .x_label_area_size(110)
            .build_cartesian_2d(0.0..across.max(1.0), 0.0..self.top())
            .map_err(|error| error.to_string())?;
        let mut mesh = chart.configure_mesh();
        mesh.disable_x_mesh().disable_x_axis().y_desc(self.axis).light_line_style(WHITE);
        mesh.draw().map_err(|error| error.to_string())?;
        self.draw_bars(&mut chart, &root)?;
        self.draw_levels(&mut chart, across)?;
        root.present().map_err(|error| error.to_string())
    }

    /// Returns the upper end of the y axis.
    fn top(&self) -> f64 {
        let bars =
            self.groups.iter().flat_map(|group| &group.bars).map(|bar| bar.iter().map(|part| part.0).sum());
        let levels = self.levels.iter().map(|level| level.0);
        let highest = bars.chain(levels).filter(|value: &f64| value.is_finite()).fold(0.0, f64::max);
        if highest > 0.0 { 1.08 * highest } else { 1.0 }
    }

    fn draw_bars<'b>(&self, chart: &mut Chart<'_, 'b>, root: &Area<'b>) -> Result<(), String> {
        let label = ("sans-serif", 12).into_text_style(root).transform(FontTransform::Rotate90);
        let label = label.pos(Pos::new(HPos::Left, VPos::Center));
        let mut x = 0.5 * f64::from(GROUP_GAP);
        for group in &self.groups {
            let start = x;
            for bar in &group.bars {
                let mut bottom = 0.0;
                for &(value, (r, g, b)) in bar.iter().filter(|part| part.0.is_finite()) {
                    let bounds = [(x + 1.0, bottom), (x + f64::from(BAR_WIDTH) - 1.0, bottom + value)];
                    let part = Rectangle::new(bounds, RGBColor(r, g, b).filled());
                    chart.draw_series(std::iter::once(part)).map_err(|error| error.to_string())?;
                    bottom += value;
                }
                x += f64::from(BAR_WIDTH);
            }
            let (middle, floor) = chart.backend_coord(&(0.5 * (start + x), 0.0));
            let name = Text::new(group.name.clone(), (middle, floor + 6), label.clone());
            root.draw(&name).map_err(|error| error.to_string())?;
            x += f64::from(GROUP_GAP);
        }
        Ok(())
    }

    fn draw_levels(&self, chart: &mut Chart<'_, '_>, across: f64) -> Result<(), String> {
        for &(level, (r, g, b)) in &self.levels {
            let line = PathElement::new([(0.0, level), (across, level)], RGBColor(r, g, b).stroke_width(1));
            chart.draw_series(std::iter::once(line)).map_err(|error| error.to_string())?;
        }
        Ok(())
    }
}
