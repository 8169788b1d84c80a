//! Shared by the test programs on GPUs.
#![allow(dead_code, unused_imports, reason = "each test program uses a part of this")]

pub(crate) mod gpu;
#[path = "../../../../tests/common/mod.rs"]
mod shared;

pub(crate) use shared::*;

/// Returns the GPUs of this machine. Prints a remark and returns `None` if there is none and none is required.
pub(crate) fn gpus() -> Option<sapwise_gpu::Gpus> {
    let gpus = sapwise_gpu::Gpus::find();
    if !gpus.is_empty() {
        return Some(gpus);
    }
    let required = std::env::var_os("SAPWISE_REQUIRE_GPU").is_some_and(|v| v == "1");
    assert!(!required, "SAPWISE_REQUIRE_GPU=1, and no GPU was found");
    println!("skipped: no GPU was found");
    None
}
