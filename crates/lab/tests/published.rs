//! The paper's three cards in `datasets/published/` hold what its Figure 9 prints, and `machines.csv` can be read.

use sapwise_lab::data::Published;
use sapwise_lab::report::{self, Label, Report};
use sapwise_tune::hardware::{GpuParameterId, How, ParameterId};
use std::collections::BTreeSet;
use std::path::Path;

/// The columns of Figure 9: the file, the card, CPU->GPU and GPU->CPU in MB/s, Internal GPU in GB/s, Memory Size in
/// MB, Clock Rate in GHz, Nb of Processors and Nb of Cores. Then of the machine of section 5 that the card stands in:
/// the name of the CPU, the number in the parentheses after it, and its GHz.
type Printed = (&'static str, &'static str, [f64; 7], (&'static str, f64, f64));

const FIGURE_9: [Printed; 3] = [
    ("quadro-fx-3600m.json", "Quadro FX 3600M", [1856.12, 559.52, 31.99, 512.0, 1.25, 8.0, 64.0], ("X7900", 2.0, 2.8)),
    ("quadro-fx-4600.json", "Quadro FX 4600", [2496.3, 2276.28, 44.36, 768.0, 1.2, 16.0, 128.0], ("X5472", 4.0, 3.0)),
    (
        "quadro-fx-5800.json",
        "Quadro FX 5800",
        [2463.36, 2309.6, 71.11, 4096.0, 1.296, 30.0, 240.0],
        ("X5482", 8.0, 3.2),
    ),
];

fn report(file: &str) -> Report {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/published");
    report::read(&std::fs::read_to_string(folder.join(file)).unwrap()).unwrap().value
}

#[test]
fn the_cards_hold_the_figures_of_the_paper_and_nothing_else() {
    let mut ids = BTreeSet::new();
    for (file, name, [up, down, internal, memory, clock, processors, lanes], (cpu, cores, ghz)) in FIGURE_9 {
        let report = report(file);
        assert_eq!(report.label, Label::Published, "{file}");
        assert!(report.provenance.command.starts_with("transcribed from"), "{file}: {}", report.provenance.command);
        assert!(ids.insert(report.hardware.machine.physical_id.clone()), "{file} has the id of another card");
        assert!(report.points.is_empty() && report.algorithms.is_empty(), "{file}: the paper prints no timings");
        let [card] = &report.hardware.gpus[..] else { panic!("{file}: not one card") };
        assert_eq!(card.gpu.name, name);
        let of_card = [
            (GpuParameterId::UploadGbPerS.as_str(), up / 1000.0),
            (GpuParameterId::DownloadGbPerS.as_str(), down / 1000.0),
            (GpuParameterId::CopyGbPerS.as_str(), internal),
            (GpuParameterId::MemoryBytes.as_str(), memory * 1_048_576.0),
            (GpuParameterId::ClockGhz.as_str(), clock),
            (GpuParameterId::Processors.as_str(), processors),
            (GpuParameterId::Lanes.as_str(), lanes),
        ];
        assert!(report.hardware.machine.cpu.contains(cpu), "{file}: {}", report.hardware.machine.cpu);
        let of_cpu = [(ParameterId::PhysicalCores.as_str(), cores), (ParameterId::ClockReportedGhz.as_str(), ghz)];
        let of_card = card.parameters.iter().map(|p| (p, of_card.iter().find(|f| f.0 == p.name)));
        let of_cpu = report.hardware.parameters.iter().map(|p| (p, of_cpu.iter().find(|f| f.0 == p.name)));
        for (p, printed) in of_card.chain(of_cpu) {
            let Some((name, value)) = printed else {
                assert!(p.value.is_none() && p.how == How::Missing && !p.source.is_empty(), "{file}: {}", p.name);
                continue;
            };
            let found = p.value.unwrap_or_else(|| panic!("{file}: {name} is missing"));
            assert!((found / value - 1.0).abs() < 1e-9, "{file}: {name} is {found}, printed {value}");
            assert_eq!(p.how, How::Published, "{file}: {name}");
            assert!(p.source.contains("ISVRI 2011"), "{file}: {name}: {}", p.source);
        }
    }
}

#[test]
fn published_machines_give_ranges_deciles() {
    let datasets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets");
    let mut model = sapwise_tune::Model::built_in().unwrap();
    let shares = Published::read(&[datasets]).unwrap().compare(&mut model).unwrap();
    assert!(shares.cpus.machines > 700 && shares.gpus.machines > 70, "{shares:?}");
    assert_eq!(model.defect(), None);
    for name in ["cache_llc_bytes", "gpu/read_gb_per_s"] {
        let range = model.ranges.iter().find(|range| range.parameter == name).unwrap();
        assert!(range.published.len() == 11 && shares.within.contains_key(name), "{name}");
    }
}
