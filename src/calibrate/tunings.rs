//! Tunings that come with a program, one for each kind of machine.

use crate::error::{Error, Unavailable};
use crate::hardware::Machine;
use crate::json;
use crate::measure::machine;
use crate::registry::{Registry, usable_cores};
use crate::tuning::Tuning;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;

/// A file that is longer was written by something else.
const LONGEST_BYTES: u64 = 16 << 20;

/// The tuning of this kind of machine; `None` where the folder has none.
///
/// # Errors
/// A sentence that says why what is there can't be used.
pub(super) fn of_this_machine(folder: &Path, registry: &Registry) -> Result<Option<Tuning>, String> {
    let machine = Machine { simd: registry.simd().to_string(), ..machine() };
    let path = folder.join(machine.tuning_file(usable_cores(), &registry.gpu_identities()));
    let ignored = |why: &dyn std::fmt::Display| format!("{} is ignored: {why}", path.display());
    match fs::metadata(&path) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(ignored(&e)),
        // To open a pipe would wait for its writer.
        Ok(found) if !found.is_file() => return Err(ignored(&"it is no file")),
        Ok(found) if found.len() > LONGEST_BYTES => return Err(ignored(&"it is too long")),
        Ok(_) => {}
    }
    let text = fs::read_to_string(&path).map_err(|e| ignored(&e))?;
    let tuning = json::tuning(&text).map_err(|e| ignored(&e))?;
    // An algorithm that this registry lacks is left out when they are made.
    let stale = tuning.costs.iter().filter_map(|cost| registry.mismatch(&cost.algorithm, cost.revision));
    let of_other_build =
        |why: &Error| matches!(why, Error::Unavailable { reason: Unavailable::OtherRevision { .. }, .. });
    match stale.into_iter().find(of_other_build) {
        Some(why) => Err(ignored(&why)),
        None => Ok(Some(tuning)),
    }
}
