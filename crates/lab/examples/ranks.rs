//! Counts what ranks would search and send, for 1 to 64 million boxes over 4 to 1024 simulated ranks, and writes the table and its picture.
//!
//! ```text
//! cargo run --release -p sapwise-lab --example ranks -- crates/lab/src/ranks/counted.csv pictures/ranks.svg
//! ```
//!
//! Takes half an hour and up to 12 GiB of memory. `uniform 16` behind the two files counts these millions of that scenario alone, and leaves the other rows of
//! the table as they are.

use anyhow::{Context, Result};
use sapwise::{Model, Registry};
use sapwise_lab::data::{Selection, read_reports};
use sapwise_lab::figures::{Figure, Picture, RanksPicture};
use sapwise_lab::progress::Silent;
use sapwise_lab::ranks::{Network, RankScene, RanksRow, read_rows, write_rows};
use sapwise_scenes::Scenario;

/// Whose times are predicted.
const REPORT: &str = "datasets/amd-epyc-zen3-2c/full.json";
/// Each with its largest number of boxes: of the other two 64 millions have more pairs than 12 GiB hold beside them.
const SCENARIOS: [(Scenario, usize); 3] =
    [(Scenario::Uniform, 64), (Scenario::Clustered, 16), (Scenario::Fragmentation, 16)];
const MILLIONS: [usize; 4] = [1, 4, 16, 64];
const RANKS: [usize; 6] = [2, 4, 16, 64, 256, 1024];

// The tests of the package compile it, and run nothing of it.
#[cfg(not(test))]
fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let table = arguments.next().context("name the table to write")?;
    let picture = arguments.next().context("name the picture to write")?;
    let only = match (arguments.next(), arguments.next()) {
        (Some(scenario), Some(millions)) => Some((scenario.parse::<Scenario>()?, millions.parse::<usize>()?)),
        _ => None,
    };
    let mut rows = if only.is_some() { read_rows(&std::fs::read_to_string(&table)?)? } else { Vec::new() };
    for (scenario, most) in SCENARIOS {
        for millions in MILLIONS.into_iter().filter(|m| *m <= most && only.is_none_or(|only| only == (scenario, *m))) {
            rows.retain(|row| (&*row.scenario, row.boxes >> 20) != (scenario.name(), millions as u64));
            rows.extend(count(scenario, millions << 20)?);
        }
    }
    let place = |row: &RanksRow| SCENARIOS.iter().position(|(s, _)| s.name() == row.scenario);
    rows.sort_by_key(|row| (place(row), row.boxes, row.ranks));
    std::fs::write(table, write_rows(&rows)?)?;
    let caption = [
        "Counted for simulated ranks; times predicted for two virtual cores of an AMD EPYC of Zen 3, exchange assumed at 10 GB/s and 2 us a step."
            .to_owned(),
        "Made by: cargo run --release -p sapwise-lab --example ranks".to_owned(),
    ];
    Ok(std::fs::write(picture, RanksPicture::new(&rows).draw(Picture::Svg, &caption)?)?)
}

/// So many boxes of a scenario over every number of ranks.
pub(crate) fn count(scenario: Scenario, boxes: usize) -> Result<Vec<RanksRow>> {
    let reports = read_reports(&[REPORT.into()], &Silent)?;
    let (profiles, _) = Selection::of(&reports).finish();
    let profile = profiles.first().context("the report can't be trained on")?;
    let algorithms = profile.with_revisions(&profile.available());
    let tuning = Model::built_in()?.predict(&profile.hardware, &algorithms)?.tuning("uniform", &[]);
    let scene = RankScene::new(scenario, boxes, &Registry::new())?;
    let row = |ranks| {
        let row = scene.over(ranks, &tuning, &Network::default());
        eprintln!(
            "{scenario} {boxes} over {ranks}: halo {:.2} %, boxes {:.3}, time {:.3}, efficiency {:.3} and {:.3}",
            100.0 * row.halo_share,
            row.searched_most_over_mean,
            row.slowest_over_mean,
            row.efficiency_boxes,
            row.efficiency
        );
        row
    };
    Ok(RANKS.into_iter().map(row).collect())
}
