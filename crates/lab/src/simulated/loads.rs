//! The frames that simulated machines are timed on: those of real scenes.

use crate::sweep::{self, Ascent, Plan};
use anyhow::Result;
use sapwise::Load;
use sapwise_scenes::Scenario;

/// Even and slow, even and fast, and in blobs: what keeping pairs is good for and what it is not, and another density.
const SCENARIOS: [Scenario; 3] = [Scenario::Uniform, Scenario::Fast, Scenario::Clustered];

/// The scenarios of a sweep, each with the load of its frame at every size.
#[derive(Debug, Clone)]
pub struct Loads(pub(super) Vec<(Scenario, Vec<Load>)>);

impl Loads {
    /// The loads at the sizes of a quick sweep, up to `max_objects` where there is one. The scenes are made and their pairs counted; nothing
    /// is timed.
    ///
    /// # Errors
    /// When the pairs of a scene can't be found.
    pub fn of_a_sweep(seed: u64, max_objects: Option<u32>) -> Result<Self> {
        let plan = Plan::new(true, &SCENARIOS, max_objects);
        let of = |a: &Ascent| Ok((a.scenario, sweep::loads(a.scenario, &a.sizes, seed, |_| Ok(()))?));
        Ok(Self(plan.ascents.iter().map(of).collect::<Result<_>>()?))
    }
}
