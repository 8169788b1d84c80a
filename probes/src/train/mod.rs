//! From reports to cost curves, fields and models.

mod columns;
mod curve;
mod fit;
mod nnls;
mod residual;
mod robust;
mod rows;
#[cfg(test)]
mod synthetic;

pub(crate) use curve::measured_fields;
