//! What Section 6 of the paper says of hardware parameters, compared with its own table and with these machines.

use super::entry::Entry;
use super::influence::{Influence, On};
use crate::evaluate::Verdict;
use sapwise::hardware::GpuParameterId;
use std::fmt;

/// The speed-up from the Quadro 4600 to the 5800 that the paper prints ("1.5X much faster"). It prints no other timing in figures.
pub(super) const PRINTED_SPEED_UP: f64 = 1.5;
/// The cards between which it is.
const SLOWER: &str = "quadro-fx-4600";
const FASTER: &str = "quadro-fx-5800";
const SMALLEST: &str = "quadro-fx-3600m";
/// A parameter that differs by less than this between two cards did not vary: what it does can't be seen.
const VARIED: f64 = 1.1;

/// What became of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    Confirmed,
    Refuted,
    Undecidable,
    /// The claim is about the paper's cards alone.
    NotAsked,
}

/// What the paper says of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Said {
    /// It does not influence the time, or hardly.
    NotLinked,
    /// It does.
    Linked,
    /// It is about the same on the three cards.
    AlikeOnAll,
    /// It is similar on two of them, which it does not name.
    AlikeOnTwo,
}

/// A claim with what follows from either evidence.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Claim {
    /// In our words.
    pub(super) text: String,
    /// The parameter of a GPU.
    pub(super) parameter: String,
    /// By the paper's own table, and why.
    pub(super) by_its_table: (Outcome, String),
    /// By the studied reports, and why.
    pub(super) by_reports: (Outcome, String),
    /// Positions of the paper's cards.
    pub(super) cards: Vec<usize>,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Confirmed => "confirmed",
            Self::Refuted => "refuted",
            Self::Undecidable => "undecidable",
            Self::NotAsked => "not asked",
        })
    }
}

/// The positions of the paper's cards, from the smallest to the fastest.
pub(super) fn cards(entries: &[Entry]) -> [Option<usize>; 3] {
    let card = |name: &str| entries.iter().position(|e| e.is_published() && e.name.ends_with(name));
    [SMALLEST, SLOWER, FASTER].map(card)
}

/// The claims of Section 6, in its order.
pub(super) fn claims(entries: &[Entry], influence: &Influence) -> Vec<Claim> {
    let said = [
        (
            "The clock rate of the GPU does not influence the time of the broad phase.",
            GpuParameterId::ClockGhz,
            Said::NotLinked,
        ),
        ("The clock rate is almost the same on the three cards.", GpuParameterId::ClockGhz, Said::AlikeOnAll),
        ("The bandwidth from CPU to GPU is almost the same on them.", GpuParameterId::UploadGbPerS, Said::AlikeOnAll),
        ("The bandwidth from GPU to CPU is similar on two of them.", GpuParameterId::DownloadGbPerS, Said::AlikeOnTwo),
        ("The bandwidth from CPU to GPU does not influence it.", GpuParameterId::UploadGbPerS, Said::NotLinked),
        ("The bandwidth from GPU to CPU does not influence it.", GpuParameterId::DownloadGbPerS, Said::NotLinked),
        ("The memory size of the GPU hardly influences it.", GpuParameterId::MemoryBytes, Said::NotLinked),
        ("The internal bandwidth of the GPU seems to influence it.", GpuParameterId::CopyGbPerS, Said::Linked),
        ("The number of cores of the GPU seems to influence it.", GpuParameterId::Lanes, Said::Linked),
    ];
    let cards = cards(entries);
    let claim = |(text, parameter, said): (&str, GpuParameterId, Said)| {
        let value = |card: Option<usize>| entries[card?].gpu()?.value(parameter);
        let values = cards.map(value);
        Claim {
            text: text.to_owned(),
            parameter: parameter.to_string(),
            by_its_table: by_its_table(said, values),
            by_reports: by_reports(said, parameter, influence),
            cards: cards.iter().flatten().copied().collect(),
        }
    };
    said.into_iter().map(claim).collect()
}

fn by_its_table(said: Said, values: [Option<f64>; 3]) -> (Outcome, String) {
    let [Some(smallest), Some(slower), Some(faster)] = values else {
        let why = "the paper's three cards are not among the reports; they are in datasets/published";
        return (Outcome::Undecidable, why.to_owned());
    };
    let ratio = faster / slower;
    let (least, most) = [smallest, slower, faster].iter().fold((f64::MAX, 0.0_f64), |(a, b), v| (a.min(*v), b.max(*v)));
    if said == Said::AlikeOnAll {
        let why = format!("the highest is {:.2} times the lowest; alike is within {VARIED}", most / least);
        return (if most / least < VARIED { Outcome::Confirmed } else { Outcome::Refuted }, why);
    }
    if said == Said::AlikeOnTwo {
        let why = format!(
            "{ratio:.2} times from the 4600 to the 5800, and {:.2} over all three; which two are meant is not said",
            most / least
        );
        return (Outcome::Undecidable, why);
    }
    let three = format!("it varies by {:.2} over all three, for which no times are printed", most / least);
    if ratio < VARIED && ratio > 1.0 / VARIED {
        let why = format!(
            "{ratio:.2} times as much from the 4600 to the 5800, the one pair with a printed time: what hardly varies can't be shown not to \
             matter; {three}"
        );
        return (Outcome::Undecidable, why);
    }
    // If the time were a power of this parameter alone.
    let exponent = PRINTED_SPEED_UP.ln() / ratio.ln();
    let why = format!(
        "{ratio:.2} times as much from the 4600 to the 5800, which takes 1/{PRINTED_SPEED_UP} of the time: alone, the time would go with its \
         power -{exponent:.2}; memory size, internal bandwidth and cores rise together there"
    );
    (Outcome::Undecidable, why)
}

