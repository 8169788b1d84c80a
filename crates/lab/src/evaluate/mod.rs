//! How well strategies choose on machines that were held out, and what hardware parameters are worth to them.

mod baselines;
mod contestants;
mod coverage;
mod crossovers;
#[cfg(test)]
mod density;
mod direct;
mod floor;
mod forest;
mod held_out;
mod importance;
mod notes;
mod partition;
#[cfg(test)]
mod reference;
mod regret_table;
mod scores;
mod validate;

pub use baselines::by_costs;
pub use crossovers::ComparedCrossover;
pub use held_out::{HeldOut, HeldOutCrossover, Time};
pub use importance::{Influence, influences};
pub use notes::folded;
pub use partition::Partition;
pub use regret_table::{NOT_TIMED, Regret, RegretTable, Strategy};
pub use scores::{OURS, SINGLE_BEST};
pub use validate::{Validated, validate};
