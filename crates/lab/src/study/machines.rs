//! Figure 9 of the paper and the table of machines: hardware parameters.

use super::{Material, Page, title};
use crate::data::COMPARED;
use crate::label_text::kind;
use crate::report::Label;
use sapwise_tune::hardware::{GpuParameterId, with_unit};

/// The rows of the paper's table, in its order.
pub(super) const PAPER: [(&str, GpuParameterId); 7] = [
    ("CPU to GPU", GpuParameterId::UploadGbPerS),
    ("GPU to CPU", GpuParameterId::DownloadGbPerS),
    ("internal", GpuParameterId::CopyGbPerS),
    ("memory", GpuParameterId::MemoryBytes),
    ("clock", GpuParameterId::ClockGhz),
    ("processors", GpuParameterId::Processors),
    ("cores", GpuParameterId::Lanes),
];

/// Most letters of a value: an impossible one, such as 1e300, has hundreds of digits.
const MOST_LETTERS: usize = 24;

pub(super) fn section(material: &Material, page: &mut Page) {
    page.section("Machines");
    let head = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
    let mut rows = vec![[head(&["GPU", "kind"]), PAPER.map(|p| p.0.to_owned()).to_vec()].concat()];
    let mut reports: Vec<_> = material.reports.iter().map(|r| &r.1).collect();
    reports.sort_by_key(|report| report.label != Label::Published);
    for report in reports {
        for gpu in &report.hardware.gpus {
            let published = report.label == Label::Published;
            let how = if published { kind(report.label).to_owned() } else { gpu.gpu.kind.to_string() };
            let values = PAPER.map(|(_, id)| shown(id.as_str(), gpu.value(id)));
            // Every profile of a host has the same GPUs.
            if !rows.iter().any(|row: &Vec<String>| row[0] == gpu.gpu.name && row[1] == how) {
                rows.push([&[gpu.gpu.name.clone(), how][..], &values].concat());
            }
        }
    }
    if rows.len() > 1 {
        let caption = "Figure 9: GPUs. Those of the paper are as it prints them; the others are measured or reported \
                       by the driver. Software means an adapter that runs on the CPU.";
        page.table(caption, &rows);
    } else {
        page.lacks("Figure 9: no report has a GPU; datasets/published holds the three cards of the paper.");
    }
    let names = COMPARED.map(|id| id.as_str().replace('_', " "));
    let mut rows = vec![[head(&["report", "CPU", "kind", "vectors", "reports"]), names.to_vec()].concat()];
    for profile in material.whole_hosts() {
        let machine = &profile.hardware.machine;
        let alike = material.profiles.iter().filter(|p| p.machine() == profile.machine()).count().to_string();
        let words = [title(profile), &machine.cpu, kind(profile.label), &machine.simd, &alike].map(str::to_owned);
        let values = COMPARED.map(|id| shown(id.as_str(), profile.hardware.value(id)));
        rows.push([&words[..], &values].concat());
    }
    page.table("The hosts, each by the report that has most of it, with the parameters that predictions read.", &rows);
}

fn shown(name: &str, value: Option<f64>) -> String {
    let Some(value) = value else { return "-".to_owned() };
    let text = with_unit(name, value);
    if text.len() > MOST_LETTERS { format!("{value:e}") } else { text }
}
