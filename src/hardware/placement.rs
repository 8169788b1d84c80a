//! Where the cores of a machine lie to each other. A hypervisor moves the virtual ones of a guest.

use super::{Hardware, ParameterId};

/// Cache lines that go from core to core one after the other in a cold fork and join. Of twelve reports of one machine whose two
/// cores its host kept near each other in seven, at 27 ns, and far apart in five, at 172 ns: the median cold fork and join was 6.9 and
/// 12.2 us, the warm one 0.41 and 1.65 us.
const HANDED_OVER: f64 = 36.0;
/// A fork and join keeps at least this share of what was measured, the share that it kept there: waking a thread is work of the
/// system, however near it is.
const LEAST_SHARE: f64 = 0.56;

impl Hardware {
    /// The same hardware with its cores as far from each other as `core_to_core_ns` says, in ns: the fork and join changes with it.
    ///
    /// What was measured while the cores lay elsewhere than in use says less of them than this does. Without a measured latency, or
    /// without a fork and join, nothing changes.
    #[must_use]
    pub fn with_cores_apart(&self, core_to_core_ns: f64) -> Self {
        let mut moved = self.clone();
        let Some(before) = self.value(ParameterId::CoreToCoreNs) else { return moved };
        for p in &mut moved.parameters {
            let value = match p.name.parse() {
                Ok(ParameterId::CoreToCoreNs) => Some(core_to_core_ns),
                Ok(ParameterId::ForkJoinColdNs) => {
                    p.value.map(|ns| (ns + HANDED_OVER * (core_to_core_ns - before)).max(LEAST_SHARE * ns))
                }
                _ => continue,
            };
            // The samples are those of the other place.
            (p.value, p.raw) = (value, Vec::new());
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parameter;

    #[test]
    fn a_fork_and_join_takes_longer_between_cores_that_lie_apart() {
        let figure = |name: ParameterId, value: f64| Parameter::reported(name, value, "test");
        let of = |parameters: &[Parameter]| Hardware::new(crate::Machine::default(), parameters.to_vec());
        let near = of(&[figure(ParameterId::CoreToCoreNs, 25.0), figure(ParameterId::ForkJoinColdNs, 7000.0)]);
        let far = near.with_cores_apart(165.0);
        assert_eq!(far.value(ParameterId::ForkJoinColdNs), Some(7000.0 + 36.0 * 140.0));
        assert_eq!(far.with_cores_apart(25.0).value(ParameterId::ForkJoinColdNs), Some(7000.0));
        // The system's part stays.
        let low = of(&[figure(ParameterId::CoreToCoreNs, 165.0), figure(ParameterId::ForkJoinColdNs, 5000.0)]);
        let kept = low.with_cores_apart(25.0).value(ParameterId::ForkJoinColdNs).unwrap();
        assert!((kept - 0.56 * 5000.0).abs() < 1e-9, "{kept}");
        let unknown = of(&near.parameters[1..]);
        assert_eq!(unknown.with_cores_apart(165.0), unknown);
    }
}
