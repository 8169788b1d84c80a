//! What goes with what: the links between parameters and outcomes, and what taking one thing does.

use super::Part;
use crate::page::{Block, Section};
use crate::figures::{self, InfluenceCell, Mark3};
use crate::data_table::{Cell, DataTable};
use crate::study::folder::Folder;
use crate::study::influence::{Influence, Link, On};
use crate::study::{Study, rank, restrictions};
use crate::train::{Effect, Interval, Verdict};
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
    let mut part = Part::new("influence", "Which parameters matter for which algorithm and border", missing);
    part.text(
        "Four methods. Rank correlation over machines (Spearman, of an algorithm with its time for frames of 1000 objects or more; a verdict of linked allows one in ten of them to be none): what goes \
         together, whatever the cause. Permuted: how much worse predictions of machines that were left out are when they get the value of \
         another machine. Fitted without: how much worse they are when every machine has the same value, in the training too: what no \
         other parameter stands in for. Left: rank correlation of a parameter that predictions of an algorithm do not read with the time \
         over the predicted one on machines that were left out: what it would add. All intervals are of 90 %. The verdict is that of \
         permuted and fitted without, else that of what is left, else that of the ranks.",
    );
    match &study.importance {
        Err(why) => part.lacks(why.clone()),
        Ok(importance) => {
            part.section.blocks.push(Block::List(importance.notes.clone()));
        }
    }
    let links: Vec<&Link> = influence.links.iter().collect();
    if links.is_empty() {
        let few = influence.machines < rank::FEWEST_MACHINES;
        let plural = if influence.machines == 1 { " was" } else { "s were" };
        part.lacks(if few {
            format!(
                "{} physical machine{plural} studied, and it takes {} to tell a link between machines; what was taken from one machine on \
                 purpose is in the next section",
                influence.machines,
                rank::FEWEST_MACHINES
            )
        } else {
            format!("no parameter and no time or border are known of {} machines, and vary", rank::FEWEST_MACHINES)
        });
        return Ok(part.section);
    }
    let matrix = matrix(influence, &links);
    let all = links.iter().map(|l| l.parameter.as_str()).collect::<BTreeSet<_>>().len();
    let told = format!(
        "{} of {all} parameters, those first that say most, against algorithms, predictions of methods, borders and the choice: the verdict, \
         and the rank correlation where there is one.",
        matrix.rows.len()
    );
    part.push(folder.figure("influence", &matrix, &told, &influence.reports))?;
    let caption = "Every link that was looked at. Permuted and fitted without: of the prediction of a method the rise of its distance from the \
                   measured times (natural logarithm), of a border that of its distance in octaves, of the choice that of the regret.";
    part.push(folder.table("influence", caption, links_sheet(&links, &influence.reports)))?;
    Ok(part.section)
}

fn outcome(on: &On) -> String {
    match on {
        On::Algorithm(name) => format!("time of {name}"),
        On::Method(name) => format!("prediction of {name}"),
        On::Border(name) => format!("border {name}"),
        On::Choice => "the choice".to_owned(),
    }
}

fn matrix(influence: &Influence, links: &[&Link]) -> plot::Influence {
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
        None => InfluenceCell { verdict: Mark3::Absent, value: None, text: String::new() },
        Some(link) => InfluenceCell {
            verdict: match link.verdict {
                Verdict::Linked => Mark3::Linked,
                Verdict::NotLinked => Mark3::NotLinked,
                Verdict::CannotBeTold => Mark3::CannotBeTold,
            },
            value: link.rank.map(|r| r.correlation),
            text: link.rank.map_or(String::new(), |r| format!("{:+.2}", r.correlation)),
        },
    };
    plot::Influence {
        title: "Which parameters matter for what".to_owned(),
        cells: rows.iter().map(|p| columns.iter().map(|on| cell(p, on)).collect()).collect(),
        columns: columns.into_iter().map(outcome).collect(),
        rows: rows.into_iter().map(str::to_owned).collect(),
    }
}

