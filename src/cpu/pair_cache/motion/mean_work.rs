//! The mean cost of frames of which one now and then makes all again.

/// The mean cost of a box over the frames from one in which all is made again to the next. A promise counts for as many
/// frames as [`FEWEST`](Self::FEWEST).
#[derive(Debug, Clone, Copy)]
pub(super) struct MeanWork {
    /// Over the frames up to the last in which all was made again, and how many frames that counts for.
    before: f32,
    weight: f32,
    /// Sum over the frames since, their number, and the last one.
    sum: f32,
    frames: f32,
    pub(super) last: f32,
}

impl MeanWork {
    const FEWEST: f32 = 16.0;
    const MOST: f32 = 64.0;
    /// Where nothing moves nothing is ever made again: the sum is kept where `f32` adds up.
    const LONGEST: f32 = 1024.0;

    pub(super) fn promised(cost: f32) -> Self {
        Self { before: cost, weight: Self::FEWEST, sum: 0.0, frames: 0.0, last: cost }
    }

    pub(super) fn mean(&self) -> f32 {
        (self.before * self.weight + self.sum) / (self.weight + self.frames)
    }

    pub(super) fn add(&mut self, cost: f32, rebuilt: bool) {
        if rebuilt {
            let weight = (self.weight + self.frames).min(Self::MOST);
            *self = Self { before: self.mean(), weight, sum: 0.0, frames: 0.0, last: cost };
        }
        if self.frames >= Self::LONGEST {
            (self.sum, self.frames) = (self.sum / 2.0, self.frames / 2.0);
        }
        (self.sum, self.frames, self.last) = (self.sum + cost, self.frames + 1.0, cost);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_work_is_that_of_whole_rounds_and_does_not_drift_where_there_are_none() {
        let mut work = MeanWork::promised(20.0);
        (0..50).for_each(|k| work.add(if k % 10 == 0 { 100.0 } else { 10.0 }, k % 10 == 0));
        assert!((work.mean() - 19.0).abs() < 2.0, "{}", work.mean());
        (0..20_000_000).for_each(|_| work.add(10.0, false));
        assert!((work.mean() - 10.0).abs() < 1.0, "{}", work.mean());
    }
}
