//! Sixteen boxes as columns, tested together against one.

use super::prefetch;
use crate::aabb::Aabb;
use crate::cpu::level::Simd;
use crate::pairs::each_bit;

/// Boxes in a node.
pub(crate) const LANES: usize = 16;

/// The bounds of up to 16 boxes: six columns, lower bounds first.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Node {
    low: [[f32; LANES]; 3],
    high: [[f32; LANES]; 3],
}

impl Node {
    /// No box in any lane: it overlaps nothing that is finite.
    pub(crate) const EMPTY: Self = Self { low: [[f32::INFINITY; LANES]; 3], high: [[f32::NEG_INFINITY; LANES]; 3] };

    /// Puts bounds into a lane.
    #[inline]
    pub(crate) fn set(&mut self, lane: usize, bounds: &Aabb) {
        for a in 0..3 {
            self.low[a][lane] = bounds.min[a];
            self.high[a][lane] = bounds.max[a];
        }
    }

    /// Makes a lane contain these bounds too. Whether that changed it.
    #[inline]
    pub(crate) fn widen(&mut self, lane: usize, bounds: &Aabb) -> bool {
        let mut changed = false;
        for a in 0..3 {
            let (low, high) = (&mut self.low[a][lane], &mut self.high[a][lane]);
            changed |= (bounds.min[a] < *low) | (bounds.max[a] > *high);
            *low = low.min(bounds.min[a]);
            *high = high.max(bounds.max[a]);
        }
        changed
    }

    /// What contains all lanes.
    pub(crate) fn bounds(&self) -> Aabb {
        Aabb {
            min: self.low.map(|lanes| lanes.into_iter().fold(f32::INFINITY, f32::min)),
            max: self.high.map(|lanes| lanes.into_iter().fold(f32::NEG_INFINITY, f32::max)),
        }
    }

    /// Bit k is set when lane k overlaps a box.
    #[inline(always)]
    fn overlapping(&self, b: &Aabb) -> u32 {
        let mut apart = [false; LANES];
        for a in 0..3 {
            for (lane, apart) in apart.iter_mut().enumerate() {
                *apart |= (self.low[a][lane] > b.max[a]) | (self.high[a][lane] < b.min[a]);
            }
        }
        apart.iter().enumerate().fold(0, |mask, (lane, &apart)| mask | u32::from(!apart) << lane)
    }
}

/// Calls `found` for every lane of the first of `levels` that overlaps a box; lane k of node n has the number 16 n + k.
///
/// Lane k of node n in a level above contains node 16 n + k of the level below. The last level that has nodes is the top.
/// `far`: the nodes are likely not in the cache, and are asked for ahead.
#[inline]
pub(crate) fn each_overlapping(simd: Simd, levels: &[Vec<Node>], far: bool, b: &Aabb, found: impl FnMut(usize)) {
    match simd {
        // SAFETY: the proof says that this CPU has the instructions.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx512(_) => unsafe { x86::walk_avx512(levels, far, b, found) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx2(_) => unsafe { x86::walk_avx2(levels, far, b, found) },
        Simd::Portable => walk(levels, far, b, Node::overlapping, found),
    }
}

/// Levels of a tree of 2^32 boxes.
const MOST_LEVELS: usize = 8;

