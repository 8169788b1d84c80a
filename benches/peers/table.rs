//! The comparison as tables in Markdown.

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

/// The absolute times of a scenario, one row for each contestant.
fn times(points: &[&Point]) -> String {
    let sizes: Vec<usize> = points.iter().map(|p| p.objects).collect();
    let mut names: Vec<&str> = Vec::new();
    for lane in points.iter().flat_map(|p| &p.lanes) {
        if !names.contains(&lane.name.as_str()) {
            names.push(&lane.name);
        }
    }
    let row = |name: &str| {
        let cell = |p: &&Point| {
            let lane = p.lanes.iter().find(|lane| lane.name == name);
            lane.map_or_else(|| "-".to_owned(), |lane| spread(lane.quartiles().map(|s| s * 1e3)))
        };
        (name.to_owned(), points.iter().map(cell).collect())
    };
    grid("contestant", &sizes, &names.into_iter().map(row).collect::<Vec<_>>())
}

fn compared(threads: u32, points: &[Point]) -> String {
    let on = if threads == 1 { "one thread".to_owned() } else { format!("{threads} threads") };
    let gain = |p: &Point| {
        let gain = p.gain()?;
        let text = spread(gain);
        Some(if goal(threads, p.objects).is_some_and(|goal| gain[1] < goal) { format!("**{text}**") } else { text })
    };
    let who = |p: &Point| {
        let (choice, share) = p.choice()?;
        let share = if share < 1.0 { format!(" in {:.0} %", share * 100.0) } else { String::new() };
        Some(format!("{}; {choice}{share}", p.best(Side::Peer)?.name))
    };
    let regret = |p: &Point| {
        let [low, median, high] = p.best(Side::Adaptive)?.over(p.best(Side::Fixed)?).map(|r| (r - 1.0) * 100.0);
        Some(format!("{median:.1} ({low:.1} to {high:.1}), {}", p.best(Side::Fixed)?.name))
    };
    let mut text = format!(
        "### Adaptive over the fastest peer, {on}\n\n\
         Time of the fastest peer over that of `adaptive`, frame by frame: median (quartiles). Bold: below the goal of {}.\n\n{}\
         ### The fastest peer, and what `adaptive` chose, {on}\n\n{}\
         ### What the choice costs, {on}\n\n\
         Time of `adaptive` over that of our fastest fixed method, less one, in percent, frame by frame: median (quartiles), and \
         that method.\n\n{}",
        goals(threads),
        by_scenario(points, gain),
        by_scenario(points, who),
        by_scenario(points, regret),
    );
    text += &format!("### Times, {on}\n\nMilliseconds a frame: median (quartiles).\n\n");
    let mut scenarios: Vec<Scenario> = points.iter().map(|p| p.scenario).collect();
    scenarios.dedup();
    for scenario in scenarios {
        let of: Vec<&Point> = points.iter().filter(|p| p.scenario == scenario).collect();
        text += &format!("`{scenario}`:\n\n{}", times(&of));
    }
    text
}

/// All tables of the comparison with peers, by number of threads.
pub(crate) fn all(results: &[(u32, Vec<Point>)]) -> String {
    let mut loads: Vec<f64> = results.iter().flat_map(|r| &r.1).filter_map(|p| p.foreign_load).collect();
    loads.sort_by(f64::total_cmp);
    let mut text = format!("{}\n\n", machine::describe());
    if let Some(highest) = loads.last() {
        text += &format!(
            "Other programs took {:.1} % of the CPU at the median of the points at which that can be told, and {:.1} % at the worst.\n\n",
            loads[loads.len() / 2] * 100.0,
            highest * 100.0
        );
    }
    for (threads, points) in results.iter().filter(|r| !r.1.is_empty()) {
        text += &compared(*threads, points);
    }
    text
}
