//! Sixteen boxes as columns, tested together against one.

use crate::Aabb;
use crate::cpu::SimdLevel;

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
    #[inline]
    pub(crate) fn overlapping(&self, level: SimdLevel, b: &Aabb) -> u32 {
        match level {
            // SAFETY: `SimdLevel::in_use` and the tests hand out only levels that this CPU has.
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx512 => unsafe { self.overlapping_avx512(b) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx2 => unsafe { self.overlapping_avx2(b) },
            _ => self.overlapping_portable(b),
        }
    }

    fn overlapping_portable(&self, b: &Aabb) -> u32 {
        let mut apart = [false; LANES];
        for a in 0..3 {
            for (lane, apart) in apart.iter_mut().enumerate() {
                *apart |= (self.low[a][lane] > b.max[a]) | (self.high[a][lane] < b.min[a]);
            }
        }
        apart.iter().enumerate().fold(0, |mask, (lane, &apart)| mask | u32::from(!apart) << lane)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn overlapping_avx512(&self, b: &Aabb) -> u32 {
        use std::arch::x86_64::*;
        let mut mask = u16::MAX;
        for a in 0..3 {
            // SAFETY: each column has 16 floats.
            let (low, high) = unsafe { (_mm512_loadu_ps(self.low[a].as_ptr()), _mm512_loadu_ps(self.high[a].as_ptr())) };
            mask &= _mm512_cmp_ps_mask::<_CMP_LE_OQ>(low, _mm512_set1_ps(b.max[a]));
            mask &= _mm512_cmp_ps_mask::<_CMP_GE_OQ>(high, _mm512_set1_ps(b.min[a]));
        }
        u32::from(mask)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn overlapping_avx2(&self, b: &Aabb) -> u32 {
        use std::arch::x86_64::*;
        let half = |from: usize| {
            let mut all = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
            for a in 0..3 {
                // SAFETY: each column has 16 floats, and `from` is 0 or 8.
                let (low, high) = unsafe {
                    (_mm256_loadu_ps(self.low[a].as_ptr().add(from)), _mm256_loadu_ps(self.high[a].as_ptr().add(from)))
                };
                let below = _mm256_cmp_ps::<_CMP_LE_OQ>(low, _mm256_set1_ps(b.max[a]));
                all = _mm256_and_ps(all, _mm256_and_ps(below, _mm256_cmp_ps::<_CMP_GE_OQ>(high, _mm256_set1_ps(b.min[a]))));
            }
            _mm256_movemask_ps(all) as u32
        };
        half(0) | half(8) << 8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_finds_the_lanes_that_overlap() {
        let lane = |k: usize| Aabb::cube([k as f32, (k * 7 % 16) as f32, (k * 3 % 16) as f32], 2.5);
        let mut node = Node::EMPTY;
        (0..LANES - 1).for_each(|k| assert!(node.widen(k, &lane(k)) && !node.widen(k, &lane(k))));
        let queries = (0..60).map(|k| Aabb::cube([(k % 17) as f32, (k % 13) as f32, (k % 11) as f32], 0.1 * k as f32));
        for query in queries {
            let expected = (0..LANES - 1).filter(|&k| lane(k).overlaps(&query)).fold(0, |mask, k| mask | 1 << k);
            for level in SimdLevel::ALL.into_iter().filter(|&l| l <= SimdLevel::detected()) {
                assert_eq!(node.overlapping(level, &query), expected, "{level}");
            }
        }
    }
}
