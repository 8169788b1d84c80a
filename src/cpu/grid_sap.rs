//! A grid of strips over two axes, a sweep along the third inside each strip. From scratch every frame.
//!
//! Phase one, one task a thread: each thread sorts its share of the boxes into bins of its own, one for each strip that a box touches. Phase
//! two, several tasks a thread: each strip gathers its bins from all threads, sorts them along the sweep axis and sweeps.
//!
//! What a strip is no good for stands apart, in a [tree](super::tree) of the frame: boxes much larger than a cell, the boxes of strips that hold
//! far more than others, and fixed boxes, of which no two are a pair. The tree is compared with itself, and with the boxes of each strip.

use crate::aabb::Aabb;
use crate::broad_phase::{BroadPhase, check_count};
use crate::cpu::Threads;
use crate::cpu::columns::{Columns, ensure, order_key, part};
use crate::cpu::kernel::node::{Group, LANES};
use crate::cpu::kernel::{InStrip, sweep_rows};
use crate::cpu::level::Simd;
use crate::cpu::tree::{Members, Tree};
use crate::cpu::workers::{Outputs, Workers};
use crate::error::Error;
use crate::filter::Filter;
use crate::load::{FramePlan, Sample, StripGrid, StripSpan};
use crate::pairs::Pairs;
use std::ops::Range;

/// Boxes that a strip holds at most; those of a fuller one stand apart. Sixteen times as many as one holds of boxes that are spread evenly: up to
/// there a sweep of one dense strip among others costs less than the tree and what the other strips have to do with it.
const MOST_BOXES: usize = 4096;

/// The same of the boxes of one thread's share, which need not be an equal part of every strip.
const MOST_OF_SHARE: usize = 1024;

/// The mask of [`StripGrid::each_strip`](crate::load::StripGrid::each_strip) in the first of a box's strips.
const BOTH: u32 = 3;

/// Marks the count of a strip whose boxes stand apart.
const OVERFULL: u32 = 1 << 31;

/// The method; see the module.
#[derive(Debug)]
struct GridSap {
    workers: Workers,
    bins: Vec<Bins>,
    /// Positions in the input of the boxes that stand apart, ascending, and the tree of them.
    apart: Vec<u32>,
    tree: Tree,
    tasks: Vec<Task>,
    outputs: Outputs,
    simd: Simd,
}

/// What one thread makes of its share of the boxes.
#[derive(Debug, Default)]
struct Bins {
    /// Where the bin of each strip begins in `entries`; one more than there are strips.
    starts: Vec<u32>,
    /// The strips in which each box of the share stands.
    spans: Vec<StripSpan>,
    entries: Vec<Entry>,
    /// Positions in the input of the boxes that stand apart; only the first `apart_count` are of this frame.
    apart: Vec<u32>,
    apart_count: usize,
    /// What went wrong, to be reported after the phase.
    error: Option<Error>,
}

/// A box in a bin.
#[derive(Debug, Clone, Copy, Default)]
struct Entry {
    bounds: Aabb,
    id: u32,
    /// The mask of [`StripGrid::each_strip`] in this strip.
    begins: u32,
}

/// Memory of one task of phase two.
#[derive(Debug, Default)]
struct Task {
    entries: Vec<Entry>,
    keys: Vec<u64>,
    columns: Columns,
    error: Option<Error>,
}

pub(super) fn create(threads: u32, pools: &Threads, simd: Simd) -> Result<Box<dyn BroadPhase>, Error> {
    let workers = Workers::new("grid-sap", threads, pools)?;
    Ok(Box::new(GridSap {
        bins: (0..workers.threads()).map(|_| Bins::default()).collect(),
        apart: Vec::new(),
        tree: Tree::new(simd),
        tasks: (0..workers.tasks()).map(|_| Task::default()).collect(),
        outputs: Outputs::default(),
        workers,
        simd,
    }))
}

