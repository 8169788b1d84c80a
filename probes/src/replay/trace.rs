//! The table of a replay, one row a frame.

use super::outcome::Outcome;
use sapwise::Reason;
use sapwise::algorithm::Load;
use sapwise_lab::write::write_atomically;
use std::io::Write;
use std::path::Path;

/// Writes one row a frame: the choice of the last repeat, and times over all repeats.
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
        "frame,objects,axis_candidates,strip_candidates,pairs,moved,moved_share,algorithm,reason,predicted_ns,\
         measured_ns,runner_up,runner_up_ns,adaptive_ns,windows_ns{times}"
    )?;
    // Empty when a frame was not timed, or an algorithm at it.
    let number = |ns: Option<f64>| ns.filter(|ns| ns.is_finite()).map_or(String::new(), |ns| format!("{ns}"));
    for (at, (frame, choice)) in outcome.frames.iter().zip(&outcome.choices).enumerate() {
        let Load { axis_candidates, strip_candidates, pairs, moved, moved_share, .. } = choice.load;
        write!(out, "{at},{},{axis_candidates},{strip_candidates},{pairs},{moved},{moved_share},", frame.objects)?;
        write!(out, "{},{},", choice.chosen.map_or("", |k| &ids[k]), name(choice.reason))?;
        write!(out, "{},{},", number(choice.predicted_ns), number(choice.measured_ns))?;
        let (id, ns) = choice.runner_up.as_ref().map_or((String::new(), None), |r| (r.0.to_string(), Some(r.1)));
        write!(out, "{id},{},{},{}", number(ns), frame.adaptive_ns, number(Some(frame.windows_ns)))?;
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
        _ => "other",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::outcome::tests::{choice, outcome};

    #[test]
    fn a_table_has_a_row_a_frame_and_a_column_an_algorithm() {
        let mut explored = choice(0, Reason::Explored);
        explored.runner_up = Some(("sap@cpu2".parse().unwrap(), 7e6));
        let outcome = outcome(
            &["grid-sap@cpu1", "brute@gpu0+1"],
            &[(10, 1.0, &[1.0, 4.0], choice(1, Reason::First)), (20, 3.0, &[f64::INFINITY, 2.0], explored)],
        );
        let mut text = Vec::new();
        csv(&mut text, &outcome).unwrap();
        let text = String::from_utf8(text).unwrap();
        let rows: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
        assert_eq!((rows.len(), rows[0].len(), rows[1].len(), rows[2].len()), (3, 17, 17, 17), "{text}");
        let cells = |row: usize, names: &[&str]| -> Vec<&str> {
            names.iter().map(|name| rows[row][rows[0].iter().position(|n| n == name).unwrap()]).collect()
        };
        let names = ["objects", "algorithm", "measured_ns", "grid-sap@cpu1_ns", "brute@gpu0+1_ns"];
        assert_eq!(cells(1, &names), ["10", "brute@gpu0+1", "", "1000000", "4000000"]);
        let names = ["grid-sap@cpu1_ns", "reason", "runner_up", "runner_up_ns", "adaptive_ns"];
        assert_eq!(cells(2, &names), ["", "explored", "sap@cpu2", "7000000", "3000000"]);
    }
}
