//! How much each timing counts in a fit.

use super::rows::Row;
use std::collections::BTreeMap;

/// Returns the weight of each row.
///
/// Every physical machine counts the same, however many profiles it has: no parameter shows what is special about a
/// machine, and twenty of its profiles would pass that off as common to all. Within a machine every profile counts
/// the same, and within a profile every octave of the number of objects. A row counts less the further it lies behind
/// the best of its point: nobody chooses the algorithm there.
pub(super) fn weights(rows: &[&Row], machines: &[usize]) -> Vec<f64> {
    let octave = |row: &Row| (row.profile, row.load.objects.ilog2());
    let mut counts: BTreeMap<(usize, u32), f64> = BTreeMap::new();
    rows.iter().for_each(|row| *counts.entry(octave(row)).or_default() += 1.0);
    let own = |row: &Row| 1.0 / (counts[&octave(row)] * row.behind);
    let mut sums: BTreeMap<usize, f64> = BTreeMap::new();
    rows.iter().for_each(|row| *sums.entry(row.profile).or_default() += own(row));
    let mut profiles: BTreeMap<usize, f64> = BTreeMap::new();
    sums.keys().for_each(|&profile| *profiles.entry(machines[profile]).or_default() += 1.0);
    rows.iter().map(|row| own(row) / sums[&row.profile] / profiles[&machines[row.profile]]).collect()
}
