//! The sections of the page, in the order in which they are read.

use super::claims::{self, Claim, Outcome, PRINTED_SPEED_UP};
use super::entry::Entry;
use super::folder::Folder;
use super::influence::{Influence, Link, On};
use super::ratios::Comparison;
use super::{Study, accuracy, hardware, map, restrictions};
use crate::page::{Block, Section};
use crate::plot::{self, InfluenceCell, Mark3};
use crate::sheet::{Cell, Sheet};
use crate::table::grouped;
use crate::train::{Effect, Interval, Verdict};
use anyhow::Result;
use std::collections::BTreeSet;

/// Rows of the matrix of influences that stay legible.
const MOST_ROWS: usize = 36;

/// A section that is being made. What it lacks is told on the page and at its end.
struct Part<'a> {
    section: Section,
    missing: &'a mut Vec<String>,
}

impl<'a> Part<'a> {
    fn new(id: &str, title: &str, missing: &'a mut Vec<String>) -> Self {
        Self { section: Section { id: id.to_owned(), title: title.to_owned(), blocks: Vec::new() }, missing }
    }

    fn text(&mut self, text: impl Into<String>) {
        self.section.blocks.push(Block::Text(text.into()));
    }

    fn lacks(&mut self, what: impl Into<String>) {
        let what = what.into();
        self.missing.push(format!("{}: {what}", self.section.title));
        self.section.blocks.push(Block::Missing(what));
    }

    fn push(&mut self, block: Result<Block>) -> Result<()> {
        self.section.blocks.push(block?);
        Ok(())
    }
}

/// Everything on the page.
///
/// # Errors
/// When a figure can't be drawn.
pub(super) fn all(
    study: &Study,
    influence: &Influence,
    claims: &[Claim],
    folder: &mut Folder,
    missing: &mut Vec<String>,
) -> Result<Vec<Section>> {
    Ok(vec![
        decided(claims, folder, missing)?,
        parameters(study, folder, missing)?,
        ratios(study, folder, missing)?,
        influences(study, influence, folder, missing)?,
        taken(study, folder, missing)?,
        curves(study, folder, missing)?,
        fields(study, folder, missing)?,
        prediction(study, folder, missing)?,
        left_out(study, missing),
    ])
}

/// The first words of the page.
pub(super) fn lead(study: &Study, influence: &Influence) -> Vec<String> {
    let count = |n: usize, what: &str| format!("{} {what}{}", grouped(n as u64), if n == 1 { "" } else { "s" });
    let studied = study.studied();
    let simulated = studied.iter().any(|&k| study.entries[k].kind == sapwise::report::Label::Simulated);
    let mut lead = vec![format!(
        "{} read, the timings of {} studied, of {}. What the paper of Avril, Gouranton and Arnaldi (ISVRI 2011) asks in its Section 6 is asked \
         of them: which hardware parameters decide how fast a broad-phase algorithm is and where another one overtakes it, and can that be \
         predicted.",
        count(study.entries.len(), "report"),
        grouped(studied.len() as u64),
        count(influence.machines, "physical machine"),
    )];
    if simulated {
        lead.push(
            "These machines are simulated. They show what the cost model that made them says, and are no evidence of how fast any machine is."
                .to_owned(),
        );
    }
    if let Ok(trained) = &study.trained
        && let Some(ours) = trained.model.validation.methods.first()
    {
        lead.push(format!(
            "Predicted from hardware parameters alone, left out in turn by {}: mean regret {:.1} %, 95th percentile {:.1} %.",
            trained.model.validation.held_out,
            100.0 * ours.mean_regret,
            100.0 * ours.p95_regret
        ));
    }
    lead
}

/// What the list of reports says of one.
pub(super) fn note(entry: &Entry) -> String {
    let machine = &entry.hardware.machine;
    let gpus: Vec<&str> = entry.hardware.gpus.iter().map(|g| g.gpu.name.as_str()).collect();
    let gpus = if gpus.is_empty() { "no GPU".to_owned() } else { gpus.join(", ") };
    let p = &entry.provenance;
    let left_out = entry.studied.as_ref().err().map_or(String::new(), |why| format!("; timings not studied: {why}"));
    format!("{}, {}, {gpus}; {}, {}; {}{left_out}", hardware::kind(entry.kind), machine.cpu, p.date, p.version, p.command)
}

