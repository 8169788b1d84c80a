//! What goes with what: parameters and outcomes between machines, and what it does to take one thing from a machine.

use super::builder::SectionBuilder;
use crate::data_table::{Cell, DataTable};
use crate::evaluate::{Interval, Verdict};
use crate::figures::{self, InfluenceCell};
use crate::page::{Block, Section};
use crate::study::folder::Folder;
use crate::study::influence::{Influence, Link, On};
use crate::study::material::Study;
use crate::study::{rank, restrictions};
use crate::text::count;
use anyhow::Result;
use std::collections::BTreeSet;

/// Rows of the matrix of influences that stay legible.
const MOST_ROWS: usize = 36;

pub(super) fn influences(
    study: &Study,
    influence: &Influence,
    folder: &mut Folder,
    missing: &mut Vec<String>,
) -> Result<Section> {
    let mut section =
        SectionBuilder::new("influence", "Which parameters matter for which algorithm and crossover", missing);
    let links: Vec<&Link> = influence.links.iter().collect();
    if links.is_empty() {
        let few = influence.machines < rank::FEWEST_MACHINES;
        section.lacks(if few {
            format!(
                "the timings are of {}, and it takes {} to tell a link between machines; the section before shows what was taken from one \
                 machine on purpose",
                count(influence.machines, "physical machine"),
                rank::FEWEST_MACHINES
            )
        } else {
            format!("no parameter and no time or crossover are known of {} machines, and vary", rank::FEWEST_MACHINES)
        });
        return Ok(section.section);
    }
    section.text(
        "Two methods. Rank correlation over machines (Spearman, of an algorithm with its time for frames of 1000 objects or more; of the links \
         one in ten is expected to be none): what goes together, whatever the cause. Fitted without: how much worse predictions of held-out \
         machines are when every machine has the same value, in the training too: what no other parameter stands in for. All intervals are \
         of 90 %. The verdict is that of fitted without, where predictions read the parameter, else that of the ranks.",
    );
    match &study.importance {
        Err(why) => section.lacks(why.clone()),
        Ok(importance) => section.section.blocks.push(Block::List(importance.notes.clone())),
    }
    let matrix = matrix(influence, &links);
    let all = links.iter().map(|l| l.parameter.as_str()).collect::<BTreeSet<_>>().len();
    let told = format!(
        "{} of {all} parameters, those first that say most, against algorithms, predictions of methods, crossovers and the choice: the verdict, \
         and the rank correlation where there is one.",
        matrix.rows.len()
    );
    let table = links_table(&links, &influence.reports);
    section.push(folder.figure("influence", &matrix, &told, &influence.reports, &[("influence", &table)]))?;
    let caption = "Every link that was looked at. Fitted without: of the prediction of a method the rise of its distance from the measured times \
                   (natural logarithm), of the choice that of the regret.";
    section.push(folder.table("influence", caption, table))?;
    Ok(section.section)
}

fn outcome(on: &On) -> String {
    match on {
        On::Algorithm(name) => format!("time of {name}"),
        On::Method(name) => format!("prediction of {name}"),
        On::Crossover(name) => format!("crossover {name}"),
        On::Choice => "the choice".to_owned(),
    }
}

fn matrix(influence: &Influence, links: &[&Link]) -> figures::Influence {
    let columns: BTreeSet<&On> = links.iter().map(|l| &l.on).collect();
    // What says most first: links, then what was shown to be none.
    let weight = |parameter: &str| {
        let own = links.iter().filter(|l| l.parameter == parameter);
        let count = |verdict| own.clone().filter(|l| l.verdict == verdict).count();
        let read = own.clone().filter(|l| l.effect.is_some()).count() > 1;
        (read, count(Verdict::Linked), count(Verdict::NotLinked))
    };
    let mut rows: Vec<&str> = links.iter().map(|l| l.parameter.as_str()).collect::<BTreeSet<_>>().into_iter().collect();
    rows.sort_by_key(|p| std::cmp::Reverse(weight(p)));
    rows.truncate(MOST_ROWS);
    let cell = |parameter: &str, on: &On| match influence.link(parameter, on) {
        None => InfluenceCell::default(),
        Some(link) => InfluenceCell {
            verdict: Some(link.verdict),
            text: link.rank.map_or(String::new(), |r| format!("{:+.2}", r.correlation)),
        },
    };
    figures::Influence {
        title: "Which parameters matter for what".to_owned(),
        cells: rows.iter().map(|p| columns.iter().map(|on| cell(p, on)).collect()).collect(),
        columns: columns.into_iter().map(outcome).collect(),
        rows: rows.into_iter().map(str::to_owned).collect(),
    }
}

