//! One line of the table of simulated ranks.

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

/// A network that is assumed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Network {
    /// Bytes that a rank sends in a nanosecond.
    pub bytes_per_ns: f64,
    /// Nanoseconds of one step of a collective operation, of which each has the logarithm of the number of ranks.
    pub step_ns: f64,
}

impl Network {
    /// Collective operations of a frame: counts, boxes, counts again, pairs.
    const OPERATIONS: f64 = 4.0;

    /// The time in which a rank sends so many bytes.
    #[must_use]
    pub fn ns(&self, bytes: f64, ranks: usize) -> f64 {
        bytes / self.bytes_per_ns + Self::OPERATIONS * self.step_ns * (ranks as f64).log2().ceil()
    }
}

impl Default for Network {
    /// 10 GB/s for each rank and 2 us a step, as a network of a cluster promises.
    fn default() -> Self {
        Self { bytes_per_ns: 10.0, step_ns: 2000.0 }
    }
}

/// A scene over some ranks.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RanksRow {
    /// The kind of scene.
    pub scenario: String,
    /// Boxes of all ranks.
    pub boxes: u64,
    /// How many ranks.
    pub ranks: u64,
    /// Pairs of all ranks.
    pub pairs: u64,
    /// Boxes that a rank searches, those of others included: the mean over ranks.
    pub searched_mean: f64,
    /// The most that a rank searches over that mean.
    pub searched_most_over_mean: f64,
    /// Boxes that are searched for another rank than the first, as a share of all boxes.
    pub halo_share: f64,
    /// Bytes that a rank sends in a frame: the mean.
    pub bytes_mean: f64,
    /// Bytes of the rank that sends most.
    pub bytes_most: f64,
    /// The predicted search of the slowest rank over the mean of all.
    pub slowest_over_mean: f64,
    /// The predicted search of the slowest rank in nanoseconds.
    pub search_slowest_ns: f64,
    /// The same with the exchange over the assumed network.
    pub frame_ns: f64,
    /// Boxes of a rank over the most that one searches: weak scaling by counted work.
    pub efficiency_boxes: f64,
    /// What a rank is predicted to take for an equal part of the boxes and pairs, with no halo, over the frame: weak scaling.
    pub efficiency: f64,
}

/// The rows as CSV, with the names of the fields above them.
///
/// # Errors
/// Never in practice.
pub fn write_rows(rows: &[RanksRow]) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    rows.iter().try_for_each(|row| writer.serialize(row))?;
    Ok(String::from_utf8(writer.into_inner().context("a table of ranks can't be written")?)?)
}

/// The rows of such a text.
///
/// # Errors
/// Where it is no such table.
pub fn read_rows(text: &str) -> Result<Vec<RanksRow>> {
    csv::Reader::from_reader(text.as_bytes()).deserialize().map(|row| Ok(row?)).collect()
}
