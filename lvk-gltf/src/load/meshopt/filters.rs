//! Filters, which attributes pass after decoding, in place.

/// Unit vectors in two coordinates of an octahedron; the third component is the number that stands for 1.
pub(super) fn octahedral_8(elements: &mut [u8]) {
    for element in elements.as_chunks_mut::<4>().0 {
        let [x, y, one] = [element[0], element[1], element[2]].map(|byte| f32::from(byte as i8));
        let vector = octahedral(x, y, one, 127.0);
        element[..3].copy_from_slice(&vector.map(|component| component as i8 as u8));
    }
}

/// As [`octahedral_8`], with 16 bits.
pub(super) fn octahedral_16(elements: &mut [u8]) {
    for element in elements.as_chunks_mut::<8>().0 {
        let [x, y, one, _] = shorts(element).map(f32::from);
        let vector = octahedral(x, y, one, 32767.0);
        for (component, value) in element.as_chunks_mut::<2>().0.iter_mut().zip(vector) {
            *component = (value as i16).to_le_bytes();
        }
    }
}

fn octahedral(x: f32, y: f32, one: f32, most: f32) -> [f32; 3] {
    let z = one - x.abs() - y.abs();
    let fold = z.min(0.0);
    let x = x + if x >= 0.0 { fold } else { -fold };
    let y = y + if y >= 0.0 { fold } else { -fold };
    let length = (x * x + y * y + z * z).sqrt();
    let scale = if length > 0.0 { most / length } else { 0.0 };
    [x, y, z].map(|component| round(component * scale))
}

/// Unit quaternions without their largest component, whose index is in the last one's lowest two bits.
pub(super) fn quaternion(elements: &mut [u8]) {
    for element in elements.as_chunks_mut::<8>().0 {
        let [x, y, z, last] = shorts(element);
        let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(last | 3);
        let [x, y, z] = [x, y, z].map(|component| f32::from(component) * scale);
        let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
        let largest = (last & 3) as usize;
        let parts = element.as_chunks_mut::<2>().0;
        for (offset, component) in [w, x, y, z].into_iter().enumerate() {
            parts[(largest + offset) & 3] = (round(component * 32767.0) as i16).to_le_bytes();
        }
    }
}

/// Floats of a 24-bit integer and an 8-bit exponent.
pub(super) fn exponential(elements: &mut [u8]) {
    for element in elements.as_chunks_mut::<4>().0 {
        let bits = i32::from_le_bytes(*element);
        let (mantissa, exponent) = (bits << 8 >> 8, bits >> 24);
        *element = (mantissa as f32 * 2.0_f32.powi(exponent)).to_le_bytes();
    }
}

/// Colours in luma and two differences; the highest bit of alpha says how many bits there are.
pub(super) fn color_8(elements: &mut [u8]) {
    for element in elements.as_chunks_mut::<4>().0 {
        let [y, co, cg, alpha] = *element;
        let rgba = color([i32::from(y), i32::from(co as i8), i32::from(cg as i8), i32::from(alpha)], 255.0);
        *element = rgba.map(|component| component as u8);
    }
}

/// As [`color_8`], with 16 bits.
pub(super) fn color_16(elements: &mut [u8]) {
    for element in elements.as_chunks_mut::<8>().0 {
        let [y, co, cg, alpha] = shorts(element);
        let rgba =
            color([i32::from(y as u16), i32::from(co), i32::from(cg), i32::from(alpha as u16)], 65535.0);
        for (component, value) in element.as_chunks_mut::<2>().0.iter_mut().zip(rgba) {
            *component = (value as u16).to_le_bytes();
        }
    }
}

fn color([y, co, cg, alpha]: [i32; 4], most: f32) -> [f32; 4] {
    // The largest number of the bits that are in use: all bits from the highest one down.
    let mut range = alpha;
    for shift in [1, 2, 4, 8] {
        range |= range >> shift;
    }
    let alpha = alpha << 1 & range | alpha & 1;
    let scale = if range > 0 { most / range as f32 } else { 0.0 };
    [y + co - cg, y + cg, y - co - cg, alpha].map(|component| (component as f32 * scale + 0.5).floor())
}

fn round(number: f32) -> f32 {
    (number + if number >= 0.0 { 0.5 } else { -0.5 }).trunc()
}

fn shorts(element: &[u8; 8]) -> [i16; 4] {
    let parts = element.as_chunks::<2>().0;
    std::array::from_fn(|i| i16::from_le_bytes(parts[i]))
}
