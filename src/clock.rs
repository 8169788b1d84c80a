//! The clock by which frames are timed.

#[cfg(not(all(target_family = "wasm", target_os = "unknown")))]
pub(crate) use std::time::Instant;

/// Whether there is one. Without it all that is timed takes no time, which must not be learned from.
pub(crate) const TICKS: bool = !cfg!(all(target_family = "wasm", target_os = "unknown"));

/// In place of the standard library's, which traps where WebAssembly runs without a system: the module has no clock but what its host hands
/// it, and a crate that asks a browser for one brings imports that other hosts lack.
#[cfg(all(target_family = "wasm", target_os = "unknown"))]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant;

#[cfg(all(target_family = "wasm", target_os = "unknown"))]
impl Instant {
    pub(crate) fn now() -> Self {
        Self
    }

    #[expect(clippy::unused_self, reason = "as of the clock in the standard library")]
    pub(crate) fn elapsed(&self) -> std::time::Duration {
        std::time::Duration::ZERO
    }
}
