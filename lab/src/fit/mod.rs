//! Cost terms fitted to the times of profiles.

pub(crate) mod columns;
mod designs;
mod measured_costs;
mod min_of_two;
mod model;
pub(crate) mod nnls;
mod prior;
pub(crate) mod residual;
pub(crate) mod robust;
mod rows;
mod terms;

pub(crate) use designs::thinned;
pub use designs::{ComponentsOf, Designs};
pub use measured_costs::{measured_costs, measured_slice, measured_tuning, slice_tuning};
pub use model::model;
pub use prior::{TimingError, prior};
pub use rows::{Row, rows};
pub use terms::{Component, components, fallback_method, terms_of_one_machine};
