//! The paper's three cards in `datasets/published/` hold what its Figure 9 prints.

use sapwise_lab::report::{self, Label, Report};
use sapwise_tune::hardware::{GpuParameterId, How, ParameterId};
use std::path::Path;

/// A column of Figure 9 and the machine of section 5 that the card stands in, in the paper's units.
struct Printed {
    file: &'static str,
    card: &'static str,
    /// CPU->GPU and GPU->CPU in MB/s.
    transfers: [f64; 2],
    /// Internal GPU in GB/s.
    internal: f64,
    /// Memory Size in MB.
    memory: f64,
    /// Clock Rate in GHz.
    clock: f64,
    /// Nb of Processors and Nb of Cores.
    counts: [f64; 2],
    /// The number in the parentheses after the CPU's name, and its GHz.
    cpu: (&'static str, f64, f64),
}

const FIGURE_9: [Printed; 3] = [
    Printed {
        file: "quadro-fx-3600m.json",
        card: "Quadro FX 3600M",
        transfers: [1856.12, 559.52],
        internal: 31.99,
        memory: 512.0,
        clock: 1.25,
        counts: [8.0, 64.0],
        cpu: ("X7900", 2.0, 2.8),
    },
    Printed {
        file: "quadro-fx-4600.json",
        card: "Quadro FX 4600",
        transfers: [2496.3, 2276.28],
        internal: 44.36,
        memory: 768.0,
        clock: 1.2,
        counts: [16.0, 128.0],
        cpu: ("X5472", 4.0, 3.0),
    },
    Printed {
        file: "quadro-fx-5800.json",
        card: "Quadro FX 5800",
        transfers: [2463.36, 2309.6],
        internal: 71.11,
        memory: 4096.0,
        clock: 1.296,
        counts: [30.0, 240.0],
        cpu: ("X5482", 8.0, 3.2),
    },
];

fn report(file: &str) -> Report {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/published");
    report::read(&std::fs::read_to_string(folder.join(file)).unwrap()).unwrap().value
}

#[test]
fn the_cards_hold_the_figures_of_the_paper_and_nothing_else() {
    for printed in FIGURE_9 {
        let report = report(printed.file);
        let file = printed.file;
        assert_eq!(report.label, Label::Published, "{file}");
        assert!(
            report.points.is_empty() && report.algorithms.is_empty(),
            "{file}: timings that the paper does not print"
        );
        let [card] = &report.hardware.gpus[..] else { panic!("{file}: not one card") };
        assert_eq!(card.gpu.name, printed.card);
        let [up, down] = printed.transfers;
        let [processors, lanes] = printed.counts;
        let of_card = [
            (GpuParameterId::UploadGbPerS.as_str(), up / 1000.0),
            (GpuParameterId::DownloadGbPerS.as_str(), down / 1000.0),
            (GpuParameterId::CopyGbPerS.as_str(), printed.internal),
            (GpuParameterId::MemoryBytes.as_str(), printed.memory * 1_048_576.0),
            (GpuParameterId::ClockGhz.as_str(), printed.clock),
            (GpuParameterId::Processors.as_str(), processors),
            (GpuParameterId::Lanes.as_str(), lanes),
        ];
        let (cpu, cores, ghz) = printed.cpu;
        assert!(report.hardware.machine.cpu.contains(cpu), "{file}: {}", report.hardware.machine.cpu);
        let of_cpu = [(ParameterId::PhysicalCores.as_str(), cores), (ParameterId::ClockReportedGhz.as_str(), ghz)];
        for (list, figures) in [(&card.parameters, &of_card[..]), (&report.hardware.parameters, &of_cpu[..])] {
            for p in list {
                match figures.iter().find(|f| f.0 == p.name) {
                    Some(&(name, value)) => {
                        let found = p.value.unwrap_or_else(|| panic!("{file}: {name} is missing"));
                        assert!((found / value - 1.0).abs() < 1e-9, "{file}: {name} is {found}, printed {value}");
                        assert_eq!(p.how, How::Published, "{file}: {name}");
                        assert!(p.source.contains("ISVRI 2011"), "{file}: {name}: {}", p.source);
                    }
                    None => {
                        assert!(
                            p.value.is_none() && p.how == How::Missing && !p.source.is_empty(),
                            "{file}: {}",
                            p.name
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn no_published_card_is_taken_for_a_measured_machine() {
    let mut ids: Vec<String> = Vec::new();
    for printed in FIGURE_9 {
        let report = report(printed.file);
        assert!(report.provenance.command.starts_with("transcribed from"), "{}", report.provenance.command);
        ids.push(report.hardware.machine.physical_id);
    }
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), FIGURE_9.len());
}
