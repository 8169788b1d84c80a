//! How much faster an algorithm is on one machine than on another.

use super::entry::{Entry, PointKey};
use sapwise::stats::quantile;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Points that two machines must share: the mean of fewer is that of one scenario's corner.
const FEWEST_POINTS: usize = 5;
/// Objects from which on a frame is large: below, fork and join and the clock make up most of it, and above, the work does.
pub(super) const LARGE: u32 = 1000;
/// Rounds of fitting machines and points in turn, at most, and the step at which the effects stand still.
const MOST_ROUNDS: usize = 500;
const STILL_LN: f64 = 1e-7;

/// A speed over that of another machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SpeedUp {
    /// Median over the points that both have.
    pub(super) median: f64,
    /// First and third quartile over them.
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) points: usize,
}

/// The speed-up from `reference` to `other` of each algorithm that both were timed with at five points or more whose objects are in `sizes`.
pub(super) fn speed_ups(reference: &Entry, other: &Entry, sizes: Range<u32>) -> BTreeMap<String, SpeedUp> {
    let (before, mut after) = (reference.times(), other.times());
    let of = |(name, before): (String, BTreeMap<PointKey<'_>, f64>)| {
        let after = after.remove(&name)?;
        let own = before.iter().filter(|(point, _)| sizes.contains(&point.1));
        let ratios: Vec<f64> = own.filter_map(|(point, ns)| Some((ns / after.get(point)?).ln())).collect();
        if ratios.len() < FEWEST_POINTS {
            return None;
        }
        let at = |share| quantile(&ratios, share).map(f64::exp);
        Some((name, SpeedUp { median: at(0.5)?, low: at(0.25)?, high: at(0.75)?, points: ratios.len() }))
    };
    before.into_iter().filter_map(of).collect()
}

/// For each algorithm the natural logarithm of the time that each entry takes for large frames, over that of the mean entry at the same
/// points.
///
/// Not every machine was timed everywhere, so points and machines are fitted in turn to the logarithms (a two-way table of
/// effects, Tukey 1977, with means). A machine that shares fewer than five points with others has none.
pub(super) fn slownesses(entries: &[&Entry]) -> BTreeMap<String, Vec<Option<f64>>> {
    let times: Vec<_> = entries.iter().map(|e| e.times()).collect();
    let names: BTreeSet<&String> = times.iter().flat_map(BTreeMap::keys).collect();
    names
        .into_iter()
        .map(|name| (name.clone(), effects(&times.iter().map(|t| t.get(name)).collect::<Vec<_>>())))
        .collect()
}

fn effects(times: &[Option<&BTreeMap<PointKey<'_>, f64>>]) -> Vec<Option<f64>> {
    let rows = times.iter().map(|t| large(t.iter().copied().flatten())).collect();
    let rows: Vec<Vec<(PointKey<'_>, f64)>> = connected(rows);
    let mut effects = vec![0.0; rows.len()];
    for _ in 0..MOST_ROUNDS {
        let mut points: BTreeMap<PointKey<'_>, (f64, f64)> = BTreeMap::new();
        for (row, effect) in rows.iter().zip(&effects) {
            for (point, ln) in row {
                let (sum, count) = points.entry(*point).or_default();
                (*sum, *count) = (*sum + ln - effect, *count + 1.0);
            }
        }
        let mut moved = 0.0_f64;
        for (row, effect) in rows.iter().zip(&mut effects).filter(|(row, _)| !row.is_empty()) {
            let off = |(point, ln): &(PointKey<'_>, f64)| ln - points[point].0 / points[point].1;
            let now = row.iter().map(off).sum::<f64>() / row.len() as f64;
            moved = moved.max((now - *effect).abs());
            *effect = now;
        }
        if moved < STILL_LN {
            break;
        }
    }
    effects.into_iter().zip(&rows).map(|(effect, row)| (!row.is_empty()).then_some(effect)).collect()
}

/// The logarithms of the times at points with many objects.
fn large<'a, 'b: 'a>(times: impl Iterator<Item = (&'a PointKey<'b>, &'a f64)>) -> Vec<(PointKey<'b>, f64)> {
    times.filter(|(point, _)| point.1 >= LARGE).map(|(point, ns)| (*point, ns.ln())).collect()
}

/// The rows of the largest group of machines that can be compared, through others where they share no point themselves; the others empty.
/// A point that one machine has alone says nothing, and neither does a machine with few points.
fn connected<'a>(mut rows: Vec<Vec<(PointKey<'a>, f64)>>) -> Vec<Vec<(PointKey<'a>, f64)>> {
    loop {
        let mut machines_at: BTreeMap<PointKey<'a>, usize> = BTreeMap::new();
        rows.iter().flatten().for_each(|(point, _)| *machines_at.entry(*point).or_default() += 1);
        let before: usize = rows.iter().map(Vec::len).sum();
        for row in &mut rows {
            row.retain(|(point, _)| machines_at[point] > 1);
            if row.len() < FEWEST_POINTS {
                row.clear();
            }
        }
        if rows.iter().map(Vec::len).sum::<usize>() == before {
            break;
        }
    }
    let mut groups: Vec<(BTreeSet<PointKey<'a>>, Vec<usize>)> = Vec::new();
    for (k, row) in rows.iter().enumerate().filter(|(_, row)| !row.is_empty()) {
        let mut joined = (row.iter().map(|(point, _)| *point).collect::<BTreeSet<_>>(), vec![k]);
        for group in std::mem::take(&mut groups) {
            if group.0.is_disjoint(&joined.0) {
                groups.push(group);
            } else {
                joined.0.extend(group.0);
                joined.1.extend(group.1);
            }
        }
        groups.push(joined);
    }
    let largest = groups.into_iter().max_by_key(|g| g.1.len()).map_or(Vec::new(), |g| g.1);
    rows.into_iter().enumerate().map(|(k, row)| if largest.contains(&k) { row } else { Vec::new() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_are_found_where_machines_were_timed_at_different_points() {
        // Points cost 1, 2, 4, ...; the machines are 1, 3 and 9 times as slow and miss some points each.
        let cost = |point: usize| f64::from(1_u32 << point);
        let machine = |factor: f64, points: &[usize]| -> BTreeMap<PointKey<'static>, f64> {
            points.iter().map(|&p| (("uniform", LARGE + p as u32), factor * cost(p))).collect()
        };
        let all = [
            machine(1.0, &[0, 1, 2, 3, 4, 5]),
            machine(3.0, &[2, 3, 4, 5, 6, 7, 8]),
            machine(9.0, &[0, 1, 5, 6, 7, 8]),
            machine(5.0, &[0, 1, 2]),
        ];
        let found = effects(&all.iter().map(Some).chain([None]).collect::<Vec<_>>());
        let ratio = |a: usize, b: usize| (found[a].unwrap() - found[b].unwrap()).exp();
        assert!((ratio(1, 0) - 3.0).abs() < 0.01 && (ratio(2, 1) - 3.0).abs() < 0.01, "{found:?}");
        assert_eq!(&found[3..], [None, None]);
        // Two that share points with each other alone can't be compared with the three.
        let apart = [machine(2.0, &[20, 21, 22, 23, 24]), machine(4.0, &[20, 21, 22, 23, 24])];
        let found = effects(&all[..3].iter().chain(&apart).map(Some).collect::<Vec<_>>());
        assert!(found[..3].iter().all(Option::is_some) && found[3..] == [None, None], "{found:?}");
    }
}
