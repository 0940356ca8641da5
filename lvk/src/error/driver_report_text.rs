//! The texts of reports and of their errors: what was found, then the remedies.

use std::fmt;

use super::device_candidate::DeviceCandidate;
use super::driver_remedies::driver_remedies;
use super::driver_report::{DriverManifest, DriverReport, VulkanReport};
use super::readable::readable_line;

impl fmt::Display for DriverReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_lines(out, self.lines(), driver_remedies(self, false))
    }
}

impl fmt::Display for VulkanReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut lines = self.drivers.lines();
        lines.extend(self.devices.iter().map(DeviceCandidate::to_string));
        write_lines(out, lines, driver_remedies(&self.drivers, !self.devices.is_empty()))
    }
}

/// Writes lines and remedies: one below the other in the alternate form, else in one line.
fn write_lines(out: &mut fmt::Formatter<'_>, mut lines: Vec<String>, remedies: Vec<String>) -> fmt::Result {
    lines.extend(remedies.into_iter().map(|remedy| format!("remedy: {remedy}")));
    let lines = lines.iter().map(|line| readable_line(&one_line(line)));
    out.write_str(&lines.collect::<Vec<_>>().join(if out.alternate() { "\n" } else { "; " }))
}

/// Joins the lines of a text, as errors of the dynamic linker may have several. The spaces within a line stay, as paths may
/// have them.
fn one_line(text: &str) -> String {
    let lines = text.split(['\n', '\r']).map(str::trim).filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join(" ")
}

