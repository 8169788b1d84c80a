//! Reports as JSON text.

use super::record::Report;
use sapwise_tune::json::{Error, Format, Read};

/// Files of reports.
pub const FORMAT: Format = Format::new("report", 3);

/// Reads a report and checks its numbers. The answer names the keys of a newer minor version that were skipped.
///
/// # Errors
/// Names the place of the defect, or the schema if it is another one.
pub fn read(text: &str) -> Result<Read<Report>, Error> {
    FORMAT.read::<Report>(text)?.checked(Report::defect)
}

/// Writes a report: one key a line, one point a line, and the raw samples of a parameter on one line, so that a full
/// sweep stays readable and below a megabyte.
///
/// # Errors
/// When a number can't be written.
pub fn write(report: &Report) -> Result<String, Error> {
    let frame = one_line_samples(&FORMAT.write(&Report { points: Vec::new(), ..report.clone() })?);
    if report.points.is_empty() {
        return Ok(frame);
    }
    let points =
        report.points.iter().map(serde_json::to_string).collect::<Result<Vec<_>, _>>().map_err(Error::Write)?;
    let points = format!("\n  \"points\": [\n    {}\n  ]", points.join(",\n    "));
    // A line break within a text is written as an escape, so this can only be the key of the report itself.
    Ok(frame.replacen("\n  \"points\": []", &points, 1))
}

/// Puts each list of raw samples on the line of its key.
fn one_line_samples(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut inside = false;
    for line in text.lines() {
        out.push_str(if inside { line.trim_start() } else { line });
        // A line break within a text is written as an escape, so this can only be the key. Numbers hold no bracket.
        inside = if inside { !line.contains(']') } else { line.trim_start() == "\"raw\": [" };
        if !inside {
            out.push('\n');
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    #[test]
    fn a_report_reads_back_whatever_its_texts_hold() {
        let text = include_str!("../../tests/fixtures/report-3.json");
        let mut file: Value = serde_json::from_str(text).unwrap();
        let hostile = "\n  \"points\": []";
        file["provenance"]["command"] = json!(hostile);
        file["points"][0]["scenario"] = json!(hostile);
        file["remarks"] = json!([hostile]);
        file["hardware"]["parameters"][0]["source"] = json!("\"raw\": [");
        let report = read(&file.to_string()).unwrap().value;
        let text = write(&report).unwrap();
        assert_eq!(read(&text).unwrap().value, report);
        assert_eq!(text.lines().filter(|l| l.starts_with("    {\"scenario\"")).count(), report.points.len());
        let without = Report { points: Vec::new(), ..report };
        assert_eq!(read(&write(&without).unwrap()).unwrap().value, without);
    }

    #[test]
    fn a_figure_that_can_not_be_is_refused_with_its_place() {
        let text = include_str!("../../tests/fixtures/report-3.json");
        let refused = |from: &str, to: &str| read(&text.replacen(from, to, 1)).unwrap_err().to_string();
        let told = refused("\"axis_candidates\":", "\"axis_candidates\":-");
        assert!(told.contains("point 0 (uniform at"), "{told}");
        let told = refused("\"samples_ns\":[", "\"samples_ns\":[0,");
        assert!(told.contains("a sample of 0 ns"), "{told}");
    }
}
