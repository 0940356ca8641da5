//! The exponent of a power law through measured points.

/// Returns the exponent `e` of the law `cost = factor * size^e` that fits the larger half of the sizes best: least squares
/// of the logarithms. Constant parts of a cost dominate at small sizes, so those do not count. Points are pairs of size and
/// cost, by rising size. `None` for fewer than two points whose numbers are positive and finite.
pub(super) fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    let is_usable = |(size, cost): &&(f64, f64)| [size, cost].iter().all(|x| x.is_finite() && **x > 0.0);
    let usable: Vec<_> = points.iter().filter(is_usable).map(|(size, cost)| (size.ln(), cost.ln())).collect();
    let larger = &usable[usable.len() / 2..];
    let count = larger.len() as f64;
    let mean = |number: fn(&(f64, f64)) -> f64| larger.iter().map(number).sum::<f64>() / count;
    let (x, y) = (mean(|point| point.0), mean(|point| point.1));
    let spread: f64 = larger.iter().map(|point| (point.0 - x).powi(2)).sum();
    let joint: f64 = larger.iter().map(|point| (point.0 - x) * (point.1 - y)).sum();
    (larger.len() >= 2 && spread > 0.0).then(|| joint / spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fitted(cost: impl Fn(f64) -> f64) -> f64 {
        let points: Vec<_> = (0..7).map(|power| 10_f64.powi(power)).map(|size| (size, cost(size))).collect();
        exponent(&points).unwrap()
    }

    #[test]
    fn power_laws_give_their_exponents() {
        for expected in [-0.5, 0.0, 0.5, 1.0, 2.0] {
            assert!((fitted(|size| 37.0 * size.powf(expected)) - expected).abs() < 1e-9);
        }
        assert!((1.0..1.15).contains(&fitted(|size| size * (size + 1.0).ln())), "a sort");
        assert!((0.0..0.15).contains(&fitted(|size| 1.0 + size.ln())), "a search in a tree");
    }

    #[test]
    fn constant_parts_at_small_sizes_do_not_count() {
        assert!((fitted(|size| 500.0 + size) - 1.0).abs() < 0.08);
        assert!(fitted(|size| 20.0 + 1e-9 * size).abs() < 1e-4);
        assert!(fitted(|size| if size < 1000.0 { size } else { 7.0 }).abs() < 1e-9);
    }

    #[test]
    fn noise_around_a_constant_stays_far_below_the_limit() {
        let noisy = |size: f64| 10.0 * if (size.log10() as i32) % 2 == 0 { 1.1 } else { 0.9 };
        assert!(fitted(noisy).abs() < 0.05, "{}", fitted(noisy));
    }

    #[test]
    fn too_few_points_have_no_exponent() {
        assert_eq!(exponent(&[]), None);
        assert_eq!(exponent(&[(1.0, 2.0)]), None);
        assert_eq!(exponent(&[(1.0, 2.0), (1.0, 3.0), (1.0, 3.0)]), None);
        assert_eq!(exponent(&[(1.0, 0.0), (10.0, f64::NAN), (100.0, 3.0)]), None);
        assert_eq!(exponent(&[(1.0, 5.0), (10.0, 5.0)]), None, "the larger half of two is one");
    }
}
