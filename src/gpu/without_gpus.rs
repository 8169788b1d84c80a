//! Lists the algorithms on GPUs in builds that can't run them; the feature `gpu` runs them.

mod methods;

pub use methods::algorithms;

#[cfg(feature = "this-machine")]
impl crate::Registry {
    /// Returns the identities of the GPUs that were added: none.
    pub(crate) fn gpu_identities(&self) -> Vec<crate::GpuIdentity> {
        Vec::new()
    }
}
