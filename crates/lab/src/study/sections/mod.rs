//! The sections of the page, in the order in which they are read: pictures first, the claims of the paper and the tables of parameters last.

mod builder;
mod causes;
mod frames;
mod lead;
mod prediction;
mod ranks;

use super::claims::{self, Claim, Outcome, PRINTED_SPEED_UP};
use super::entry::Entry;
use super::folder::Folder;
use super::hardware;
use super::influence::Influence;
use super::material::Study;
use super::ratios::Comparison;
use crate::data_table::{Cell, DataTable};
use crate::label_text::kind;
use crate::page::{Block, Section};
use anyhow::Result;
use builder::SectionBuilder;

pub(super) use lead::{can_say, lead};

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
        frames::curves(study, folder, missing)?,
        frames::fields(study, folder, missing)?,
        prediction::prediction(study, folder, missing)?,
        ratios(study, folder, missing)?,
        causes::restrictions(study, folder, missing)?,
        causes::influences(study, influence, folder, missing)?,
        paper(claims, folder, missing)?,
        parameters(study, folder, missing)?,
        ranks::ranks(folder, missing)?,
        notes(study, missing),
    ])
}

/// What the list of reports says of one.
pub(super) fn note(entry: &Entry) -> String {
    let machine = &entry.hardware.machine;
    let gpus: Vec<&str> = entry.hardware.gpus.iter().map(|g| g.gpu.name.as_str()).collect();
    let gpus = if gpus.is_empty() { "no GPU".to_owned() } else { gpus.join(", ") };
    let p = &entry.provenance;
    let left_out = entry.studied.as_ref().err().map_or(String::new(), |why| format!("; timings not studied: {why}"));
    format!("{}, {}, {gpus}; {}, {}; {}{left_out}", kind(entry.kind), machine.cpu, p.date, p.version, p.command)
}

fn paper(claims: &[Claim], folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut section = SectionBuilder::new("claims", "What the paper says, and what became of it", missing);
    let undecided: Vec<&Claim> = claims.iter().filter(|c| c.by_reports.0 == Outcome::Undecidable).collect();
    if let Some(first) = undecided.first() {
        section.lacks(if undecided.iter().all(|c| c.by_reports.1 == first.by_reports.1) {
            let decided = |c: &&Claim| !matches!(c.by_reports.0, Outcome::Undecidable | Outcome::NotAsked);
            let decided = claims.iter().filter(decided).count();
            format!("these reports decide {decided} of {} claims: {}", claims.len(), first.by_reports.1)
        } else {
            format!(
                "these reports leave {} of {} claims open; the table says why for each",
                undecided.len(),
                claims.len()
            )
        });
    }
    let mut table = DataTable::new([
        ("the paper says", "claim"),
        ("by these reports", "by_these_reports"),
        ("by its own table", "by_its_table"),
        ("reason in these reports", "by_these_reports_because"),
        ("reason in its own table", "by_its_table_because"),
    ]);
    for claim in claims {
        let [reports, own] = [&claim.by_reports, &claim.by_its_table];
        let cells = [&claim.text, &reports.0.to_string(), &own.0.to_string(), &reports.1, &own.1];
        table.push(cells.map(Cell::text).to_vec(), &claim.cards);
    }
    let caption = "Claims of Section 6 of the paper. Its own evidence is the table of three cards and one speed-up in figures, 1.5 from the \
                   Quadro 4600 to the 5800; its curves are pictures, and nothing is read off them.";
    section.push(folder.table("claims", caption, table))?;
    Ok(section.section)
}

