use super::*;
use sapwise::tuning::{Product, Source, Step, Term};
use serde_json::{Value, json};

fn sample() -> Value {
    let tuning = Tuning::from_steps(vec![Step::new(0, "brute@cpu1".parse().unwrap())]).unwrap();
    serde_json::from_str(&write_tuning(&tuning).unwrap()).unwrap()
}

#[test]
fn a_tuning_reads_back_and_its_first_key_is_the_schema() {
    let text = write_tuning(&tuning(&sample().to_string()).unwrap()).unwrap();
    assert!(text.starts_with("{\n  \"schema\": \"tuning/3\",\n  \"source\": \"default\",\n"), "{text}");
    assert_eq!(tuning(&text).unwrap().source, Source::Default);
}

#[test]
fn an_unknown_key_is_an_error_and_in_a_newer_minor_version_it_is_listed() {
    let mut file = sample();
    file["colour"] = json!("green");
    file["steps"][0]["why"] = json!({ "deep": [1, 2] });
    let error = tuning(&file.to_string()).unwrap_err();
    assert!(matches!(&error, Error::UnknownKey { .. }), "{error:?}");
    assert!(error.to_string().contains("is no key of tuning/3"), "{error}");
    file["schema"] = json!("tuning/3.3");
    let read = Format::TUNING.read::<Tuning>(&file.to_string()).unwrap();
    assert_eq!((read.schema.minor(), read.value), (3, tuning(&sample().to_string()).unwrap()));
    let mut skipped = read.skipped;
    skipped.sort();
    assert_eq!(skipped, ["colour", "steps[0].why"]);
}

#[test]
fn another_schema_is_refused_by_name() {
    for other in ["fields/1", "model/5", "tuning/2", "tuning/4", "tuning", "tuning/+3", "tuning/3.x", ""] {
        let mut file = sample();
        file["schema"] = json!(other);
        let error = tuning(&file.to_string()).unwrap_err();
        assert!(matches!(error, Error::OtherSchema { .. }), "{other}: {error}");
        assert!(error.to_string().contains("\"tuning/3\", which `sapwise predict"), "{other}: {error}");
    }
    let old = model(r#"{"schema": "model/1"}"#).unwrap_err().to_string();
    assert!(old.contains("\"model/1\"") && old.contains("`sapwise train REPORTS... --out MODEL.json`"), "{old}");
}

#[test]
fn an_error_has_its_path_and_line() {
    let mut file = sample();
    file["steps"][0]["from_objects"] = json!("none");
    let text = write(&file).unwrap();
    let error = tuning(&text).unwrap_err().to_string();
    let line = 1 + text.lines().position(|l| l.contains("from_objects")).unwrap();
    assert!(error.starts_with("steps[0].from_objects: ") && error.contains(&format!("line {line} ")), "{error}");
    file["steps"][0]["from_objects"] = json!(3);
    let error = tuning(&file.to_string()).unwrap_err();
    assert!(error.to_string().contains("don't begin at 0"), "{error}");
    for text in ["", "{", "[]", "{} {}", r#"{"schema": 1}"#] {
        assert!(matches!(tuning(text), Err(Error::Data { .. })), "{text}");
    }
}

#[test]
fn a_model_is_read_without_the_notes_of_its_training() {
    let built_in = Model::built_in().unwrap();
    let text = Format::MODEL.write(&built_in).unwrap();
    assert!(!text.contains("\"training\""));
    assert_eq!(model(&text).unwrap(), built_in);
    let read = Format::MODEL.read::<Model>(include_str!("../../../../models/default.json")).unwrap();
    assert!(read.skipped.is_empty());
    // The build has only removed white space.
    assert_eq!(read.value, built_in);
}

#[test]
fn a_term_is_a_word_or_a_product_of_powers() {
    let product = Term::Product(Product { objects: 1, log2_objects: 2, ..Product::ONE });
    for (term, text) in [
        (Term::ColdObjects, r#""cold_objects""#),
        (product, r#"{"product":{"objects":1,"log2_objects":2}}"#),
        (Term::Product(Product::ONE), r#"{"product":{}}"#),
    ] {
        assert_eq!(serde_json::to_string(&term).unwrap(), text);
        assert_eq!(serde_json::from_str::<Term>(text).unwrap(), term);
    }
    assert!(serde_json::from_str::<Term>(r#"{"product":{"objects":-1}}"#).is_err());
    assert!(serde_json::from_str::<Term>(r#""nodes""#).is_err());
}
