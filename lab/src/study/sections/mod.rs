//! The sections of the page, in the order in which they are read.

mod frames;
mod links;

use super::claims::{self, Claim, Outcome, PRINTED_SPEED_UP};
use super::entry::Entry;
use super::folder::Folder;
use super::influence::Influence;
use super::ratios::Comparison;
use super::{Study, hardware};
use crate::page::{Block, Section};
use crate::data_table::{Cell, DataTable};
use crate::text::grouped;
use anyhow::Result;

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
pub(in crate::study) fn all(
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
        links::influences(study, influence, folder, missing)?,
        links::taken(study, folder, missing)?,
        frames::curves(study, folder, missing)?,
        frames::fields(study, folder, missing)?,
        frames::prediction(study, folder, missing)?,
        left_out(study, missing),
    ])
}

/// The first words of the page.
pub(in crate::study) fn lead(study: &Study, influence: &Influence) -> Vec<String> {
    let count = |n: usize, what: &str| format!("{} {what}{}", grouped(n as u64), if n == 1 { "" } else { "s" });
    let studied = study.studied();
    let simulated = studied.iter().any(|&k| study.entries[k].kind == crate::report::Label::Simulated);
    let mut lead = vec![format!(
        "{} read, the timings of {} studied, of {}. What the paper of Avril, Gouranton and Arnaldi (ISVRI 2011) asks in its Section 6 is asked \
         of them: which hardware parameters decide how fast a broad-phase algorithm is and where another one overtakes it, and can that be \
         predicted.",
        count(study.entries.len(), "report"),
        grouped(studied.len() as u64),
        count(influence.machines, "physical machine"),
    )];
    if influence.reports.len() < influence.machines && influence.machines > 1 {
        lead.push(format!(
            "Rank correlations look at {} of these machines, evenly taken.",
            grouped(influence.reports.len() as u64)
        ));
    }
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
pub(in crate::study) fn note(entry: &Entry) -> String {
    let machine = &entry.hardware.machine;
    let gpus: Vec<&str> = entry.hardware.gpus.iter().map(|g| g.gpu.name.as_str()).collect();
    let gpus = if gpus.is_empty() { "no GPU".to_owned() } else { gpus.join(", ") };
    let p = &entry.provenance;
    let left_out = entry.studied.as_ref().err().map_or(String::new(), |why| format!("; timings not studied: {why}"));
    format!("{}, {}, {gpus}; {}, {}; {}{left_out}", crate::label_text::kind(entry.kind), machine.cpu, p.date, p.version, p.command)
}

fn decided(claims: &[Claim], folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut part = Part::new("claims", "What the paper says, and what became of it", missing);
    let mut sheet = DataTable::new([
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
            "{undecided} of {} claims can't be decided by these reports; the table says why for each",
            claims.len()
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
    let caption = "Every parameter of the machines, one row a report. Kinds: real_full is a whole machine, real_restricted one with fewer cores or \
                   shorter vectors than it has, real_contended one that other programs load, real_software_gpu one whose GPU is a program; \
                   simulated is made up, published from a publication. datasets/README.md says how each parameter is measured.";
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
         algorithm is. A speed-up is the median over all scenarios and sizes from 1000 objects on that both were timed at, with its \
         quartiles.",
    );
    let mut drawn = |part: &mut Part<'_>, id: &str, comparison: &Comparison<'_>, told: &str| {
        let (figure, alike) = comparison.figure();
        let alike = if alike.is_empty() { String::new() } else { format!(" Alike within 5 %: {}.", alike.join(", ")) };
        let some = comparison
            .share_drawn()
            .map_or(String::new(), |(drawn, all)| format!(" Drawn: {drawn} of {all}, evenly taken."));
        part.push(folder.figure(id, &figure, &format!("{told}{some}{alike}"), &comparison.drawn()))
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
