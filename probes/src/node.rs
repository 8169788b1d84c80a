//! The file name of this node's report, which holds a hash instead of the host's name.

use crate::profiles::machine_stem;
use sapwise::algorithm::usable_cores;
use sapwise_tune::measure;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// The variable that names a node whose host name and machine id are not its own: containers of one image, or two nodes
/// on one machine.
const VARIABLE: &str = "SAPWISE_NODE";

/// The id that Linux gives an installation.
const MACHINE_ID: &str = "/etc/machine-id";

/// Returns the file for the report of this node within a folder: `amd-epyc-2c-5f0c9a1b2d3e.json`, made of CPU, cores
/// and node.
pub(crate) fn report_in(folder: &Path) -> PathBuf {
    folder.join(format!("{}-{}.json", machine_stem(&measure::machine().cpu, usable_cores()), node()))
}

/// Returns the 12 hex digits of this node. Two of a thousand nodes share theirs once in half a billion fleets.
fn node() -> String {
    let given = std::env::var(VARIABLE).ok().filter(|text| !text.is_empty());
    digits(&given.unwrap_or_else(|| {
        let id = std::fs::read_to_string(MACHINE_ID).unwrap_or_default();
        format!("{}\n{}", id.trim(), sysinfo::System::host_name().unwrap_or_default())
    }))
}

fn digits(text: &str) -> String {
    Sha256::digest(text).iter().take(6).map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_keeps_its_digits_and_another_has_others() {
        // As `printf n1 | sha256sum` begins.
        assert_eq!(digits("n1"), "676b8bb84ce7");
        assert_ne!(digits("n1"), digits("n2"));
        assert_eq!(node().len(), 12);
    }
}
