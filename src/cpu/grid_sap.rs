//! A grid of strips over two axes, with a sweep along the third axis in each strip. From scratch every frame.
//!
//! ```text
//!   grid axis 1
//!   ^  +---+---+---+      Each cell is a strip: it runs along the sweep axis, which points out of the page.
//!   |  |   | a | a |      Box a covers two cells and stands in both strips. So does b.
//!   |  +---+---+-b-+      Both meet in one strip or several; the one in which the later of them begins
//!   |  |   |   | b |      on each grid axis reports the pair: see `StripGrid::each_strip`.
//!   |  +---+---+---+
//!   +----------------> grid axis 0
//! ```
//!
//! Phase one has one task a thread: each sorts its share of the boxes into its own bins, one for each strip. Phase two
//! has several tasks a thread: for each strip, a task gathers the bins of all threads, sorts them along the sweep axis
//! and sweeps.
//!
//! Oversized boxes, the boxes of overfull strips and [passive](crate::filter::Screen) boxes go into a separate
//! [tree](super::tree). Its boxes are compared with each other, but for two passive ones, and with the boxes of every
//! strip.

use crate::cpu::{
    Columns, Group, Input, LANES, Made, Members, Outputs, Simd, Threads, Tree, Workers, ensure, order_key, part,
    reserve, sweep_rows,
};
use crate::load::{StripGrid, StripSpan};
use crate::{Aabb, BroadPhase, Error, FramePlan, Pairs, SceneStats, check_count};
use std::ops::Range;

/// Most boxes of a strip. The boxes of a fuller one go into the tree. This is sixteen times the number in a strip of
/// evenly spread boxes: up to there sweeping a dense strip costs less than the tree and its comparison with the other
/// strips.
const MOST_BOXES: usize = 4096;

/// Most boxes of a strip in the share of one thread, which need not be an equal part of every strip.
const MOST_OF_SHARE: usize = 1024;

/// The mask of [`StripGrid::each_strip`] in the first strip of a box.
const BOTH: u32 = 3;

/// Marks the count of an overfull strip.
const OVERFULL: u32 = 1 << 31;

/// The method; see the module.
#[derive(Debug)]
struct GridSap {
    workers: Workers,
    bins: Vec<Bins>,
    /// Positions in the input of the boxes in the tree, ascending.
    apart: Vec<u32>,
    tree: Tree,
    tasks: Vec<Task>,
    outputs: Outputs,
    simd: Simd,
}

/// The bins of one thread: its share of the boxes by strips.
#[derive(Debug, Default)]
struct Bins {
    /// Start of the bin of each strip in `entries`, and the end of the last bin.
    starts: Vec<u32>,
    /// The strips of each box of the share.
    spans: Vec<StripSpan>,
    entries: Vec<Entry>,
    /// Positions in the input of the boxes that go into the tree.
    apart: Vec<u32>,
}

/// A box in a bin.
#[derive(Debug, Clone, Copy, Default)]
struct Entry {
    bounds: Aabb,
    id: u32,
    /// The mask of [`StripGrid::each_strip`] in this strip.
    begins: u32,
}

/// The buffers of one task of phase two.
#[derive(Debug, Default)]
struct Task {
    entries: Vec<Entry>,
    keys: Vec<u64>,
    columns: Columns,
}

pub(super) fn create(threads: u32, pools: &Threads, simd: Simd) -> Made {
    let workers = Workers::new("grid-sap", threads, pools);
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
        let grid = plan.grid(boxes);
        let workers = &workers.fit(boxes.len());
        let input = Input { workers, boxes, screen: pairs.screen() };
        let _frame = workers.frame()?;
        let threads = workers.threads();
        let (bins, tasks) = (&mut bins[..threads], &mut tasks[..workers.tasks()]);
        workers.try_each_of(bins.iter_mut().enumerate(), |(k, bin)| {
            bin.fill(&grid, input, part(boxes.len(), k, threads))
        })?;
        apart.clear();
        reserve(apart, bins.iter().map(|b| b.apart.len()).sum(), "boxes in a tree")?;
        bins.iter().for_each(|b| apart.extend_from_slice(&b.apart));
        let tree = if apart.is_empty() {
            None
        } else {
            tree.build(input, Members::Of(apart), &SceneStats::of_members(boxes, apart))?;
            Some(&*tree)
        };
        let (bins, strips, count) = (&*bins, grid.strips(), tasks.len());
        outputs.collect(workers, pairs, |lists| {
            workers.try_each_of(tasks.iter_mut().zip(lists).enumerate(), |(k, (task, list))| {
                let strips = balanced(bins, strips, k, count)..balanced(bins, strips, k + 1, count);
                task.find(bins, tree, grid.axis, strips, *simd, list)?;
                tree.into_iter().for_each(|tree| tree.self_pairs(k, count, list));
                Ok(())
            })
        })?;
        pairs.finish_on(workers)
    }

    fn prepare(&mut self, objects: usize) {
        // The frame that needs the memory reports a refused allocation. A box stands in 1.6 strips on average.
        let share = objects / self.bins.len();
        for bin in &mut self.bins {
            let _ = ensure(&mut bin.entries, share + share * 5 / 8, "boxes in strips");
        }
    }
}

