//! Recompiles the shaders of a sample and of its panel.

use super::run_error::RunError;
use super::sample::Sample;
use super::ui::Painter;

/// Compiles the shaders of `sample` and of what paints over it anew. All of them are taken over, or none.
///
/// # Errors
/// Those of the shaders; the old pipelines then stay, of both.
pub fn reload<S: Sample>(sample: &mut S, painter: &mut Painter) -> Result<(), RunError> {
    let recompiled = painter.recompiled()?;
    sample.reload()?;
    painter.take_over(recompiled);
    Ok(())
}
