//! Every frame of a replay in a table, to read elsewhere.

use super::outcome::Outcome;
use crate::exit::WrongUsage;

use sapwise::{Load, Reason};
use sapwise_lab::write::write_atomically;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

/// How the table is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    Csv,
    Json,
}

impl Format {
    /// What the name of a file asks for.
    ///
    /// # Errors
    /// When it asks for neither.
    pub(crate) fn of(path: &Path) -> Result<Self, WrongUsage> {
        match path.extension().and_then(|e| e.to_str()) {
            Some("csv") => Ok(Self::Csv),
            Some("json") => Ok(Self::Json),
            _ => Err(WrongUsage(format!("--trace {}: name a file that ends in .csv or .json", path.display()))),
        }
    }
}

/// One frame. What was decided is that of the last repeat; times are those over all repeats.
#[derive(Serialize)]
struct Row {
    frame: usize,
    objects: usize,
    load: Load,
    /// What ran.
    algorithm: Option<String>,
    reason: &'static str,
    predicted_ns: Option<f64>,
    /// Null where the frame was not timed: short frames are not all.
    measured_ns: Option<f64>,
    runner_up: Option<String>,
    runner_up_ns: Option<f64>,
    adaptive_ns: f64,
    oracle_ns: f64,
    /// By id; null where it was not timed.
    fixed_ns: BTreeMap<String, Option<f64>>,
}

/// Writes one row a frame.
///
/// # Errors
/// Names the file. Nothing is left half-written.
pub(crate) fn write_trace(path: &Path, format: Format, outcome: &Outcome) -> anyhow::Result<()> {
    write_atomically(path, |out| match format {
        Format::Csv => csv(out, outcome),
        Format::Json => json(out, outcome),
    })
}

fn rows(outcome: &Outcome) -> impl Iterator<Item = Row> {
    let frames = outcome.frames.iter().zip(&outcome.told).zip(outcome.last_taken());
    frames.enumerate().map(|(frame, ((f, told), taken))| {
        let fixed = outcome.fixed.iter().map(ToString::to_string);
        let finite = f.fixed_ns.iter().map(|ns| Some(*ns).filter(|ns| ns.is_finite()));
        Row {
            frame,
            objects: f.objects,
            load: told.load,
            algorithm: taken.chosen.map(|k| outcome.fixed[k].to_string()),
            reason: name(told.reason),
            predicted_ns: told.predicted_ns,
            measured_ns: told.measured_ns,
            runner_up: told.runner_up.as_ref().map(|r| r.0.to_string()),
            runner_up_ns: told.runner_up.as_ref().map(|r| r.1),
            adaptive_ns: f.adaptive_ns,
            oracle_ns: outcome.oracle.ns[frame],
            fixed_ns: fixed.zip(finite).collect(),
        }
    })
}

fn csv(out: &mut dyn Write, outcome: &Outcome) -> anyhow::Result<()> {
    let mut ids: Vec<String> = outcome.fixed.iter().map(ToString::to_string).collect();
    ids.sort_unstable();
    let times: String = ids.iter().map(|id| format!(",{id}_ns")).collect();
    writeln!(
        out,
        "frame,objects,axis_candidates,strip_candidates,pairs,moved,algorithm,reason,predicted_ns,measured_ns,runner_up,\
         runner_up_ns,adaptive_ns,oracle_ns{times}"
    )?;
    let number = |ns: Option<f64>| ns.map_or(String::new(), |ns| format!("{ns}"));
    for row in rows(outcome) {
        let Load { axis_candidates, strip_candidates, pairs, moved, .. } = row.load;
        write!(out, "{},{},{axis_candidates},{strip_candidates},{pairs},{moved},", row.frame, row.objects)?;
        write!(out, "{},{},", row.algorithm.unwrap_or_default(), row.reason)?;
        write!(out, "{},{},", number(row.predicted_ns), number(row.measured_ns))?;
        write!(out, "{},{},", row.runner_up.unwrap_or_default(), number(row.runner_up_ns))?;
        write!(out, "{},{}", row.adaptive_ns, row.oracle_ns)?;
        // In the order of the ids, as in the first line.
        row.fixed_ns.values().try_for_each(|ns| write!(out, ",{}", number(*ns)))?;
        writeln!(out)?;
    }
    Ok(())
}

