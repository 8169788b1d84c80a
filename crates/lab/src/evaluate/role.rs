//! What an algorithm is on any machine, whatever its number of threads.

use sapwise::AlgorithmId;
use sapwise::algorithm::BackendClass;

/// A method on one or all threads of its machine, or on one or all GPUs: every machine has these, whatever its counts.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Role {
    pub(super) class: BackendClass,
    pub(super) method: String,
    /// All threads, or all GPUs; `false` if there is only one.
    pub(super) all: bool,
}

/// Returns the roles of algorithms on a machine, in order. Of several single GPUs the first one counts.
pub(super) fn roles(ids: &[AlgorithmId]) -> Vec<(Role, AlgorithmId)> {
    let mut roles: Vec<(Role, AlgorithmId)> = Vec::new();
    for id in ids {
        let width = id.backend().width();
        let role = Role { class: id.backend().class(), method: id.method().to_owned(), all: width > 1 };
        if (width == 1 || role.widest(ids) == Some(width)) && roles.iter().all(|r| r.0 != role) {
            roles.push((role, id.clone()));
        }
    }
    roles.sort();
    roles
}

impl Role {
    /// Returns the algorithm that has this role among those of a machine. With one thread, or one GPU, that is all.
    pub(super) fn among<'a>(&self, ids: impl Iterator<Item = &'a AlgorithmId> + Clone) -> Option<&'a AlgorithmId> {
        let alike = || ids.clone().filter(|id| self.is_of(id));
        if !self.all {
            return alike().find(|id| id.backend().width() == 1);
        }
        let most = alike().map(|id| id.backend().width()).max();
        alike().find(|id| Some(id.backend().width()) == most)
    }

    /// Returns the most threads, or GPUs, that algorithms of its method run on.
    fn widest(&self, ids: &[AlgorithmId]) -> Option<u32> {
        ids.iter().filter(|id| self.is_of(id)).map(|id| id.backend().width()).max()
    }

    fn is_of(&self, id: &AlgorithmId) -> bool {
        id.method() == self.method && id.backend().class() == self.class
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_role_is_found_on_machines_with_other_counts() {
        let [two, one] = [&["bvh@cpu1", "bvh@cpu2", "bvh@cpu4", "sap@cpu1"][..], &["bvh@cpu1"]]
            .map(|ids| ids.iter().map(|id| id.parse().unwrap()).collect::<Vec<AlgorithmId>>());
        let found: Vec<String> = roles(&two).into_iter().map(|(role, id)| format!("{id} {}", role.all)).collect();
        assert_eq!(found, ["bvh@cpu1 false", "bvh@cpu4 true", "sap@cpu1 false"]);
        let role = |all| Role { class: BackendClass::Cpu, method: "bvh".to_owned(), all };
        for (ids, alone, whole) in [(&two, "bvh@cpu1", "bvh@cpu4"), (&one, "bvh@cpu1", "bvh@cpu1")] {
            let among = |all| role(all).among(ids.iter()).unwrap().to_string();
            assert_eq!((among(false), among(true)), (alone.to_owned(), whole.to_owned()));
        }
        assert_eq!(role(true).among(two[3..].iter()), None);
    }
}
