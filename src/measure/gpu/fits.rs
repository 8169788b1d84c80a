//! Lines through transfer times, and steps through times of workgroups.

/// A line `t = latency + volume / rate` through times of several volumes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    /// Time of no volume; never negative.
    pub(super) latency: f64,
    /// Volume per time.
    pub(super) rate: f64,
}

/// The line with the least sum of relative deviations from `(volume, time)` points.
///
/// Relative, because volumes span four orders of magnitude: the largest alone would decide else. Deviations and not their
/// squares, so that one point that another program spoiled does not bend the line. Such a line goes through two of the
/// points, or through one of them and the origin, so all of these are tried. `None` where no line rises.
pub(super) fn line(points: &[(f64, f64)]) -> Option<Line> {
    let usable = |&&(v, t): &&(f64, f64)| v > 0.0 && t > 0.0 && v.is_finite() && t.is_finite();
    let points: Vec<(f64, f64)> = points.iter().filter(usable).copied().collect();
    let deviation =
        |latency: f64, slope: f64| -> f64 { points.iter().map(|(v, t)| (1.0 - (latency + slope * v) / t).abs()).sum() };
    let mut best: Option<(f64, Line)> = None;
    let mut consider = |latency: f64, slope: f64| {
        if slope > 0.0 && slope.is_finite() && latency >= 0.0 {
            let error = deviation(latency, slope);
            if best.is_none_or(|(least, _)| error < least) {
                best = Some((error, Line { latency, rate: 1.0 / slope }));
            }
        }
    };
    for (i, &(v, t)) in points.iter().enumerate() {
        consider(0.0, t / v);
        for &(w, u) in &points[..i] {
            let slope = (t - u) / (v - w);
            consider(t - slope * v, slope);
        }
    }
    best.map(|(_, line)| line)
}

/// How many workgroups run at the same time, from `(workgroups, time)` points: the `U` for which `t = b * ceil(n / U)` errs
/// least.
///
/// The line of steps goes through the origin: a free intercept was tried, and it made the answer worse. Relative squares,
/// so that the first steps count as much as the later ones. `None` without two points, and where the times show no step:
/// then every number up to the last could be the answer.
pub(super) fn parallel_units(points: &[(u32, f64)]) -> Option<u32> {
    let points: Vec<(u32, f64)> = points.iter().filter(|(n, t)| *n > 0 && *t > 0.0 && t.is_finite()).copied().collect();
    let most = points.iter().map(|(n, _)| *n).max()?;
    let error = |units: u32| -> f64 {
        let steps = points.iter().map(|&(n, t)| f64::from(n.div_ceil(units)) / t);
        let (sum, squares) = steps.fold((0.0, 0.0), |(sum, squares), s| (sum + s, squares + s * s));
        // With the best b, the sum of (1 - b s)^2 is this.
        points.len() as f64 - sum * sum / squares
    };
    // The smallest of equals: between two numbers of workgroups that were timed, the points can't tell.
    let best = (1..=most).min_by(|&a, &b| error(a).total_cmp(&error(b)))?;
    (best < most).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transfer(latency: f64, rate: f64) -> Vec<(f64, f64)> {
        (0..8).map(|k| 4096.0 * 4_f64.powi(k)).map(|v| (v, latency + v / rate)).collect()
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-6 * b.abs().max(1.0)
    }

    #[test]
    fn a_line_is_found_again() {
        for (latency, rate) in [(80_000.0, 2.7), (5_000.0, 25.0), (0.0, 12.0)] {
            let line = line(&transfer(latency, rate)).unwrap();
            assert!(close(line.latency, latency) && close(line.rate, rate), "{line:?}");
        }
    }

    #[test]
    fn spoiled_points_do_not_bend_it() {
        let mut points = transfer(50_000.0, 10.0);
        points[1].1 *= 9.0;
        points[6].1 *= 2.5;
        let line = line(&points).unwrap();
        assert!(close(line.latency, 50_000.0) && close(line.rate, 10.0), "{line:?}");
    }

    #[test]
    fn no_line() {
        assert_eq!(line(&[]), None);
        assert_eq!(line(&[(1.0, f64::NAN), (2.0, f64::INFINITY), (0.0, 1.0)]), None);
        // One point: through the origin.
        assert_eq!(line(&[(10.0, 5.0)]), Some(Line { latency: 0.0, rate: 2.0 }));
        // Falling times: still something that rises, with no negative latency.
        assert!(line(&[(1.0, 5.0), (2.0, 4.0)]).is_some_and(|l| l.latency >= 0.0 && l.rate > 0.0));
    }

    fn staircase(units: u32, ns: impl IntoIterator<Item = u32>) -> Vec<(u32, f64)> {
        ns.into_iter().map(|n| (n, 2.0 * f64::from(n.div_ceil(units)))).collect()
    }

    #[test]
    fn steps_are_counted() {
        for units in [1, 2, 3, 8] {
            assert_eq!(parallel_units(&staircase(units, 1..=36)), Some(units));
        }
        // 132 units, looked at sparsely but on both sides of the step.
        let ns = [1, 2, 4, 8, 16, 32, 64, 128, 131, 132, 133, 134, 200, 256, 264, 265, 400];
        assert_eq!(parallel_units(&staircase(132, ns)), Some(132));
    }

    #[test]
    fn steps_on_a_real_machine() {
        // Two cores, in ms for 1 to 12 workgroups.
        let times = [2.0, 2.0, 3.9, 4.0, 5.9, 6.0, 8.0, 7.0, 8.4, 8.8, 11.4, 11.5];
        let points: Vec<_> = (1..).zip(times).collect();
        assert_eq!(parallel_units(&points), Some(2));
    }

    #[test]
    fn an_overhead_of_a_tenth_does_not_matter() {
        let points: Vec<_> = staircase(20, 1..=80).into_iter().map(|(n, t)| (n, t + 0.2)).collect();
        assert_eq!(parallel_units(&points), Some(20));
    }

    #[test]
    fn no_steps() {
        assert_eq!(parallel_units(&[]), None);
        assert_eq!(parallel_units(&[(1, 2.0)]), None);
        assert_eq!(parallel_units(&staircase(100, 1..=50)), None);
        assert_eq!(parallel_units(&[(0, 1.0), (3, f64::NAN)]), None);
    }
}
