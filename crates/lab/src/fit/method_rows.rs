//! The rows of each method, a few of each profile when there are many.

use super::rows::{Row, rows};
use crate::data::Profile;
use rayon::prelude::*;
use sapwise::algorithm::BackendClass;
use std::collections::BTreeMap;

/// Approximate number of rows of a method that are kept. In the features of its residual each takes 512 bytes.
const MOST_ROWS: usize = 30_000;
/// Fewest rows of a method that each profile adds.
const FEWEST_OF_PROFILE: usize = 2;

/// For each method on a class of processor the rows on one thread, or on GPUs, and those on several threads.
type MethodRows = BTreeMap<(BackendClass, String), [Vec<Row>; 2]>;

/// Returns the rows of all profiles, without a scenario, thinned when there are many.
pub(super) fn rows_by_method(profiles: &[Profile], without: Option<&str>) -> MethodRows {
    // If there are too many profiles, evenly spaced ones add rows.
    let step = (profiles.len() * FEWEST_OF_PROFILE).div_ceil(MOST_ROWS).max(1);
    let most = (MOST_ROWS / profiles.len().max(1)).max(FEWEST_OF_PROFILE);
    let of_profile = |(k, profile): (usize, &Profile)| -> MethodRows {
        let mut own = MethodRows::new();
        for row in rows(profile, k, without) {
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

/// Returns at most `most` of the rows, evenly spaced. `turn` shifts the selection.
pub(crate) fn thinned<T>(rows: Vec<T>, most: usize, turn: usize) -> Vec<T> {
    let all = rows.len();
    if all <= most {
        return rows;
    }
    let shift = turn % all;
    let kept = |k: usize| (k * most) / all != ((k + 1) * most) / all;
    rows.into_iter().enumerate().filter(|(k, _)| kept((k + shift) % all)).map(|(_, row)| row).collect()
}