fn decided(claims: &[Claim], folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut part = Part::new("claims", "What the paper says, and what became of it", missing);
    let mut sheet = Sheet::new([
        ("the paper says", "claim"),
        ("by its own table", "by_its_table"),
        ("because", "by_its_table_because"),
        ("by these reports", "by_these_reports"),
        ("because", "by_these_reports_because"),
    ]);
    for claim in claims {
        let cells = [
            &claim.text,
            &claim.by_its_table.0.to_string(),
            &claim.by_its_table.1,
            &claim.by_reports.0.to_string(),
            &claim.by_reports.1,
        ];
        sheet.push(cells.map(Cell::text).to_vec(), &claim.cards);
    }
    let caption = "Claims of Section 6 of the paper. Its own evidence is the table of three cards and one speed-up in figures, 1.5 from the \
                   Quadro 4600 to the 5800; its curves are pictures, and nothing is read off them.";
    part.push(folder.table("claims", caption, sheet))?;
    let undecided = claims.iter().filter(|c| c.by_reports.0 == Outcome::Undecidable).count();
    if undecided > 0 {
        part.lacks(format!(
            "{undecided} of {} claims can't be decided by these reports; it takes those of {} or more machines with different GPUs",
            claims.len(),
            super::rank::FEWEST_MACHINES
        ));
    }
    Ok(part.section)
}

fn parameters(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut part = Part::new("parameters", "Hardware parameters", missing);
    let entries = &study.entries;
    if !entries.iter().any(Entry::is_published) {
        part.lacks("the paper's three cards are not among the reports; add datasets/published to have them beside these");
    }
    let paper = hardware::as_in_the_paper(entries);
    if paper.rows.is_empty() {
        part.lacks("no report has a GPU");
    } else {
        let caption = "The parameters of Figure 9 of the paper, one row a GPU. Those of the paper's cards are as printed; of ours, measured by \
                       transfers of 32 MiB or reported by the driver. Software is a program on the CPU that acts as a GPU.";
        part.push(folder.table("figure-9", caption, paper))?;
    }
    let caption = "Every parameter of the machines, one row a report. A dash says why on hover.";
    part.push(folder.table("machines", caption, hardware::machines(entries)))?;
    let gpus = hardware::gpus(entries);
    if !gpus.rows.is_empty() {
        part.push(folder.table("gpus", "Every parameter of the GPUs, one row each.", gpus))?;
    }
    Ok(part.section)
}

fn ratios(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut part = Part::new("ratios", "Machines beside each other", missing);
    part.text(
        "Figures 10 and 11 of the paper: how many times the reference machine's value each parameter is, beside how many times as fast each \
         algorithm is. A speed-up is the geometric mean over all scenarios and sizes from 1000 objects on that both were timed at, with its \
         quartiles.",
    );
    let mut drawn = |part: &mut Part<'_>, id: &str, comparison: &Comparison<'_>, told: &str| {
        let (figure, alike) = comparison.figure();
        let alike = if alike.is_empty() { String::new() } else { format!(" Alike within 5 %: {}.", alike.join(", ")) };
        part.push(folder.figure(id, &figure, &format!("{told}{alike}"), &comparison.drawn()))
    };
    if let [Some(smallest), Some(slower), Some(faster)] = claims::cards(&study.entries) {
        let ten = Comparison::new(&study.entries, smallest, &[slower, faster]);
        let told = "Figure 10 of the paper: its cards over the smallest of them. It prints no times in figures to set beside these.";
        drawn(&mut part, "figure-10-paper", &ten, told)?;
        let eleven =
            Comparison::new(&study.entries, slower, &[faster]).with_printed("broad phase, as printed", PRINTED_SPEED_UP);
        let told = "Figure 11 of the paper: the 5800 over the 4600, with the one speed-up that it prints in figures.";
        drawn(&mut part, "figure-11-paper", &eleven, told)?;
    }
    match study.reference {
        Some(reference) if study.wanted.iter().any(|k| *k != reference) => {
            let comparison = Comparison::new(&study.entries, reference, &study.wanted);
            drawn(
                &mut part,
                "figure-10-11",
                &comparison,
                "Parameters and speed over those of the reference, quartiles as bars.",
            )?;
            part.push(folder.table("ratios", "Every ratio, of all machines that were asked for.", comparison.sheet()))?;
        }
        _ => part.lacks("it takes two reports with timings to set one beside the other"),
    }
    Ok(part.section)
}

