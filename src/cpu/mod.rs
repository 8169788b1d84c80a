//! Algorithms on the CPU, one file per method.

mod level;

pub use level::SimdLevel;
