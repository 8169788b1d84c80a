//! Errors that a device reports later. Only browsers do: elsewhere a scope's error is there when the scope ends.

use std::future::Future;
#[cfg(target_family = "wasm")]
use std::{mem::take, pin::Pin, sync::Mutex, sync::PoisonError};

/// The answers that a device still owes.
#[derive(Default)]
pub(super) struct Late {
    #[cfg(target_family = "wasm")]
    owed: Mutex<Vec<Pin<Box<dyn Future<Output = Option<wgpu::Error>> + Send>>>>,
}

#[cfg(not(target_family = "wasm"))]
impl Late {
    /// Returns the error of a scope that has ended.
    pub(super) fn hear(&self, answer: impl Future<Output = Option<wgpu::Error>>) -> Option<wgpu::Error> {
        pollster::block_on(answer)
    }
}

#[cfg(target_family = "wasm")]
impl Late {
    /// Keeps the answer for [`settle`](Self::settle).
    pub(super) fn hear(
        &self,
        answer: impl Future<Output = Option<wgpu::Error>> + Send + 'static,
    ) -> Option<wgpu::Error> {
        self.owed.lock().unwrap_or_else(PoisonError::into_inner).push(Box::pin(answer));
        None
    }

    /// Waits for all answers, and returns the first error.
    pub(super) async fn settle(&self) -> Option<wgpu::Error> {
        let answers = take(&mut *self.owed.lock().unwrap_or_else(PoisonError::into_inner));
        let mut first = None;
        for answer in answers {
            first = first.or(answer.await);
        }
        first
    }
}
