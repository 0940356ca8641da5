//! Draws the title and the legend above a chart.

use plotters::coord::Shift;
use plotters::prelude::*;

/// A colour: red, green and blue.
pub(super) type Rgb = (u8, u8, u8);

/// Drawing area of a chart.
pub(super) type Area<'b> = DrawingArea<SVGBackend<'b>, Shift>;

/// Height of the legend in pixels.
const HEIGHT: i32 = 22;

/// Draws title and legend in the upper part of `root`, on white, and returns the remaining area.
pub(super) fn draw_title_and_legend<'b>(
    root: &Area<'b>,
    title: &str,
    legend: &[(String, Rgb)],
) -> Result<Area<'b>, String> {
    root.fill(&WHITE).map_err(|error| error.to_string())?;
    let below = root.titled(title, ("sans-serif", 17)).map_err(|error| error.to_string())?;
    let (strip, rest) = below.split_vertically(HEIGHT);
    let mut x = 70;
    for (name, (r, g, b)) in legend {
        let patch = Rectangle::new([(x, 5), (x + 10, 15)], RGBColor(*r, *g, *b).filled());
        strip.draw(&patch).map_err(|error| error.to_string())?;
        let text = Text::new(name.clone(), (x + 14, 4), ("sans-serif", 12));
        strip.draw(&text).map_err(|error| error.to_string())?;
        x += 32 + 6 * name.chars().count() as i32;
    }
    Ok(rest)
}
