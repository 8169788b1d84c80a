//! The role of an algorithm, which does not depend on the number of threads of a machine.

use sapwise::AlgorithmId;
use sapwise::algorithm::BackendClass;

/// A method on one or all threads of its machine, or on one or all GPUs: every machine has these, whatever its numbers
/// of threads and GPUs.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Role {
    pub(super) class: BackendClass,
    pub(super) method: String,
    /// All threads, or all GPUs; `false` if there is only one.
    pub(super) all: bool,
}

/// Returns the roles of algorithms on a machine, in order. Of several single GPUs the first one counts.
pub(super) fn roles(ids: &[AlgorithmId]) -> Vec<(Role, AlgorithmId)> {
    let role = |id: &AlgorithmId| {
        let backend = id.backend();
        Role { class: backend.class(), method: id.method().to_owned(), all: backend.width() > 1 }
    };
    let mut roles: Vec<(Role, AlgorithmId)> = ids.iter().map(|id| (role(id), id.clone())).collect();
    roles.retain(|(role, id)| role.among(ids.iter()) == Some(id));
    roles.sort();
    roles.dedup();
    roles
}

impl Role {
    /// Returns the algorithm that has this role among those of a machine. With one thread, or one GPU, that is all.
    pub(super) fn among<'a>(&self, ids: impl Iterator<Item = &'a AlgorithmId> + Clone) -> Option<&'a AlgorithmId> {
        let alike = || ids.clone().filter(|id| id.method() == self.method && id.backend().class() == self.class);
        let most = alike().map(|id| id.backend().width()).max();
        let wanted = if self.all { most } else { Some(1) };
        alike().find(|id| Some(id.backend().width()) == wanted)
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
