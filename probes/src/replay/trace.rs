//! Every frame of a replay in a table, to read elsewhere.

use super::outcome::Outcome;
use crate::exit::WrongUsage;
use sapwise::{Load, Reason};
use sapwise_lab::write::write_atomically;
use std::io::Write;
use std::path::Path;

/// Refuses a file whose name promises another format than the table has.
///
/// # Errors
/// Says which ending it takes.
pub(crate) fn check_trace(path: &Path) -> Result<(), WrongUsage> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("csv") => Ok(()),
        _ => Err(WrongUsage(format!("--trace {}: name a file that ends in .csv", path.display()))),
    }
}

/// Writes one row a frame. What was decided is that of the last repeat; times are those over all repeats.
///
/// # Errors
/// Names the file. Nothing is left half-written.
pub(crate) fn write_trace(path: &Path, outcome: &Outcome) -> anyhow::Result<()> {
    write_atomically(path, |out| csv(out, outcome))
}

fn csv(out: &mut dyn Write, outcome: &Outcome) -> anyhow::Result<()> {
    let ids: Vec<String> = outcome.fixed.iter().map(ToString::to_string).collect();
    let mut order: Vec<usize> = (0..ids.len()).collect();
    order.sort_unstable_by_key(|&k| &ids[k]);
    let times: String = order.iter().map(|&k| format!(",{}_ns", ids[k])).collect();
    writeln!(
        out,
        "frame,objects,axis_candidates,strip_candidates,pairs,moved,algorithm,reason,predicted_ns,measured_ns,runner_up,\
         runner_up_ns,adaptive_ns,oracle_ns{times}"
    )?;
    // Empty where a frame or an algorithm in it was not timed: short frames are not all.
    let number = |ns: Option<f64>| ns.filter(|ns| ns.is_finite()).map_or(String::new(), |ns| format!("{ns}"));
    let frames = outcome.frames.iter().zip(&outcome.told).zip(outcome.last_taken());
    for (at, ((frame, told), taken)) in frames.enumerate() {
        let Load { axis_candidates, strip_candidates, pairs, moved, .. } = told.load;
        write!(out, "{at},{},{axis_candidates},{strip_candidates},{pairs},{moved},", frame.objects)?;
        write!(out, "{},{},", taken.chosen.map_or("", |k| &ids[k]), name(told.reason))?;
        write!(out, "{},{},", number(told.predicted_ns), number(told.measured_ns))?;
        let (id, ns) = told.runner_up.as_ref().map_or((String::new(), None), |r| (r.0.to_string(), Some(r.1)));
        write!(out, "{id},{},{},{}", number(ns), frame.adaptive_ns, outcome.oracle.ns[at])?;
        order.iter().try_for_each(|&k| write!(out, ",{}", number(Some(frame.fixed_ns[k]))))?;
        writeln!(out)?;
    }
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
        Reason::Sheltered => "sheltered",
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
        assert_eq!(
            (cell(2, "reason"), cell(2, "runner_up"), cell(2, "runner_up_ns")),
            ("explored", "sap@cpu2", "7000000")
        );
        assert_eq!((cell(2, "adaptive_ns"), cell(2, "oracle_ns")), ("3000000", "2000000"));
    }

    #[test]
    fn the_name_of_the_file_says_what_it_holds() {
        assert!(check_trace(Path::new("b.c/a.csv")).is_ok());
        for other in ["a", "a.tsv", "csv", "a.json"] {
            assert!(check_trace(Path::new(other)).unwrap_err().to_string().contains(".csv"));
        }
    }
}
