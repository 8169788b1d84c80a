//! Error scopes: they catch a device's errors about our calls, so that its handlers, which may be the program's,
//! never see them.

use super::Late;
use std::ops::{Deref, DerefMut};

/// Catches the errors of this thread's calls, of one kind or of every kind, until it ends.
pub(super) struct Scope {
    guards: [Option<wgpu::ErrorScopeGuard>; 3],
}

impl Scope {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let filters = [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Validation];
        Self { guards: filters.map(|filter| Some(device.push_error_scope(filter))) }
    }

    /// Catches errors of one kind.
    pub(super) fn of_one(device: &wgpu::Device, filter: wgpu::ErrorFilter) -> Self {
        Self { guards: [Some(device.push_error_scope(filter)), None, None] }
    }

    /// Ends the scope, and returns its error. In a browser that comes [`Late`].
    pub(super) fn end(mut self, late: &Late) -> Result<(), wgpu::Error> {
        self.guards().fold(None, |error, guard| late.hear(guard.pop()).or(error)).map_or(Ok(()), Err)
    }

    /// Returns the guards that have not ended, in the order that wgpu insists on.
    fn guards(&mut self) -> impl Iterator<Item = wgpu::ErrorScopeGuard> {
        self.guards.iter_mut().rev().filter_map(Option::take)
    }
}

impl Drop for Scope {
    fn drop(&mut self) {
        self.guards().for_each(drop);
    }
}

/// Commands that are being recorded. One scope covers them until they are submitted.
pub struct Recording {
    encoder: wgpu::CommandEncoder,
    scope: Scope,
}

impl Recording {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let scope = Scope::new(device);
        let encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("sapwise") });
        Self { encoder, scope }
    }

    pub(super) fn submit(self, queue: &wgpu::Queue, late: &Late) -> Result<wgpu::SubmissionIndex, wgpu::Error> {
        let submission = queue.submit([self.encoder.finish()]);
        self.scope.end(late).map(|()| submission)
    }
}

impl Deref for Recording {
    type Target = wgpu::CommandEncoder;

    fn deref(&self) -> &Self::Target {
        &self.encoder
    }
}

impl DerefMut for Recording {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.encoder
    }
}
