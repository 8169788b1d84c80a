//! From reports to cost curves, fields and models.

mod curve;
mod nnls;
mod robust;
mod rows;
#[cfg(test)]
mod synthetic;

pub(crate) use curve::measured_fields;
