//! The sweep: every algorithm on the same frames of seeded scenes, over sizes and scenarios.

mod conduct;
mod contest;
mod doubt;
mod dropout;
mod order;
mod plan;
mod race;
mod scenario;
mod verify;

pub(crate) use conduct::{Conditions, Found, conduct};
pub(crate) use dropout::Standing;
pub(crate) use order::{Course, Event, Order, Visit};
pub(crate) use plan::Plan;
pub(crate) use race::WARM_UP;
pub(crate) use scenario::{PAIR_LIMIT, add_gpus, next_frame, sweep};

/// The median of samples in nanoseconds. `None` without samples.
pub(crate) fn median(samples: &[u64]) -> Option<f64> {
    let samples: Vec<f64> = samples.iter().map(|&ns| ns as f64).collect();
    sapwise::stats::median(&samples)
}
