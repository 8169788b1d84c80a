//! The best that could be had: an algorithm for every frame, chosen without luck.
//!
//! The least of several noisy times lies below the time of the algorithm that it belongs to. So the best algorithm is chosen by one
//! half of the repeats and its time taken from the other half, then the other way round. A choice that noise has misled makes such an
//! oracle too slow, never too fast; of three of them, which choose by more or fewer frames, the fastest is taken.

use super::frame::Frame;
use super::samples::mean_of;
use sapwise::stats::median;

/// Frames before and behind that may have a say in the choice ...
const NEIGHBOURS: usize = 4;
/// ... if their numbers of objects differ by no more than this share.
const ALIKE: f64 = 0.05;

/// By what a choice is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sight {
    /// By the frame alone. The best where it is quiet: it may take every other frame from another algorithm.
    Frame,
    /// By the frames about it too.
    Neighbours,
    /// By all frames: one algorithm for all frames.
    AllFrames,
    /// By all frames of a window: one algorithm for each.
    Window,
}

/// Frames of a window. An incremental algorithm rebuilds what it keeps once in some tens of frames; an oracle that chooses for every frame alone
/// runs it in its cheap frames only, and another one in the frame of the rebuild.
pub(crate) const WINDOW: usize = 32;

/// What it runs, and how long that takes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Oracle {
    /// Of each frame, nanoseconds; infinite where nothing ran.
    pub(crate) ns: Vec<f64>,
    /// A position among the fixed algorithms for each frame, as each half of the repeats has it.
    chosen_by: [Vec<Option<usize>>; 2],
}

impl Oracle {
    pub(super) fn new(frames: &[Frame]) -> Self {
        let all = [Sight::Frame, Sight::Neighbours, Sight::AllFrames].map(|sight| Self::with(frames, sight));
        let [by_frame, rest @ ..] = all;
        rest.into_iter().fold(by_frame, |best, next| if next.total() < best.total() { next } else { best })
    }

    /// One algorithm for each window of frames, which pays for what it keeps. Where noise misleads that choice, one for all frames.
    pub(super) fn of_windows(frames: &[Frame]) -> Self {
        let [windows, whole] = [Sight::Window, Sight::AllFrames].map(|sight| Self::with(frames, sight));
        if whole.total() < windows.total() { whole } else { windows }
    }

    fn with(frames: &[Frame], sight: Sight) -> Self {
        let chosen_by = [0, 1].map(|half| choices(frames, half, sight));
        let time = |(at, frame): (usize, &Frame)| {
            let from = |half: usize| frame.fixed[chosen_by[1 - half][at]?].of_half(half);
            mean_of([from(0), from(1)]).unwrap_or(f64::INFINITY)
        };
        Self { ns: frames.iter().enumerate().map(time).collect(), chosen_by }
    }

    fn total(&self) -> f64 {
        self.ns.iter().sum()
    }

    /// What its choice took in one repeat, which had no say in the choice.
    pub(super) fn in_repeat(&self, at: usize, frame: &Frame, repeat: usize) -> Option<f64> {
        let chosen = &frame.fixed[self.chosen_by[1 - repeat % 2][at]?];
        // Whoever is not timed in every repeat has the time of the others.
        chosen.at(repeat).or_else(|| Some(chosen.time()))
    }
}

/// What one half of the repeats holds for the best at each frame. With one repeat there is one half, which decides for both.
fn choices(frames: &[Frame], half: usize, sight: Sight) -> Vec<Option<usize>> {
    let half =
        if frames.iter().any(|f| f.fixed.iter().any(|s| s.half(half).next().is_some())) { half } else { 1 - half };
    let least = |time: &dyn Fn(usize) -> Option<f64>| {
        let count = frames.first().map_or(0, |f| f.fixed.len());
        let times = (0..count).filter_map(|k| Some((k, time(k)?)));
        times.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
    };
    match sight {
        Sight::AllFrames => {
            let total = |k: usize| frames.iter().map(|f| f.fixed[k].of_half(half)).sum();
            vec![least(&total); frames.len()]
        }
        Sight::Window => frames
            .chunks(WINDOW)
            .flat_map(|window| {
                let total = |k: usize| window.iter().map(|f| f.fixed[k].of_half(half)).sum();
                std::iter::repeat_n(least(&total), window.len())
            })
            .collect(),
        Sight::Frame => frames.iter().map(|f| least(&|k| f.fixed[k].of_half(half))).collect(),
        Sight::Neighbours => (0..frames.len())
            .map(|at| {
                let near = near(frames, at);
                least(&|k| {
                    // An algorithm that was not timed at this frame can't be run in it.
                    frames[at].fixed[k].of_half(half)?;
                    median(&near.iter().flat_map(|f| f.fixed[k].half(half)).collect::<Vec<_>>())
                })
            })
            .collect(),
    }
}

