//! Sorts pairs by radix: into buckets by the highest bits, then each bucket, which fits into a cache, from the lowest
//! bits on.
//!
//! Within a bucket only the rest of a key counts. It usually has 32 bits, which halves the bytes moved. With several
//! threads, each first sorts its own share into buckets, and then all shares of a bucket are joined.

use crate::cpu::{Workers, ensure, split};
use crate::{Error, Pair};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// A value that its sort key determines.
pub(crate) trait Keyed: Copy + Default + Send + Sync {
    /// Returns the sort key: two numbers, the more significant one in the upper half.
    fn key(self) -> u64;
    /// Returns the value with this key.
    fn of(key: u64) -> Self;
}

impl Keyed for Pair {
    #[inline(always)]
    fn key(self) -> u64 {
        u64::from(self.0) << 32 | u64::from(self.1)
    }

    #[inline(always)]
    fn of(key: u64) -> Self {
        ((key >> 32) as u32, key as u32)
    }
}

impl Keyed for u64 {
    #[inline(always)]
    fn key(self) -> u64 {
        self
    }

    #[inline(always)]
    fn of(key: u64) -> Self {
        key
    }
}

impl Keyed for u32 {
    #[inline(always)]
    fn key(self) -> u64 {
        u64::from(self)
    }

    #[inline(always)]
    fn of(key: u64) -> Self {
        key as u32
    }
}

/// Fewest elements for a radix sort: with fewer, its counters cost more than comparing.
const FEW: usize = 256;

/// Fewest elements for several threads: with fewer, waking a thread takes as long as the sort.
const SMALLEST_SHARED: usize = 16_384;

/// Elements of a bucket: 32 KB of pairs and half of that to sort them into stay in the caches of a core.
const BUCKET: usize = 4096;

/// Most bits of a digit: more counters, or more places to write to, leave the first-level cache.
const MOST_BITS: u32 = 11;

/// Most bits of a digit in a small bucket: clearing more counters would take as long as counting.
const BITS_OF_FEW: u32 = 8;

/// Shares for each thread, to even out unequal ones.
const SHARES_PER_THREAD: usize = 4;

/// The buffers of a sort, kept from list to list: usually half the size of the list.
#[derive(Debug, Default)]
pub(crate) struct Sorter {
    narrow: Vec<u32>,
    /// Used instead if the rest of a key has more than 32 bits.
    wide: Vec<u64>,
    /// For each share, the start of each of its buckets, and the end of the last.
    starts: Vec<u32>,
}

/// A clone begins with empty buffers.
impl Clone for Sorter {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl Sorter {
    /// Sorts a list.
    pub(crate) fn sort<T: Keyed>(&mut self, on: &Workers, list: &mut [T]) {
        // Brute force and GPUs often return sorted pairs, and so does a lookup of canonical pairs in ascending ids.
        if list.is_sorted_by_key(|t| t.key()) {
            return;
        }
        let by_radix = list.len() >= FEW && u32::try_from(list.len()).is_ok();
        let on = if list.len() < SMALLEST_SHARED { &Workers::one() } else { on };
        if !by_radix || self.sort_on(on, list).is_err() {
            // In place, without buffers.
            list.sort_unstable_by_key(|t| t.key());
        }
    }

    /// Sorts a list with the buffers.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]. Then the list is as it was.
    fn sort_on<T: Keyed>(&mut self, on: &Workers, list: &mut [T]) -> Result<(), Error> {
        let Self { narrow, wide, starts } = self;
        let layout = Layout::of(on, list);
        let len = list.len();
        // At least sixteen elements of each bucket in each share, so that joining them copies whole cache lines.
        let shares = if on.threads() == 1 {
            1
        } else {
            (on.threads() * SHARES_PER_THREAD).min(len / layout.buckets / 16).max(1)
        };
        let counters = shares * (layout.buckets + 1);
        ensure(starts, counters, "sort keys")?;
        if layout.rest <= u32::BITS {
            ensure(narrow, len, "sort keys")?;
            by_buckets(on, list, &mut narrow[..len], &mut starts[..counters], layout);
        } else {
            ensure(wide, len, "sort keys")?;
            by_buckets(on, list, &mut wide[..len], &mut starts[..counters], layout);
        }
        Ok(())
    }
}

/// The layout of packed keys: their two numbers without the leading zeros that all of them share. The upper bits are
/// the bucket.
#[derive(Debug, Clone, Copy)]
struct Layout {
    /// Bits of the second number.
    low: u32,
    buckets: usize,
    /// Bits below those of the bucket.
    rest: u32,
    rest_mask: u64,
}

impl Layout {
    fn of<T: Keyed>(on: &Workers, list: &[T]) -> Self {
        let (high, low) = (AtomicU32::new(0), AtomicU32::new(0));
        on.each_of(list.chunks(list.len().div_ceil(on.threads())), |list| {
            let halves = |t: &T| ((t.key() >> 32) as u32, t.key() as u32);
            let most = list.iter().map(halves).fold((0, 0), |most, of| (most.0.max(of.0), most.1.max(of.1)));
            high.fetch_max(most.0, Relaxed);
            low.fetch_max(most.1, Relaxed);
        });
        let bits = |most: AtomicU32| u32::BITS - most.into_inner().leading_zeros();
        let low = bits(low);
        let all = bits(high) + low;
        let bits = (list.len() / BUCKET).checked_ilog2().map_or(0, |bits| bits + 1).min(MOST_BITS).min(all);
        let rest = all - bits;
        Self { low, buckets: 1 << bits, rest, rest_mask: 1_u64.checked_shl(rest).unwrap_or(0).wrapping_sub(1) }
    }

