//! A comparison as a person reads it.

use super::{BorderSpread, Comparison, Losses, ParameterSpread};
use crate::steadiness::Steadiness;
use crate::text::{count, grouped};
use crate::units;

impl Comparison {
    /// The comparison in words and in tables that `draw` draws from rows, the first of which is the head.
    pub fn text(&self, draw: impl Fn(&[Vec<String>]) -> String) -> String {
        let mut text = format!("{} of one machine", count(self.reports, "report"));
        if let Some(load) = self.foreign_load {
            text.push_str(&format!(", foreign load at most {} at half of the points of each", percent(load)));
        }
        let known: Vec<&Steadiness> = self.steadiness.iter().flatten().collect();
        if let Some(first) = known.first() {
            let of = |pick: fn(f64, f64) -> f64| known.iter().map(|s| s.core_to_core_ns).fold(first.core_to_core_ns, pick);
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
        if !self.borders.is_empty() {
            text.push('\n');
            let head = [
                "scenario",
                "border",
                "objects",
                "farthest from it",
                "IQR/median",
                "held by own intervals",
                "error of x2 costs",
                "reports",
            ];
            text.push_str(&draw(&table(&head, self.borders.iter().map(border))));
            text.push_str(BORDERS);
        }
        if let Some(Losses { own, others, beyond_own, beyond_own_most }) = &self.losses {
            text.push_str(&format!(
                "\nMean regret of the tuning of a report: {} on its own timings, {} on those of the others; beyond its own {}, at most {}\n",
                percent(*own),
                percent(*others),
                percent(*beyond_own),
                percent(*beyond_own_most)
            ));
        }
        text
    }
}

/// What the columns of the borders mean.
const BORDERS: &str = "Objects: the median over the reports. Farthest: the largest distance of a report's border from that median. Held: the share of the \
reports\nwhose own 90 % interval holds the median. Error of x2: what the wrong algorithm costs at half or twice the objects of the border.\n";

fn table(head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> Vec<Vec<String>> {
    std::iter::once(head.iter().map(|&h| h.to_owned()).collect()).chain(rows).collect()
}

fn parameter(s: &ParameterSpread) -> Vec<String> {
    let over = |v: f64| if s.median == 0.0 { "-".to_owned() } else { format!("{:.3}", v / s.median) };
    vec![
        s.name.clone(),
        units::value(&s.name, s.median),
        s.dispersion.map_or("-".to_owned(), percent),
        format!("{} to {}", over(s.low), over(s.high)),
    ]
}

fn border(b: &BorderSpread) -> Vec<String> {
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