impl BroadPhase for GridSap {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        self.find_pairs_with(&FramePlan::default(), boxes, pairs)
    }

    fn find_pairs_with(&mut self, plan: &FramePlan, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        check_count(boxes.len())?;
        let Self { workers, bins, apart, tree, tasks, outputs, simd } = self;
        let (grid, filter) = (plan.grid(boxes), pairs.filter());
        let workers = &workers.fit(boxes.len());
        let threads = workers.threads();
        let (bins, tasks) = (&mut bins[..threads], &mut tasks[..workers.tasks()]);
        workers.each(bins, |k, bin| {
            bin.error = bin.fill(&grid, boxes, part(boxes.len(), k, threads), threads, filter).err();
        });
        bins.iter_mut().find_map(|b| b.error.take()).map_or(Ok(()), Err)?;
        apart.clear();
        let count = bins.iter().map(|b| b.apart_count).sum();
        apart.try_reserve(count).map_err(|_| Error::OutOfMemory { what: "boxes that stand apart", elements: count })?;
        bins.iter().for_each(|b| apart.extend_from_slice(&b.apart[..b.apart_count]));
        let tree = if apart.is_empty() {
            None
        } else {
            tree.build(workers, boxes, Members::Of(apart), &Sample::of_members(boxes, apart), filter)?;
            Some(&*tree)
        };
        let (bins, strips, count) = (&*bins, grid.strips(), tasks.len());
        outputs.collect(workers, pairs, |lists| {
            workers.each_with(tasks, lists, |k, task, list| {
                let strips = balanced(bins, strips, k, count)..balanced(bins, strips, k + 1, count);
                task.error = task.find(bins, tree, grid.axis, strips, *simd, list).err();
                if let Some(tree) = tree {
                    tree.self_pairs(tree.part(k, count), list);
                }
            });
            tasks.iter_mut().find_map(|t| t.error.take()).map_or(Ok(()), Err)
        })?;
        pairs.finish_on(workers)
    }

    fn prepare(&mut self, objects: usize) {
        // A refused allocation is reported by the frame that needs it. Boxes stand in 1.6 strips on average.
        let share = objects / self.bins.len();
        for bin in &mut self.bins {
            let _ = ensure(&mut bin.entries, share + share * 5 / 8, "boxes in strips");
        }
    }
}

/// The first strip of part `k` of `parts` parts that hold equally many entries.
fn balanced(bins: &[Bins], strips: usize, k: usize, parts: usize) -> usize {
    let before = |strip: usize| bins.iter().map(|b| u64::from(b.starts[strip])).sum::<u64>();
    let wanted = before(strips) * k as u64 / parts as u64;
    if k == parts {
        return strips;
    }
    let (mut low, mut high) = (0, strips);
    while low < high {
        let middle = (low + high) / 2;
        if before(middle) < wanted { low = middle + 1 } else { high = middle }
    }
    low
}

impl Bins {
    /// Sorts a share of the boxes into bins. Where each goes is worked out once, in the pass that counts.
    fn fill(
        &mut self,
        grid: &StripGrid,
        boxes: &[Aabb],
        share: Range<usize>,
        threads: usize,
        filter: Option<&Filter>,
    ) -> Result<(), Error> {
        let first = share.start;
        let share = &boxes[share];
        let strips = grid.strips();
        ensure(&mut self.starts, strips + 1, "strips")?;
        ensure(&mut self.spans, share.len(), "boxes in strips")?;
        // The axes are constants in each of the three, so that no index is computed.
        match grid.axis {
            0 => self.count::<0>(grid, share, first, filter)?,
            1 => self.count::<1>(grid, share, first, filter)?,
            _ => self.count::<2>(grid, share, first, filter)?,
        }
        let most = (MOST_BOXES / threads).max(MOST_OF_SHARE) as u32;
        if self.apart_count > 0 || self.starts[..strips].iter().any(|&count| count > most) {
            self.set_apart(grid, most, first, share.len())?;
        }
        let starts = &mut self.starts[..=strips];
        let entries: u64 = starts.iter().map(|&s| u64::from(s)).sum();
        if u32::try_from(entries).is_err() {
            return Err(Error::OutOfMemory {
                what: "boxes in strips",
                elements: usize::try_from(entries).unwrap_or(usize::MAX),
            });
        }
        let mut total = 0_u32;
        for start in starts.iter_mut() {
            total += std::mem::replace(start, total);
        }
        ensure(&mut self.entries, total as usize, "boxes in strips")?;
        let entries = &mut self.entries[..total as usize];
        for ((&span, b), id) in self.spans.iter().zip(share).zip(first as u32..) {
            grid.each_strip(span, |strip, begins| {
                let at = &mut starts[strip];
                entries[*at as usize] = Entry { bounds: *b, id, begins };
                *at += 1;
            });
        }
        // Every start has moved to its bin's end, which is the start of the next.
        starts.copy_within(..strips, 1);
        starts[0] = 0;
        Ok(())
    }

    /// Finds the strips of each box and counts how many go into each bin.
    fn count<const AXIS: usize>(
        &mut self,
        grid: &StripGrid,
        share: &[Aabb],
        first: usize,
        filter: Option<&Filter>,
    ) -> Result<(), Error> {
        let starts = &mut self.starts[..=grid.strips()];
        starts.fill(0);
        self.apart_count = 0;
        for ((b, span), k) in share.iter().zip(&mut self.spans).zip(first..) {
            if let Some(defect) = b.defect() {
                return Err(Error::InvalidBox { index: k, defect });
            }
            let fixed = filter.is_some_and(|f| f.is_fixed(k));
            *span = if fixed { StripSpan::APART } else { grid.span::<AXIS>(b) };
            self.apart_count += usize::from(*span == StripSpan::APART);
            grid.each_strip(*span, |strip, _| starts[strip] += 1);
        }
        Ok(())
    }