/// Returns the first strip of part `k` of `parts` parts with about equally many entries.
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
    /// Sorts a share of the boxes into bins. The pass that counts works out the strips of each box; the second pass
    /// reuses them.
    fn fill(&mut self, grid: &StripGrid, input: Input<'_>, share: Range<usize>) -> Result<(), Error> {
        let (first, strips) = (share.start, grid.strips());
        let any_apart = self.count(grid, input, share.clone())?;
        let share = &input.boxes[share];
        self.apart.clear();
        let most = (MOST_BOXES / input.workers.threads()).max(MOST_OF_SHARE) as u32;
        if any_apart || self.starts[..strips].iter().any(|&count| count > most) {
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
        starts.iter_mut().for_each(|start| total += std::mem::replace(start, total));
        ensure(&mut self.entries, total as usize, "boxes in strips")?;
        let entries = &mut self.entries[..total as usize];
        for ((&span, b), id) in self.spans.iter().zip(share).zip(first as u32..) {
            grid.each_strip(span, |strip, begins| {
                let at = &mut starts[strip];
                entries[*at as usize] = Entry { bounds: *b, id, begins };
                *at += 1;
            });
        }
        // Every start has moved to the end of its bin, which is the start of the next bin.
        starts.copy_within(..strips, 1);
        starts[0] = 0;
        Ok(())
    }

    /// Finds the strips of each box and counts the boxes of each bin. Returns whether any box goes into the tree.
    fn count(&mut self, grid: &StripGrid, input: Input<'_>, share: Range<usize>) -> Result<bool, Error> {
        ensure(&mut self.starts, grid.strips() + 1, "strips")?;
        ensure(&mut self.spans, share.len(), "boxes in strips")?;
        let starts = &mut self.starts[..=grid.strips()];
        starts.fill(0);
        let mut any_apart = false;
        for ((b, span), k) in input.boxes[share.clone()].iter().zip(&mut self.spans).zip(share) {
            if let Some(defect) = b.defect() {
                return Err(Error::InvalidBox { index: k, defect });
            }
            let passive = input.screen.is_some_and(|s| s.is_passive(k));
            *span = if passive { StripSpan::APART } else { grid.span(b) };
            any_apart |= *span == StripSpan::APART;
            grid.each_strip(*span, |strip, _| starts[strip] += 1);
        }
        Ok(any_apart)
    }

    /// Takes the boxes of strips with more than `most` boxes out of all their strips, and lists the boxes for the
    /// tree.
    fn set_apart(&mut self, grid: &StripGrid, most: u32, first: usize, len: usize) -> Result<(), Error> {
        let Self { starts, spans, apart, .. } = self;
        let starts = &mut starts[..grid.strips()];
        starts.iter_mut().filter(|count| **count > most).for_each(|count| *count |= OVERFULL);
        for (span, id) in spans[..len].iter_mut().zip(first..) {
            let mut leaves = false;
            grid.each_strip(*span, |strip, _| leaves |= starts[strip] & OVERFULL != 0);
            if leaves {
                grid.each_strip(*span, |strip, _| starts[strip] -= 1);
                *span = StripSpan::APART;
            }
            if *span == StripSpan::APART {
                reserve(apart, 1, "boxes in a tree")?;
                apart.push(id as u32);
            }
        }
        starts.iter_mut().for_each(|count| *count &= !OVERFULL);
        Ok(())
    }

    /// Returns the bin of a strip.
    fn bin(&self, strip: usize) -> &[Entry] {
        &self.entries[self.starts[strip] as usize..self.starts[strip + 1] as usize]
    }
}

impl Task {
    /// Adds the pairs of the boxes in these strips with each other and with those in the tree.
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
            sweep_rows::<true>(simd, &self.columns, 0..boxes, pairs);
            if let Some(tree) = tree {
                (0..boxes)
                    .step_by(LANES)
                    .filter_map(|at| self.group(at, axis))
                    .for_each(|group| tree.pairs_with(&group, pairs));
            }
        }
        Ok(())
    }

    /// Writes the boxes of a strip to the columns, ascending on the sweep axis.
    fn sort(&mut self, bins: &[Bins], strip: usize, axis: usize) -> Result<(), Error> {
        let entries: &[Entry] = if let [only] = bins {
            only.bin(strip)
        } else {
            self.entries.clear();
            reserve(&mut self.entries, bins.iter().map(|b| b.bin(strip).len()).sum(), "boxes in strips")?;
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

    /// Returns up to 16 boxes that follow each other along the sweep, without those that began in an earlier strip:
    /// each box is in one group of one strip. `None` if none is left.
    fn group(&self, at: usize, axis: usize) -> Option<Group> {
        let of = &self.columns;
        let rows = at..(at + LANES).min(of.len());
        Group::of(rows.filter(|&row| of.begins[row] == BOTH).map(|row| {
            let mut b = Aabb::default();
            for k in 0..3 {
                (b.min[(axis + k) % 3], b.max[(axis + k) % 3]) = (of.low[k][row], of.high[k][row]);
            }
            (b, of.ids[row])
        }))
    }
}
