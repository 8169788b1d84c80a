//! Finds the pairs of one of many worlds, on one thread: small ones without a sort, large ones with a tree.

use crate::cpu::kernel::small::{MOST_ROWS, small_world};
use crate::cpu::{Columns, Input, Members, Simd, Tree, Workers, ensure, order_key, sweep_rows};
use crate::{Aabb, Error, Pairs, SceneStats};
use std::ops::Range;

/// The most boxes of a world that is swept along x. Even if all overlap on x, a sweep takes about as long as a tree.
const MOST_SWEPT: usize = 512;

/// The buffers of the search.
#[derive(Debug, Default)]
pub(crate) struct WorldSearch {
    /// Lower bound on x in the upper half, position in the input in the lower.
    keys: Vec<u64>,
    columns: Columns,
    tree: Tree,
    simd: Simd,
}

impl WorldSearch {
    pub(crate) fn new(simd: Simd) -> Self {
        Self { tree: Tree::new(simd), simd, ..Self::default() }
    }

    /// Adds the pairs among the boxes of `world`, which are valid.
    pub(crate) fn find(&mut self, boxes: &[Aabb], world: Range<usize>, pairs: &mut Pairs) -> Result<(), Error> {
        if pairs.is_any_over() {
            return Ok(());
        }
        let Self { keys, columns, tree, simd } = self;
        let (first, len) = (world.start, world.len());
        if len > MOST_SWEPT {
            let input = Input { workers: &Workers::one(), boxes: &boxes[..world.end], screen: pairs.screen() };
            tree.build(input, Members::From(first), &SceneStats::of(&boxes[world]))?;
            tree.self_pairs(0, 1, pairs);
            return Ok(());
        }
        columns.resize(len)?;
        let mut rows = columns.as_mut();
        if len <= MOST_ROWS {
            boxes[world].iter().enumerate().for_each(|(at, b)| rows.set(at, b, 0, (first + at) as u32));
            small_world(*simd, columns, first as u32, pairs);
        } else {
            ensure(keys, len, "sort keys")?;
            let keys = &mut keys[..len];
            for (key, id) in keys.iter_mut().zip(world) {
                *key = u64::from(order_key(boxes[id].min[0])) << 32 | id as u64;
            }
            keys.sort_unstable();
            keys.iter().enumerate().for_each(|(at, &key)| rows.set(at, &boxes[key as u32 as usize], 0, key as u32));
            sweep_rows::<false>(*simd, columns, 0..len, pairs);
        }
        Ok(())
    }
}
