//! How well strategies choose on machines that were held out.

mod baselines;
mod contestants;
mod coverage;
mod crossovers;
mod direct;
mod floor;
mod forest;
mod held_out;
mod influence;
mod partition;
mod regret_table;
mod role;
mod scores;
mod validate;

pub use baselines::by_costs;
pub use crossovers::ComparedCrossover;
pub use held_out::{HeldOut, HeldOutCrossover, UnitRegrets};
pub use influence::{Influence, Slope, influences};
pub use partition::Partition;
pub use regret_table::{NOT_TIMED, Regret, RegretTable, Strategy};
pub use scores::{OURS, SINGLE_BEST};
pub use validate::{Validated, validate};
