use super::*;
use crate::{Source, Step};
use serde_json::{Value, json};

fn sample() -> Value {
    let tuning = Tuning::from_steps(vec![Step::new(0, "brute@cpu1".parse().unwrap())]).unwrap();
    serde_json::from_str(&write_tuning(&tuning).unwrap()).unwrap()
}

#[test]
fn tuning_reads_back_and_its_first_key_is_the_schema() {
    let text = write_tuning(&tuning(&sample().to_string()).unwrap()).unwrap();
    assert!(text.starts_with("{\n  \"schema\": \"tuning/2\",\n  \"source\": \"default\",\n"), "{text}");
    assert_eq!(tuning(&text).unwrap().source, Source::Default);
}

#[test]
fn an_unknown_key_is_an_error_that_names_it_but_in_a_newer_minor_version_it_is_told() {
    let mut file = sample();
    file["colour"] = json!("green");
    file["steps"][0]["why"] = json!({ "deep": [1, 2] });
    let error = tuning(&file.to_string()).unwrap_err();
    assert!(
        matches!(&error, Error::UnknownKey { .. }) && error.to_string().contains("is no key of tuning/2"),
        "{error}"
    );
    file["schema"] = json!("tuning/2.3");
    let read = Format::TUNING.read::<Tuning>(&file.to_string()).unwrap();
    assert_eq!((read.schema.minor(), read.value), (3, tuning(&sample().to_string()).unwrap()));
    let mut skipped = read.skipped;
    skipped.sort();
    assert_eq!(skipped, ["colour", "steps[0].why"]);
}

#[test]
fn an_old_schema_is_refused_with_the_command_that_makes_it_again() {
    let schema = |schema: &str| {
        let mut file = sample();
        file["schema"] = json!(schema);
        tuning(&file.to_string()).unwrap_err()
    };
    let old = schema("fields/1");
    assert!(
        matches!(old, Error::OldSchema { .. }) && old.to_string().contains("`sapwise predict --out TUNING.json`"),
        "{old}"
    );
    for other in ["model/3", "tuning/3", "tuning", "tuning/+2", "tuning/2.x", ""] {
        let error = schema(other);
        assert!(
            matches!(error, Error::OtherSchema { .. }) && error.to_string().contains("\"tuning/2\""),
            "{other}: {error}"
        );
    }
    assert!(matches!(model(r#"{"schema": "model/1"}"#), Err(Error::OldSchema { .. })));
}

#[test]
fn what_is_wrong_has_its_path_line_and_column() {
    let mut file = sample();
    file["steps"][0]["from_objects"] = json!("none");
    let text = write(&file).unwrap();
    let error = tuning(&text).unwrap_err();
    let line = 1 + text.lines().position(|l| l.contains("from_objects")).unwrap();
    assert_eq!(error.position().map(|p| p.0), Some(line));
    assert!(error.to_string().starts_with("steps[0].from_objects: "), "{error}");
    file["steps"][0]["from_objects"] = json!(3);
    let error = tuning(&file.to_string()).unwrap_err();
    assert!(error.to_string().contains("don't begin at 0"), "{error}");
    for text in ["", "{", "[]", "{} {}", r#"{"schema": 1}"#] {
        assert!(matches!(tuning(text), Err(Error::Data { .. })), "{text}");
    }
}

#[test]
fn a_model_is_read_without_what_training_says_of_itself() {
    let built_in = Model::built_in().unwrap();
    let text = write_model(&built_in).unwrap();
    assert!(!text.contains("\"training\""));
    assert_eq!(model(&text).unwrap(), built_in);
    let read = Format::MODEL.read::<Model>(include_str!("../../models/default.json")).unwrap();
    assert!(read.skipped.is_empty());
}