fn links_table(links: &[&Link], reports: &[usize]) -> DataTable {
    let mut table = DataTable::new([
        ("parameter", "parameter"),
        ("outcome", "outcome"),
        ("verdict", "verdict"),
        ("rank correlation", "rank_correlation"),
        ("from", "rank_correlation_low"),
        ("to", "rank_correlation_high"),
        ("machines", "rank_machines"),
        ("fitted without", "fitted_without_rise"),
        ("from", "fitted_without_rise_low"),
        ("to", "fitted_without_rise_high"),
        ("by ranks", "rank_verdict"),
        ("by predictions", "prediction_verdict"),
    ]);
    for link in links {
        let few = "fewer than five machines have both, or one of both is the same on all";
        let unread = "predictions of this do not read it, or too few machines have it";
        let rank = |of: fn(&rank::Rank) -> f64| Cell::optional(link.rank.as_ref().map(of), 2, few);
        let refitted = link.effect.as_ref().and_then(|e| e.rise);
        let rise = |of: fn(Interval) -> f64| Cell::optional(refitted.map(of), 4, unread);
        let verdict = |of: Option<Verdict>, none: &str| {
            of.map_or_else(|| Cell::Missing(none.to_owned()), |verdict| Cell::text(verdict.to_string()))
        };
        let cells = vec![
            Cell::text(&link.parameter),
            Cell::text(outcome(&link.on)),
            Cell::text(link.verdict.to_string()),
            rank(|r| r.correlation),
            rank(|r| r.low),
            rank(|r| r.high),
            Cell::optional(link.rank.map(|r| r.machines as f64), 0, few),
            rise(|i| i.mean),
            rise(|i| i.low),
            rise(|i| i.high),
            verdict(link.rank.map(|r| r.verdict), few),
            verdict(link.effect.as_ref().map(|e| e.verdict), unread),
        ];
        table.push(cells, reports);
    }
    table
}

pub(super) fn restrictions(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut section = SectionBuilder::new("restrictions", "One machine with less of one thing", missing);
    let (effects, shown) = restrictions::effects(&study.entries);
    if effects.is_empty() {
        section.lacks(
            "no two reports of one machine differ in one thing only; `sapwise probe --profiles` measures such a family",
        );
        return Ok(section.section);
    }
    section.text(
        "Between machines everything differs at once. Here are pairs of reports of one machine that differ in one thing, which was taken on \
         purpose, and in when they were measured. A verdict takes three pairs: linked where each shows 5 % or more in the same direction, \
         not linked where none does. Only pairs count whose parameters show that something was taken.",
    );
    let mut table = DataTable::new([
        ("taken", "taken"),
        ("algorithm", "algorithm"),
        ("objects", "objects"),
        ("time over time without", "slowdown_ratio"),
        ("verdict", "verdict"),
        ("least", "slowdown_least_ratio"),
        ("most", "slowdown_most_ratio"),
        ("pairs", "pairs"),
    ]);
    for e in &effects {
        let sizes = if e.large { "1000 or more" } else { "fewer than 1000" };
        let mut cells =
            vec![Cell::text(&e.taken), Cell::text(&e.algorithm), Cell::text(sizes), Cell::number(e.slowdown, 3)];
        cells.extend([Cell::text(e.verdict.to_string()), Cell::number(e.least, 3), Cell::number(e.most, 3)]);
        cells.push(Cell::count(e.pairs as u64));
        table.push(cells, &e.reports);
    }
    section.push(folder.table("restrictions", "What each restriction does to the time of each algorithm.", table))?;
    let mut proofs = DataTable::new([
        ("taken", "taken"),
        ("parameter", "parameter"),
        ("with over without", "ratio"),
        ("least", "least_ratio"),
        ("most", "most_ratio"),
        ("pairs", "pairs"),
    ]);
    for s in &shown {
        let heads = [Cell::text(&s.taken), Cell::text(&s.parameter)];
        let figures = [s.ratio, s.least, s.most].map(|r| Cell::number(r, 3));
        proofs.push([&heads[..], &figures, &[Cell::count(s.pairs as u64)]].concat(), &s.reports);
    }
    section.push(folder.table("restriction-proofs", "What the parameters show of each restriction.", proofs))?;
    Ok(section.section)
}