/// Writes the text of [`Error::NoDevice`](super::Error::NoDevice) behind its headline.
pub(super) fn no_device_text(
    problem: Option<&str>,
    candidates: &[DeviceCandidate],
    drivers: Option<&DriverReport>,
) -> String {
    let mut parts: Vec<String> = problem.map(str::to_owned).into_iter().collect();
    parts.extend(candidates.iter().map(DeviceCandidate::to_string));
    if let Some(drivers) = drivers
        && (problem.is_none() || drivers.manifests.iter().any(DriverManifest::is_broken))
    {
        parts.extend(drivers.absences());
        let remedies = driver_remedies(drivers, true);
        parts.extend(remedies.into_iter().map(|remedy| format!("remedy: {remedy}")));
    }
    let lacks = |what: &str| candidates.iter().any(|device| device.missing.iter().any(|name| name == what));
    match problem {
        Some(_) => {}
        None if lacks("Vulkan 1.3") => parts.push("remedy: update the drivers to Vulkan 1.3".to_owned()),
        None => parts.push(
            "remedy: use another device or a newer driver, or do without the features that are lacking"
                .to_owned(),
        ),
    }
    parts.iter().map(|part| one_line(part)).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::super::device_candidate::DeviceKind;
    use super::super::driver_report::{LoaderReport, ManifestOutcome, SearchedPath};
    use super::*;

    fn report(loader_opens: bool, manifests: Vec<DriverManifest>) -> DriverReport {
        let path = "libvulkan.so.1".into();
        let loader = if loader_opens {
            LoaderReport::Opened { path, version: Some((1, 3, 239)) }
        } else {
            LoaderReport::NotOpened { path, error: "no such\n\tfile".to_owned() }
        };
        let searched = vec![
            SearchedPath { path: "/etc/vulkan/icd.d".into(), variable: None },
            SearchedPath { path: "/a.json".into(), variable: Some("VK_DRIVER_FILES") },
        ];
        DriverReport { loader, failure: None, searched, manifests }
    }

    fn nvidia(outcome: ManifestOutcome) -> DriverManifest {
        DriverManifest {
            path: "/etc/vulkan/icd.d/nvidia_icd.json".into(),
            library: Some("libGLX_nvidia.so.0".into()),
            api_version: Some("1.4.312".to_owned()),
            outcome,
        }
    }

    fn no_x11() -> DriverManifest {
        let error = "libX11.so.6: cannot open shared object file: No such file or directory".to_owned();
        nvidia(ManifestOutcome::LoadFailed { error })
    }

    fn device(missing: &[&str]) -> DeviceCandidate {
        let missing = missing.iter().map(|what| (*what).to_owned()).collect();
        let (name, driver) = ("Toy".to_owned(), "toys 1.2".to_owned());
        DeviceCandidate { index: 0, name, kind: DeviceKind::Cpu, api_version: (1, 3, 5), driver, missing }
    }

    #[test]
    fn machine_without_a_loader_still_names_its_drivers() {
        let text = report(false, vec![nvidia(ManifestOutcome::Loaded)]).to_string();
        let parts: Vec<_> = text.split("; ").collect();
        assert_eq!(parts[0], "the loader libvulkan.so.1 cannot be opened: no such file");
        assert_eq!(
            parts[1],
            "the driver manifest /etc/vulkan/icd.d/nvidia_icd.json names libGLX_nvidia.so.0 for Vulkan 1.4.312, which \
             can be loaded"
        );
        assert!(parts[2].starts_with("remedy: install"), "{text}");
        assert_eq!(parts.len(), 3, "{text}");
    }

    #[test]
    fn alternate_form_has_a_line_for_each_item() {
        let report =
            VulkanReport { drivers: report(true, vec![no_x11()]), devices: vec![device(&["wings"])] };
        let text = format!("{report:#}");
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines[0], "the loader libvulkan.so.1 offers Vulkan 1.3.239");
        assert!(lines[1].contains("which cannot be loaded: libX11.so.6: cannot open"), "{text}");
        assert_eq!(lines[2], "[0] Toy (CPU, Vulkan 1.3.5, toys 1.2): lacks wings");
        assert!(lines[3].starts_with("remedy: ") && lines[3].contains("libX11.so.6"), "{text}");
        assert_eq!(format!("{report}"), text.replace('\n', "; "));
    }

    #[test]
    fn paths_keep_their_spaces() {
        let mut report = report(true, vec![nvidia(ManifestOutcome::Loaded)]);
        report.manifests[0].path = "/my  drivers/a.json".into();
        assert!(report.to_string().contains("manifest /my  drivers/a.json names"), "{report}");
        let text = no_device_text(Some("'a  b' names\r\n no device"), &[], Some(&report));
        assert_eq!(text, "'a  b' names no device");
    }

    #[test]
    fn search_without_a_result_is_told() {
        let text = report(true, Vec::new()).to_string();
        assert!(text.contains("no driver manifest in /etc/vulkan/icd.d, VK_DRIVER_FILES=/a.json"), "{text}");
    }

    #[test]
    fn loader_older_than_needed_says_so() {
        let mut report = report(true, vec![nvidia(ManifestOutcome::Loaded)]);
        report.loader = LoaderReport::Opened { path: "/lib/l.so".into(), version: Some((1, 2, 131)) };
        let text = report.to_string();
        assert!(text.starts_with("the loader /lib/l.so offers Vulkan 1.2.131, 1.3 is needed; "), "{text}");
    }

    #[test]
    fn loader_whose_version_is_unknown_is_not_too_old() {
        let mut report = report(true, vec![nvidia(ManifestOutcome::Loaded)]);
        report.loader = LoaderReport::Opened { path: "/lib/l.so".into(), version: None };
        let text = report.to_string();
        assert!(text.starts_with("the loader /lib/l.so does not tell its version; "), "{text}");
        assert!(!report.loader.is_too_old() && !text.contains("update the loader"), "{text}");
    }

    #[test]
    fn summary_is_the_first_reason() {
        let summary = |drivers, devices| VulkanReport { drivers, devices }.summary();
        let loader = summary(report(false, vec![no_x11()]), Vec::new());
        assert_eq!(loader, "the Vulkan loader libvulkan.so.1 cannot be opened");
        assert_eq!(summary(report(true, Vec::new()), Vec::new()), "no Vulkan driver is installed");
        let broken = summary(report(true, vec![no_x11()]), Vec::new());
        assert!(broken.contains("nvidia_icd.json") && broken.contains("libX11.so.6: cannot"), "{broken}");
        let loaded = || report(true, vec![nvidia(ManifestOutcome::Loaded)]);
        assert!(summary(loaded(), vec![device(&["ray tracing"])]).ends_with("lacks ray tracing"));
        assert_eq!(summary(loaded(), Vec::new()), "the drivers offer no device");
        let failed = DriverReport { failure: Some("vkCreateInstance failed".to_owned()), ..loaded() };
        assert_eq!(summary(failed, Vec::new()), "vkCreateInstance failed");
    }

    /// As on Windows and Android, where the report searches the variables only.
    #[test]
    fn summary_does_not_claim_to_know_all_drivers() {
        let summary = |drivers| VulkanReport { drivers, devices: Vec::new() }.summary();
        let failure = Some("vkCreateInstance: ERROR_INCOMPATIBLE_DRIVER".to_owned());
        let variable = report(true, Vec::new()).searched.pop().unwrap();
        for searched in [Vec::new(), vec![variable]] {
            let unknown = DriverReport { searched, ..report(true, Vec::new()) };
            assert_eq!(summary(unknown.clone()), "the drivers offer no device");
            assert_eq!(
                summary(DriverReport { failure: failure.clone(), ..unknown }),
                failure.clone().unwrap()
            );
        }
    }

    #[test]
    fn lack_of_a_device_names_drivers_that_do_not_load() {
        let text = no_device_text(None, &[device(&["ray queries"])], Some(&report(true, vec![no_x11()])));
        for part in
            ["[0] Toy", "lacks ray queries", "the loader libvulkan", "libX11.so.6: cannot", "remedy: "]
        {
            assert!(text.contains(part), "no '{part}' in {text}");
        }
        let loaded = report(true, vec![nvidia(ManifestOutcome::Loaded)]);
        let named = no_device_text(Some("'x' names no device"), &[device(&[])], Some(&loaded));
        assert_eq!(named, "'x' names no device; [0] Toy (CPU, Vulkan 1.3.5, toys 1.2): usable");
        let old = no_device_text(None, &[device(&["Vulkan 1.3"])], None);
        assert!(old.ends_with("remedy: update the drivers to Vulkan 1.3"), "{old}");
    }
}