    /// Takes the boxes of strips with more than `most` of them out of all their strips, and lists the boxes that stand apart.
    fn set_apart(&mut self, grid: &StripGrid, most: u32, first: usize, len: usize) -> Result<(), Error> {
        let Self { starts, spans, apart, apart_count, .. } = self;
        let starts = &mut starts[..grid.strips()];
        *apart_count = 0;
        starts.iter_mut().filter(|count| **count > most).for_each(|count| *count |= OVERFULL);
        for (span, id) in spans[..len].iter_mut().zip(first..) {
            let mut leaves = false;
            grid.each_strip(*span, |strip, _| leaves |= starts[strip] & OVERFULL != 0);
            if leaves {
                grid.each_strip(*span, |strip, _| starts[strip] -= 1);
                *span = StripSpan::APART;
            }
            if *span == StripSpan::APART {
                ensure(apart, *apart_count + 1, "boxes that stand apart")?;
                apart[*apart_count] = id as u32;
                *apart_count += 1;
            }
        }
        starts.iter_mut().for_each(|count| *count &= !OVERFULL);
        Ok(())
    }

    /// The bin of a strip.
    fn bin(&self, strip: usize) -> &[Entry] {
        &self.entries[self.starts[strip] as usize..self.starts[strip + 1] as usize]
    }
}

impl Task {
    /// Adds the pairs of the boxes in these strips with one another and with those in the tree.
    fn find(
        &mut self,
        bins: &[Bins],
        tree: Option<&Tree>,
        axis: usize,
        strips: Range<usize>,
        simd: Simd,
        pairs: &mut Pairs,
    ) -> Result<(), Error> {
        for strip in strips {
            self.sort(bins, strip, axis)?;
            let boxes = self.columns.len();
            sweep_rows::<InStrip>(simd, &self.columns, 0..boxes, pairs);
            if let Some(tree) = tree {
                (0..boxes)
                    .step_by(LANES)
                    .filter_map(|at| self.group(at, axis))
                    .for_each(|group| tree.pairs_with(&group, pairs));
            }
        }
        Ok(())
    }

    /// Brings the boxes of a strip into columns that ascend on the sweep axis.
    fn sort(&mut self, bins: &[Bins], strip: usize, axis: usize) -> Result<(), Error> {
        let entries: &[Entry] = if let [only] = bins {
            only.bin(strip)
        } else {
            self.entries.clear();
            let elements = bins.iter().map(|b| b.bin(strip).len()).sum();
            let refused = |_| Error::OutOfMemory { what: "boxes in strips", elements };
            self.entries.try_reserve(elements).map_err(refused)?;
            bins.iter().for_each(|b| self.entries.extend_from_slice(b.bin(strip)));
            &self.entries
        };
        ensure(&mut self.keys, entries.len(), "sort keys")?;
        self.columns.resize(entries.len())?;
        let keys = &mut self.keys[..entries.len()];
        for (at, (key, entry)) in keys.iter_mut().zip(entries).enumerate() {
            *key = u64::from(order_key(entry.bounds.min[axis])) << 32 | at as u64;
        }
        keys.sort_unstable();
        let mut columns = self.columns.as_mut();
        for (at, &key) in keys.iter().enumerate() {
            let entry = &entries[key as u32 as usize];
            columns.set(at, &entry.bounds, axis, entry.id);
            columns.begins[at] = entry.begins;
        }
        Ok(())
    }

    /// Up to 16 boxes that follow one another along the sweep, those of them that begin in this strip: each box is in one group of one strip.
    fn group(&self, at: usize, axis: usize) -> Option<Group> {
        let of = &self.columns;
        let rows = at..(at + LANES).min(of.len());
        let begins = &of.padded().begins[rows.clone()];
        let mut group: Option<Group> = None;
        for (lane, row) in rows.enumerate().filter(|&(lane, _)| begins[lane] == BOTH) {
            let mut b = Aabb::default();
            for k in 0..3 {
                (b.min[(axis + k) % 3], b.max[(axis + k) % 3]) = (of.low(k)[row], of.high(k)[row]);
            }
            let group = group.get_or_insert_with(|| Group::of(&b));
            group.set(lane, &b, of.ids()[row]);
        }
        group
    }
}
