//! Sorts keys on all threads: each part by a radix sort, then merges the parts two by two.

use crate::Error;
use crate::cpu::{Workers, ensure};

/// Fewest keys of a merging task: a smaller task costs more than it saves.
const SMALLEST_MERGE: usize = 4096;

/// Fewest keys for a radix sort: fewer are compared sooner than their digits are counted.
const SMALLEST_RADIX: usize = 512;

/// Bits of a digit: 2048 counts fit into the first-level cache, and three digits hold the upper half of a key.
const DIGIT: u32 = 11;
const DIGITS: usize = 3;

/// Sorts keys by their upper halves, then by their lower ones.
///
/// Keys with the same upper half must come with ascending lower halves, as positions in the input do. `scratch` may
/// have any length and content.
pub(crate) fn sort(workers: &Workers, keys: &mut [u64], scratch: &mut Vec<u64>) -> Result<(), Error> {
    let len = keys.len();
    if len < SMALLEST_RADIX {
        keys.sort_unstable();
        return Ok(());
    }
    ensure(scratch, len, "sort keys")?;
    let scratch = &mut scratch[..len];
    let mut run = len.div_ceil(workers.threads().next_power_of_two()).max(SMALLEST_MERGE);
    workers.each_of(keys.chunks_mut(run).zip(scratch.chunks_mut(run)), |(keys, scratch)| radix(keys, scratch));
    let part = (len / workers.tasks()).max(SMALLEST_MERGE);
    let (mut from, mut to, mut swapped) = (&mut *keys, &mut *scratch, false);
    while run < len {
        // The last part of each two runs may be short.
        let most = len.div_ceil(part) + len.div_ceil(2 * run);
        let pairs_of_runs = from.chunks(2 * run).zip(to.chunks_mut(2 * run));
        let parts = pairs_of_runs.flat_map(|(from, to)| {
            let (a, b) = from.split_at(run.min(from.len()));
            to.chunks_mut(part).zip((0..).step_by(part)).map(move |(to, first)| (a, b, first, to))
        });
        workers.each_of(parts.take(most), |(a, b, first, to)| merge_part(a, b, first, to));
        (from, to, swapped) = (to, from, !swapped);
        run *= 2;
    }
    if swapped {
        workers.each_of(keys.chunks_mut(part).zip(scratch.chunks(part)), |(to, from)| to.copy_from_slice(from));
    }
    Ok(())
}

/// Sorts keys by their upper halves and keeps the order of those with the same one. `scratch` has the length of `keys`.
fn radix(keys: &mut [u64], scratch: &mut [u64]) {
    if keys.len() < SMALLEST_RADIX {
        return keys.sort_unstable();
    }
    let digit = |key: u64, k: usize| (key >> (u64::BITS / 2 + DIGIT * k as u32)) as usize & ((1 << DIGIT) - 1);
    let mut starts = [[0_u32; 1 << DIGIT]; DIGITS];
    for &key in &*keys {
        (0..DIGITS).for_each(|k| starts[k][digit(key, k)] += 1);
    }
    let (mut from, mut to) = (&mut *keys, &mut *scratch);
    let mut swapped = false;
    for (k, starts) in starts.iter_mut().enumerate() {
        // A digit that all keys share changes nothing.
        if starts[digit(from[0], k)] as usize == from.len() {
            continue;
        }
        let mut total = 0;
        starts.iter_mut().for_each(|start| total += std::mem::replace(start, total));
        for &key in &*from {
            let at = &mut starts[digit(key, k)];
            to[*at as usize] = key;
            *at += 1;
        }
        std::mem::swap(&mut from, &mut to);
        swapped = !swapped;
    }
    if swapped {
        keys.copy_from_slice(scratch);
    }
}

/// Merges `a` and `b`, both ascending, and writes the part from position `first` on to `to`.
fn merge_part(a: &[u64], b: &[u64], first: usize, to: &mut [u64]) {
    // The number of keys of `a` before position `first`.
    let (mut low, mut high) = (first.saturating_sub(b.len()), first.min(a.len()));
    while low < high {
        let middle = (low + high) / 2;
        if a[middle] < b[first - middle - 1] { low = middle + 1 } else { high = middle }
    }
    let (mut a, mut b) = (&a[low..], &b[first - low..]);
    for to in to {
        let from_a = match (a.first(), b.first()) {
            (Some(x), Some(y)) => x < y,
            (one, _) => one.is_some(),
        };
        let from = if from_a { &mut a } else { &mut b };
        *to = from[0];
        *from = &from[1..];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::Threads;
    use crate::mix;

    #[test]
    fn keys_are_sorted_on_any_number_of_threads() {
        let most = if cfg!(feature = "parallel") { 5 } else { 1 };
        for threads in 1..=most {
            let workers = Workers::new("sort", threads, &Threads::default());
            let mut scratch = Vec::new();
            for (len, distinct) in [(0, 1), (1, 1), (4096, 9), (4097, u64::MAX), (50_000, 3), (100_003, u64::MAX)] {
                let mut keys: Vec<u64> = (0..len as u64 + 7).map(|k| ((mix(k) >> 32) % distinct) << 32 | k).collect();
                let mut expected = keys[..len].to_vec();
                expected.sort_unstable();
                sort(&workers, &mut keys[..len], &mut scratch).unwrap();
                assert!(keys[..len] == expected, "{len} keys, {threads} threads");
            }
        }
    }
}
