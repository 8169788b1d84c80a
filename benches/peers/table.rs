//! The results as one line for each point, and as CSV.

use crate::contestants::Side;
use crate::point::{Point, Quartiles};
use std::fmt::Write;

/// Writes a number with three significant digits.
fn digits(value: f64) -> String {
    let whole = value.abs().log10().floor().max(-9.0) as i32 + 1;
    format!("{value:.*}", usize::try_from(3 - whole).unwrap_or(0))
}

/// Writes the median with the quartiles.
fn spread([low, median, high]: Quartiles) -> String {
    format!("{} ({} to {})", digits(median), digits(low), digits(high))
}

/// Writes 1000 as 1k and 1000000 as 1M.
fn size(objects: usize) -> String {
    match objects {
        n if n >= 1_000_000 && n.is_multiple_of(1_000_000) => format!("{}M", n / 1_000_000),
        n if n >= 1_000 && n.is_multiple_of(1_000) => format!("{}k", n / 1_000),
        n => n.to_string(),
    }
}

/// Returns the result of a point in one line.
pub(crate) fn line(point: &Point) -> String {
    let mut text = format!("{} {}:", point.scenario, size(point.objects));
    for side in [Side::Adaptive, Side::Fixed, Side::Peer] {
        if let Some(lane) = point.best(side) {
            let _ = write!(text, " {} {} ms,", lane.name, digits(lane.median() * 1e3));
        }
    }
    if let Some(gain) = point.gain() {
        let _ = write!(text, " gain {},", spread(gain));
    }
    let frames = point.lanes.first().map_or(0, |lane| lane.seconds.len());
    let _ = write!(text, " {frames} frames");
    if let Some(load) = point.foreign_load {
        let _ = write!(text, ", foreign load {:.0} %", load * 100.0);
    }
    if !point.left.is_empty() {
        let _ = write!(text, ", too slow: {}", point.left.join(" "));
    }
    text
}

/// Returns the times of all points in milliseconds, one row for each contestant. Without slowest frames the `tail_`
/// columns are empty. Only the row of `adaptive` has the last column: the median ratio of the fastest peer's time to
/// its own in each frame.
pub(crate) fn csv(results: &[(u32, Vec<Point>)]) -> String {
    let mut text = "threads,scenario,objects,contestant,median_ms,quartile_1_ms,quartile_3_ms,frames,\
        tail_p50_ms,tail_p99_ms,tail_worst_ms,tail_frames,tail_runs,peer_over_adaptive\n"
        .to_owned();
    for (threads, points) in results {
        for point in points {
            for lane in &point.lanes {
                let [low, median, high] = lane.quartiles().map(|s| digits(s * 1e3));
                let (scenario, objects, name, frames) = (point.scenario, point.objects, &lane.name, lane.seconds.len());
                let _ = write!(text, "{threads},{scenario},{objects},{name},{median},{low},{high},{frames},");
                let _ = match &lane.tail {
                    Some(tail) => {
                        let [p50, p99, worst] = tail.quantiles().map(|s| digits(s * 1e3));
                        write!(text, "{p50},{p99},{worst},{},{}", tail.seconds.len(), tail.runs)
                    }
                    None => write!(text, ",,,,"),
                };
                let gain = point.gain().filter(|_| lane.name == "adaptive").map(|[_, median, _]| digits(median));
                let _ = writeln!(text, ",{}", gain.unwrap_or_default());
            }
        }
    }
    text
}
