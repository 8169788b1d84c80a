//! Sorts keys on all threads: each part on its own, then parts merged two by two.

use crate::cpu::columns::ensure;
use crate::cpu::workers::Workers;
use crate::error::Error;

/// Keys that one task merges at the least; below, a task costs more than it saves.
const SMALLEST_MERGE: usize = 4096;

/// Sorts the first `len` keys. `scratch` may be of any length and hold anything, and is left so.
pub(crate) fn sort(workers: &Workers, keys: &mut Vec<u64>, scratch: &mut Vec<u64>, len: usize) -> Result<(), Error> {
    let mut run = len.div_ceil(workers.threads().next_power_of_two()).max(SMALLEST_MERGE);
    workers.each_of(keys[..len].chunks_mut(run), <[u64]>::sort_unstable);
    if run >= len {
        return Ok(());
    }
    ensure(scratch, len, "sort keys")?;
    while run < len {
        let part = (len / workers.tasks()).max(SMALLEST_MERGE);
        // Each run of two ends in a part that may be short.
        let most = len.div_ceil(part) + len.div_ceil(2 * run);
        let pairs_of_runs = keys[..len].chunks(2 * run).zip(scratch[..len].chunks_mut(2 * run));
        let parts = pairs_of_runs.flat_map(|(from, to)| {
            let (a, b) = from.split_at(run.min(from.len()));
            to.chunks_mut(part).zip((0..).step_by(part)).map(move |(to, first)| (a, b, first, to))
        });
        workers.each_of(parts.take(most), |(a, b, first, to)| merge_part(a, b, first, to));
        std::mem::swap(keys, scratch);
        run *= 2;
    }
    Ok(())
}

/// Writes to `to` what stands from position `first` on when `a` and `b`, both ascending, are merged.
fn merge_part(a: &[u64], b: &[u64], first: usize, to: &mut [u64]) {
    // How many of the first come from `a`: the fewest such that what is left of it does not belong before them.
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
    use crate::splitmix::mix;

    #[test]
    fn keys_are_sorted_with_any_number_of_threads() {
        let most = if cfg!(feature = "parallel") { 5 } else { 1 };
        for threads in 1..=most {
            let workers = Workers::new("sort", threads, &Threads::default()).unwrap();
            let mut scratch = Vec::new();
            for (len, distinct) in [(0, 1), (1, 1), (4096, 9), (4097, u64::MAX), (50_000, 3), (100_003, u64::MAX)] {
                let mut keys: Vec<u64> = (0..len as u64 + 7).map(|k| mix(k) % distinct).collect();
                let mut expected = keys[..len].to_vec();
                expected.sort_unstable();
                sort(&workers, &mut keys, &mut scratch, len).unwrap();
                assert!(keys[..len] == expected, "{len} keys, {threads} threads");
            }
        }
    }
}
