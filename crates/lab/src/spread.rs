//! A mean beside the least and the largest value, since a mean alone hides how far the values differ.

/// Returns the least and the largest of some values; `None` without values.
pub fn range(values: &[f64]) -> Option<[f64; 2]> {
    let least = values.iter().copied().min_by(f64::total_cmp)?;
    Some([least, values.iter().copied().max_by(f64::total_cmp)?])
}

/// Formats a mean share with its range as percentages: `5.0 % (0.2 to 31.0)`, or `5.0 %` if the range is unknown.
pub fn percent(mean: f64, range: Option<[f64; 2]>, decimals: usize) -> String {
    let [mean, least, largest] = [mean, range.map_or(mean, |r| r[0]), range.map_or(mean, |r| r[1])].map(|v| 100.0 * v);
    match range {
        None => format!("{mean:.decimals$} %"),
        Some(_) => format!("{mean:.decimals$} % ({least:.decimals$} to {largest:.decimals$})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_of_values_holds_their_mean_and_stands_beside_it() {
        let values = [0.31, 0.002, 0.1];
        assert_eq!(percent(0.05, range(&values), 1), "5.0 % (0.2 to 31.0)");
        assert_eq!((percent(0.05, None, 2).as_str(), range(&[])), ("5.00 %", None));
    }
}
