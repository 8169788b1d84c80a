//! The rows of each method, of many profiles a few each.

use super::rows::{Row, rows};
use crate::data::Profile;
use rayon::prelude::*;
use sapwise::BackendClass;
use std::collections::BTreeMap;

/// Rows of a method, about. Its dozen coefficients need no more, and a fit takes time in proportion to them: of many reports each
/// adds a few rows, other ones than the next.
const MOST_ROWS: usize = 6000;
/// Rows of a method for each profile at least.
const FEWEST_OF_PROFILE: usize = 2;

/// Of each method on a class of processor the rows on one thread, or on GPUs, and those on several threads.
type MethodRows = BTreeMap<(BackendClass, String), [Vec<Row>; 2]>;

/// The rows of all profiles, thinned where there are many.
pub(super) fn rows_by_method(profiles: &[Profile]) -> MethodRows {
    // Of so many that not each can add the fewest rows, some add them, spread over all.
    let step = (profiles.len() * FEWEST_OF_PROFILE).div_ceil(MOST_ROWS).max(1);
    let most = (MOST_ROWS / profiles.len().max(1)).max(FEWEST_OF_PROFILE);
    let of_profile = |(k, profile): (usize, &Profile)| -> MethodRows {
        let mut own = MethodRows::new();
        for row in rows(profile, k) {
            let id = profile.id(row.algorithm);
            let (class, several) = (id.backend().class(), id.backend().width() > 1);
            let place = usize::from(several && class == BackendClass::Cpu);
            own.entry((class, id.method().to_owned())).or_default()[place].push(row);
        }
        own.into_iter().map(|(method, rows)| (method, rows.map(|rows| thinned(rows, most, k)))).collect()
    };
    let mut all = MethodRows::new();
    for own in profiles.par_iter().enumerate().step_by(step).map(of_profile).collect::<Vec<_>>() {
        for (method, rows) in own {
            all.entry(method).or_default().iter_mut().zip(rows).for_each(|(all, rows)| all.extend(rows));
        }
    }
    all
}

/// At most so many of the rows, evenly spaced, from a place that differs with `turn`.
pub(crate) fn thinned(rows: Vec<Row>, most: usize, turn: usize) -> Vec<Row> {
    let all = rows.len();
    if all <= most {
        return rows;
    }
    let shift = turn % all;
    let kept = |k: usize| (k * most) / all != ((k + 1) * most) / all;
    rows.into_iter().enumerate().filter(|(k, _)| kept((k + shift) % all)).map(|(_, row)| row).collect()
}
