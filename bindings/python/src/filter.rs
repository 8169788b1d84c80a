//! The keywords `groups`, `masks`, `owner` and `fixed`.

use crate::call;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use sapwise::Membership;

/// What a caller gave for each keyword.
#[derive(Clone, Copy)]
pub(crate) struct Keywords<'a, 'py> {
    pub(crate) groups: Option<&'a Bound<'py, PyAny>>,
    pub(crate) masks: Option<&'a Bound<'py, PyAny>>,
    pub(crate) owner: Option<&'a Bound<'py, PyAny>>,
    pub(crate) fixed: Option<&'a Bound<'py, PyAny>>,
}

/// The keywords that were given, with one entry for each box.
pub(crate) struct Columns {
    groups: Option<Vec<u32>>,
    masks: Option<Vec<u32>>,
    owner: Option<Vec<u32>>,
    fixed: Option<Vec<bool>>,
}

impl<'py> Keywords<'_, 'py> {
    /// Returns the entries of `count` boxes; `None` if no keyword was given. `count` is a number, a pair of them for
    /// two lists, or `None` if the entries say how many they are.
    pub(crate) fn columns(&self, py: Python<'py>, count: impl IntoPyObject<'py>) -> PyResult<Option<Columns>> {
        let Self { groups, masks, owner, fixed } = *self;
        if [groups, masks, owner, fixed].iter().all(Option::is_none) {
            return Ok(None);
        }
        type Bits<'py> = Option<Bound<'py, PyArray1<u32>>>;
        type Made<'py> = (Bits<'py>, Bits<'py>, Bits<'py>, Option<Bound<'py, PyArray1<bool>>>);
        let made = call(py, "sapwise._arrays", "memberships", (count, groups, masks, owner, fixed))?;
        let (groups, masks, owner, fixed): Made<'_> = made.extract()?;
        let bits = |column: Bits<'_>| column.map(|column| column.to_vec()).transpose();
        let fixed = fixed.map(|column| column.to_vec()).transpose()?;
        Ok(Some(Columns { groups: bits(groups)?, masks: bits(masks)?, owner: bits(owner)?, fixed }))
    }

    /// Returns the memberships of these boxes; `None` if no keyword was given.
    pub(crate) fn memberships(
        &self,
        py: Python<'py>,
        count: impl IntoPyObject<'py>,
    ) -> PyResult<Option<Vec<Membership>>> {
        Ok(self.columns(py, count)?.map(|columns| {
            let given = [&columns.groups, &columns.masks, &columns.owner].map(|column| column.as_ref().map(Vec::len));
            let count = given.into_iter().flatten().next().or(columns.fixed.as_ref().map(Vec::len)).unwrap_or(0);
            (0..count).map(|k| columns.over(k, Membership::ALL)).collect()
        }))
    }
}

impl Columns {
    /// Returns this membership with what was given for box `k`.
    pub(crate) fn over(&self, k: usize, of: Membership) -> Membership {
        Membership {
            groups: self.groups.as_ref().map_or(of.groups, |groups| groups[k]),
            mask: self.masks.as_ref().map_or(of.mask, |masks| masks[k]),
            owner: self.owner.as_ref().map_or(of.owner, |owner| owner[k]),
            fixed: self.fixed.as_ref().map_or(of.fixed, |fixed| fixed[k]),
        }
    }
}
