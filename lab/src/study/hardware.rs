//! Figure 9 of the paper: the hardware parameters of every machine.

use super::entry::Entry;
use crate::data_table::{Cell, Column, DataTable};
use sapwise::hardware::GpuParameterId;
use sapwise::hardware::{How, ParameterId};
use sapwise::{GpuHardware, Parameter};

/// Letters of a value that is sound, at most.
const MOST_LETTERS: usize = 24;

/// The rows of the paper's table, in its order, with what each is called here.
const PAPER: [(&str, &str); 7] = [
    ("CPU to GPU (upload)", GpuParameterId::UploadGbPerS),
    ("GPU to CPU (download)", GpuParameterId::DownloadGbPerS),
    ("internal GPU (copy)", GpuParameterId::CopyGbPerS),
    ("memory size", GpuParameterId::MemoryBytes),
    ("clock rate", GpuParameterId::ClockGhz),
    ("processors", GpuParameterId::Processors),
    ("cores (lanes)", GpuParameterId::Lanes),
];

/// The table as the paper has it, its cards first, one row a GPU. What acts as a GPU is told by its kind.
pub(super) fn as_in_the_paper(entries: &[Entry]) -> DataTable {
    let mut sheet = heads(&["GPU", "kind", "report"]);
    sheet.columns.extend(PAPER.map(|(title, key)| Column { title: title.to_owned(), key: key.to_owned() }));
    let mut gpus: Vec<(usize, &GpuHardware)> =
        entries.iter().enumerate().flat_map(|(k, e)| e.hardware.gpus.iter().map(move |g| (k, g))).collect();
    gpus.sort_by_key(|(k, _)| !entries[*k].is_published());
    for (k, gpu) in gpus {
        let mut cells = gpu_heads(&entries[k], gpu);
        cells.extend(PAPER.map(|(_, name)| cell(name, &gpu.parameters)));
        sheet.push(cells, &[k]);
    }
    sheet
}

/// Every parameter of the machines that any of them has, one row a report.
pub(super) fn machines(entries: &[Entry]) -> DataTable {
    let mut sheet = heads(&["report", "CPU", "kind", "vectors"]);
    let lists = || entries.iter().map(|e| &e.hardware.parameters[..]);
    let names = present(ParameterId::ALL, lists());
    columns(&mut sheet, &names);
    for (k, entry) in entries.iter().enumerate() {
        let machine = &entry.hardware.machine;
        let mut cells = [&entry.name[..], &machine.cpu, crate::label_text::kind(entry.kind), &machine.simd].map(Cell::text).to_vec();
        cells.extend(names.iter().map(|name| cell(name, &entry.hardware.parameters)));
        sheet.push(cells, &[k]);
    }
    sheet
}

/// The same of the GPUs, one row each.
pub(super) fn gpus(entries: &[Entry]) -> DataTable {
    let mut sheet = heads(&["GPU", "kind", "report"]);
    let lists = || entries.iter().flat_map(|e| &e.hardware.gpus).map(|g| &g.parameters[..]);
    let names = present(GpuParameterId::OF_ONE, lists());
    columns(&mut sheet, &names);
    for (k, entry) in entries.iter().enumerate() {
        for gpu in &entry.hardware.gpus {
            let mut cells = gpu_heads(entry, gpu);
            cells.extend(names.iter().map(|name| cell(name, &gpu.parameters)));
            sheet.push(cells, &[k]);
        }
    }
    sheet
}

fn heads(titles: &[&str]) -> DataTable {
    let column = |title: &&str| Column { title: (*title).to_owned(), key: title.to_ascii_lowercase() };
    DataTable { columns: titles.iter().map(column).collect(), rows: Vec::new() }
}

fn gpu_heads(entry: &Entry, gpu: &GpuHardware) -> Vec<Cell> {
    let kind = if entry.is_published() { "published".to_owned() } else { gpu.gpu.kind.to_string() };
    vec![Cell::text(&gpu.gpu.name), Cell::text(kind), Cell::text(&entry.name)]
}

fn columns(sheet: &mut DataTable, names: &[String]) {
    sheet.columns.extend(names.iter().map(|name| Column { title: words(name), key: name.clone() }));
}

/// A parameter's name without its unit, which stands with each value.
pub(super) fn words(name: &str) -> String {
    let units = ["_gb_per_s", "_gflop_per_s", "_g_per_s", "_bytes", "_ghz", "_ns", "_ratio"];
    let bare = units.iter().find_map(|unit| name.strip_suffix(unit)).unwrap_or(name);
    bare.replace(['/', '_'], " ")
}

/// Those of the names that any of the lists has a value of.
fn present<'a>(names: Vec<String>, lists: impl Iterator<Item = &'a [Parameter]> + Clone) -> Vec<String> {
    let has = |name: &String| lists.clone().flatten().any(|p| p.name == *name && p.value.is_some());
    names.into_iter().filter(has).collect()
}

fn cell(name: &str, parameters: &[Parameter]) -> Cell {
    match parameters.iter().find(|p| p.name == name) {
        None => Cell::Missing("the report does not have it".to_owned()),
        Some(Parameter { value: Some(value), .. }) => {
            let shown = crate::units::value(name, *value);
            // A value that can't be, such as 1e300, has hundreds of digits.
            let shown = if shown.len() > MOST_LETTERS { format!("{value:e}") } else { shown };
            Cell::Number { value: *value, shown }
        }
        Some(p) if p.how == How::Missing => Cell::Missing(p.source.clone()),
        Some(_) => Cell::Missing("the report holds no value".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_without_their_unit() {
        assert_eq!(words("gpu/upload_rate_gb_per_s"), "gpu upload rate");
        assert_eq!(words("latency_16_kib_ns"), "latency 16 kib");
        assert_eq!(words("usable_cores"), "usable cores");
    }
}
