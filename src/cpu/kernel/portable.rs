//! Plain Rust, which the compiler turns into the vectors of the target's baseline.

use super::{Lanes, Query, View};

/// Four rows at a time.
#[derive(Clone, Copy)]
pub(super) struct Portable;

impl Lanes for Portable {
    const COUNT: usize = 4;

    #[inline(always)]
    unsafe fn reach_and_hits(self, view: &View<'_>, at: usize, query: &Query) -> (u32, u32) {
        let four = |column: &[f32]| -> [f32; 4] { [column[at], column[at + 1], column[at + 2], column[at + 3]] };
        let reach = mask(four(view.low[0]).map(|v| v <= query.high[0]));
        if reach == 0 {
            return (0, 0);
        }
        let (low1, high1) = (four(view.low[1]), four(view.high[1]));
        let (low2, high2) = (four(view.low[2]), four(view.high[2]));
        let hits = [0, 1, 2, 3].map(|k| {
            (low1[k] <= query.high[1])
                & (high1[k] >= query.low[1])
                & (low2[k] <= query.high[2])
                & (high2[k] >= query.low[2])
        });
        (reach, reach & mask(hits))
    }

    #[inline(always)]
    unsafe fn ends_after(self, view: &View<'_>, at: usize, low: f32) -> u32 {
        mask([0, 1, 2, 3].map(|k| view.high[0][at + k] >= low))
    }
}

#[inline(always)]
fn mask(lanes: [bool; 4]) -> u32 {
    u32::from(lanes[0]) | u32::from(lanes[1]) << 1 | u32::from(lanes[2]) << 2 | u32::from(lanes[3]) << 3
}
