//! How well the crossovers are predicted from hardware parameters alone: the validation of a training as tables.

use super::entry::Entry;
use crate::figures::{CrossingPair, Crossings};
use crate::data_table::{Cell, DataTable};
use crate::train::{Held, HeldBorder, OURS};
use sapwise::model::Validation;
use sapwise::{AlgorithmId, Border};
use std::collections::BTreeMap;

/// Kinds of borders, each drawn with a mark of its own.
const KINDS: [&str; 3] = ["between methods", "between numbers of threads or GPUs", "between CPU and GPU"];
/// Those whose predicted curves do not cross.
const APART: &str = "predicted not to cross: an end of the sizes";

/// Two fits mean the same border where they are within 5 % of each other, as a natural logarithm.
const SAME_LN: f64 = 0.05;

/// The score of every way to choose.
pub(super) fn scores(validation: &Validation, studied: &[usize]) -> DataTable {
    let mut sheet = DataTable::new([
        ("way to choose", "way_to_choose"),
        ("mean regret", "mean_regret_share"),
        ("95th percentile", "p95_regret_share"),
        ("cells over 10 %", "cells_over_10_percent_share"),
        ("gap closed", "gap_closed_share"),
        ("mean in games", "mean_regret_in_games_share"),
        ("borders off by (octaves)", "borders_off_by_octaves"),
        ("within half an octave", "within_half_octave_share"),
    ]);
    for m in &validation.methods {
        let share = |value: Option<f64>, why: &str| value.map_or_else(|| Cell::Missing(why.to_owned()), Cell::percent);
        let none = "it predicts no costs";
        let cells = vec![
            Cell::text(&m.name),
            Cell::percent(m.mean_regret),
            Cell::percent(m.p95_regret),
            Cell::percent(m.share_over_10_percent),
            Cell::percent(m.closed_gap),
            share(m.mean_regret_in_games, "not told"),
            Cell::optional(m.crossing_error_octaves, 2, none),
            share(m.crossings_within_half_octave, none),
        ];
        sheet.push(cells, studied);
    }
    sheet
}

/// The regret of every way on each machine, or profile of the only one, that was left out.
pub(super) fn regrets(held: &Held, entries: &[Entry]) -> DataTable {
    let mut sheet = DataTable::new([("left out", "left_out"), ("CPU", "cpu")]);
    for (name, _) in &held.regrets {
        let key = format!("regret_{}_share", name.replace([' ', '+', '(', ')'], "_"));
        sheet.columns.push(crate::data_table::Column { title: (*name).to_owned(), key });
    }
    for (k, unit) in held.units.iter().enumerate() {
        let is_own = |e: &Entry| e.studied.is_ok() && if held.by_machine { e.machine() == unit } else { e.file == *unit };
        let own: Vec<usize> = (0..entries.len()).filter(|&k| is_own(&entries[k])).collect();
        let cpu = own.first().map_or("", |&k| &entries[k].hardware.machine.cpu);
        let mut cells = vec![Cell::text(unit), Cell::text(cpu)];
        // A way that was judged on fewer has no row of its own for each of them.
        let all = |regrets: &[f64]| (regrets.len() == held.units.len()).then(|| regrets[k]);
        let missing = || Cell::Missing("it was judged on some only".to_owned());
        cells.extend(held.regrets.iter().map(|(_, regrets)| all(regrets).map_or_else(missing, Cell::percent)));
        sheet.push(cells, &own);
    }
    sheet
}

/// Predicted beside measured times.
pub(super) fn times(held: &Held, entries: &[Entry]) -> DataTable {
    let mut sheet = DataTable::new([
        ("report", "report"),
        ("method", "method"),
        ("on the", "processor"),
        ("objects", "objects"),
        ("measured (us)", "measured_us"),
        ("predicted (us)", "predicted_us"),
        ("predicted over measured", "predicted_over_measured_ratio"),
    ]);
    for t in &held.times {
        let own = entries.iter().position(|e| e.file == t.file);
        let times = [t.measured_ns, t.predicted_ns].map(|ns| Cell::number(ns / 1e3, 2));
        let heads = [Cell::text(&t.file), Cell::text(&t.method), Cell::text(t.class.to_string())];
        let ratio = Cell::number(t.predicted_ns / t.measured_ns, 3);
        sheet.push([&heads[..], &[Cell::count(t.objects.into())], &times, &[ratio]].concat(), own.as_slice());
    }
    sheet
}

