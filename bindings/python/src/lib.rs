//! `sapwise._sapwise`: the compiled half of the Python package. What users see is in `sapwise/__init__.py`.

mod boxes;
mod decision;
mod engine;
mod error;
mod filter;
mod finder;
mod frame;
mod handles;
mod hardware;
mod held;
mod memory;
mod one_shot;
mod snapshot;
mod space;
mod start;
mod tuning;
mod view;

use boxes::{Corners, boxes, kept};
use decision::PyDecision;
use error::{call, exception, failed, invalid_box, unusable, with_cause};
use filter::Keywords;
use handles::array;
use held::{Held, Searcher, learning_methods};
use start::Start;
use tuning::PyTuning;

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
    use super::snapshot::restored_space;
    #[pymodule_export]
    use super::space::PySpace;
    #[pymodule_export]
    use super::tuning::{PyTuning, predict};
    #[pymodule_export]
    use super::view::PyView;

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
