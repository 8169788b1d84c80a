//! Comparison of the pairs that the algorithms found, outside the timed region.

use sapwise::{Aabb, Pairs};

/// Up to this many boxes a double loop that shares no code with any algorithm gives the right answer.
pub(crate) const NAIVE_OBJECTS: usize = 2000;

/// Number and fingerprint of pairs, by which answers are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Answer {
    pub(crate) pairs: u64,
    pub(crate) fingerprint: u64,
}

impl Answer {
    pub(crate) fn of(pairs: &Pairs) -> Self {
        Self { pairs: pairs.len() as u64, fingerprint: pairs.fingerprint() }
    }

    /// Returns the answer of the double loop; `None` for large frames.
    pub(crate) fn naive(boxes: &[Aabb], scratch: &mut Pairs) -> Option<Self> {
        if boxes.len() > NAIVE_OBJECTS {
            return None;
        }
        scratch.clear();
        for (j, b) in boxes.iter().enumerate() {
            for (i, a) in boxes[..j].iter().enumerate() {
                // Written out here, because Aabb::overlaps is under test.
                let apart = (0..3).any(|k| a.max[k] < b.min[k] || b.max[k] < a.min[k]);
                if !apart {
                    scratch.push(i as u32, j as u32);
                }
            }
        }
        scratch.finish().ok()?;
        Some(Self::of(scratch))
    }

    /// Returns how this answer differs from the right one, if it does.
    pub(crate) fn mismatch(self, right: Self) -> Option<String> {
        (self != right).then(|| {
            format!(
                "wrong pairs: {} with fingerprint {:016x} where {} with {:016x} are right",
                self.pairs, self.fingerprint, right.pairs, right.fingerprint
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_or_exchanged_pair_is_told() {
        let boxes = [Aabb::cube([0.0; 3], 1.0), Aabb::cube([2.0, 0.0, 0.0], 1.0), Aabb::cube([9.0; 3], 1.0)];
        let right = Answer::naive(&boxes, &mut Pairs::new()).unwrap();
        assert_eq!(right.pairs, 1);
        let answer = |pairs: &[(u32, u32)]| {
            let mut list = Pairs::new();
            pairs.iter().for_each(|&(a, b)| list.push(a, b));
            Answer::of(&list).mismatch(right)
        };
        assert_eq!(answer(&[(1, 0)]), None);
        assert!(answer(&[]).is_some() && answer(&[(0, 2)]).is_some());
    }
}
