//! Cost terms fitted to the times of profiles.

pub(crate) mod columns;
mod correction;
mod design;
mod designs;
mod late_helpers;
mod load_residual;
mod measured_costs;
mod measured_tuning;
mod method_rows;
mod min_of_two;
mod model;
mod nnls;
mod robust;
mod rows;
mod terms;
mod weights;

pub use designs::Designs;
pub(crate) use measured_costs::costs_of_one;
pub use measured_costs::measured_costs;
pub use measured_tuning::{measured_slice, measured_tuning, slice_tuning};
pub(crate) use method_rows::thinned;
pub use model::model;
pub use rows::{Row, rows};
pub use terms::{Component, components, fallback_method};
