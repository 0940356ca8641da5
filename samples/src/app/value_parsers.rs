//! Parsers of numbers on command lines.

use std::ops::RangeInclusive;

use clap::builder::RangedI64ValueParser;

/// Accepts whole numbers in `range`.
#[must_use]
pub fn whole(range: RangeInclusive<u32>) -> RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(i64::from(*range.start())..=i64::from(*range.end()))
}

/// Accepts numbers from 0 to `max`.
pub fn up_to(max: f32) -> impl Fn(&str) -> Result<f32, String> + Clone {
    move |text| match text.parse::<f32>() {
        Ok(value) if (0.0..=max).contains(&value) => Ok(value),
        _ => Err(format!("a number from 0 to {max} is needed")),
    }
}

/// Accepts finite numbers above 0.
///
/// # Errors
/// Says what is needed.
pub fn positive(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("a positive number is needed".to_owned()),
    }
}
