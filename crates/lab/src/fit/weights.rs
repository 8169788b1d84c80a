//! What each timing counts in a fit.

use super::rows::Row;
use crate::data::Profile;
use crate::report::Label;
use std::collections::BTreeMap;

/// Every physical machine counts the same, however many profiles it has: what a machine has of its own, which no parameter
/// tells, stands in all of its profiles, so that twenty of one machine would pass off its own for what machines share. Within a
/// machine every profile counts the same, and within that every octave of the number of objects. A contended profile counts a
/// quarter of the others of its machine: what other programs take changes from one second to the next, so that its parameters
/// say little about its timings. On the first one a cold fork and join was measured 800 times as long as a parallel frame took.
/// And a row counts the less the further it lies behind the best of its point: nobody chooses the algorithm there.
pub(super) fn weights(rows: &[&Row], profiles: &[Profile], machines: &[usize]) -> Vec<f64> {
    let octave = |row: &Row| (row.profile, row.load.objects.ilog2());
    let mut counts: BTreeMap<(usize, u32), f64> = BTreeMap::new();
    for row in rows {
        *counts.entry(octave(row)).or_default() += 1.0;
    }
    let own = |row: &Row| 1.0 / (counts[&octave(row)] * row.behind);
    let mut sums: BTreeMap<usize, f64> = BTreeMap::new();
    for row in rows {
        *sums.entry(row.profile).or_default() += own(row);
    }
    let trust = |profile: usize| if profiles[profile].label == Label::RealContended { 0.25 } else { 1.0 };
    let mut trusts: BTreeMap<usize, f64> = BTreeMap::new();
    for &profile in sums.keys() {
        *trusts.entry(machines[profile]).or_default() += trust(profile);
    }
    let weight = |row: &&Row| trust(row.profile) / trusts[&machines[row.profile]] * own(row) / sums[&row.profile];
    rows.iter().map(weight).collect()
}
