//! How well times, crossovers and choices are predicted from hardware parameters alone: the validation of a training as tables.

use super::entry::Entry;
use crate::Validation;
use crate::data_table::{Cell, Column, DataTable};
use crate::evaluate::{HeldOut, HeldOutCrossover, OURS};
use crate::figures::{Agreement, AgreementGroup, AgreementPoint, Values};
use sapwise::{AlgorithmId, BackendClass, Crossover};
use std::collections::BTreeMap;

/// Kinds of crossovers, each drawn with a mark of its own; the last is of those whose predicted curves do not cross.
const KINDS: [&str; 4] = [
    "between methods",
    "between numbers of threads or GPUs",
    "between CPU and GPU",
    "predicted not to cross: an end of the sizes",
];

/// Two fits mean the same crossover where they are within 5 % of each other, as a natural logarithm.
const SAME_LN: f64 = 0.05;

/// The score of every strategy.
pub(super) fn scores(validation: &Validation, studied: &[usize]) -> DataTable {
    let mut table = DataTable::new([
        ("strategy", "strategy"),
        ("unseen scenario", "unseen_scenario_share"),
        ("unseen scenario in games", "unseen_scenario_in_games_share"),
        ("mean regret", "mean_regret_share"),
        ("least", "least_regret_share"),
        ("largest", "largest_regret_share"),
        ("mean regret in games", "mean_regret_in_games_share"),
        ("least in games", "least_regret_in_games_share"),
        ("largest in games", "largest_regret_in_games_share"),
        ("one thread", "one_thread_share"),
        ("several threads", "several_threads_share"),
        ("by means", "by_means_share"),
        ("95th percentile", "p95_regret_share"),
        ("crossovers off by (octaves)", "crossovers_off_by_octaves"),
        ("crossovers within half an octave", "crossovers_within_half_octave_share"),
        ("points over 10 %", "points_over_10_percent_share"),
        ("gap to the oracle closed", "gap_closed_share"),
    ]);
    for m in &validation.methods {
        let share = |value: Option<f64>, why: &str| value.map_or_else(|| Cell::Missing(why.to_owned()), Cell::percent);
        let (none, unknown, not_asked) = ("it predicts no costs", "not known", "not asked of this strategy");
        let cells = vec![
            Cell::text(&m.name),
            share(m.unseen_scenario.map(|s| s.all.all), not_asked),
            share(m.unseen_scenario.map(|s| s.all.in_games), not_asked),
            Cell::percent(m.mean_regret),
            share(m.least_regret, unknown),
            share(m.largest_regret, unknown),
            share(m.mean_regret_in_games, unknown),
            share(m.least_regret_in_games, unknown),
            share(m.largest_regret_in_games, unknown),
            share(m.one_thread.map(|r| r.all), unknown),
            share(m.several_threads.map(|r| r.all), unknown),
            share(m.by_means.map(|r| r.all), unknown),
            Cell::percent(m.p95_regret),
            Cell::optional(m.crossing_error_octaves, 2, none),
            share(m.crossings_within_half_octave, none),
            Cell::percent(m.share_over_10_percent),
            Cell::Number { value: m.closed_gap, shown: crate::model_card::gap_closed(m.closed_gap) },
        ];
        table.push(cells, studied);
    }
    table
}

/// The regret of every strategy on each machine, or profile of the only one, that was held out.
pub(super) fn regrets(held_out: &HeldOut, entries: &[Entry]) -> DataTable {
    let mut table = DataTable::new([("held out", "held_out"), ("CPU", "cpu"), ("strategy", "strategy")]);
    table.columns.push(Column::new("mean regret", "mean_regret_share"));
    for (strategy, regrets) in &held_out.regrets {
        // One that was judged on fewer does not say which of them.
        let by_unit = regrets.len() == held_out.units.len();
        for (k, regret) in regrets.iter().enumerate() {
            let unit = by_unit.then(|| held_out.units[k].as_str());
            let is_own = |e: &Entry| {
                e.studied.is_ok() && unit == Some(if held_out.by_machine { e.machine() } else { e.file.as_str() })
            };
            let own: Vec<usize> = (0..entries.len()).filter(|&k| is_own(&entries[k])).collect();
            let none = || Cell::Missing("this strategy was judged on some of them only".to_owned());
            let cpu = own.first().map(|&k| Cell::text(&entries[k].hardware.machine.cpu));
            let cells = vec![
                unit.map_or_else(none, Cell::text),
                cpu.unwrap_or_else(none),
                Cell::text(*strategy),
                Cell::percent(*regret),
            ];
            table.push(cells, &own);
        }
    }
    table
}

