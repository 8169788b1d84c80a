//! A whole study of made-up machines.

use super::*;
use crate::progress::Silent;
use crate::report;
use crate::synthetic::Machine;

const MADE: &str = "Made on a day by a command.";

/// A folder with a report of each machine, the first with a name that is no markup.
fn reports(folder: &Path, machines: &[Machine]) -> PathBuf {
    let reports = folder.join("reports");
    fs::create_dir(&reports).unwrap();
    for (k, machine) in machines.iter().enumerate() {
        let mut report = machine.report();
        if k == 0 {
            report.hardware.machine.cpu = "</table><script>alert(1)</script>".to_owned();
        }
        fs::write(reports.join(format!("{}.json", machine.name)), report::write(&report).unwrap()).unwrap();
    }
    reports
}

#[test]
fn a_study_of_several_hosts_shows_everything() {
    let folder = tempfile::tempdir().unwrap();
    let reports = reports(folder.path(), &Machine::family_with_gpus()[..5]);
    let out = folder.path().join("a/study");
    let summary = study(&[reports], &out, MADE, &Silent).unwrap();
    assert_eq!((summary.reports, summary.studied, summary.hosts), (5, 5, 5));
    assert!(summary.missing.is_empty(), "{:?}", summary.missing);
    let page = fs::read_to_string(out.join(PAGE)).unwrap();
    for file in &summary.files[1..] {
        let text = fs::read_to_string(out.join(file)).unwrap();
        assert!(page.contains(&format!("href=\"{file}\"")) || file.ends_with(".csv"), "{file}");
        assert!(text.lines().count() > 5, "{file}: {text}");
    }
    assert!(!page.contains("<script") && page.contains("&lt;script&gt;") && !page.contains("NaN"));
    assert!(page.contains("single best") && page.contains("random forest"));
    let header = |file: &str| fs::read_to_string(out.join(file)).unwrap().lines().next().unwrap().to_owned();
    let regrets = "strategy,held_out,folder,seen_share,seen_in_games_share,unseen_share,unseen_in_games_share";
    assert_eq!(header("regrets.csv"), regrets);
    assert!(header("timings.csv").ends_with("samples,quartile_1_ns,quartile_3_ns,median_ns,mean_ns"));
    assert!(page.contains(MADE) && page.contains("hosts have timings on a real GPU"));
}

#[test]
fn what_is_missing_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let reports = reports(folder.path(), &Machine::family()[..1]);
    let out = folder.path().join("study");
    let summary = study(std::slice::from_ref(&reports), &out, MADE, &Silent).unwrap();
    for what in ["Figure 4", "Figure 6", "Nothing was held out", "Figure 9", "two hosts", "three reports"] {
        assert!(summary.missing.iter().any(|m| m.contains(what)), "{what}: {:?}", summary.missing);
    }
    // A study is replaced; a folder of something else, and one that only looks like a study, is left alone.
    study(std::slice::from_ref(&reports), &out, MADE, &Silent).unwrap();
    fs::write(out.join(PAGE), "<html>mine</html>").unwrap();
    let error = study(&[reports], &out, MADE, &Silent).unwrap_err().to_string();
    assert!(error.contains("not empty") && error.contains("--out"), "{error}");
}
