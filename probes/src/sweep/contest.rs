//! The stopping rule of a race: which algorithms need more frames, and when none does.
//!
//! A probe decides between the best. One that is far behind gets the few samples that its cost curve needs; two that
//! are close get samples until it is clear which is faster, or that it does not matter.

use sapwise_lab::sweep::median as median_ns;
use sapwise_tune::stats::{median, relative_iqr};

/// Fewest frames before anything is decided.
pub(super) const FEW_FRAMES: usize = 5;
/// An algorithm that is surely slower than the best by more than this factor rests for the remainder of the point.
const BEATEN: f64 = 1.5;
/// Standard errors that count as sure.
const SURE: f64 = 3.0;
/// A difference below this does not matter: the goal for the regret of a measured tuning is 0.5 %.
const INDIFFERENT: f64 = 0.005;
/// Relative standard error of a median that is good enough for a cost curve: visits to the same point differ by more.
const GOOD_ERROR: f64 = 0.02;

/// The standing of those who take part.
#[derive(Debug, PartialEq)]
pub(super) struct Contest {
    /// Positions of those who are surely beaten in the list that was judged.
    pub(super) beaten: Vec<usize>,
    /// Whether more frames would change nothing.
    pub(super) decided: bool,
}

impl Contest {
    /// Judges lists of samples whose k-th entries belong to the same frame.
    pub(super) fn judge(samples: &[&[u64]]) -> Self {
        let medians: Vec<Option<f64>> = samples.iter().map(|s| median_ns(s)).collect();
        let leader = (0..samples.len()).filter(|&k| samples[k].len() >= FEW_FRAMES).min_by(|&a, &b| {
            let of = |k: usize| medians[k].unwrap_or(f64::INFINITY);
            of(a).total_cmp(&of(b))
        });
        let Some(leader) = leader else { return Self { beaten: Vec::new(), decided: false } };
        let mut contest = Self { beaten: Vec::new(), decided: error(samples[leader]) < GOOD_ERROR };
        for k in (0..samples.len()).filter(|&k| k != leader) {
            let Some((behind, error_of_it)) = behind(samples[k], samples[leader]) else {
                contest.decided = false;
                continue;
            };
            if behind - SURE * error_of_it > BEATEN.ln() {
                contest.beaten.push(k);
                continue;
            }
            let sure = behind.abs() > SURE * error_of_it;
            let indifferent = behind.abs() + SURE * error_of_it < INDIFFERENT;
            contest.decided &= (sure || indifferent) && error(samples[k]) < GOOD_ERROR;
        }
        contest
    }
}

/// Returns the median over the frames of the logarithm of a ratio of times, and its standard error.
fn behind(samples: &[u64], leader: &[u64]) -> Option<(f64, f64)> {
    if samples.len().min(leader.len()) < FEW_FRAMES {
        return None;
    }
    let ratios: Vec<f64> = samples.iter().zip(leader).map(|(&a, &b)| a as f64 / b as f64).collect();
    Some((median(&ratios)?.ln(), standard_error(&ratios)))
}

/// Returns the relative standard error of the median, infinite below four samples.
fn error(samples: &[u64]) -> f64 {
    standard_error(&samples.iter().map(|&ns| ns as f64).collect::<Vec<f64>>())
}

/// Takes the standard error from the quartiles, so that single outliers don't count. For a normal distribution the
/// standard deviation is the interquartile range over 1.349, and the error of the median is 1.2533 standard
/// deviations over √n.
fn standard_error(samples: &[f64]) -> f64 {
    relative_iqr(samples).map_or(f64::INFINITY, |iqr| 1.2533 / 1.349 * iqr / (samples.len() as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples around a centre, within 2 % of it, that rise and fall with the frame.
    fn around(centre: u64, frames: usize) -> Vec<u64> {
        (0..frames as u64).map(|k| centre * (1000 + (k * 7) % 21) / 1000).collect()
    }

    #[test]
    fn outliers_do_not_widen_the_error_and_spread_does() {
        assert_eq!(error(&[5, 5, 5]), f64::INFINITY);
        assert_eq!(error(&[100, 100, 100, 100, 100, 100, 100, 9000]), 0.0);
        let wide: Vec<u64> = (0..100).map(|k| 900 + 2 * k).collect();
        assert!((error(&wide) - 0.0093).abs() < 0.001);
    }

    #[test]
    fn who_is_far_behind_is_beaten_and_the_others_are_decided() {
        let (best, near, far) = (around(10_000, 10), around(12_000, 10), around(40_000, 10));
        assert_eq!(Contest::judge(&[&far, &best, &near]), Contest { beaten: vec![0], decided: true });
        assert_eq!(Contest::judge(&[&best[..4], &far[..4]]), Contest { beaten: vec![], decided: false });
        assert_eq!(Contest::judge(&[]), Contest { beaten: vec![], decided: false });
    }

    #[test]
    fn equals_are_decided_and_a_doubt_is_not() {
        let one = around(100_000, 20);
        let same: Vec<u64> = one.iter().map(|ns| ns + ns / 1000).collect();
        assert!(Contest::judge(&[&one, &same]).decided);
        // Two per cent faster or slower from frame to frame, with a difference of 1 % at the median.
        let doubtful: Vec<u64> =
            one.iter().enumerate().map(|(k, ns)| ns * (950 + (k as u64 % 5) * 30) / 1000).collect();
        assert!(!Contest::judge(&[&one, &doubtful]).decided);
    }
}
