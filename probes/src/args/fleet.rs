//! The arguments of `sapwise fleet`.

use super::known;
use clap::Args;
use std::path::PathBuf;

/// Says which reports of many nodes can be believed: what each node's hardware is, which are of one kind, and which was shared, throttled or cut short.
///
/// The exit status is 1 where a node has failed, is missing, or differs from the others of its kind.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sapwise probe --out reports/      # on every node; reports/ is a shared folder
  sapwise fleet reports/ --nodes 16
  sapwise train reports/ --out model.json")]
pub(crate) struct Fleet {
    /// Reports, or folders whose *.json files are reports.
    #[arg(required = true, value_name = "R.json")]
    pub(crate) reports: Vec<PathBuf>,
    /// How many nodes there should be: fewer fail.
    #[arg(long, value_name = "N", value_parser = known::whole(1..=u32::MAX), allow_negative_numbers = true)]
    pub(crate) nodes: Option<u32>,
    /// One JSON object on standard output instead of a table.
    #[arg(long)]
    pub(crate) json: bool,
}
