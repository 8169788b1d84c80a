//! Every median time of the studied reports, one row each, for whoever analyses them with tools of their own.

use super::entry::Entry;
use super::folder::Folder;
use crate::data_table::{Cell, DataTable};
use anyhow::Result;
use sapwise::BackendClass;

/// Writes `tables/timings.csv`.
///
/// # Errors
/// When a row does not fit its columns.
pub(super) fn write(entries: &[Entry], folder: &mut Folder) -> Result<()> {
    let mut table = DataTable::new([
        ("report", "report"),
        ("scenario", "scenario"),
        ("algorithm", "algorithm"),
        ("method", "method"),
        ("processor", "processor"),
        ("threads", "threads"),
        ("GPUs", "gpus"),
        ("objects", "objects"),
        ("pairs", "pairs"),
        ("median (ns)", "median_ns"),
    ]);
    for (k, entry) in entries.iter().enumerate().filter(|(_, e)| e.studied.is_ok()) {
        for spot in &entry.profile.points {
            for (id, ns) in spot.medians.iter().map(|&(k, ns)| (entry.profile.id(k), ns)) {
                let on_gpus = id.backend().class() == BackendClass::Gpu;
                let (threads, gpus) = if on_gpus { (0, id.backend().width()) } else { (id.threads(), 0) };
                let words =
                    [&entry.name, &spot.scenario, &id.to_string(), id.method(), &id.backend().class().to_string()];
                let mut cells: Vec<Cell> = words.into_iter().map(Cell::text).collect();
                cells.extend([threads, gpus, spot.load.objects].map(|n| Cell::count(n.into())));
                cells.extend([spot.load.pairs, ns].map(Cell::exact));
                table.push(cells, &[k]);
            }
        }
    }
    folder.data("timings", "The median time of every algorithm at every point of every studied report", &table)
}
