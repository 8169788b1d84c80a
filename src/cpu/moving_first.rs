//! Boxes that may move before those that are fixed, so that two fixed boxes are never compared.

use crate::cpu::columns::ensure;
use crate::error::Error;
use crate::filter::Filter;

/// See the module.
#[derive(Debug, Default)]
pub(super) struct MovingFirst {
    ids: Vec<u32>,
}

impl MovingFirst {
    /// The positions of `count` boxes, ascending among those that may move and among the fixed ones, and how many may move. `None` where all
    /// may: then they stand in order already.
    pub(super) fn order(&mut self, filter: Option<&Filter>, count: usize) -> Result<Option<(&[u32], usize)>, Error> {
        let Some(filter) = filter else { return Ok(None) };
        let fixed = (0..count).filter(|&id| filter.is_fixed(id)).count();
        if fixed == 0 {
            return Ok(None);
        }
        ensure(&mut self.ids, count, "positions of boxes")?;
        let (mut next, moving) = ([0, count - fixed], count - fixed);
        for id in 0..count {
            let next = &mut next[usize::from(filter.is_fixed(id))];
            self.ids[*next] = id as u32;
            *next += 1;
        }
        Ok(Some((&self.ids[..count], moving)))
    }
}
