//! `sapwise._sapwise`: the compiled half of the Python package. What users see is in `sapwise/__init__.py`.

mod boxes;
mod decision;
mod error;
mod finder;
mod frame;
mod hardware;
mod memory;
mod narrow;
mod one_shot;
mod start;
mod tuning;

use pyo3::prelude::*;

#[pymodule]
mod _sapwise {
    #[pymodule_export]
    use super::decision::PyDecision;
    #[pymodule_export]
    use super::finder::PyBroadPhase;
    #[pymodule_export]
    use super::hardware::measure_hardware;
    #[pymodule_export]
    use super::one_shot::{last_decision, pairs, pairs_between};
    #[pymodule_export]
    use super::tuning::{PyTuning, predict};

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
