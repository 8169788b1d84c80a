//! A comparison as a person reads it.

use super::{Comparison, CrossoverSpread, ParameterSpread};
use crate::spread;
use crate::steadiness::Steadiness;
use crate::text::{count, grouped};
use sapwise::hardware::with_unit;

impl Comparison {
    /// The comparison in words and in tables that `draw` draws from rows, the first of which is the head.
    pub fn text(&self, draw: impl Fn(&[Vec<String>]) -> String) -> String {
        let mut text = format!("{} of one machine", count(self.reports, "report"));
        if let Some(load) = self.foreign_load {
            text.push_str(&format!(", foreign load at most {} at half of the points of each", percent(load)));
        }
        let known: Vec<&Steadiness> = self.steadiness.iter().flatten().collect();
        if let Some(first) = known.first() {
            let of =
                |pick: fn(f64, f64) -> f64| known.iter().map(|s| s.core_to_core_ns).fold(first.core_to_core_ns, pick);
            let moved = known.iter().filter(|s| !s.is_steady()).count();
            text.push_str(&format!(
                "\nlatency between cores {:.0} to {:.0} ns from report to report; it changed within {moved} of them",
                of(f64::min),
                of(f64::max)
            ));
        }
        for sentence in &self.not_compared {
            text.push_str(&format!("\n{sentence}"));
        }
        text.push_str("\n\n");
        let head = ["parameter", "median", "IQR/median", "least to most, over the median"];
        text.push_str(&draw(&table(&head, self.parameters.iter().map(parameter))));
        if !self.crossovers.is_empty() {
            text.push('\n');
            let head = [
                "scenario",
                "crossover",
                "objects",
                "farthest from it",
                "IQR/median",
                "held by own intervals",
                "error of x2 costs",
                "reports",
            ];
            text.push_str(&draw(&table(&head, self.crossovers.iter().map(crossover))));
            text.push_str(CROSSOVERS);
        }
        if let Some(losses) = &self.losses {
            let told = |mean: f64, range: [f64; 2]| spread::percent(mean, Some(range), 2);
            text.push_str(&format!(
                "\nMean regret (least to largest) of the tuning of a report: {} on its own timings, {} on those of the others; beyond its own {}\n",
                told(losses.own, losses.own_range),
                told(losses.others, losses.others_range),
                told(losses.beyond_own, losses.beyond_own_range)
            ));
        }
        text
    }
}

/// What the columns of the crossovers mean.
const CROSSOVERS: &str = "Objects: the median over the reports. Farthest: the largest distance of a report's crossover from that median. Held: the share of the \
reports\nwhose own 90 % interval holds the median. Error of x2: what the wrong algorithm costs at half or twice the objects of the crossover.\n";

fn table(head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> Vec<Vec<String>> {
    std::iter::once(head.iter().map(|&h| h.to_owned()).collect()).chain(rows).collect()
}

fn parameter(s: &ParameterSpread) -> Vec<String> {
    let over = |v: f64| if s.median == 0.0 { "-".to_owned() } else { format!("{:.3}", v / s.median) };
    vec![
        s.name.clone(),
        with_unit(&s.name, s.median),
        s.dispersion.map_or("-".to_owned(), percent),
        format!("{} to {}", over(s.low), over(s.high)),
    ]
}

fn crossover(b: &CrossoverSpread) -> Vec<String> {
    vec![
        b.scenario.clone(),
        format!("{} to {}", b.below, b.above),
        grouped(b.objects.round() as u64),
        percent(b.largest_deviation),
        b.dispersion.map_or("-".to_owned(), percent),
        percent(b.own_interval_holds_median),
        b.cost_of_factor_two.map_or("-".to_owned(), percent),
        b.reports.to_string(),
    ]
}

fn percent(share: f64) -> String {
    format!("{:.2} %", share * 100.0)
}
