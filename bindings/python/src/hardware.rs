//! Measures the hardware in this process, one family of parameters after another.

use crate::error::parsed;
use crate::failed;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use sapwise_tune::measure::{Family, Options, family, machine};
use sapwise_tune::{ParameterId, json};
use std::str::FromStr;
use std::time::Duration;

/// Time limit of a quick measurement.
const QUICK: Duration = Duration::from_secs(2);

/// Returns the machine, and a list of its parameters, as dicts. Checks for Ctrl-C between families, each of which takes
/// up to a second.
#[pyfunction]
#[pyo3(signature = (quick, progress))]
pub(crate) fn measure_hardware<'py>(
    py: Python<'py>,
    quick: bool,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyList>)> {
    let of = Family::ALL.len();
    let share = QUICK / u32::try_from(of).map_err(|why| failed(py, why.to_string()))?;
    let options = if quick { Options::default().with_limit(share) } else { Options::default() };
    let list = PyList::empty(py);
    for (k, each) in Family::ALL.into_iter().enumerate() {
        py.check_signals()?;
        if let Some(progress) = progress {
            progress.call1((k, of, each.as_str()))?;
        }
        for parameter in py.detach(|| family(each, &options)) {
            let dict = PyDict::new(py);
            dict.set_item("name", &parameter.name)?;
            dict.set_item("value", parameter.value)?;
            dict.set_item("unit", ParameterId::from_str(&parameter.name).map_or("", |id| id.quantity().unit))?;
            dict.set_item("dispersion", parameter.dispersion)?;
            dict.set_item("samples", parameter.samples)?;
            dict.set_item("spoiled", parameter.spoiled)?;
            dict.set_item("foreign_load", parameter.foreign_load)?;
            dict.set_item("how", parameter.how.as_str())?;
            dict.set_item("source", &parameter.source)?;
            list.append(dict)?;
        }
    }
    py.check_signals()?;
    if let Some(progress) = progress {
        progress.call1((of, of, "done"))?;
    }
    Ok((parsed(py, json::write(&machine()))?, list))
}