    /// Packs a key.
    #[inline(always)]
    fn packed(self, key: u64) -> u64 {
        key >> 32 << self.low | key & 0xffff_ffff
    }

    #[inline(always)]
    fn bucket<T: Keyed>(self, t: T) -> usize {
        (self.packed(t.key()) >> self.rest) as usize
    }

    #[inline(always)]
    fn rest<T: Keyed, K: Keyed>(self, t: T) -> K {
        K::of(self.packed(t.key()) & self.rest_mask)
    }

    /// Returns the common bits of all packed keys of a bucket.
    fn base(self, bucket: usize) -> u64 {
        // With one bucket all 64 bits may be the rest.
        (bucket as u64).checked_shl(self.rest).unwrap_or(0)
    }

    /// Returns the value with this rest of a key in a bucket.
    #[inline(always)]
    fn whole<T: Keyed, K: Keyed>(self, base: u64, rest: K) -> T {
        let packed = base | rest.key();
        T::of(packed >> self.low << 32 | packed & ((1 << self.low) - 1))
    }
}

/// Sorts `list` with the buffer `rests`, which has its length. The length of `starts` determines the number of shares.
fn by_buckets<T: Keyed, K: Keyed>(on: &Workers, list: &mut [T], rests: &mut [K], starts: &mut [u32], layout: Layout) {
    if layout.buckets == 1 {
        return sort_bucket(list, rests, true, 0, layout);
    }
    let each = layout.buckets + 1;
    let share = list.len().div_ceil(starts.len() / each);
    let parts = list.chunks(share).zip(rests.chunks_mut(share)).zip(starts.chunks_mut(each));
    let shares = parts.len();
    on.each_of(parts, |((from, to), starts)| {
        starts.fill(0);
        scatter(from, to, starts, |t| layout.bucket(t), |t| layout.rest(t));
        // Every start has moved to the end of its bucket, which is the start of the next one.
        starts.copy_within(..each - 1, 1);
        starts[0] = 0;
    });
    let starts = &starts[..shares * each];
    let sizes = || (0..each - 1).map(|k| starts.chunks(each).map(|s| (s[k + 1] - s[k]) as usize).sum());
    if shares > 1 {
        on.each_of(split(list, sizes()).enumerate(), |(bucket, to)| {
            let parts = starts.chunks(each).zip(rests.chunks(share));
            let rests = parts.flat_map(|(s, rests)| &rests[s[bucket] as usize..s[bucket + 1] as usize]);
            let base = layout.base(bucket);
            to.iter_mut().zip(rests).for_each(|(t, &rest)| *t = layout.whole(base, rest));
        });
    }
    on.each_of(split(list, sizes()).zip(split(rests, sizes())).enumerate(), |(bucket, (list, rests))| {
        sort_bucket(list, rests, shares > 1, layout.base(bucket), layout);
    });
}

/// Sorts `from` by digit, stably, and writes `make` of each element to `to`. `starts` has a counter for each digit: all
/// 0 before, and the end of each digit in `to` afterwards.
#[inline(always)]
fn scatter<F: Copy, T>(
    from: &[F],
    to: &mut [T],
    starts: &mut [u32],
    digit: impl Fn(F) -> usize,
    make: impl Fn(F) -> T,
) {
    from.iter().for_each(|&f| starts[digit(f)] += 1);
    let mut total = 0;
    starts.iter_mut().for_each(|start| total += std::mem::replace(start, total));
    for &f in from {
        let at = &mut starts[digit(f)];
        to[*at as usize] = make(f);
        *at += 1;
    }
}

/// Sorts a bucket into `list`. It stands in `list` if `whole`, else as rests of keys in `rests`. Each pass sorts some
/// bits from one to the other.
fn sort_bucket<T: Keyed, K: Keyed>(list: &mut [T], rests: &mut [K], mut whole: bool, base: u64, layout: Layout) {
    let most = if list.len() < BUCKET / 2 { BITS_OF_FEW } else { MOST_BITS };
    let passes = if list.len() < FEW { 0 } else { layout.rest.div_ceil(most) };
    // Copies it if the last pass would not end in `list`.
    if whole != (passes % 2 == 0) {
        if whole {
            rests.iter_mut().zip(&*list).for_each(|(rest, &t)| *rest = layout.rest(t));
        } else {
            list.iter_mut().zip(&*rests).for_each(|(t, &rest)| *t = layout.whole(base, rest));
        }
        whole = !whole;
    }
    if passes == 0 {
        return list.sort_unstable_by_key(|t| t.key());
    }
    let width = layout.rest.div_ceil(passes);
    let mut starts = [0_u32; 1 << MOST_BITS];
    let starts = &mut starts[..1 << width];
    for pass in 0..passes {
        let digit = |rest: K| (rest.key() >> (pass * width)) as usize & ((1 << width) - 1);
        starts.fill(0);
        if whole {
            scatter(list, rests, starts, |t| digit(layout.rest(t)), |t| layout.rest(t));
        } else {
            scatter(rests, list, starts, digit, |rest| layout.whole(base, rest));
        }
        whole = !whole;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::Threads;
    use crate::mix;

    fn assert_sorts<T: Keyed + PartialEq>(list: &[T], what: &str) {
        let threads: &[u32] = if cfg!(feature = "parallel") { &[1, 2, 3, 7] } else { &[1] };
        for &threads in threads {
            let workers = Workers::new("sort", threads, &Threads::default());
            // The second and third time with used buffers.
            let mut sorter = Sorter::default();
            for len in [list.len(), list.len() / 2, list.len()] {
                let mut sorted = list[..len].to_vec();
                sorter.sort(&workers, &mut sorted);
                let mut expected = list[..len].to_vec();
                expected.sort_by_key(|t| t.key());
                assert!(sorted == expected, "{what}, {len} on {threads} threads");
            }
        }
    }

    #[test]
    fn radix_sort_matches_comparison() {
        for len in [0, 1, 2, 255, 256, 257, 1000, 4095, 4096, 8192, 16_383, 16_384, 50_001, 300_000] {
            for (what, firsts, seconds) in [
                ("a usual frame", len as u64 / 5 + 1, len as u64 / 5 + 1),
                ("few boxes", 3, 5),
                ("one box in every pair", 1, 1 << 20),
                ("one box is always second", 1 << 20, 1),
                ("ids of all bits", 1 << 32, 1 << 32),
            ] {
                let of = |k: usize| ((mix(k as u64) % firsts) as u32, (mix(!(k as u64)) % seconds) as u32);
                let list: Vec<Pair> = (0..len).map(of).collect();
                assert_sorts(&list, what);
                let keys: Vec<u64> = list.iter().map(|p| p.key()).collect();
                assert_sorts(&keys, what);
            }
            let near_the_end =
                |k: usize| (u32::MAX - (mix(k as u64) % 1000) as u32, u32::MAX - (mix(7 + k as u64) % 1000) as u32);
            assert_sorts(&(0..len).map(near_the_end).collect::<Vec<Pair>>(), "ids near the end");
            let ascending: Vec<Pair> = (0..len as u32).map(|k| (k / 7, k % 7 + k)).collect();
            assert_sorts(&ascending, "a sorted list");
            assert_sorts(&ascending.iter().rev().copied().collect::<Vec<Pair>>(), "a reversed list");
            // One box is in half of all pairs.
            let skewed = |k: usize| {
                if k.is_multiple_of(2) { (5, k as u32) } else { ((mix(k as u64) % 100_000) as u32, k as u32) }
            };
            assert_sorts(&(0..len).map(|k| skewed(k * 7919 % len.max(1))).collect::<Vec<Pair>>(), "a skewed list");
        }
    }
}
