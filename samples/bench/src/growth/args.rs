//! The command line of `bench growth`.

use std::path::PathBuf;

use clap::Args;
use clap::builder::PossibleValuesParser;

use super::group::GroupKey;

/// Options of the growth curves.
#[derive(Debug, Clone, PartialEq, Args)]
pub(crate) struct GrowthArgs {
    /// Folder for `growth.md` and its plots, beside the tables on standard output
    #[arg(long, value_name = "FOLDER")]
    pub(super) out: Option<PathBuf>,

    /// Groups of curves to measure, separated by commas [default: all]
    #[arg(long, value_name = "CURVE,...", value_delimiter = ',', num_args = 1..)]
    #[arg(value_parser = PossibleValuesParser::new(GroupKey::ALL.map(GroupKey::name)))]
    only: Vec<String>,

    /// The file that a child process loads, to print what that takes
    #[arg(long, hide = true, value_name = "FILE")]
    pub(crate) load: Option<PathBuf>,
}

impl GrowthArgs {
    /// Returns the groups to measure, in the order of the report.
    pub(super) fn groups(&self) -> Vec<GroupKey> {
        let is_selected =
            |key: &GroupKey| self.only.is_empty() || self.only.iter().any(|name| name == key.name());
        GroupKey::ALL.into_iter().filter(is_selected).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        growth: GrowthArgs,
    }

    #[test]
    fn selected_groups_keep_the_order_of_the_report() {
        let groups = |line: &str| {
            let words = std::iter::once("growth").chain(line.split_whitespace());
            Line::try_parse_from(words).map(|line| line.growth.groups())
        };
        assert_eq!(groups("").unwrap(), GroupKey::ALL);
        let expected = [GroupKey::Instances, GroupKey::Draws];
        assert_eq!(groups("--only draws,instances").unwrap(), expected);
        assert_eq!(groups("--only draws instances").unwrap(), expected);
        assert!(groups("--only everything").is_err());
    }
}
