//! `sapwise part`: one part of a measurement, in a process of its own. Hidden: `probe` and `predict` start it.

use crate::args::{Part, PartKind};
use crate::exit::{Outcome, WrongUsage};
use crate::sweep::{Order, sweep};
use crate::{child, output};
use sapwise::measure::{self, Family, Options};

pub(crate) fn run(arguments: Part) -> anyhow::Result<Outcome> {
    child::end_with_parent();
    match arguments.part {
        PartKind::Hardware { family, threads } => {
            let family: Family = family.parse().map_err(WrongUsage)?;
            let parameters = measure::family(family, &Options { threads, ..Options::default() });
            output::print_json(&parameters)?;
        }
        PartKind::Sweep { order } => {
            let order: Order = serde_json::from_str(&order).map_err(|e| WrongUsage(format!("the order: {e}")))?;
            sweep(&order, &mut |event| output::print_json(&event))?;
        }
    }
    Ok(Outcome::Done)
}
