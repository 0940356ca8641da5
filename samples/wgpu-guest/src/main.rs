//! Writes a picture of wgpu with ray traced shadows of `lvk` to `wgpu_guest.ppm`.

use lvk_wgpu_guest::{Error, Guest};

fn main() -> Result<(), Error> {
    let side = 512;
    let pixels = Guest::new(side, false)?.frame([0.4, 0.3, 1.0])?;
    let rgb: Vec<u8> = pixels.chunks(4).flat_map(|pixel| &pixel[..3]).copied().collect();
    let header = format!("P6 {side} {side} 255\n");
    std::fs::write("wgpu_guest.ppm", [header.as_bytes(), &rgb].concat())?;
    println!("wrote wgpu_guest.ppm");
    Ok(())
}
