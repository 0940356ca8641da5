//! Splits an image into launches.

use std::ops::Range;

/// Rows of an image of `height` rows in launch_tiles of at most `rows` (0 counts as 1), from top to bottom.
pub(super) fn launch_tiles(height: u32, rows: u32) -> Vec<Range<u32>> {
    let rows = rows.max(1);
    (0..height.div_ceil(rows))
        .map(|tile| {
            let first = tile * rows;
            first..first.saturating_add(rows).min(height)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_short_image_is_one_tile() {
        for rows in [5, 64, u32::MAX] {
            let all = launch_tiles(5, rows);
            assert_eq!((all.len(), all[0].clone()), (1, 0..5));
        }
    }

    proptest! {
        #[test]
        fn tiles_cover_every_line_once(height in 0_u32..5000, rows in 0_u32..400) {
            let all = launch_tiles(height, rows);
            let covered: Vec<u32> = all.iter().cloned().flatten().collect();
            prop_assert_eq!(covered, (0..height).collect::<Vec<_>>());
            prop_assert!(all.iter().all(|tile| !tile.is_empty() && tile.len() as u32 <= rows.max(1)));
        }
    }
}
