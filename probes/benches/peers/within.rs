//! Ours beside ours: threads, SIMD levels, objects at rest.

use crate::contestants::Side;
use crate::point::{Lane, Point};
use crate::table::{digits, grid, sizes, spread};
use sapwise::{AlgorithmId, SimdLevel};
use sapwise_scenes::Scenario;

/// The fastest fixed method of ours on that many threads.
fn best_on(point: &Point, threads: u32) -> Option<&Lane> {
    let on = |lane: &Lane| lane.name.parse::<AlgorithmId>().is_ok_and(|id| id.threads() == threads);
    point.fastest(|lane| lane.side == Side::Fixed && on(lane))
}

/// The name of a row, and what stands in it for a point.
type Row<'a> = (&'a str, &'a dyn Fn(&Point) -> Option<String>);

/// A table of these rows.
fn rows(points: &[Point], figures: &[Row<'_>]) -> String {
    let row = |(name, cell): &Row<'_>| {
        ((*name).to_owned(), points.iter().map(|p| cell(p).unwrap_or_else(|| "-".to_owned())).collect())
    };
    grid("", &sizes(points), &figures.iter().map(row).collect::<Vec<_>>())
}

/// What the second thread gains, from the races in which both take turns.
fn threads(points: &[Point]) -> String {
    let gain = |p: &Point| Some(spread(best_on(p, 1)?.over(best_on(p, 2)?)));
    let who = |p: &Point| Some(format!("{}, {}", best_on(p, 1)?.name, best_on(p, 2)?.name));
    format!(
        "#### A second thread\n\n`uniform`: time of the fastest fixed method on one thread over that of the fastest on two.\n\n{}",
        rows(points, &[("gain", &gain), ("methods", &who)])
    )
}

/// What wider vectors gain, for the method that is fastest at the highest level.
fn levels(points: &[Point]) -> String {
    let at = |p: &Point, level: SimdLevel| {
        let top = SimdLevel::in_use().to_string();
        let best = p.fastest(|lane| lane.name.ends_with(&top))?;
        let name = best.name.replace(&top, &level.to_string());
        let [of_level, portable] =
            [&name, &best.name.replace(&top, "portable")].map(|name| p.lanes.iter().find(|lane| lane.name == *name));
        Some(spread(portable?.over(of_level?)))
    };
    let avx2 = |p: &Point| at(p, SimdLevel::Avx2);
    let avx512 = |p: &Point| at(p, SimdLevel::Avx512);
    let who = |p: &Point| {
        let top = SimdLevel::in_use().to_string();
        Some(p.fastest(|lane| lane.name.ends_with(&top))?.name.replace(&top, "").trim().to_owned())
    };
    format!(
        "#### Wider vectors\n\n`uniform` on one thread: time at the portable level over that at a higher one, for the method that is \
         fastest at the highest.\n\n{}",
        rows(points, &[("AVX2", &avx2), ("AVX-512", &avx512), ("method", &who)])
    )
}

/// What objects at rest save. The two scenarios are different races, so this is a ratio of medians.
fn rest(points: &[Point]) -> Option<String> {
    let of = |scenario: Scenario, n: usize| {
        points.iter().find(|p| p.scenario == scenario && p.objects == n).and_then(|p| p.best(Side::Fixed))
    };
    let both = |&n: &usize| Some((n, of(Scenario::Uniform, n)?, of(Scenario::Resting, n)?));
    let found: Vec<_> = sizes(points).iter().filter_map(both).collect();
    let sizes: Vec<usize> = found.iter().map(|f| f.0).collect();
    let shares = found.iter().map(|(_, moving, resting)| digits(resting.median() / moving.median())).collect();
    let names = found.iter().map(|(_, moving, resting)| format!("{}, {}", moving.name, resting.name)).collect();
    let rows = [("share".to_owned(), shares), ("methods".to_owned(), names)];
    (!sizes.is_empty()).then(|| {
        format!(
            "#### Objects at rest\n\nMedian in `resting`, where 5 % move, over median in `uniform`, where all move, of the method \
             that is fastest in each.\n\n{}",
            grid("", &sizes, &rows)
        )
    })
}

/// All tables of ours beside ours.
pub(crate) fn all(results: &[(u32, Vec<Point>)], level_points: &[Point]) -> String {
    let on = |threads: u32| results.iter().find(|r| r.0 == threads && !r.1.is_empty()).map(|r| &r.1[..]);
    let mut text = "### Within Sapwise\n\n".to_owned();
    text += &on(2).map(threads).unwrap_or_default();
    text += &if level_points.is_empty() { String::new() } else { levels(level_points) };
    text += &on(1).and_then(rest).unwrap_or_default();
    text
}