fn links_sheet(links: &[&Link], reports: &[usize]) -> DataTable {
    let mut sheet = DataTable::new([
        ("parameter", "parameter"),
        ("of", "of"),
        ("verdict", "verdict"),
        ("rank", "rank_correlation"),
        ("from", "rank_low"),
        ("to", "rank_high"),
        ("machines", "rank_machines"),
        ("by ranks", "rank_verdict"),
        ("permuted", "permuted_rise"),
        ("from", "permuted_low"),
        ("to", "permuted_high"),
        ("fitted without", "fitted_without_rise"),
        ("from", "fitted_without_low"),
        ("to", "fitted_without_high"),
        ("by predictions", "prediction_verdict"),
        ("left", "left_correlation"),
        ("from", "left_low"),
        ("to", "left_high"),
    ]);
    for link in links {
        let mut cells =
            vec![Cell::text(&link.parameter), Cell::text(outcome(&link.on)), Cell::text(link.verdict.to_string())];
        let few = "fewer than five machines have both, or one of both is the same on all";
        let rank = |of: fn(&rank::Rank) -> f64| Cell::optional(link.rank.as_ref().map(of), 2, few);
        cells.extend([rank(|r| r.correlation), rank(|r| r.low), rank(|r| r.high)]);
        cells.push(Cell::optional(link.rank.map(|r| r.machines as f64), 0, few));
        cells.push(link.rank.map_or_else(|| Cell::Missing(few.to_owned()), |r| Cell::text(r.verdict.to_string())));
        let effect = link.effect.as_ref();
        let unread = "predictions of this do not read it, or too few machines have it";
        let mut interval = |of: fn(&Effect) -> Option<Interval>| {
            let found = effect.and_then(of);
            cells.extend(
                [found.map(|i| i.mean), found.map(|i| i.low), found.map(|i| i.high)].map(|v| Cell::optional(v, 4, unread)),
            );
        };
        interval(|e| e.permuted);
        interval(|e| e.refitted);
        cells.push(effect.map_or_else(|| Cell::Missing(unread.to_owned()), |e| Cell::text(e.verdict.to_string())));
        let read = "predictions read it, or it is no time";
        let left = link.left.map_or([None; 3], |r| [r.correlation, r.low, r.high].map(Some));
        cells.extend(left.map(|v| Cell::optional(v, 2, read)));
        sheet.push(cells, reports);
    }
    sheet
}

pub(super) fn taken(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut part = Part::new("taken", "What taking one thing from a machine does", missing);
    let (effects, shown) = restrictions::effects(&study.entries);
    if effects.is_empty() {
        part.lacks(
            "no two reports of one machine differ in one thing only; `sapwise probe --profiles` measures such a family",
        );
        return Ok(part.section);
    }
    part.text(
        "Between machines everything differs at once. Here are pairs of reports of one machine that differ in one thing that was taken on \
         purpose, and in when they were measured. A verdict takes three pairs: linked where each shows 5 % or more to the same side, not \
         linked where none does. Only pairs count whose parameters show that something was taken.",
    );
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
    part.push(folder.table("restrictions", "What the parameters show of each restriction.", proofs))?;
    let mut sheet = DataTable::new([
        ("taken", "taken"),
        ("algorithm", "algorithm"),
        ("objects", "objects"),
        ("time over time without", "slowdown_ratio"),
        ("least", "slowdown_least_ratio"),
        ("most", "slowdown_most_ratio"),
        ("pairs", "pairs"),
        ("verdict", "verdict"),
    ]);
    for e in &effects {
        let figures = [e.slowdown, e.least, e.most].map(|r| Cell::number(r, 3));
        let ends = [Cell::count(e.pairs as u64), Cell::text(e.verdict.to_string())];
        let sizes = if e.large { "1000 or more" } else { "fewer than 1000" };
        let heads = [Cell::text(&e.taken), Cell::text(&e.algorithm), Cell::text(sizes)];
        sheet.push([&heads[..], &figures, &ends].concat(), &e.reports);
    }
    part.push(folder.table("taken", "What each restriction does to the time of each algorithm.", sheet))?;
    Ok(part.section)
}
