//! Times in which something works.

/// Returns the length of the union of intervals, each from its first to its second time.
pub(crate) fn union_length(mut intervals: Vec<[u64; 2]>) -> u64 {
    intervals.sort_unstable();
    let (mut sum, mut end) = (0, 0);
    for [from, to] in intervals {
        sum += to.saturating_sub(from.max(end));
        end = end.max(to);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::union_length;

    #[test]
    fn overlapping_intervals_count_once() {
        assert_eq!(union_length(Vec::new()), 0);
        assert_eq!(union_length(vec![[10, 14]]), 4);
        assert_eq!(union_length(vec![[20, 25], [10, 14]]), 9, "a gap between two");
        assert_eq!(
            union_length(vec![[10, 20], [15, 30], [12, 13]]),
            20,
            "one within another, and one that goes on"
        );
        assert_eq!(union_length(vec![[10, 14], [14, 16]]), 6);
        assert_eq!(union_length(vec![[14, 10]]), 0, "a clock that went back");
    }
}
