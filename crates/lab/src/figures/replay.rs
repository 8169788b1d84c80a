//! A replay frame by frame: Figure 8 of the paper.

use super::{HPos, LINE, Result, colour, log, mesh, range, svg, text};
use plotters::prelude::*;

/// Most points of a curve; more can't be seen.
const MOST_POINTS: usize = 1000;
/// Most letters of a line of the caption.
const MOST_LETTERS: usize = 150;

/// The times of the adaptive choice and of every fixed algorithm, a value a frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Replay {
    /// The title above the picture.
    pub title: String,
    /// The time of the choice in ns.
    pub chosen_ns: Vec<f64>,
    /// The position of the algorithm that was chosen, among the fixed ones.
    pub chosen: Vec<Option<usize>>,
    /// Names of the fixed algorithms with their times in ns; infinite for a frame that was not timed.
    pub fixed: Vec<(String, Vec<f64>)>,
    /// Paragraphs below the picture.
    pub caption: Vec<String>,
}

impl Replay {
    /// Draws the choice in black over the curves of the algorithms, and below them a strip in the colour of the chosen
    /// algorithm.
    ///
    /// # Errors
    /// When plotters fails.
    pub fn svg(&self) -> Result<String> {
        let caption: Vec<String> = self.caption.iter().flat_map(|text| wrapped(text)).collect();
        let names: Vec<String> = self.fixed.iter().map(|f| f.0.clone()).collect();
        let below = LINE * (caption.len() as u32 + 1);
        svg((1400, 600 + below), &self.title, &names, |area| {
            let (above, captions) = area.split_vertically(600);
            let (times, strip) = above.split_vertically(540);
            let frames = 0.0..self.chosen_ns.len().max(1) as f64;
            let us = || self.fixed.iter().map(|f| &f.1).chain([&self.chosen_ns]).flatten().map(|ns| ns / 1e3);
            let mut chart = ChartBuilder::on(&times)
                .margin(12)
                .x_label_area_size(44)
                .y_label_area_size(70)
                .build_cartesian_2d(frames.clone(), log(range(us(), 1.2)))?;
            mesh(&mut chart, "frame", "time of a frame (µs); black: the adaptive choice")?;
            for (k, (_, ns)) in self.fixed.iter().enumerate() {
                chart.draw_series(LineSeries::new(thinned(ns), colour(k).stroke_width(2)))?;
            }
            chart.draw_series(LineSeries::new(thinned(&self.chosen_ns), BLACK.stroke_width(2)))?;
            let mut chart =
                ChartBuilder::on(&strip).margin_left(82).margin_right(12).build_cartesian_2d(frames, 0.0..1.0)?;
            text(&strip, "chosen", (74, 20), HPos::Right)?;
            let mut first = 0;
            for run in self.chosen.chunk_by(|a, b| a == b) {
                let corners = [(first as f64, 0.3), ((first + run.len()) as f64, 1.0)];
                first += run.len();
                let Some(k) = run[0] else { continue };
                chart.draw_series([Rectangle::new(corners, colour(k).filled())])?;
            }
            for (k, line) in caption.iter().enumerate() {
                text(&captions, line, (12, (LINE * (k as u32 + 1)) as i32), HPos::Left)?;
            }
            Ok(())
        })
    }
}

/// Returns means in µs over equal numbers of frames, each at its first frame. Infinite times are left out.
fn thinned(ns: &[f64]) -> Vec<(f64, f64)> {
    let step = ns.len().div_ceil(MOST_POINTS).max(1);
    let mean = |(k, chunk): (usize, &[f64])| {
        let known: Vec<f64> = chunk.iter().copied().filter(|ns| ns.is_finite()).collect();
        (!known.is_empty()).then(|| ((k * step) as f64, sapwise_tune::stats::mean(&known) / 1e3))
    };
    ns.chunks(step).enumerate().filter_map(mean).collect()
}

/// Splits a text into lines of whole words.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.is_empty() || line.chars().count() + word.chars().count() < MOST_LETTERS => {
                line.push_str(if line.is_empty() { "" } else { " " });
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
