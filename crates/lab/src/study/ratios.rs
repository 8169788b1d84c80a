//! Figures 10 and 11 of the paper: parameters over those of a reference machine, beside the speed-up of each algorithm.

use super::entry::Entry;
use super::hardware::words;
use super::influence::parameters;
use super::speed::{LARGE, SpeedUp, speed_ups};
use crate::data_table::{Cell, DataTable};
use crate::figures::{RatioGroup, RatioKind, RatioValue, Ratios};
use std::collections::{BTreeMap, BTreeSet};

/// Machines in one picture.
const MOST_DRAWN: usize = 4;
/// A parameter that is within this of the reference on every machine is told and not drawn.
const ALIKE: f64 = 0.05;

/// A comparison of machines with one of them.
pub(super) struct Comparison<'a> {
    entries: &'a [Entry],
    /// Its position.
    pub(super) reference: usize,
    /// The others, with the speed-up of each algorithm.
    others: Vec<(usize, BTreeMap<String, SpeedUp>)>,
    /// A speed-up that is printed somewhere, and what it is called.
    printed: Option<(&'a str, f64)>,
}

impl<'a> Comparison<'a> {
    /// Of these machines, by position, with the reference.
    pub(super) fn new(entries: &'a [Entry], reference: usize, others: &[usize]) -> Self {
        let other = |&k: &usize| (k, speed_ups(&entries[reference], &entries[k], LARGE..u32::MAX));
        let others = others.iter().filter(|k| **k != reference).map(other).collect();
        Self { entries, reference, others, printed: None }
    }

    /// With a printed speed-up of every other machine.
    pub(super) fn with_printed(self, name: &'a str, speed_up: f64) -> Self {
        Self { printed: Some((name, speed_up)), ..self }
    }

    /// Every ratio, a row for each machine and parameter or algorithm.
    pub(super) fn table(&self) -> DataTable {
        let mut table = DataTable::new([
            ("machine", "machine"),
            ("what", "what"),
            ("name", "name"),
            ("ratio to the reference", "ratio"),
            ("lower quartile", "ratio_lower_quartile"),
            ("upper quartile", "ratio_upper_quartile"),
            ("scenarios and sizes", "points"),
            ("reference", "reference"),
        ]);
        let reference = &self.entries[self.reference];
        for (k, speed_ups) in &self.others {
            let machine = &self.entries[*k];
            let heads = |what: &str, name: &str| [&machine.name[..], what, name].map(Cell::text).to_vec();
            let reference = || vec![Cell::text(&reference.name)];
            let one = || Cell::Missing("a parameter has one value".to_owned());
            for name in parameters() {
                let Some(ratio) = self.parameter(&name, *k) else { continue };
                let figures = [Cell::number(ratio, 3), one(), one(), one()];
                table.push([heads("parameter", &name), figures.to_vec(), reference()].concat(), &[self.reference, *k]);
            }
            for (name, s) in speed_ups {
                let figures = [s.median, s.low, s.high].map(|r| Cell::number(r, 3)).to_vec();
                let cells =
                    [heads("speed-up", name), figures, vec![Cell::count(s.points as u64)], reference()].concat();
                table.push(cells, &[self.reference, *k]);
            }
        }
        table
    }

    /// The picture of some machines, and the parameters that are alike on all of them.
    pub(super) fn figure(&self) -> (Ratios, Vec<String>) {
        let drawn = self.some();
        let (mut groups, mut alike) = (Vec::new(), Vec::new());
        for name in parameters() {
            let ratios: Vec<Option<f64>> = drawn.iter().map(|(k, _)| self.parameter(&name, *k)).collect();
            if ratios.iter().flatten().all(|r| (r - 1.0).abs() <= ALIKE) {
                alike.extend(ratios.iter().any(Option::is_some).then(|| words(&name)));
                continue;
            }
            let value = |ratio: Option<f64>| ratio.map(|ratio| RatioValue { ratio, low: None, high: None });
            let values = ratios.into_iter().map(value).collect();
            groups.push(RatioGroup { name: words(&name), kind: RatioKind::Parameter, values });
        }
        let names: BTreeSet<&String> = drawn.iter().flat_map(|(_, s)| s.keys()).collect();
        for name in names {
            let value = |s: &SpeedUp| RatioValue { ratio: s.median, low: Some(s.low), high: Some(s.high) };
            let values = drawn.iter().map(|(_, speed_ups)| speed_ups.get(name).map(value)).collect();
            groups.push(RatioGroup { name: name.clone(), kind: RatioKind::Algorithm, values });
        }
        if let Some((name, ratio)) = self.printed {
            let value = RatioValue { ratio, low: None, high: None };
            groups.push(RatioGroup {
                name: name.to_owned(),
                kind: RatioKind::Algorithm,
                values: vec![Some(value); drawn.len()],
            });
        }
        groups.retain(|g| g.values.iter().any(Option::is_some));
        let figure = Ratios {
            title: format!("Parameters and speed over those of {}", self.entries[self.reference].name),
            reference: self.entries[self.reference].name.clone(),
            machines: drawn.iter().map(|(k, _)| self.entries[*k].name.clone()).collect(),
            groups,
        };
        (figure, alike)
    }

    /// How many of how many machines are drawn, where that is not all.
    pub(super) fn share_drawn(&self) -> Option<(usize, usize)> {
        let (drawn, all) = (self.some().len(), self.others.len());
        (drawn < all).then_some((drawn, all))
    }

    /// The reports that are drawn.
    pub(super) fn drawn(&self) -> Vec<usize> {
        std::iter::once(self.reference).chain(self.some().iter().map(|(k, _)| *k)).collect()
    }

    /// Of many machines some, evenly taken.
    fn some(&self) -> Vec<&(usize, BTreeMap<String, SpeedUp>)> {
        let step = self.others.len().div_ceil(MOST_DRAWN).max(1);
        self.others.iter().step_by(step).collect()
    }

    fn parameter(&self, name: &str, other: usize) -> Option<f64> {
        let both = self.entries[other].value(name).zip(self.entries[self.reference].value(name));
        both.filter(|(a, b)| *a > 0.0 && *b > 0.0).map(|(a, b)| a / b)
    }
}
