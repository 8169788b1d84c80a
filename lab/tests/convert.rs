//! Files of the first release in their current form.

use sapwise_lab::convert::{ConvertError, convert};
use serde_json::Value;

/// Each file of the first release, with the schema that it has now.
const OLD: [(&str, &str); 5] = [
    (include_str!("fixtures/old/report-1.json"), "report/2"),
    (include_str!("fixtures/old/report-1-gpu.json"), "report/2"),
    (include_str!("fixtures/old/model-1.json"), "model/2"),
    (include_str!("fixtures/old/model-1-folds.json"), "model/2"),
    (include_str!("fixtures/old/fields-1.json"), "tuning/1"),
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
        assert_eq!(numbers(&old, &["clouds", "folds"]), numbers(&new, &[]));
        for gone in ["strips", "sweep@", "verlet", "\"sweep\""] {
            assert!(!converted.text.contains(gone), "{schema}: {gone}");
        }
    }
}

#[test]
fn a_model_keeps_what_predicts_apart_from_its_training_and_loses_its_folds_aloud() {
    let [plain, folds] = [2, 3].map(|k| convert(OLD[k].0).unwrap());
    assert!(plain.dropped.is_empty());
    assert_eq!(folds.dropped.len(), 2, "{:?}", folds.dropped);
    assert!(folds.dropped[0].starts_with("clouds: ") && folds.dropped[1].starts_with("folds: "), "{:?}", folds.dropped);
    for converted in [plain, folds] {
        let model: Value = serde_json::from_str(&converted.text).unwrap();
        assert_eq!(model["training"]["trained_on"].as_array().unwrap().len(), 7);
        assert_eq!(model["training"]["validation"]["physical_machines"], 1);
        for key in ["trained_on", "validation", "clouds", "folds"] {
            assert!(model.get(key).is_none(), "{key}");
        }
        assert_eq!(sapwise::json::model(&converted.text).unwrap().methods.len(), 3);
    }
}

#[test]
fn the_score_of_a_strategy_that_is_gone_is_left_out() {
    let text = OLD[2].0.replacen("\"direct regression\"", "\"direct elastic net\"", 1);
    let converted = convert(&text).unwrap();
    assert!(converted.dropped.len() == 1 && converted.dropped[0].contains("elastic net"), "{:?}", converted.dropped);
    assert!(!converted.text.contains("elastic net"));
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
    let text =
        OLD[4].0.replacen("\"cache_bytes\"", "\"otherwise\": [{\"term\": \"sort\", \"unit_ns\": 3.5}], \"cache_bytes\"", 1);
    let text = text.replacen("bandwidth_one_thread_gb_per_s is", "verlet@cpu2, unlike one sweep of (sweep@gpu0+1), is", 1);
    let tuning: Value = serde_json::from_str(&convert(&text).unwrap().text).unwrap();
    assert_eq!(tuning["costs"][0]["curve"]["fallback_terms"][0]["unit_ns"], 3.5);
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
    let nested = format!("{{\"schema\": \"model/1\", \"name\": {}{}}}", "[".repeat(10_000), "]".repeat(10_000));
    assert!(matches!(refused(&nested), ConvertError::Json(_)));
}
