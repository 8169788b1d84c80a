//! Labels of reports as text.

use crate::report::Label;

/// Returns the label as it is written in files.
pub fn kind(label: Label) -> &'static str {
    match label {
        Label::RealFull => "real_full",
        Label::RealRestricted => "real_restricted",
        Label::RealContended => "real_contended",
        Label::RealSoftwareGpu => "real_software_gpu",
        Label::RealBrowser => "real_browser",
        Label::Published => "published",
    }
}

/// Returns the meaning of a label.
pub fn meaning(label: Label) -> &'static str {
    match label {
        Label::RealFull => "a whole machine, undisturbed",
        Label::RealRestricted => "fewer cores or a lower level of vector instructions than the machine has",
        Label::RealContended => "other programs took part of the machine",
        Label::RealSoftwareGpu => "the GPU is a software adapter, which runs on the CPU",
        Label::RealBrowser => "measured by a page in a browser, in WebAssembly on one thread",
        Label::Published => "parameters from a publication, without timings",
    }
}
