//! GPUs that are known to have no units for ray tracing, though their driver offers it.

/// Vendor of the PCI ids of NVIDIA.
const NVIDIA: u32 = 0x10de;

/// Models with NVIDIA's chip GH100, which has no ray tracing cores (NVIDIA H100 Tensor Core GPU Architecture, 2022). On an H100 and an H200
/// frames by lowered pipelines took 0.5 to 1.2 times as long as by the driver's (docs/performance.md). Other chips were not measured, so they are not here.
const MODELS: [&str; 5] = ["H100", "H200", "H800", "H20", "GH200"];

/// Returns true for a device that has no units for ray tracing, by its name, such as `NVIDIA H100 80GB HBM3`.
pub(crate) fn are_missing(vendor_id: u32, device_name: &str) -> bool {
    vendor_id == NVIDIA && device_name.split_whitespace().any(|word| MODELS.contains(&word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_known_by_a_word_of_their_name() {
        for name in ["NVIDIA H100 80GB HBM3", "NVIDIA H100 PCIe", "NVIDIA H200", "NVIDIA GH200 480GB"] {
            assert!(are_missing(NVIDIA, name), "{name}");
        }
        for name in ["NVIDIA GeForce RTX 4090", "NVIDIA L40S", "NVIDIA A100-SXM4-40GB", "H100", ""] {
            assert!(!are_missing(if name == "H100" { 0x1002 } else { NVIDIA }, name), "{name}");
        }
    }
}