/// A frame and those about it that are like it.
fn near(frames: &[Frame], at: usize) -> Vec<&Frame> {
    let objects = frames[at].objects;
    let window = &frames[at.saturating_sub(NEIGHBOURS)..(at + NEIGHBOURS + 1).min(frames.len())];
    window.iter().filter(|f| f.objects.abs_diff(objects) as f64 <= ALIKE * objects as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::examples::{frame_of, samples};
    use crate::replay::samples::Samples;

    /// The least of the times at a frame, which luck has its part in.
    fn optimistic(fixed: &[Samples]) -> f64 {
        fixed.iter().map(Samples::time).fold(f64::INFINITY, f64::min)
    }

    fn frame(objects: usize, fixed: &[&[f64]]) -> Frame {
        frame_of(objects, fixed.iter().map(|ns| samples(ns)).collect())
    }

    #[test]
    fn an_oracle_pays_what_its_choice_took_in_the_other_half() {
        // Medians of the even repeats 10 and 12, of the odd ones 14 and 11: each half prefers the one that was lucky in it.
        let frames = [frame(5, &[&[10.0, 14.0, 10.0, 14.0], &[12.0, 11.0, 12.0, 11.0]])];
        let oracle = Oracle::with(&frames, Sight::Frame);
        // Chosen by the even half, the first takes 14 in the odd one; chosen by the odd half, the second takes 12 in the even one.
        assert_eq!(oracle.ns, [13.0]);
        assert_eq!([0, 1, 2, 3].map(|r| oracle.in_repeat(0, &frames[0], r)), [12.0, 14.0, 12.0, 14.0].map(Some));
        assert_eq!(optimistic(&frames[0].fixed), 11.5);
        // Where the same one is the best in both halves, the two agree with its time.
        let frames = [frame(5, &[&[10.0, 14.0, 11.0, 10.0], &[20.0, 21.0, 20.0, 21.0]])];
        assert_eq!((Oracle::new(&frames).ns[0], optimistic(&frames[0].fixed)), (11.25, 11.25));
    }

    #[test]
    fn in_a_window_an_algorithm_pays_for_what_it_keeps() {
        // The first is cheap but for one frame in eight; the second is always as dear as the mean of a little less.
        let frames: Vec<Frame> = (0..WINDOW)
            .map(|at| frame(100, &[if at % 8 == 0 { &[90.0; 4] } else { &[10.0; 4] }, &[18.0; 4]]))
            .collect();
        let total = |oracle: Oracle| oracle.ns.iter().sum::<f64>();
        assert_eq!(total(Oracle::new(&frames)), 4.0 * (18.0 + 7.0 * 10.0));
        assert_eq!(total(Oracle::of_windows(&frames)), 32.0 * 18.0);
    }

    #[test]
    fn frames_about_it_choose_better_than_a_noisy_one() {
        let (quiet, noisy) = ([10.0; 4], [10.0, 30.0, 10.0, 30.0]);
        let other = [12.0; 4];
        let frames: Vec<Frame> =
            (0..9).map(|at| frame(100, &[if at == 4 { &noisy } else { &quiet }, &other])).collect();
        // By itself the odd half prefers the second in the noisy frame, and pays for it in the even one.
        let by_frame = Oracle::with(&frames, Sight::Frame);
        assert_eq!((by_frame.ns[3], by_frame.ns[4]), (10.0, 21.0));
        let by_neighbours = Oracle::with(&frames, Sight::Neighbours);
        assert_eq!((by_neighbours.ns[3], by_neighbours.ns[4]), (10.0, 20.0));
        assert_eq!(Oracle::new(&frames), by_neighbours);
        // Frames with other numbers of objects have no say.
        let other_counts: Vec<Frame> = (0..9)
            .map(|at| frame(if at == 4 { 100 } else { 110 }, &[if at == 4 { &noisy } else { &quiet }, &other]))
            .collect();
        assert_eq!(Oracle::with(&other_counts, Sight::Neighbours).ns[4], 21.0);
    }

    #[test]
    fn where_noise_misleads_every_frame_one_algorithm_is_better_than_any_choice() {
        // The first takes 10; of the second each half has another quarter of the samples that look good.
        let lucky = |at: usize| [[1.0, 99.0, 1.0, 99.0], [99.0, 1.0, 99.0, 1.0]][at % 2];
        let frames: Vec<Frame> = (0..8).map(|at| frame(1000 * (at + 1), &[&[10.0; 4], &lucky(at)])).collect();
        let oracle = Oracle::new(&frames);
        assert_eq!(oracle.ns, [10.0; 8]);
        assert!(Oracle::with(&frames, Sight::Frame).total() > 300.0);
    }

    #[test]
    fn of_alike_algorithms_the_least_time_is_too_low_and_the_oracle_is_not() {
        // Eight algorithms that take 100 on average: numbers of a generator, spread evenly over 90 to 110.
        let mut random = sapwise_scenes::Random::new(7);
        let mut noisy = || 90.0 + 20.0 * random.uniform();
        let mut all = || (0..8).map(|_| samples(&[(); 6].map(|()| noisy()))).collect();
        let frames: Vec<Frame> = (0..400).map(|_| frame_of(50, all())).collect();
        let honest = Oracle::new(&frames).total() / 400.0;
        let least = frames.iter().map(|f| optimistic(&f.fixed)).sum::<f64>() / 400.0;
        assert!((honest - 100.0).abs() < 1.0, "{honest}");
        assert!(least < 97.0, "{least}");
    }

    #[test]
    fn one_repeat_has_the_least_time_and_one_that_was_not_timed_is_not_chosen() {
        let frames = [frame(5, &[&[10.0], &[12.0], &[]]), frame(9, &[&[30.0], &[20.0], &[]])];
        let oracle = Oracle::new(&frames);
        assert_eq!(oracle.ns, [10.0, 20.0]);
        assert_eq!(oracle.in_repeat(1, &frames[1], 0), Some(20.0));
        assert_eq!(Oracle::new(&[frame(5, &[&[]])]).ns, [f64::INFINITY]);
        // Timed twice only, for it is hopeless; the other was interrupted after its third repeat.
        assert_eq!(Oracle::new(&[frame(5, &[&[10.0, 12.0, 10.0], &[500.0, 400.0]])]).ns, [11.0]);
    }
}
