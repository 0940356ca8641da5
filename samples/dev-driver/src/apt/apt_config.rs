//! Configuration files that give `apt-get` a private state, so that it writes no file of the system.

use std::path::Path;

use super::mirror::Mirror;

/// Suite that contains the software driver with ray tracing.
pub(super) const BACKPORTS: &str = "bookworm-backports";
/// Suite that contains a current validation layer.
pub(super) const SECURITY: &str = "bookworm-security";
const KEYRING: &str = "/usr/share/keyrings/debian-archive-keyring.gpg";

/// Returns the keyring that verifies every signature: the system's, from package `debian-archive-keyring`.
pub(super) fn keyring() -> &'static Path {
    Path::new(KEYRING)
}

/// Returns the package sources in deb822 form. They request package lists only, without translations and icons.
pub(super) fn debian_sources(mirror: &Mirror) -> String {
    let stanza = |address: &str, suites: &str| {
        format!(
            "Types: deb\nURIs: {address}\nSuites: {suites}\nComponents: main\nTargets: Packages\nSigned-By: {KEYRING}\n"
        )
    };
    let archive = stanza(&mirror.archive, &format!("bookworm {BACKPORTS}"));
    format!("{archive}\n{}", stanza(&mirror.security, SECURITY))
}

/// Returns the configuration that apt reads after the system's. The system's proxy and credentials stay in force, its hooks
/// (which may write elsewhere) do not run, and none of its settings can disable the signature check.
pub(super) fn apt_conf(work: &Path) -> String {
    let work = work.display();
    format!(
        "#clear APT::Update::Pre-Invoke;\n\
         #clear APT::Update::Post-Invoke;\n\
         #clear APT::Update::Post-Invoke-Success;\n\
         Dir::State \"{work}/state\";\n\
         Dir::State::lists \"{work}/state/lists\";\n\
         Dir::State::status \"{work}/state/status\";\n\
         Dir::State::extended_states \"{work}/state/extended\";\n\
         Dir::Cache \"{work}/cache\";\n\
         Dir::Cache::archives \"{work}/cache/archives\";\n\
         Dir::Log \"{work}/log\";\n\
         Dir::Etc::sourcelist \"{work}/debian.sources\";\n\
         Dir::Etc::sourceparts \"/dev/null\";\n\
         Dir::Etc::preferences \"/dev/null\";\n\
         Dir::Etc::preferencesparts \"/dev/null\";\n\
         APT::Architecture \"amd64\";\n\
         #clear APT::Architectures;\n\
         APT::Architectures {{ \"amd64\"; }};\n\
         APT::Default-Release \"{BACKPORTS}\";\n\
         APT::Install-Recommends \"false\";\n\
         APT::Get::Assume-Yes \"true\";\n\
         APT::Get::AllowUnauthenticated \"false\";\n\
         APT::Update::Error-Mode \"any\";\n\
         Acquire::Languages \"none\";\n\
         Acquire::AllowInsecureRepositories \"false\";\n\
         Acquire::AllowWeakRepositories \"false\";\n\
         Acquire::AllowDowngradeToInsecureRepositories \"false\";\n"
    )
}

/// Returns a package database that contains only the system's C library. The C library cannot be downloaded, so apt checks
/// the requirements of the packages against its version.
pub(super) fn dpkg_status(libc_version: &str) -> String {
    format!(
        "Package: libc6\nStatus: install ok installed\nArchitecture: amd64\nMulti-Arch: same\n\
         Maintainer: -\nVersion: {libc_version}\nDescription: -\n\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_signed_and_name_the_mirror() {
        let text = debian_sources(&Mirror {
            archive: "http://near/debian".into(),
            security: "http://near/sec".into(),
        });
        assert_eq!(text.matches("Signed-By: /usr/share/keyrings/").count(), 2);
        assert!(text.contains("URIs: http://near/debian\nSuites: bookworm bookworm-backports\n"));
        assert!(text.contains("\n\nTypes: deb\nURIs: http://near/sec\nSuites: bookworm-security\n"));
    }

    #[test]
    fn every_folder_that_apt_writes_is_below_the_work_folder() {
        let text = apt_conf(Path::new("/p/w"));
        for key in [
            "Dir::State",
            "Dir::State::lists",
            "Dir::State::status",
            "Dir::Cache",
            "Dir::Cache::archives",
            "Dir::Log",
        ] {
            assert!(text.contains(&format!("\n{key} \"/p/w/")), "{key}");
        }
    }
}
