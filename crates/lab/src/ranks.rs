//! Boxes over simulated ranks: what each rank would search and send, counted with the cuts of `sapwise-ranks` and without MPI.
//!
//! One process has the boxes of all ranks. It cuts space as the ranks would, and counts for each region its boxes, its pairs and what crosses. The time of a
//! rank's search is predicted from its load; that of the exchange follows from the bytes and from a [`Network`] that is assumed and was not measured.

mod census;
mod row;

use anyhow::{Context, Result};
use census::Census;
use sapwise::{Adaptive, BroadPhase, Pairs, Registry, Tuning};
use sapwise_ranks::{Cuts, Sample, bisect, costs, predicted_ns};
use sapwise_scenes::{Scenario, Scene};

pub use row::{Network, RanksRow, read_rows, write_rows};

/// Cuts by counts of boxes, and then once more by what each region costs: as ranks cut, which know no costs before their first frames.
const ROUNDS: usize = 3;

/// A scene with its pairs, to be spread over several numbers of ranks.
pub struct RankScene {
    scenario: Scenario,
    scene: Scene,
    pairs: Pairs,
    /// Of each box.
    pairs_of: Vec<u32>,
    /// How far boxes move in a frame, in edges.
    moved: f64,
}

impl RankScene {
    /// So many boxes of a scenario, `fragmentation` at its peak, with their pairs.
    ///
    /// # Errors
    /// When the pairs can't be found.
    pub fn new(scenario: Scenario, boxes: usize, registry: &Registry) -> Result<Self> {
        const PEAK: u64 = 270;
        let mut scene = scenario.start(boxes, 1);
        if scenario == Scenario::Fragmentation {
            (0..PEAK).for_each(|_| scene.advance());
        }
        let mut broad_phase = Adaptive::new(Tuning::usual(registry), registry)?;
        let mut pairs = Pairs::new();
        broad_phase.find_pairs(scene.boxes(), &mut pairs).context("the pairs of all ranks can't be found")?;
        let mut pairs_of = vec![0; scene.boxes().len()];
        for &(i, j) in &pairs {
            pairs_of[i as usize] += 1;
            pairs_of[j as usize] += 1;
        }
        Ok(Self { scenario, scene, pairs, pairs_of, moved: 0.05 })
    }

    /// The scene over ranks of equal machines, whose times are predicted by `tuning`. Each rank owns the boxes whose middle lies in its region, as it does
    /// where owners follow the cuts.
    #[must_use]
    pub fn over(&self, ranks: usize, tuning: &Tuning, network: &Network) -> RanksRow {
        let boxes = self.scene.boxes();
        let shares = vec![1.0 / ranks as f64; ranks];
        let mut before: Option<(Cuts, Vec<f64>)> = None;
        let mut best: Option<RanksRow> = None;
        // Nothing is known of pairs before the first frame.
        let mut pair_cost = 0.0;
        for _ in 0..ROUNDS {
            let most = Sample::MOST.saturating_mul(ranks);
            let mut samples = Sample::with_pairs(boxes, most, |k| self.pairs_of[k], pair_cost);
            if let Some((cuts, works)) = &before {
                let owned = Sample::weights(&samples, cuts);
                Sample::weigh(&mut samples, cuts, &costs(works, &owned));
            }
            let cuts = bisect(&mut samples, &shares, &mut |_| ());
            drop(samples);
            let census = Census::of(&cuts, boxes, self.pairs.as_slice());
            // As `Distributed` weighs regions: by the boxes and pairs of each, and the candidates of a mean one.
            let mean = census.mean_load(boxes, self.moved);
            pair_cost = sapwise_ranks::pair_cost(&mean, |load| predicted_ns(tuning, load));
            let time = |objects: u64, pairs: f64| {
                predicted_ns(tuning, &mean.rescaled(objects.min(u64::from(u32::MAX)) as u32, pairs))
            };
            let times: Vec<f64> = census.searched.iter().zip(&census.found).map(|(&n, &p)| time(n, p as f64)).collect();
            let even = time((boxes.len() / ranks) as u64, self.pairs.len() as f64 / ranks as f64);
            let row = self.row(&census, &times, even, network);
            if best.as_ref().is_none_or(|b| row.slowest_over_mean < b.slowest_over_mean) {
                best = Some(row);
            }
            let all = times.iter().sum::<f64>() / ranks as f64;
            before = Some((cuts, times.iter().map(|ns| ns / all).collect()));
        }
        best.unwrap_or_default()
    }

    fn row(&self, census: &Census, times: &[f64], even_ns: f64, network: &Network) -> RanksRow {
        let ranks = times.len();
        let boxes = self.scene.boxes().len();
        let mean = |values: &[u64]| values.iter().sum::<u64>() as f64 / ranks as f64;
        let most = |values: &[u64]| values.iter().copied().max().unwrap_or(0) as f64;
        let mean_ns = times.iter().sum::<f64>() / ranks as f64;
        let slowest = times.iter().copied().fold(0.0, f64::max);
        let bytes: Vec<u64> = census.bytes(ranks);
        let frame = times.iter().zip(&bytes).map(|(ns, &b)| ns + network.ns(b as f64, ranks)).fold(0.0, f64::max);
        RanksRow {
            scenario: self.scenario.name().to_owned(),
            boxes: boxes as u64,
            ranks: ranks as u64,
            pairs: self.pairs.len() as u64,
            searched_mean: mean(&census.searched),
            searched_most_over_mean: most(&census.searched) / mean(&census.searched).max(1.0),
            halo_share: census.searched.iter().sum::<u64>() as f64 / boxes.max(1) as f64 - 1.0,
            bytes_mean: mean(&bytes),
            bytes_most: most(&bytes),
            slowest_over_mean: slowest / mean_ns,
            search_slowest_ns: slowest,
            frame_ns: frame,
            efficiency_boxes: boxes as f64 / ranks as f64 / most(&census.searched).max(1.0),
            efficiency: even_ns / frame,
        }
    }
}
