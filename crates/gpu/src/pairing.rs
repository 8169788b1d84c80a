//! The two kernels of a method that count and write its pairs, and their variants with the test of a filter.

use super::kernel::source;
use super::{Bound, Gpu, Inputs, Kernel, Output};
use sapwise::error::GpuError;

#[derive(Debug)]
pub(super) struct Pairing {
    texts: source::Pairing,
    plain: [Kernel; 2],
    /// Compiled for the first filter.
    filtered: Option<[Kernel; 2]>,
    bound: Option<[Bound; 2]>,
}

impl Pairing {
    pub(super) fn new(gpu: &Gpu, texts: source::Pairing) -> Result<Self, GpuError> {
        Ok(Self { texts, plain: compiled(gpu, texts, source::UNFILTERED)?, filtered: None, bound: None })
    }

    /// Binds the variant of the frame's filter to the method's `own` buffers and to those of every method.
    pub(super) fn bind(
        &mut self,
        gpu: &Gpu,
        inputs: &Inputs<'_>,
        output: &Output,
        own: &[(u32, &wgpu::Buffer)],
    ) -> Result<(), GpuError> {
        let mut both = [own, &[(0, inputs.params), (4, output.sums())]].concat();
        both.extend(inputs.memberships.map(|memberships| (9, memberships)));
        let [count, write]: &[Kernel; 2] = match (inputs.memberships, &mut self.filtered) {
            (None, _) => &self.plain,
            (Some(_), Some(filtered)) => filtered,
            (Some(_), none) => none.insert(compiled(gpu, self.texts, source::FILTER)?),
        };
        let count = count.bind(gpu, &[both.as_slice(), &[(3, inputs.header)]].concat())?;
        self.bound = Some([count, write.bind(gpu, &[both.as_slice(), &[(5, output.pairs())]].concat())?]);
        Ok(())
    }

    /// Counts the pairs of each block.
    pub(super) fn record_count(&self, pass: &mut wgpu::ComputePass<'_>, blocks: u32) {
        if let Some([count, _]) = &self.bound {
            count.dispatch(pass, blocks);
        }
    }

    /// Writes the pairs of the window to their positions.
    pub(super) fn record_write(&self, pass: &mut wgpu::ComputePass<'_>, blocks: u32) {
        if let Some([_, write]) = &self.bound {
            write.dispatch(pass, blocks);
        }
    }
}

fn compiled(gpu: &Gpu, texts: source::Pairing, filter: &'static str) -> Result<[Kernel; 2], GpuError> {
    let [count, write] = source::pairing(texts, filter);
    Ok([Kernel::new(gpu, &count, "count")?, Kernel::new(gpu, &write, "write")?])
}
