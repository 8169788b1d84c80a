//! A hook for benchmarks that time the parts of a frame. Programs set none, and pay one test for each call.

/// Where a part of a frame has just ended.
#[derive(Debug)]
pub enum Place<'a, 'pass> {
    /// On the CPU.
    Host,
    /// In commands that are being recorded.
    Commands(&'a mut wgpu::CommandEncoder),
    /// In a compute pass that is being recorded.
    Pass(&'a mut wgpu::ComputePass<'pass>),
}

/// Called at the end of each part of a frame, with its name.
pub type Watch = Box<dyn Fn(&'static str, Place<'_, '_>) + Send + Sync>;
