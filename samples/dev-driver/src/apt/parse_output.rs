//! Parses the output of `apt-get`.

/// One package that `apt-get --print-uris` lists.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Archive {
    /// Package name.
    pub(super) name: String,
    /// Version as Debian writes it.
    pub(super) version: String,
    /// Size of the archive file.
    pub(super) size_bytes: u64,
}

/// Returns the archives in the output of `--print-uris`: `'address' name_version_architecture.deb size hash`.
pub(super) fn archives(text: &str) -> Vec<Archive> {
    text.lines().filter(|line| line.starts_with('\'')).filter_map(archive).collect()
}

fn archive(line: &str) -> Option<Archive> {
    let mut words = line.split_whitespace().skip(1);
    let (file, size) = (words.next()?, words.next()?);
    let (name, rest) = file.split_once('_')?;
    let (version, _) = rest.rsplit_once('_')?;
    Some(Archive {
        name: name.to_owned(),
        version: version.replace("%3a", ":"),
        size_bytes: size.parse().ok()?,
    })
}

/// Returns the percentage in a line of the status channel such as `dlstatus:3:41.5:Retrieving file 3 of 37`.
pub(super) fn percent_done(line: &str) -> Option<f64> {
    let mut fields = line.strip_prefix("dlstatus:")?.split(':').skip(1);
    fields.next()?.parse().ok().filter(|percent: &f64| (0.0..=100.0).contains(percent))
}

/// Returns the size in a line such as `Fetched 9,500 kB in 2s (4,750 kB/s)`.
pub(super) fn downloaded_size(text: &str) -> Option<&str> {
    let line = text.lines().find_map(|line| line.strip_prefix("Fetched "))?;
    line.split_once(" in ").map(|(amount, _)| amount)
}

/// Returns the first error of an error output, or its last line if no line is an error.
pub(super) fn first_error(text: &str) -> String {
    let lines = || text.lines().map(str::trim).filter(|line| !line.is_empty());
    let error = lines().find_map(|line| line.strip_prefix("E: "));
    error.or_else(|| lines().next_back()).unwrap_or("no error message").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn archives_come_with_name_version_and_size() {
        let text = "Reading package lists...\n\
            'http://near/pool/x/mesa_25.0.7-2%7ebpo12%2b1_amd64.deb' mesa-vulkan-drivers_25.0.7-2~bpo12+1_amd64.deb 11366132 \n\
            'http://near/pool/l/llvm.deb' libllvm15_1%3a15.0.6-4+b1_amd64.deb 23115156 MD5Sum:9ad0\n\
            'broken' line\n";
        let found = archives(text);
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].name, "mesa-vulkan-drivers");
        assert_eq!(found[0].version, "25.0.7-2~bpo12+1");
        assert_eq!(found[1].version, "1:15.0.6-4+b1");
        assert_eq!(found.iter().map(|archive| archive.size_bytes).sum::<u64>(), 34_481_288);
    }

    #[test]
    fn percent_reads_only_the_download_status() {
        assert_eq!(percent_done("dlstatus:36:83.2769:Retrieving file 36 of 36"), Some(83.2769));
        assert_eq!(percent_done("pmstatus:x:50:Installing"), None);
        assert_eq!(percent_done("dlstatus:1:nonsense:Retrieving"), None);
        assert_eq!(percent_done("dlstatus:1:NaN:Retrieving"), None);
        assert_eq!(percent_done("Get:1 http://near bookworm InRelease"), None);
    }

    #[test]
    fn the_index_size_is_parsed() {
        assert_eq!(downloaded_size("Hit:1\nFetched 9,500 kB in 2s (4,750 kB/s)\n"), Some("9,500 kB"));
        assert_eq!(downloaded_size("Reading package lists..."), None);
    }

    #[test]
    fn the_first_error_is_parsed() {
        let text = "W: a warning\nE: Unable to locate package x\nE: later\n";
        assert_eq!(first_error(text), "Unable to locate package x");
        assert_eq!(first_error("something\nelse\n\n"), "else");
        assert_eq!(first_error(""), "no error message");
    }
}