/// Predicted beside measured times.
pub(super) fn times(held_out: &HeldOut, entries: &[Entry]) -> DataTable {
    let mut table = DataTable::new([
        ("report", "report"),
        ("scenario", "scenario"),
        ("objects", "objects"),
        ("algorithm", "algorithm"),
        ("predicted over measured", "predicted_over_measured_ratio"),
        ("measured (us)", "measured_us"),
        ("predicted (us)", "predicted_us"),
        ("method", "method"),
        ("processor", "processor"),
        ("threads", "threads"),
    ]);
    for t in &held_out.times {
        let own = entries.iter().position(|e| e.file == t.file);
        let id = &t.algorithm;
        let threads = match id.backend().class() {
            BackendClass::Cpu => Cell::count(id.threads().into()),
            BackendClass::Gpu => Cell::Missing("it runs on GPUs".to_owned()),
        };
        let cells = vec![
            Cell::text(&t.file),
            Cell::text(&t.scenario),
            Cell::count(t.objects.into()),
            Cell::text(id.to_string()),
            Cell::number(t.predicted_ns / t.measured_ns, 3),
            Cell::number(t.measured_ns / 1e3, 2),
            Cell::number(t.predicted_ns / 1e3, 2),
            Cell::text(id.method()),
            Cell::text(id.backend().class().to_string()),
            threads,
        ];
        table.push(cells, own.as_slice());
    }
    table
}

/// Measured crossovers with their intervals, by the file of their report.
pub(super) type Measured = BTreeMap<String, Vec<Crossover>>;

/// The measured crossovers beside the predicted ones, as a table and as a picture.
pub(super) fn crossovers(held_out: &HeldOut, measured: &Measured, entries: &[Entry]) -> (DataTable, Agreement) {
    let mut table = DataTable::new([
        ("report", "report"),
        ("below", "below"),
        ("above", "above"),
        ("measured (objects)", "measured_objects"),
        ("predicted (objects)", "predicted_objects"),
        ("off by (octaves)", "off_by_octaves"),
        ("interval from (objects)", "measured_low_objects"),
        ("interval to (objects)", "measured_high_objects"),
        ("predicted curves cross", "predicted_to_cross"),
    ]);
    let mut groups = KINDS.map(|name| AgreementGroup { name: name.to_owned(), ..AgreementGroup::default() });
    groups.iter_mut().enumerate().for_each(|(k, group)| group.style = k);
    for HeldOutCrossover { file, compared } in &held_out.crossovers {
        let own = entries.iter().position(|e| e.file == *file);
        let interval =
            measured.get(file).and_then(|b| interval(b, &compared.below, &compared.above, compared.measured));
        let why = "its interval does not follow from the paired samples";
        let objects = |value: f64| Cell::number(value, 0);
        let cells = vec![
            Cell::text(file),
            Cell::text(compared.below.to_string()),
            Cell::text(compared.above.to_string()),
            objects(compared.measured),
            objects(compared.predicted),
            Cell::number(compared.octaves(), 2),
            Cell::optional(interval.map(|i| i.0), 0, why),
            Cell::optional(interval.map(|i| i.1), 0, why),
            Cell::text(if compared.crosses { "yes" } else { "no: an end of the slice stands for it" }),
        ];
        table.push(cells, own.as_slice());
        let kind = if compared.crosses { kind(&compared.below, &compared.above) } else { KINDS.len() - 1 };
        let point = AgreementPoint { measured: compared.measured, predicted: compared.predicted, interval };
        groups[kind].points.push(point);
    }
    let groups = groups.into_iter().filter(|g| !g.points.is_empty()).collect();
    let title = format!("Predicted and measured crossovers, {OURS}");
    (table, Agreement { title, values: Values::CrossoversObjects, groups })
}

/// The interval of the measured crossover between two algorithms near a number of objects. Both fits, that of the validation and that with
/// intervals, see the same timings; where they do not agree on a crossover its interval is not known.
fn interval(crossovers: &[Crossover], below: &AlgorithmId, above: &AlgorithmId, objects: f64) -> Option<(f64, f64)> {
    let is_own = |b: &&Crossover| b.below == *below && b.above == *above && (b.objects / objects).ln().abs() < SAME_LN;
    crossovers.iter().find(is_own)?.interval().filter(|(low, high)| (*low..=*high).contains(&objects))
}

fn kind(below: &AlgorithmId, above: &AlgorithmId) -> usize {
    if below.backend().class() != above.backend().class() {
        2
    } else {
        usize::from(below.backend().width() != above.backend().width())
    }
}
