//! Which profiles are held out together.

use crate::data::Profile;
use sapwise_tune::hardware::ParameterId;
use std::collections::BTreeMap;

/// Folds of profiles: each is judged by what was fitted to all others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Partition {
    /// What a fold is, in words.
    pub held_out: String,
    /// Whether folds are of whole physical machines.
    pub by_machine: bool,
    /// Positions of profiles. A profile of the only machine is in one fold for each of its restrictions.
    pub folds: Vec<Vec<usize>>,
}

impl Partition {
    /// Makes a fold of each physical machine with all its profiles; of one machine alone, of each SIMD level and each
    /// thread count; without such restrictions, of each profile.
    pub fn new(profiles: &[Profile]) -> Self {
        let of = |held_out: &str, by_machine, folds| Self { held_out: held_out.to_owned(), by_machine, folds };
        let machines = grouped(profiles, Profile::machine);
        if machines.len() > 1 {
            return of("physical machine", true, machines);
        }
        let by = |id: ParameterId| {
            let folds = grouped(profiles, |p| p.hardware.value(id).map_or(0, |v| v as u64));
            if folds.len() > 1 { folds } else { Vec::new() }
        };
        let restrictions = [by(ParameterId::SimdLanes), by(ParameterId::UsableCores)].concat();
        if !restrictions.is_empty() {
            return of("SIMD level and thread count", false, restrictions);
        }
        of("profile", false, (0..profiles.len()).map(|k| vec![k]).collect())
    }
}

/// Returns the positions of the profiles that share a key, in the order of the keys.
fn grouped<'a, K: Ord>(profiles: &'a [Profile], key: impl Fn(&'a Profile) -> K) -> Vec<Vec<usize>> {
    let mut groups: BTreeMap<K, Vec<usize>> = BTreeMap::new();
    for (k, profile) in profiles.iter().enumerate() {
        groups.entry(key(profile)).or_default().push(k);
    }
    groups.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::{Machine, profiles};

    #[test]
    fn machines_are_held_out_with_all_their_profiles() {
        let mut machines = Machine::family();
        machines[1].name = machines[0].name;
        let partition = Partition::new(&profiles(machines));
        assert_eq!(partition.folds, [vec![0, 1], vec![2], vec![3], vec![4], vec![5], vec![6]]);
        assert!(partition.by_machine && partition.held_out == "physical machine");
    }

    #[test]
    fn of_one_machine_each_level_and_each_thread_count_is_held_out() {
        let mut machines = Machine::family();
        machines.truncate(4);
        machines.iter_mut().for_each(|m| m.name = "0000000000000001");
        let all = profiles(machines);
        // Lanes 8, 4, 8, 16 and threads 2, 4, 8, 8.
        let partition = Partition::new(&all);
        assert_eq!(partition.folds, [vec![1], vec![0, 2], vec![3], vec![0], vec![1], vec![2, 3]]);
        assert!(!partition.by_machine && partition.held_out.contains("SIMD level"));
        let alike = vec![all[0].clone(), all[0].clone()];
        assert_eq!(Partition::new(&alike).folds, [vec![0], vec![1]]);
    }
}
