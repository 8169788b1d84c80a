//! Figure 9 of the paper: the hardware parameters of every machine.

use super::entry::Entry;
use crate::data::{COMPARED, COMPARED_OF_GPUS};
use crate::data_table::{Cell, Column, DataTable};
use crate::label_text::kind;
use sapwise::hardware::{GpuParameterId, How, with_unit};
use sapwise::{GpuHardware, Parameter};

/// Letters of a value that is sound, at most.
const MOST_LETTERS: usize = 24;

/// The rows of the paper's table, in its order, with what each is called here.
const PAPER: [(&str, GpuParameterId); 7] = [
    ("CPU to GPU (upload)", GpuParameterId::UploadGbPerS),
    ("GPU to CPU (download)", GpuParameterId::DownloadGbPerS),
    ("internal GPU (copy)", GpuParameterId::CopyGbPerS),
    ("memory size", GpuParameterId::MemoryBytes),
    ("clock rate", GpuParameterId::ClockGhz),
    ("processors", GpuParameterId::Processors),
    ("cores (lanes)", GpuParameterId::Lanes),
];

/// The table as the paper has it, its cards first, one row a GPU. Software adapters are told by their kind.
pub(super) fn as_in_the_paper(entries: &[Entry]) -> DataTable {
    let mut table = heads(&["GPU", "kind", "report"]);
    table.columns.extend(PAPER.map(|(title, key)| Column::new(title, key)));
    let mut gpus: Vec<(usize, &GpuHardware)> =
        entries.iter().enumerate().flat_map(|(k, e)| e.hardware.gpus.iter().map(move |g| (k, g))).collect();
    gpus.sort_by_key(|(k, _)| !entries[*k].is_published());
    for (k, gpu) in gpus {
        let mut cells = gpu_heads(&entries[k], gpu);
        cells.extend(PAPER.map(|(_, name)| cell(name, &gpu.parameters)));
        table.push(cells, &[k]);
    }
    table
}

/// The parameters of the machines by which predictions compare them, one row a report.
pub(super) fn machines(entries: &[Entry]) -> DataTable {
    let mut table = heads(&["report", "CPU", "kind", "vectors"]);
    columns(&mut table, &COMPARED);
    for (k, entry) in entries.iter().enumerate() {
        let machine = &entry.hardware.machine;
        let mut cells = [&entry.name[..], &machine.cpu, kind(entry.kind), &machine.simd].map(Cell::text).to_vec();
        cells.extend(COMPARED.iter().map(|name| cell(name, &entry.hardware.parameters)));
        table.push(cells, &[k]);
    }
    table
}

/// The same of the GPUs, one row each.
pub(super) fn gpus(entries: &[Entry]) -> DataTable {
    let mut table = heads(&["GPU", "kind", "report"]);
    columns(&mut table, &COMPARED_OF_GPUS);
    for (k, entry) in entries.iter().enumerate() {
        for gpu in &entry.hardware.gpus {
            let mut cells = gpu_heads(entry, gpu);
            cells.extend(COMPARED_OF_GPUS.iter().map(|name| cell(name, &gpu.parameters)));
            table.push(cells, &[k]);
        }
    }
    table
}

/// Every parameter of every report, one row each.
pub(super) fn parameters(entries: &[Entry]) -> DataTable {
    let mut table = DataTable::new([
        ("report", "report"),
        ("of", "processor"),
        ("parameter", "parameter"),
        ("value", "value"),
        ("interquartile range over median", "dispersion_ratio"),
        ("samples", "samples"),
        ("how", "how"),
        ("source", "source"),
    ]);
    for (k, entry) in entries.iter().enumerate() {
        let gpus = entry.hardware.gpus.iter().map(|g| (format!("gpu{}", g.gpu.index), &g.parameters));
        for (of, list) in std::iter::once(("machine".to_owned(), &entry.hardware.parameters)).chain(gpus) {
            for p in list {
                let spread = p.dispersion.map_or_else(|| Cell::Missing("it has none".to_owned()), Cell::exact);
                let mut cells = vec![Cell::text(&entry.name), Cell::text(&of), Cell::text(p.name.to_string())];
                cells.extend([p.value.map_or_else(|| Cell::Missing(p.source.clone()), Cell::exact), spread]);
                cells.extend([Cell::count(p.samples.into()), Cell::text(p.how.to_string()), Cell::text(&p.source)]);
                table.push(cells, &[k]);
            }
        }
    }
    table
}

fn heads(titles: &[&str]) -> DataTable {
    let column = |title: &&str| Column::new(*title, title.to_ascii_lowercase());
    DataTable { columns: titles.iter().map(column).collect(), rows: Vec::new() }
}

fn gpu_heads(entry: &Entry, gpu: &GpuHardware) -> Vec<Cell> {
    let kind = if entry.is_published() { "published".to_owned() } else { gpu.gpu.kind.to_string() };
    vec![Cell::text(&gpu.gpu.name), Cell::text(kind), Cell::text(&entry.name)]
}

fn columns<Id: AsRef<str>>(table: &mut DataTable, ids: &[Id]) {
    table.columns.extend(ids.iter().map(|id| Column::new(words(id.as_ref()), id.as_ref())));
}

/// A parameter's name without its unit, which stands with each value.
pub(super) fn words(name: &str) -> String {
    let units = ["_gb_per_s", "_gflop_per_s", "_g_per_s", "_bytes", "_ghz", "_ns", "_ratio"];
    let bare = units.iter().find_map(|unit| name.strip_suffix(unit)).unwrap_or(name);
    bare.replace(['/', '_'], " ")
}

fn cell(id: impl AsRef<str>, parameters: &[Parameter]) -> Cell {
    let name = id.as_ref();
    match parameters.iter().find(|p| p.name == name) {
        None => Cell::Missing("the report does not have it".to_owned()),
        Some(Parameter { value: Some(value), .. }) => {
            let shown = with_unit(name, *value);
            // A value that can't be, such as 1e300, has hundreds of digits.
            let shown = if shown.len() > MOST_LETTERS { format!("{value:e}") } else { shown };
            Cell::Number { value: *value, shown }
        }
        Some(p) if p.how == How::Missing => Cell::Missing(p.source.clone()),
        Some(_) => Cell::Missing("the report has no value".to_owned()),
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
