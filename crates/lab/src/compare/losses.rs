//! What it costs to use the tuning that one report measured under the timings of another.

use crate::data::{Evidence, Profile, usable};
use crate::evaluate::{RegretTable, Strategy, by_costs};
use crate::fit::measured_costs;
use crate::report::{Label, Report};
use crate::spread::range;
use sapwise::stats::mean;
use serde::Serialize;

/// Mean regrets over the points of reports, against the best at each point.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Losses {
    /// Of the tuning of a report on its own timings.
    pub own: f64,
    /// The least and the largest of these.
    pub own_range: [f64; 2],
    /// Of the tuning of every other report on them.
    pub others: f64,
    /// The least and the largest of these.
    pub others_range: [f64; 2],
    /// What the tuning of another report costs beyond a report's own: mean over all ordered pairs of reports.
    pub beyond_own: f64,
    /// The least and the largest of these.
    pub beyond_own_range: [f64; 2],
}

/// A simulated report is compared like a real one.
fn evidence(report: &Report) -> Evidence {
    if report.label == Label::Simulated { Evidence::Simulated } else { Evidence::Real }
}

/// `None` with fewer than two reports that hold usable timings.
pub(super) fn losses(reports: &[(String, Report)]) -> Option<Losses> {
    // One by one: together, a repeated report would be left out.
    let profiles: Vec<Profile> =
        reports.iter().flat_map(|r| usable(std::slice::from_ref(r), evidence(&r.1)).0).collect();
    if profiles.len() < 2 {
        return None;
    }
    let (mut own, mut others, mut beyond) = (Vec::new(), Vec::new(), Vec::new());
    for (k, judged) in profiles.iter().enumerate() {
        let available = judged.available();
        let table = RegretTable::new(judged);
        let loss = |of: &Profile| {
            let choose: Strategy<'_> = by_costs(measured_costs(of).0, &available);
            table.regret(judged, &choose).mean
        };
        let by_own = loss(judged);
        own.push(by_own);
        for (_, other) in profiles.iter().enumerate().filter(|(j, _)| *j != k) {
            let by_other = loss(other);
            others.push(by_other);
            beyond.push(by_other - by_own);
        }
    }
    Some(Losses {
        own: mean(&own),
        own_range: range(&own)?,
        others: mean(&others),
        others_range: range(&others)?,
        beyond_own: mean(&beyond),
        beyond_own_range: range(&beyond)?,
    })
}