fn json(out: &mut dyn Write, outcome: &Outcome) -> anyhow::Result<()> {
    let mut before = "{\"frames\":[";
    for row in rows(outcome) {
        writeln!(out, "{before}")?;
        serde_json::to_writer(&mut *out, &row)?;
        before = ",";
    }
    writeln!(out, "\n]}}")?;
    Ok(())
}

fn name(reason: Reason) -> &'static str {
    match reason {
        Reason::First => "first",
        Reason::Stayed => "stayed",
        Reason::Hysteresis => "hysteresis",
        Reason::Switched => "switched",
        Reason::Explored => "explored",
        Reason::FellBack => "fell_back",
        _ => "other",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::examples::{outcome, taken};
    use crate::replay::frame::Taken;

    fn example() -> Outcome {
        let explored = Taken { explored: true, ..taken(0) };
        let frames: [(usize, f64, &[f64], _); 2] =
            [(10, 1.0, &[1.0, 4.0], taken(1)), (20, 3.0, &[f64::INFINITY, 2.0], explored)];
        let mut outcome = outcome(&["grid-sap@cpu1", "brute@gpu0+1"], &frames);
        outcome.told[1].reason = Reason::Explored;
        outcome.told[1].runner_up = Some(("sap@cpu2".parse().unwrap(), 7e6));
        outcome
    }

    #[test]
    fn a_table_has_a_row_a_frame_and_a_column_an_algorithm() {
        let mut text = Vec::new();
        csv(&mut text, &example()).unwrap();
        let text = String::from_utf8(text).unwrap();
        let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
        assert_eq!(rows.len(), 3, "{text}");
        assert!(rows.iter().all(|r| r.len() == 16), "{text}");
        let cell = |row: usize, name: &str| rows[row][rows[0].iter().position(|n| *n == name).unwrap()];
        assert_eq!((cell(1, "objects"), cell(1, "algorithm"), cell(1, "measured_ns")), ("10", "brute@gpu0+1", ""));
        assert_eq!((cell(1, "grid-sap@cpu1_ns"), cell(1, "brute@gpu0+1_ns")), ("1000000", "4000000"));
        assert_eq!((cell(2, "grid-sap@cpu1_ns"), cell(2, "brute@gpu0+1_ns")), ("", "2000000"));
        assert_eq!((cell(2, "reason"), cell(2, "runner_up"), cell(2, "runner_up_ns")), ("explored", "sap@cpu2", "7000000"));
        assert_eq!((cell(2, "adaptive_ns"), cell(2, "oracle_ns")), ("3000000", "2000000"));
    }

    #[test]
    fn the_same_as_json_is_one_document() {
        let mut text = Vec::new();
        json(&mut text, &example()).unwrap();
        let read: serde_json::Value = serde_json::from_slice(&text).unwrap();
        let frames = read["frames"].as_array().unwrap();
        assert_eq!((frames.len(), &frames[1]["reason"]), (2, &"explored".into()));
        assert_eq!(frames[1]["fixed_ns"], serde_json::json!({"grid-sap@cpu1": null, "brute@gpu0+1": 2e6}));
        assert_eq!(frames[0]["load"]["objects"], 0);
    }

    #[test]
    fn the_name_of_the_file_says_which() {
        assert_eq!(Format::of(Path::new("a.csv")).unwrap(), Format::Csv);
        assert_eq!(Format::of(Path::new("b.c/a.json")).unwrap(), Format::Json);
        for other in ["a", "a.tsv", "csv"] {
            assert!(Format::of(Path::new(other)).unwrap_err().to_string().contains(".csv or .json"));
        }
    }
}