/// How the regret falls with the number of machines in the training.
pub(super) fn learning(validation: &Validation, studied: &[usize]) -> DataTable {
    let mut sheet = DataTable::new([
        ("machines", "machines"),
        ("trainings", "trainings"),
        ("way to choose", "way_to_choose"),
        ("mean regret", "mean_regret_share"),
        ("5th percentile", "p5_regret_share"),
        ("95th percentile", "p95_regret_share"),
    ]);
    for l in &validation.learning {
        for m in &l.methods {
            let counts = [l.machines, l.trainings].map(|n| Cell::count(n as u64));
            let regrets = [m.mean_regret, m.low, m.high].map(Cell::percent);
            sheet.push([&counts[..], &[Cell::text(&m.name)], &regrets[..]].concat(), studied);
        }
    }
    sheet
}

/// Measured borders with their intervals, by the file of their report.
pub(super) type Measured = BTreeMap<String, Vec<Border>>;

/// The measured borders beside the predicted ones, as a table and as a picture.
pub(super) fn borders(held: &Held, measured: &Measured, entries: &[Entry]) -> (DataTable, Crossings) {
    let mut sheet = DataTable::new([
        ("report", "report"),
        ("below", "below"),
        ("above", "above"),
        ("measured (objects)", "measured_objects"),
        ("from", "measured_low_objects"),
        ("to", "measured_high_objects"),
        ("predicted (objects)", "predicted_objects"),
        ("off by (octaves)", "off_by_octaves"),
        ("crosses", "crosses"),
    ]);
    let mut pairs = Vec::new();
    for HeldBorder { file, beside } in &held.borders {
        let own = entries.iter().position(|e| e.file == *file);
        let interval = measured.get(file).and_then(|b| interval(b, &beside.below, &beside.above, beside.measured));
        let why = "its interval was not told from the paired samples";
        let objects = |value: f64| Cell::number(value, 0);
        let cells = vec![
            Cell::text(file),
            Cell::text(beside.below.to_string()),
            Cell::text(beside.above.to_string()),
            objects(beside.measured),
            Cell::optional(interval.map(|i| i.0), 0, why),
            Cell::optional(interval.map(|i| i.1), 0, why),
            objects(beside.predicted),
            Cell::number(beside.octaves(), 2),
            Cell::text(if beside.crosses { "yes" } else { "no: an end of the slice stands for it" }),
        ];
        sheet.push(cells, own.as_slice());
        let kind = if beside.crosses { kind(&beside.below, &beside.above) } else { KINDS.len() };
        let (measured_low, measured_high) = interval.unwrap_or((beside.measured, beside.measured));
        pairs.push(CrossingPair {
            name: KINDS.get(kind).copied().unwrap_or(APART).to_owned(),
            style: kind,
            measured: beside.measured,
            measured_low,
            measured_high,
            predicted: beside.predicted,
        });
    }
    (sheet, Crossings { title: format!("Predicted and measured borders, {OURS}"), pairs })
}

/// The interval of the measured border between two algorithms at a place. Both fits, that of the validation and that with intervals, see the
/// same timings; where they do not agree on a border its interval is not known.
fn interval(borders: &[Border], below: &AlgorithmId, above: &AlgorithmId, objects: f64) -> Option<(f64, f64)> {
    let is_own = |b: &&Border| b.below == *below && b.above == *above && (b.objects / objects).ln().abs() < SAME_LN;
    borders.iter().find(is_own)?.interval().filter(|(low, high)| (*low..=*high).contains(&objects))
}

fn kind(below: &AlgorithmId, above: &AlgorithmId) -> usize {
    if below.backend().class() != above.backend().class() {
        2
    } else {
        usize::from(below.backend().width() != above.backend().width())
    }
}
