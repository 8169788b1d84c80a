//! Cost terms fitted to the times of profiles.

pub(crate) mod columns;
mod designs;
mod late_helpers;
pub(crate) mod load_residual;
mod measured_costs;
mod method_rows;
mod min_of_two;
mod model;
pub(crate) mod nnls;
pub(crate) mod robust;
mod rows;
mod terms;
mod weights;

pub use designs::{ComponentsOf, Designs, Fitted, TrainingSet};
pub use measured_costs::{measured_costs, measured_costs_over, measured_slice, measured_tuning, slice_tuning};
pub(crate) use method_rows::thinned;
pub use model::model;
pub use rows::{Row, rows};
pub use terms::{Component, components, fallback_method};
