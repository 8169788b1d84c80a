//! Damages JSON texts so that they stay JSON, and get past the parser.

use crate::source::Random;
use serde_json::{Value, json};

/// Returns the text with one to four damages; `None` if it is no JSON.
pub fn damaged(text: &[u8], seed: u32) -> Option<String> {
    let mut whole: Value = serde_json::from_slice(text).ok()?;
    let mut random = Random::new(seed);
    for _ in 0..1 + random.below(4) {
        // A value may replace one at another place of the file.
        let other = pick(&mut whole, &mut random).clone();
        damage(pick(&mut whole, &mut random), other, &mut random);
    }
    Some(whole.to_string())
}

/// Picks a value anywhere in the file: at each level it usually descends.
fn pick<'a>(value: &'a mut Value, random: &mut Random) -> &'a mut Value {
    let children = match value {
        Value::Array(items) => items.len(),
        Value::Object(keys) => keys.len(),
        _ => 0,
    };
    if children == 0 || random.below(6) == 0 {
        return value;
    }
    let at = random.below(children);
    let child = match value {
        Value::Array(items) => items.get_mut(at),
        Value::Object(keys) => keys.values_mut().nth(at),
        _ => None,
    };
    pick(child.expect("`at` is below the number of children"), random)
}

fn damage(value: &mut Value, other: Value, random: &mut Random) {
    match (value, random.below(6)) {
        (value, 0) => *value = other,
        (Value::Array(items), 1) if !items.is_empty() => drop(items.remove(random.below(items.len()))),
        (Value::Array(items), 2) if !items.is_empty() => items.push(items[random.below(items.len())].clone()),
        (Value::Array(items), 3) if !items.is_empty() => items.rotate_left(1),
        (Value::Array(items), _) => items.push(other),
        (Value::Object(keys), 1 | 2) if !keys.is_empty() => {
            let key = keys.keys().nth(random.below(keys.len())).cloned();
            key.map(|key| keys.remove(&key));
        }
        (Value::Object(keys), _) => drop(keys.insert(["schema", "made up", ""][random.below(3)].to_owned(), other)),
        (Value::String(text), 1 | 2) => *text = text.chars().rev().collect(),
        (Value::String(text), 3) => drop(text.pop()),
        (Value::String(text), _) => *text = word(NAMES, random).to_owned(),
        (Value::Bool(flag), _) => *flag = !*flag,
        (value @ Value::Number(_), 1 | 2) => {
            *value = json!(value.as_f64().unwrap_or(1.0) * FACTORS[random.below(FACTORS.len())])
        }
        (value, _) => *value = serde_json::from_str(word(NUMBERS, random)).unwrap_or_default(),
    }
}

const FACTORS: [f64; 8] = [-1.0, 0.5, 2.0, 1.0e3, 1.0e-3, 1.0e12, 1.0e-12, 1.0 + f64::EPSILON];

const NUMBERS: &str = "0 1 -1 2 0.0 -0.0 1e308 -1e308 5e-324 4294967295 4294967296 18446744073709551615 1e999 null";

const NAMES: &str = " brute@cpu1 pair-cache@cpu2 grid-sap@gpu0+1 bvh@cpu4096 sap call cpu gpu uniform tuning/3 \
                     tuning/3.7 model/5 report/3";

/// Picks one of the words of a text, which are separated by one blank.
fn word(text: &'static str, random: &mut Random) -> &'static str {
    text.split(' ').nth(random.below(text.split(' ').count())).unwrap_or_default()
}
