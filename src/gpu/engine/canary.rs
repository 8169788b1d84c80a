//! Whether a GPU has executed what it was given, told before anything else of its answer is believed.
//!
//! Each submission has a number, which its kernels write beside their answer. A GPU that hangs, or a driver with nothing behind it, leaves there what was
//! before: that would read as a box that is no box, or as the pairs of another frame.

use super::Engine;
use crate::error::GpuError;
use crate::gpu::params::Header;

impl Engine {
    /// The number of the submission that is about to be made.
    pub(super) fn next_submission(&mut self) -> u32 {
        // 0 is what an untouched header holds.
        self.submissions = self.submissions.wrapping_add(1).max(1);
        self.submissions
    }

    /// `Err` where the header is not that of the submission of this number. The GPU counts as lost from then on.
    pub(super) fn check_ran(&self, header: &Header, submission: u32) -> Result<(), GpuError> {
        if header.ran == submission { Ok(()) } else { Err(self.gpu.inert()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aabb::Aabb;
    use crate::error::GpuErrorKind;
    use crate::gpu::engine::Piece;
    use crate::gpu::first_for_tests;
    use crate::gpu::look::Look;
    use crate::gpu::output::Output;
    use crate::gpu::storage::Failure;
    use crate::load::SampledBoxes;
    use crate::pairs::Pairs;

    const METHODS: [&str; 4] = ["brute", "sap", "grid-sap", "bvh"];

    fn start(engine: &mut Engine, boxes: &[Aabb]) {
        let params = engine.plan(boxes.len() as u32, || Look::at(&SampledBoxes::from(boxes)));
        engine.start(Piece { boxes, ids: None }, params).unwrap();
    }

    fn finish(engine: &mut Engine) -> Result<usize, Failure> {
        let mut pairs = Pairs::new();
        engine.finish(&mut pairs).map(|()| pairs.len())
    }

    fn kind(found: Result<usize, Failure>) -> GpuErrorKind {
        match found {
            Err(Failure::Gpu(error)) => error.kind(),
            other => panic!("{other:?}"),
        }
    }

    fn boxes() -> Vec<Aabb> {
        (0..300).map(|k| Aabb::cube([k as f32, 0.0, 0.0], 0.6)).collect()
    }

    #[test]
    fn a_frame_of_which_no_kernel_has_run_is_the_fault_of_the_gpu_and_not_of_a_box() {
        for method in METHODS {
            let Some(gpu) = first_for_tests() else { return };
            let mut engine = Engine::new(gpu.clone(), method).unwrap();
            for _ in 0..3 {
                start(&mut engine, &boxes());
                assert_eq!(finish(&mut engine), Ok(299), "{method}");
            }
            // As large as the one before, so that it is bound by nobody, and what is bound to nothing is not dispatched.
            let mut output = Output::new(&gpu).unwrap();
            output.ensure_blocks(&gpu, 1 << 16).unwrap();
            output.ensure_pairs(&gpu, u64::from(engine.output.capacity())).unwrap();
            engine.output = output;
            start(&mut engine, &boxes());
            assert_eq!(kind(finish(&mut engine)), GpuErrorKind::Inert, "{method}");
            assert!(
                gpu.fault().is_some_and(|why| why.contains("gpu0 (") && why.contains("executes nothing")),
                "{method}"
            );
            assert_eq!(gpu.check().unwrap_err().kind(), GpuErrorKind::Inert);
        }
    }

    #[test]
    fn an_answer_to_another_submission_is_none() {
        let Some(gpu) = first_for_tests() else { return };
        let mut engine = Engine::new(gpu, "sap").unwrap();
        start(&mut engine, &boxes());
        assert_eq!(finish(&mut engine), Ok(299));
        start(&mut engine, &boxes());
        // What comes back is then of the frame before.
        let number = engine.next_submission();
        engine.frame.as_mut().unwrap().params.submission = number;
        assert_eq!(kind(finish(&mut engine)), GpuErrorKind::Inert);
    }

    #[test]
    fn no_number_is_that_of_an_untouched_header() {
        let Some(gpu) = first_for_tests() else { return };
        let mut engine = Engine::new(gpu, "brute").unwrap();
        engine.submissions = u32::MAX;
        assert_eq!(engine.next_submission(), 1);
        assert_ne!(engine.next_submission(), Header::START.ran);
    }
}
