//! GPUs on which lowered ray tracing pipelines are faster than the driver's.

/// PCI id of the vendor NVIDIA.
const NVIDIA: u32 = 0x10de;

/// Models with NVIDIA's chip GH100, which has no ray tracing cores (NVIDIA H100 Tensor Core GPU Architecture, 2022). On an H100, frames by
/// lowered pipelines took 0.5 to 1.2 times as long as by the driver's, and four of five were faster (docs/performance.md). The others have the
/// same chip. Further chips without such cores, as GA100, were not measured, so they are not here.
const MODELS: [&str; 5] = ["H100", "H200", "H800", "H20", "GH200"];

/// Returns true for a device of these models, by its name, as `NVIDIA H100 80GB HBM3`, or `NVIDIA H100-80C` of a virtual GPU.
pub(crate) fn is_preferred(vendor_id: u32, device_name: &str) -> bool {
    let mut words = device_name.split([' ', '-']);
    vendor_id == NVIDIA && words.any(|word| MODELS.contains(&word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_known_by_a_word_of_their_name() {
        for name in ["NVIDIA H100 80GB HBM3", "NVIDIA H100-80C", "NVIDIA H20-3e", "NVIDIA GH200 480GB"] {
            assert!(is_preferred(NVIDIA, name), "{name}");
        }
        for name in ["NVIDIA GeForce RTX 4090", "NVIDIA L40S", "NVIDIA A100-SXM4-40GB", ""] {
            assert!(!is_preferred(NVIDIA, name), "{name}");
        }
        assert!(!is_preferred(0x1002, "H100"), "another vendor");
    }
}