#[inline(always)]
fn walk(levels: &[Vec<Node>], far: bool, b: &Aabb, overlapping: impl Fn(&Node, &Aabb) -> u32, mut found: impl FnMut(usize)) {
    let Some(top) = levels.iter().rposition(|level| !level.is_empty()) else { return };
    for root in 0..levels[top].len() {
        // For each level below the top, the node whose children are being visited and which of them are left.
        let mut open = [(0, 0); MOST_LEVELS];
        let mut at = top;
        open[at] = (root, overlapping(&levels[at][root], b));
        loop {
            let (node, left) = &mut open[at];
            if *left == 0 || at == 0 {
                let first = *node * LANES;
                each_bit(*left, |lane| found(first + lane));
                at += 1;
                if at > top {
                    break;
                }
                continue;
            }
            let child = *node * LANES + left.trailing_zeros() as usize;
            *left &= *left - 1;
            let below = &levels[at - 1];
            // A lane without a child holds nothing, which still overlaps infinite bounds.
            let Some(below_node) = below.get(child) else { continue };
            if far && *left != 0 {
                let next = *node * LANES + left.trailing_zeros() as usize;
                below.get(next).into_iter().for_each(prefetch);
            }
            at -= 1;
            open[at] = (child, overlapping(below_node, b));
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Node, walk};
    use crate::Aabb;
    use std::arch::x86_64::*;

    #[target_feature(enable = "avx512f")]
    pub(super) fn walk_avx512(levels: &[Vec<Node>], far: bool, b: &Aabb, found: impl FnMut(usize)) {
        let overlapping = |node: &Node, b: &Aabb| {
            let mut mask = u16::MAX;
            for a in 0..3 {
                // SAFETY: each column has 16 floats.
                let (low, high) = unsafe { (_mm512_loadu_ps(node.low[a].as_ptr()), _mm512_loadu_ps(node.high[a].as_ptr())) };
                mask &= _mm512_cmp_ps_mask::<_CMP_LE_OQ>(low, _mm512_set1_ps(b.max[a]));
                mask &= _mm512_cmp_ps_mask::<_CMP_GE_OQ>(high, _mm512_set1_ps(b.min[a]));
            }
            u32::from(mask)
        };
        walk(levels, far, b, overlapping, found);
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn walk_avx2(levels: &[Vec<Node>], far: bool, b: &Aabb, found: impl FnMut(usize)) {
        let half = |node: &Node, b: &Aabb, from: usize| {
            let mut all = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
            for a in 0..3 {
                // SAFETY: each column has 16 floats, and `from` is 0 or 8.
                let (low, high) = unsafe {
                    (_mm256_loadu_ps(node.low[a].as_ptr().add(from)), _mm256_loadu_ps(node.high[a].as_ptr().add(from)))
                };
                let below = _mm256_cmp_ps::<_CMP_LE_OQ>(low, _mm256_set1_ps(b.max[a]));
                all = _mm256_and_ps(all, _mm256_and_ps(below, _mm256_cmp_ps::<_CMP_GE_OQ>(high, _mm256_set1_ps(b.min[a]))));
            }
            _mm256_movemask_ps(all) as u32
        };
        walk(levels, far, b, |node, b| half(node, b, 0) | half(node, b, 8) << 8, found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_finds_the_lanes_that_overlap() {
        let boxes: Vec<Aabb> =
            (0..300).map(|k| Aabb::cube([k as f32 / 9.0, (k * 7 % 16) as f32, (k * 3 % 16) as f32], 2.5)).collect();
        let mut levels = vec![vec![Node::EMPTY; 19], vec![Node::EMPTY; 2], vec![]];
        for (k, b) in boxes.iter().enumerate() {
            levels[0][k / LANES].set(k % LANES, b);
            assert!(levels[1][k / LANES / LANES].widen(k / LANES % LANES, b) || k % LANES > 0);
        }
        let infinite = Aabb::new([f32::NEG_INFINITY; 3], [f32::INFINITY; 3]);
        let queries = (0..60).map(|k| Aabb::cube([(k % 34) as f32, (k % 13) as f32, (k % 11) as f32], 0.1 * k as f32));
        for query in queries.chain([infinite]) {
            let expected: Vec<usize> = (0..boxes.len()).filter(|&k| boxes[k].overlaps(&query)).collect();
            for simd in Simd::every() {
                let mut found = Vec::new();
                each_overlapping(simd, &levels, true, &query, |k| found.push(k));
                // Lanes that hold nothing overlap infinite bounds: the caller knows how many there are.
                found.retain(|&k| k < boxes.len());
                assert_eq!(found, expected, "{simd:?}");
            }
        }
    }
}