fn influences(study: &Study, influence: &Influence, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
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
        part.lacks(format!(
            "{} physical machine{} studied, and it takes {} to tell a link between machines; what was taken from one machine on \
             purpose is in the next section",
            influence.machines,
            if influence.machines == 1 { " was" } else { "s were" },
            super::rank::FEWEST_MACHINES
        ));
        return Ok(part.section);
    }
    let told =
        "Parameters against algorithms, borders and the choice: the verdict, and the rank correlation where there is one.";
    part.push(folder.figure("influence", &matrix(influence, &links), told, &influence.reports))?;
    let caption = "Every link that was looked at. Permuted and fitted without: of an algorithm the rise of the distance between predicted and \
                   measured times (natural logarithm), of a border that of its distance in octaves, of the choice that of the regret.";
    part.push(folder.table("influence", caption, links_sheet(&links)))?;
    Ok(part.section)
}

fn outcome(on: &On) -> String {
    match on {
        On::Algorithm(name) => format!("time of {name}"),
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

fn links_sheet(links: &[&Link]) -> Sheet {
    let mut sheet = Sheet::new([
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
        let rank = |of: fn(&super::rank::Rank) -> f64| Cell::optional(link.rank.as_ref().map(of), 2, few);
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
        sheet.push(cells, &[]);
    }
    sheet
}

fn taken(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut part = Part::new("taken", "What taking one thing from a machine does", missing);
    let (effects, shown) = restrictions::effects(&study.entries);
    if effects.is_empty() {
        part.lacks(
            "no two reports of one machine differ in one thing only; `sapwise probe --profiles` measures such a family",
        );
        return Ok(part.section);
    }
    part.text(
        "Between machines everything differs at once. Here are pairs of reports of one machine that differ in one thing that was taken \
         on purpose, so that a link is a cause on that machine: linked where every pair shows 5 % or more to the same side, not linked \
         where none does. A restriction is proved by what it does to parameters.",
    );
    let mut proofs =
        Sheet::new([("taken", "taken"), ("parameter", "parameter"), ("with over without", "ratio"), ("pairs", "pairs")]);
    for s in &shown {
        let figures = [Cell::number(s.ratio, 3), Cell::count(s.pairs as u64)];
        proofs.push([&[Cell::text(s.taken.to_string()), Cell::text(&s.parameter)][..], &figures].concat(), &[]);
    }
    part.push(folder.table("restrictions", "What the parameters show of each restriction.", proofs))?;
    let mut sheet = Sheet::new([
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
        let heads = [Cell::text(e.taken.to_string()), Cell::text(&e.algorithm), Cell::text(sizes)];
        sheet.push([&heads[..], &figures, &ends].concat(), &e.reports);
    }
    part.push(folder.table("taken", "What each restriction does to the time of each algorithm.", sheet))?;
    Ok(part.section)
}

fn curves(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut part = Part::new("curves", "Time over objects", missing);
    part.text(
        "Figures 4, 6 and 7 of the paper. Each side is its fastest algorithm at each size, medians with quartiles; the shades are the fields \
         of optimal performance by curves fitted to the same timings, the lines where one side overtakes another, with 90 % intervals.",
    );
    for (compared, drawn) in &study.drawn {
        let reports: Vec<(&Entry, &sapwise::Report)> = drawn.iter().map(|(k, r)| (&study.entries[*k], r)).collect();
        let of: Vec<usize> = drawn.iter().map(|d| d.0).collect();
        if of.is_empty() {
            part.lacks(format!("{}: no report has timings of both sides", compared.title()));
            continue;
        }
        let told = format!("{}, by the number of objects.", compared.title());
        part.push(folder.figure(compared.id(), &compared.figure(&reports), &told, &of))?;
    }
    Ok(part.section)
}

fn fields(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut part = Part::new("fields", "Fields over objects and density", missing);
    part.text(
        "The map that the paper could not draw: the number of objects alone does not decide. Cells are boxes spread evenly that move as in \
         the scenario uniform, by curves fitted to the machine's own timings on the left, and on the right predicted from its parameters by a \
         model that has not seen it. Points are what was timed, scenarios that clump or rest among them, so that a point may differ from its cell.",
    );
    let threads = study.drawn.iter().find(|(compared, _)| *compared == super::Compared::Threads);
    let first = threads.and_then(|(_, drawn)| drawn.first()).map(|d| d.0).or_else(|| study.studied().first().copied());
    let drawn = first.map(|k| (k, map::map(&study.entries[k], &study.profiles)));
    match drawn {
        None => part.lacks("no report has timings that can be studied"),
        Some((_, Err(why))) => part.lacks(format!("{why:#}")),
        Some((k, Ok(map))) => {
            let told = format!(
                "Left out: the {} of this report. At {} points the predicted choices lose {:.1} % on average; in {:.0} % of the cells both \
                 choose the same.",
                map.held_out,
                map.points,
                100.0 * map.regret,
                100.0 * map.agreeing
            );
            part.push(folder.figure("field-map", &map.figure, &told, &[k]))?;
        }
    }
    Ok(part.section)
}

fn prediction(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut part = Part::new("prediction", "Can it be predicted?", missing);
    let trained = match &study.trained {
        Ok(trained) => trained,
        Err(why) => {
            part.lacks(why.clone());
            return Ok(part.section);
        }
    };
    let validation = &trained.model.validation;
    if validation.methods.is_empty() {
        part.lacks("nothing was left out: it takes two reports; add reports of other machines");
        return Ok(part.section);
    }
    if !trained.held.by_machine {
        part.lacks(format!(
            "there is one physical machine, and what is left out in turn is its {}: this says little about machines never seen",
            validation.held_out
        ));
    }
    let studied = study.studied();
    part.push(folder.table(
        "scores",
        "Ways to choose an algorithm for a machine that was left out.",
        accuracy::scores(validation),
    ))?;
    part.push(folder.table(
        "regrets",
        "Mean regret of each of them on what was left out.",
        accuracy::regrets(&trained.held, &study.entries),
    ))?;
    let (sheet, figure) = accuracy::borders(&trained.held, &study.borders, &study.entries);
    if sheet.rows.is_empty() {
        part.lacks("no border was measured on what was left out");
    } else {
        let ends = trained.held.borders.iter().filter(|b| !b.beside.crosses).count();
        let told = format!(
            "Borders between fields, measured with 90 % intervals. Of {} predicted ones {ends} do not cross within the sizes that were \
             measured; the end beyond which they would stands for them.",
            trained.held.borders.len()
        );
        part.push(folder.figure("crossings", &figure, &told, &studied))?;
        part.push(folder.table("crossings", "Every one of these borders.", sheet))?;
    }
    if validation.learning.is_empty() {
        part.lacks("there is no learning curve: it takes three physical machines");
    } else {
        part.push(folder.table(
            "learning",
            "Regret by the number of machines in the training.",
            accuracy::learning(validation),
        ))?;
    }
    Ok(part.section)
}

fn left_out(study: &Study, missing: &mut Vec<String>) -> Section {
    let mut part = Part::new("notes", "What these figures don't say", missing);
    let whole = part.missing.clone();
    if !whole.is_empty() {
        part.text("Missing above:");
        part.section.blocks.push(Block::List(whole));
    }
    if !study.notes.is_empty() {
        part.text("Notes of the training:");
        part.section.blocks.push(Block::List(study.notes.clone()));
    }
    part.section
}
