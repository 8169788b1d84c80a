//! Cores and SIMD lanes.

use super::Options;
use crate::hardware::{Parameter, ParameterId};
use sapwise::algorithm::SimdLevel;

pub(super) fn measure(options: &Options) -> Vec<Parameter> {
    let restricted = if options.threads.is_some() { ", lowered by the caller" } else { "" };
    let source = format!("std::thread::available_parallelism{restricted}");
    let physical = match sysinfo::System::physical_core_count() {
        Ok(cores) if cores > 0 => Parameter::reported(ParameterId::PhysicalCores, cores as f64, "sysinfo"),
        _ => Parameter::missing(ParameterId::PhysicalCores, "sysinfo does not report it"),
    };
    vec![
        Parameter::reported(ParameterId::UsableCores, options.usable_cores() as f64, &source),
        physical,
        Parameter::reported(ParameterId::SimdLanes, f64::from(SimdLevel::in_use().lanes()), "SimdLevel::in_use"),
    ]
}
