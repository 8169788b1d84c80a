//! The section about simulated ranks, which is of no report: it shows the table that comes with the lab.

use super::super::folder::Folder;
use super::builder::SectionBuilder;
use crate::data_table::{Cell, DataTable};
use crate::figures::RanksPicture;
use crate::page::Section;
use crate::ranks::{RanksRow, read_rows};
use anyhow::Result;

/// Made by `cargo run --release -p sapwise-lab --example ranks`.
const COUNTED: &str = include_str!("../../ranks/counted.csv");

/// The picture and the table of simulated ranks.
///
/// # Errors
/// When the figure can't be drawn.
pub(super) fn ranks(folder: &mut Folder<'_>, missing: &mut Vec<String>) -> Result<Section> {
    let mut section = SectionBuilder::new("ranks", "Boxes over simulated ranks", missing);
    section.text(
        "What the ranks of an MPI program would search and send, counted in one process with the cuts that they would make. These figures come with the \
         lab and are of none of the reports: they were counted once, and the times in them are predicted.",
    );
    let rows = read_rows(COUNTED)?;
    let told = "Boxes that are searched in more than one region; the most boxes, and the longest predicted search, of a rank over the mean; and what an equal \
                part of the boxes is predicted to take over the frame, with an exchange that is assumed at 10 GB/s and 2 us a step. Predicted for two virtual \
                cores of an AMD EPYC of Zen 3. Each rank owns the boxes of its region.";
    section.push(folder.figure("ranks", &RanksPicture::new(&rows), told, &[], &[("ranks", &table(&rows))]))?;
    Ok(section.section)
}

fn table(rows: &[RanksRow]) -> DataTable {
    let mut table = DataTable::new([
        ("scenario", "scenario"),
        ("boxes", "boxes"),
        ("ranks", "ranks"),
        ("pairs", "pairs"),
        ("halo", "halo_share"),
        ("most boxes over mean", "searched_most_over_mean"),
        ("slowest over mean", "slowest_over_mean"),
        ("bytes of a rank", "bytes_mean"),
        ("most bytes", "bytes_most"),
        ("efficiency by boxes", "efficiency_boxes"),
        ("efficiency by time", "efficiency"),
    ]);
    for row in rows {
        let cells = vec![
            Cell::text(&row.scenario),
            Cell::count(row.boxes),
            Cell::count(row.ranks),
            Cell::count(row.pairs),
            Cell::percent(row.halo_share),
            Cell::number(row.searched_most_over_mean, 3),
            Cell::number(row.slowest_over_mean, 3),
            Cell::count(row.bytes_mean as u64),
            Cell::count(row.bytes_most as u64),
            Cell::percent(row.efficiency_boxes),
            Cell::percent(row.efficiency),
        ];
        table.push(cells, &[]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_that_comes_with_the_lab_can_be_read_and_holds_what_documents_say() {
        let rows = read_rows(COUNTED).unwrap();
        let of = |scenario: &str, boxes: u64, ranks| {
            rows.iter().find(|r| (&*r.scenario, r.boxes >> 20, r.ranks) == (scenario, boxes, ranks)).unwrap()
        };
        assert!(of("uniform", 64, 64).halo_share <= 0.06 && of("uniform", 64, 1024).efficiency_boxes >= 0.9);
        assert!(of("clustered", 16, 256).slowest_over_mean <= 1.1);
        assert_eq!(table(&rows).rows.len(), rows.len());
    }
}
