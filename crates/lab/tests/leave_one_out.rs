//! The example for researchers works.

#[path = "../examples/leave_one_out.rs"]
mod example;

use std::path::Path;

#[test]
fn the_model_without_a_machine_loses_less_on_it_than_brute_force_does() {
    let datasets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets");
    let text = example::leave_one_out(&datasets, "amd-epyc-zen3-2c/full.json").unwrap();
    let regret = |name: &str| -> f64 {
        let line = text.lines().find(|l| l.starts_with(name)).unwrap();
        line[name.len()..].split_whitespace().next().unwrap().parse().unwrap()
    };
    assert!(text.contains("held out: physical machine"), "{text}");
    assert!(regret("the model") < 50.0 && regret("the model") < regret("brute@cpu1"), "{text}");
    assert!(example::leave_one_out(&datasets, "nowhere.json").is_err());
}
