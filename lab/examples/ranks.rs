//! Counts what ranks would search and send, for 1 to 64 million boxes over 4 to 1024 simulated ranks, and writes the table and its picture.
//!
//! ```text
//! cargo run --release -p sapwise-lab --example ranks -- lab/src/ranks/counted.csv pictures/ranks.svg
//! ```
//!
//! Takes minutes and up to 11 GB of memory. A third argument is the largest number of boxes in millions, 64 unless told.

use anyhow::{Context, Result};
use sapwise::{Model, Registry};
use sapwise_lab::data::{Evidence, Selection, read_reports};
use sapwise_lab::figures::{Figure, Picture, RanksPicture};
use sapwise_lab::progress::Silent;
use sapwise_lab::ranks::{Network, RankScene, RanksRow, write_rows};
use sapwise_scenes::Scenario;

/// Whose times are predicted.
const REPORT: &str = "datasets/amd-epyc-zen3-2c-full--2026-11-22.json";
const SCENARIOS: [Scenario; 3] = [Scenario::Uniform, Scenario::Clustered, Scenario::Fragmentation];
const MILLIONS: [usize; 4] = [1, 4, 16, 64];
const RANKS: [usize; 6] = [2, 4, 16, 64, 256, 1024];

// The tests of the package compile it, and run nothing of it.
#[cfg(not(test))]
fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let table = arguments.next().context("name the table to write")?;
    let picture = arguments.next().context("name the picture to write")?;
    let most = arguments.next().map_or(Ok(64), |text| text.parse())?;
    let rows = count(most)?;
    std::fs::write(table, write_rows(&rows)?)?;
    let caption = [
        "Counted for simulated ranks; times predicted for two virtual cores of an AMD EPYC of Zen 3, exchange assumed at 1 GB/s and 5 us a step."
            .to_owned(),
        "Made by: cargo run --release -p sapwise-lab --example ranks".to_owned(),
    ];
    Ok(std::fs::write(picture, RanksPicture::new(&rows).draw(Picture::Svg, &caption)?)?)
}

/// Every scenario with up to so many million boxes.
pub(crate) fn count(most: usize) -> Result<Vec<RanksRow>> {
    let reports = read_reports(&[REPORT.into()], &Silent)?;
    let (profiles, _) = Selection::of(&reports, Evidence::Real).finish();
    let profile = profiles.first().context("the report can't be trained on")?;
    let algorithms = profile.with_revisions(&profile.available());
    let tuning = Model::built_in()?.predict(&profile.hardware, &algorithms)?.tuning("uniform", &[]);
    let (registry, network) = (Registry::new(), Network::default());
    let mut rows = Vec::new();
    for scenario in SCENARIOS {
        for millions in MILLIONS.into_iter().filter(|m| *m <= most) {
            let boxes = millions << 20;
            let scene = RankScene::new(scenario, boxes, &registry)?;
            for ranks in RANKS {
                let row = scene.over(ranks, &tuning, &network);
                eprintln!(
                    "{scenario} {millions}M over {ranks}: halo {:.2} %, boxes {:.3}, time {:.3}, efficiency {:.3} and {:.3}",
                    100.0 * row.halo_share,
                    row.searched_most_over_mean,
                    row.slowest_over_mean,
                    row.efficiency_boxes,
                    row.efficiency
                );
                rows.push(row);
            }
        }
    }
    Ok(rows)
}
