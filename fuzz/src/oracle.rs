//! Answers by definition.

use sapwise::error::BoxDefect;
use sapwise::internals::Pair;
use sapwise::{Aabb, Error, Membership};
use std::collections::BTreeSet;

/// The answer that every algorithm must give.
#[derive(Debug)]
pub struct Answer {
    /// The wanted pairs in canonical order, or the error.
    pub pairs: Result<Vec<Pair>, Error>,
    /// Number of overlapping pairs, wanted or not.
    pub overlapping: u64,
}

/// Returns the answer for these boxes with a filter and a limit.
pub fn answer(boxes: &[Aabb], memberships: Option<&[Membership]>, limit: Option<usize>) -> Answer {
    if let Some((index, defect)) = boxes.iter().enumerate().find_map(|(k, b)| Some((k, defect(b)?))) {
        return Answer { pairs: Err(Error::InvalidBox { index, defect }), overlapping: 0 };
    }
    let of = |k: usize| {
        let all = Membership { groups: !0, mask: !0, fixed: false, owner: 0 };
        memberships.and_then(|m| m.get(k)).copied().unwrap_or(all)
    };
    let mut pairs = Vec::new();
    let mut overlapping = 0;
    for i in 0..boxes.len() {
        for j in i + 1..boxes.len() {
            if !overlap(&boxes[i], &boxes[j]) {
                continue;
            }
            let (a, b) = (of(i), of(j));
            overlapping += 1;
            let apart = a.owner == 0 || a.owner != b.owner;
            if a.groups & b.mask != 0 && b.groups & a.mask != 0 && !(a.fixed && b.fixed) && apart {
                pairs.push((i as u32, j as u32));
            }
        }
    }
    match limit.filter(|&limit| pairs.len() > limit) {
        Some(limit) => Answer { pairs: Err(Error::TooManyPairs { limit }), overlapping },
        None => Answer { pairs: Ok(pairs), overlapping },
    }
}

fn overlap(a: &Aabb, b: &Aabb) -> bool {
    // Without branches: the fuzzer would try to cover each.
    (0..3).fold(true, |meet, k| meet & (a.min[k] <= b.max[k]) & (b.min[k] <= a.max[k]))
}

fn defect(b: &Aabb) -> Option<BoxDefect> {
    let nan = b.min.iter().chain(&b.max).any(|x| x.is_nan());
    let inverted = (0..3).any(|k| b.min[k] > b.max[k]);
    if nan { Some(BoxDefect::NotANumber) } else { inverted.then_some(BoxDefect::Inverted) }
}

/// Returns the pairs of two ids that these pairs of positions stand for, each once.
pub fn of_ids(pairs: &[Pair], ids: &[u8]) -> BTreeSet<(u8, u8)> {
    let named = pairs.iter().map(|&(i, j)| (ids[i as usize], ids[j as usize]));
    named.filter(|(a, b)| a != b).map(|(a, b)| (a.min(b), a.max(b))).collect()
}