/// By what the parameter, or the one that predictions read in its place, adds to the predicted times of each method on GPUs.
fn by_reports(said: Said, parameter: GpuParameterId, influence: &Influence) -> (Outcome, String) {
    if matches!(said, Said::AlikeOnAll | Said::AlikeOnTwo) {
        return (Outcome::NotAsked, "it is a claim about the three cards".to_owned());
    }
    let read_instead = match parameter {
        GpuParameterId::UploadGbPerS => GpuParameterId::UploadRateGbPerS,
        GpuParameterId::DownloadGbPerS => GpuParameterId::DownloadRateGbPerS,
        GpuParameterId::CopyGbPerS => GpuParameterId::ReadGbPerS,
        other => other,
    };
    let [named, read] = [parameter, read_instead].map(|name| format!("gpu/{name}"));
    let of_gpus = |on: &On| match on {
        On::Method(method) => method.ends_with("GPU"),
        On::Algorithm(name) => name.contains("gpu0"),
        On::Crossover(_) | On::Choice => false,
    };
    let links = || influence.links.iter().filter(|l| of_gpus(&l.on));
    let ranks: Vec<String> = links()
        .filter(|l| l.parameter == named)
        .filter_map(|l| match (&l.on, l.rank) {
            (On::Algorithm(name), Some(r)) => {
                Some(format!("{name} {:+.2} ({:+.2} to {:+.2})", r.correlation, r.low, r.high))
            }
            _ => None,
        })
        .collect();
    // What a parameter is worth to predictions decides; of one that they do not read the ranks do.
    let effects: Vec<Verdict> =
        links().filter(|l| l.parameter == read).filter_map(|l| l.effect.as_ref().map(|e| e.verdict)).collect();
    let is_read = !effects.is_empty();
    let of_ranks = links().filter(|l| l.parameter == named).filter_map(|l| l.rank.map(|r| r.verdict));
    let verdicts: Vec<Verdict> = if is_read { effects } else { of_ranks.collect() };
    if verdicts.is_empty() {
        let why = format!(
            "fewer than {} machines with a GPU, software adapters left out, have both the parameter and timings on it",
            super::rank::FEWEST_MACHINES
        );
        return (Outcome::Undecidable, why);
    }
    let with = |verdict| verdicts.iter().filter(|v| **v == verdict).count();
    let (linked, not, all) = (with(Verdict::Linked), with(Verdict::NotLinked), verdicts.len());
    let how = if is_read {
        format!("predictions read it as {read}; fitted without it, predictions of held-out machines show it")
    } else {
        "no prediction reads it; rank correlations show it".to_owned()
    };
    let why = format!(
        "{how} linked with {linked} and not linked with {not} of {all} methods on GPUs. Rank correlations with their times: {}",
        if ranks.is_empty() { "none".to_owned() } else { ranks.join(", ") }
    );
    // More than half of the methods decide. What adds nothing to the parameters that are read may still be a cause that they stand for.
    let outcome = match said {
        Said::NotLinked if 2 * linked > all => Outcome::Refuted,
        Said::NotLinked if linked == 0 && 2 * not > all => Outcome::Confirmed,
        Said::Linked if 2 * linked > all => Outcome::Confirmed,
        Said::Linked if is_read && linked == 0 && not == all => Outcome::Refuted,
        _ => Outcome::Undecidable,
    };
    (outcome, why)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_table_decides_little() {
        let of = |said, values: [f64; 3]| by_its_table(said, values.map(Some));
        let (outcome, why) = of(Said::NotLinked, [1.25, 1.2, 1.296]);
        assert!(
            outcome == Outcome::Undecidable && why.contains("1.08 times") && why.contains("hardly varies"),
            "{why}"
        );
        let (outcome, why) = of(Said::Linked, [31.99, 44.36, 71.11]);
        assert!(outcome == Outcome::Undecidable && why.contains("1.60 times") && why.contains("power -0.86"), "{why}");
        let (outcome, why) = of(Said::AlikeOnAll, [1.856, 2.496, 2.463]);
        assert!(outcome == Outcome::Refuted && why.contains("1.34 times"), "{why}");
        let (outcome, why) = of(Said::AlikeOnTwo, [0.55952, 2.27628, 2.3096]);
        assert!(outcome == Outcome::Undecidable && why.contains("1.01 times") && why.contains("4.13"), "{why}");
        assert_eq!(by_its_table(Said::Linked, [None, Some(1.0), Some(2.0)]).0, Outcome::Undecidable);
    }
}
