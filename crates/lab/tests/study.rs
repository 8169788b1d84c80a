//! A study of the stored reports. `SAPWISE_STUDY` names a folder for it, for whoever wants to look at its page.

use sapwise_lab::progress::Silent;
use sapwise_lab::study::{PAGE, Sources, Study, prepare};
use std::path::{Path, PathBuf};

#[test]
fn the_stored_reports_make_a_study_whose_files_are_all_there() {
    let datasets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets");
    let few = ["full", "1t", "avx2", "two-gpus"].map(|p| datasets.join(format!("amd-epyc-zen5-2c/{p}.json")));
    let all = std::env::var_os("SAPWISE_STUDY");
    let folder = tempfile::tempdir().unwrap();
    let out = all.as_ref().map_or_else(|| folder.path().join("study"), PathBuf::from);
    let reports = if all.is_some() { vec![datasets.clone()] } else { few.to_vec() };
    let reports: Vec<PathBuf> = reports.into_iter().chain([datasets.join("published")]).collect();
    prepare(&out).unwrap();
    let sources = Sources::new(&reports, None, &[]).unwrap();
    let study = Study::of(&sources, "sapwise study".to_owned(), &Silent).unwrap();
    let summary = study.write(&out, &Silent).unwrap();
    assert!(study.unreadable().is_empty() && summary.files.iter().any(|f| f.path == PAGE));
    assert!(summary.files.iter().all(|f| out.join(&f.path).is_file() && !f.holds.is_empty()), "{:?}", summary.files);
    // The cause of what can't be said comes before the claims.
    assert!(summary.can_say[0].contains("physical machine"), "{:?}", summary.can_say);
}
