//! Files of earlier versions in their current form.

use sapwise_lab::convert::{ConvertError, convert};
use serde_json::Value;

/// Each of them, with the schema that it has now.
const OLD: [(&str, &str); 4] = [
    (include_str!("fixtures/old/report-1.json"), "report/2"),
    (include_str!("fixtures/old/report-1-gpu.json"), "report/2"),
    (include_str!("fixtures/old/fields-1.json"), "tuning/2"),
    (include_str!("fixtures/old/tuning-1.json"), "tuning/2"),
];

/// All numbers of a file in ascending order, without those under some keys.
fn numbers(value: &Value, without: &[&str]) -> Vec<f64> {
    fn collect(value: &Value, without: &[&str], into: &mut Vec<f64>) {
        match value {
            Value::Number(n) => into.push(n.as_f64().unwrap()),
            Value::Array(items) => items.iter().for_each(|v| collect(v, without, into)),
            Value::Object(entries) => {
                entries
                    .iter()
                    .filter(|(key, _)| !without.contains(&key.as_str()))
                    .for_each(|(_, v)| collect(v, without, into));
            }
            _ => {}
        }
    }
    let mut all = Vec::new();
    collect(value, without, &mut all);
    all.sort_unstable_by(f64::total_cmp);
    all
}

#[test]
fn old_files_become_current_and_keep_every_figure() {
    for (text, schema) in OLD {
        let converted = convert(text).unwrap();
        assert_eq!(converted.schema, schema);
        let (old, new): (Value, Value) =
            (serde_json::from_str(text).unwrap(), serde_json::from_str(&converted.text).unwrap());
        assert_eq!(new["schema"], schema);
        assert_eq!(numbers(&old, &["correction"]), numbers(&new, &["work", "factor"]));
        for gone in ["strips", "sweep@", "verlet", "\"sweep\""] {
            assert!(!converted.text.contains(gone), "{schema}: {gone}");
        }
    }
}

#[test]
fn a_tuning_loses_its_correction_by_the_number_of_objects_aloud() {
    let converted = convert(OLD[3].0).unwrap();
    assert!(matches!(&converted.dropped[..], [one] if one.starts_with("correction: ")), "{:?}", converted.dropped);
    assert!(!converted.text.contains("correction"));
}

#[test]
fn a_model_is_trained_again() {
    for text in [include_str!("fixtures/old/model-1.json"), include_str!("fixtures/old/model-2.json")] {
        assert!(convert(text).unwrap_err().to_string().contains("`sapwise train REPORTS... --out MODEL.json`"));
    }
}

#[test]
fn a_current_file_is_not_converted_again() {
    for (text, schema) in OLD {
        let again = convert(&convert(text).unwrap().text).unwrap_err();
        assert!(matches!(&again, ConvertError::Current(s) if s == schema), "{again}");
    }
}

#[test]
fn a_fallback_and_names_in_texts_are_renamed() {
    let text = OLD[2].0.replacen(
        "\"cache_bytes\"",
        "\"otherwise\": [{\"term\": \"sort\", \"unit_ns\": 3.5}], \"cache_bytes\"",
        1,
    );
    let text =
        text.replacen("bandwidth_one_thread_gb_per_s is", "verlet@cpu2, unlike one sweep of (sweep@gpu0+1), is", 1);
    let tuning: Value = serde_json::from_str(&convert(&text).unwrap().text).unwrap();
    let fallback = &tuning["works"][tuning["costs"][0]["work"].as_u64().unwrap() as usize]["fallback"];
    assert_eq!(tuning["works"][fallback["work"].as_u64().unwrap() as usize]["terms"][0]["unit_ns"], 3.5);
    let warning = tuning["warnings"][0].as_str().unwrap();
    assert!(warning.starts_with("pair-cache@cpu2, unlike one sweep of (sap@gpu0+1), is 31.2300,"), "{warning}");
}

#[test]
fn what_is_cut_foreign_or_unsound_is_refused_in_words() {
    let refused = |text: &str| convert(text).unwrap_err();
    assert!(matches!(refused(include_str!("fixtures/old/report-1-cut.json")), ConvertError::Json(_)));
    assert!(matches!(refused("[]"), ConvertError::Unknown(_)));
    assert!(matches!(refused("{}"), ConvertError::Unknown(_)));
    assert!(matches!(refused("{\"schema\": \"cache/1\"}"), ConvertError::Cache));
    let other = refused("{\"schema\": \"recipe/1\"}").to_string();
    assert!(other.contains("recipe/1") && other.contains("fields/1"), "{other}");
    let unsound = OLD[0].0.replacen("\"seed\"", "\"sead\"", 1);
    assert!(matches!(refused(&unsound), ConvertError::Unsound("report/2", _)));
    let nested = format!("{{\"schema\": \"fields/1\", \"name\": {}{}}}", "[".repeat(10_000), "]".repeat(10_000));
    assert!(matches!(refused(&nested), ConvertError::Json(_)));
}
