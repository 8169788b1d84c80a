//! The comparison as a table of ratios in Markdown and as CSV with every time.

use crate::contestants::Side;
use crate::machine;
use crate::point::{Point, Quartiles};
use sapwise_scenes::Scenario;
use std::fmt::Write;

/// The goals in words.
fn goals(threads: u32) -> &'static str {
    if threads == 1 { "1.5 up to 1k objects, 2 up to 30k, 3 from 100k" } else { "2 up to 30k objects, 3 from 100k" }
}

/// The gain that is wanted on a number of threads at a number of objects, where there is a goal.
fn goal(threads: u32, objects: usize) -> Option<f64> {
    match (threads, objects) {
        (1, ..=1_000) => Some(1.5),
        (_, ..=30_000) => Some(2.0),
        (_, 100_000..) => Some(3.0),
        _ => None,
    }
}

/// Three significant digits.
fn digits(value: f64) -> String {
    let whole = value.abs().log10().floor().max(-9.0) as i32 + 1;
    format!("{value:.*}", usize::try_from(3 - whole).unwrap_or(0))
}

/// Median and quartiles.
fn spread([low, median, high]: Quartiles) -> String {
    format!("{} ({} to {})", digits(median), digits(low), digits(high))
}

/// 1000 as 1k, 1000000 as 1M.
fn size(objects: usize) -> String {
    match objects {
        n if n >= 1_000_000 && n.is_multiple_of(1_000_000) => format!("{}M", n / 1_000_000),
        n if n >= 1_000 && n.is_multiple_of(1_000) => format!("{}k", n / 1_000),
        n => n.to_string(),
    }
}

/// A table with a row for each name and a column for each size.
fn grid(corner: &str, sizes: &[usize], rows: &[(String, Vec<String>)]) -> String {
    let mut text = format!("| {corner} |");
    sizes.iter().for_each(|&n| text += &format!(" {} |", size(n)));
    text += "\n|---|";
    text += &"---|".repeat(sizes.len());
    text += "\n";
    for (name, cells) in rows {
        text += &format!("| {name} | {} |\n", cells.join(" | "));
    }
    text + "\n"
}

/// The sizes of some points, ascending.
fn sizes(points: &[Point]) -> Vec<usize> {
    let mut sizes: Vec<usize> = points.iter().map(|p| p.objects).collect();
    sizes.sort_unstable();
    sizes.dedup();
    sizes
}

/// What was measured, in one line for whoever waits.
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

/// One row for each scenario, made by `cell` from its points.
fn by_scenario(points: &[Point], cell: impl Fn(&Point) -> Option<String>) -> String {
    let sizes = sizes(points);
    let mut scenarios: Vec<Scenario> = points.iter().map(|p| p.scenario).collect();
    scenarios.dedup();
    let row = |scenario: Scenario| {
        let at = |n: &usize| points.iter().find(|p| p.scenario == scenario && p.objects == *n).and_then(&cell);
        (scenario.to_string(), sizes.iter().map(|n| at(n).unwrap_or_else(|| "-".to_owned())).collect())
    };
    grid("scenario", &sizes, &scenarios.into_iter().map(row).collect::<Vec<_>>())
}

/// All times of all points in milliseconds: one row for each contestant. Without slowest frames the `tail_` columns are
/// empty. Only the row of `adaptive` has the last column: the time of the fastest peer over its own, frame by frame,
/// median.
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

/// The ratios to the fastest peer and the slowest frames of `pair-cache`, by number of threads, under a line that says
/// where and when they were measured.
pub(crate) fn summary(results: &[(u32, Vec<Point>)]) -> String {
    let mut loads: Vec<f64> = results.iter().flat_map(|r| &r.1).filter_map(|p| p.foreign_load).collect();
    loads.sort_by(f64::total_cmp);
    let mut text = format!("# Beside peers\n\n{}\n\n", machine::describe());
    if let Some(highest) = loads.last() {
        let median = loads[loads.len() / 2];
        let _ = writeln!(text, "Foreign load: median {:.1} %, at most {:.1} %.\n", median * 100.0, highest * 100.0);
    }
    for (threads, points) in results.iter().filter(|r| !r.1.is_empty()) {
        let gain = |p: &Point| {
            let median = p.gain()?[1];
            let below = goal(*threads, p.objects).is_some_and(|goal| median < goal);
            Some(if below { format!("**{}**", digits(median)) } else { digits(median) })
        };
        let _ = write!(
            text,
            "## Threads: {threads}\n\nTime of the fastest peer over that of `adaptive`, frame by frame, median. \
             Bold: below the goal of {}.\n\n{}",
            goals(*threads),
            by_scenario(points, gain),
        );
        let id = format!("pair-cache@cpu{threads}");
        let slowest = |p: &Point| {
            let tail = p.lanes.iter().find(|lane| lane.name == id)?.tail.as_ref()?;
            let [p50, p99, worst] = tail.quantiles();
            Some(format!("{}, {}", digits(p99 / p50), digits(worst / p50)))
        };
        let table = by_scenario(points, slowest);
        let _ = write!(text, "`{id}`: 99th percentile and slowest frame over its median.\n\n{table}");
    }
    text
}