fn parameters(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut section = SectionBuilder::new("parameters", "Hardware parameters", missing);
    let entries = &study.entries;
    if !entries.iter().any(Entry::is_published) {
        section.lacks(
            "the paper's three cards are not among the reports; add datasets/published to see them beside these",
        );
    }
    let paper = hardware::as_in_the_paper(entries);
    if paper.rows.is_empty() {
        section.lacks("no report has a GPU");
    } else {
        let caption = "The parameters of Figure 9 of the paper, one row a GPU. Those of the paper's cards are as printed; ours are measured by \
                       transfers of 32 MiB or reported by the driver. Software means a software adapter, which runs on the CPU.";
        section.push(folder.table("figure-9", caption, paper))?;
    }
    let caption = "The machines by the parameters that predictions read, one row a report; tables/parameters.csv has every parameter of \
                   every report. Kinds: real_full is a whole machine, real_restricted one with fewer cores or shorter vectors than it has, \
                   real_contended one that other programs load, real_software_gpu one whose GPU is a software adapter, simulated one made \
                   from a specification, published one from a publication. datasets/README.md says how each parameter is measured.";
    section.push(folder.table("machines", caption, hardware::machines(entries)))?;
    let gpus = hardware::gpus(entries);
    if !gpus.rows.is_empty() {
        section.push(folder.table("gpus", "The GPUs by the parameters that predictions read, one row each.", gpus))?;
    }
    folder.data("parameters", "Every hardware parameter of every report", &hardware::parameters(entries))?;
    Ok(section.section)
}

fn ratios(study: &Study, folder: &mut Folder, missing: &mut Vec<String>) -> Result<Section> {
    let mut section = SectionBuilder::new("ratios", "Machines beside each other", missing);
    section.text(
        "Figures 10 and 11 of the paper: how many times the reference machine's value each parameter is, beside how many times as fast each \
         algorithm is. A speed-up is the median over all scenarios and sizes from 1000 objects on that both were timed at, with its \
         quartiles.",
    );
    let mut draw = |section: &mut SectionBuilder<'_>, id: &str, comparison: &Comparison<'_>, told: &str| {
        let (figure, alike) = comparison.figure();
        let alike = if alike.is_empty() { String::new() } else { format!(" Alike within 5 %: {}.", alike.join(", ")) };
        let some = comparison
            .share_drawn()
            .map_or(String::new(), |(drawn, all)| format!(" Drawn: {drawn} of {all}, evenly chosen."));
        let told = format!("{told}{some}{alike}");
        section.push(folder.figure(id, &figure, &told, &comparison.drawn(), &[(id, &comparison.table())]))
    };
    match study.reference {
        Some(reference) if study.wanted.iter().any(|k| *k != reference) => {
            let comparison = Comparison::new(&study.entries, reference, &study.wanted);
            let told = "Parameters and speed over those of the reference, quartiles as bars.";
            draw(&mut section, "figure-10-11", &comparison, told)?;
        }
        _ => section.lacks("it takes two reports with timings to compare one with the other"),
    }
    if let [Some(smallest), Some(slower), Some(faster)] = claims::cards(&study.entries) {
        let ten = Comparison::new(&study.entries, smallest, &[slower, faster]);
        let told = "Figure 10 of the paper: its cards over the smallest of them. It prints no times in figures to compare with these.";
        draw(&mut section, "figure-10-paper", &ten, told)?;
        let eleven = Comparison::new(&study.entries, slower, &[faster])
            .with_printed("broad phase, as printed", PRINTED_SPEED_UP);
        let told = "Figure 11 of the paper: the 5800 over the 4600, with the one speed-up that it prints in figures.";
        draw(&mut section, "figure-11-paper", &eleven, told)?;
    }
    Ok(section.section)
}

fn notes(study: &Study, missing: &mut Vec<String>) -> Section {
    let mut section = SectionBuilder::new("notes", "Limits of this study", missing);
    let whole = section.missing.clone();
    if !whole.is_empty() {
        section.text("Missing above:");
        section.section.blocks.push(Block::List(whole));
    }
    if !study.notes.is_empty() {
        section.text("Notes of the training:");
        section.section.blocks.push(Block::List(study.notes.clone()));
    }
    section.section
}
