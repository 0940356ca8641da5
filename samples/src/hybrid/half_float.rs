//! Half-precision bits of a number, for textures that every device can filter.

/// IEEE 754 binary16 nearest to `value`, ties to even; values too large become infinite, NaN stays NaN.
pub(crate) fn half_bits(value: f32) -> u16 {
    let bits = value.to_bits();
    let sign = (bits >> 16 & 0x8000) as u16;
    let magnitude = bits & 0x7fff_ffff;
    if magnitude > 0x7f80_0000 {
        return sign | 0x7e00;
    }
    // 65520 is the first number that rounds to infinity.
    if magnitude >= 0x477f_f000 {
        return sign | 0x7c00;
    }
    if magnitude < 0x3880_0000 {
        // Below the smallest normal number a half counts units of 2^-24.
        let units = f32::from_bits(magnitude) * 16_777_216.0;
        return sign | units.round_ties_even() as u16;
    }
    let rebased = magnitude - (112 << 23);
    let odd = rebased >> 13 & 1;
    sign | ((rebased + 0x0fff + odd) >> 13) as u16
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn value(bits: u16) -> f64 {
        let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
        let mantissa = f64::from(bits & 0x3ff);
        match bits >> 10 & 31 {
            0 => sign * mantissa * 2.0_f64.powi(-24),
            31 if mantissa == 0.0 => sign * f64::INFINITY,
            31 => f64::NAN,
            exponent => sign * (1.0 + mantissa / 1024.0) * 2.0_f64.powi(i32::from(exponent) - 15),
        }
    }

    #[test]
    fn known_numbers() {
        for (number, bits) in [(0.0, 0), (-0.0, 0x8000), (1.0, 0x3c00), (-2.0, 0xc000), (65504.0, 0x7bff)] {
            assert_eq!(half_bits(number), bits, "{number}");
        }
        assert_eq!(half_bits(1e9), 0x7c00);
        assert_eq!(half_bits(f32::NAN) & 0x7fff, 0x7e00);
    }

    proptest! {
        #[test]
        fn no_other_half_is_nearer(number in -70000.0_f32..70000.0, exponent in -30_i32..1) {
            let number = number * 2.0_f32.powi(exponent);
            let bits = half_bits(number);
            let error = |bits| (value(bits) - f64::from(number)).abs();
            if value(bits).is_finite() {
                prop_assert!(error(bits) <= error(bits ^ 0x8000));
                prop_assert!(bits & 0x7fff == 0 || error(bits) <= error(bits - 1));
                prop_assert!(error(bits) <= error(bits + 1) || bits & 0x7fff == 0x7bff);
            } else {
                prop_assert!(number.abs() >= 65520.0);
            }
        }
    }
}
