//! Range of a hardware parameter in training, beside the values that others published of real machines.

use crate::hardware::with_unit;

/// Values that [`Range::published`] holds.
const DECILES: usize = 11;

/// Range of a hardware parameter in training.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub struct Range {
    /// Name of the parameter; that of a GPU after `gpu/`.
    pub parameter: String,
    /// Lowest value.
    pub min: f64,
    /// Highest value.
    pub max: f64,
    /// Eleven deciles, from the lowest to the highest value, of real machines that others published. Empty if
    /// unknown.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub published: Vec<f64>,
}

impl Range {
    /// Returns whether a value lies inside, or outside by at most a tenth: two measurements of one machine differ by
    /// up to that.
    pub fn holds(&self, value: f64) -> bool {
        (self.min / 1.1..=self.max * 1.1).contains(&value)
    }

    /// Returns the share, from 0 to 1, of published machines with less than `value`, interpolated between deciles.
    /// `None` if no deciles are known.
    pub fn share_below(&self, value: f64) -> Option<f64> {
        let last = self.published.len().checked_sub(1)?;
        let above = self.published.iter().take_while(|&&decile| decile < value).count();
        if above == 0 || above > last {
            return Some(if above == 0 { 0.0 } else { 1.0 });
        }
        let [low, high] = [self.published[above - 1], self.published[above]];
        Some((above as f64 - 1.0 + (value - low) / (high - low)) / last as f64)
    }

    /// Returns a warning if the range does not [hold](Self::holds) a value.
    pub(super) fn excess(&self, name: &str, of: &str, value: Option<f64>) -> Option<String> {
        let value = value.filter(|&value| !self.holds(value))?;
        let [shown, least, most] = [value, self.min, self.max].map(|value| with_unit(name, value));
        let published = match (&self.published[..], self.share_below(value)) {
            ([lowest, ..], _) if value < *lowest => "; all published machines have more".to_owned(),
            ([.., highest], _) if value > *highest => "; all published machines have less".to_owned(),
            (_, Some(share)) => format!("; {:.0} % of published machines have less", 100.0 * share),
            (_, None) => String::new(),
        };
        Some(format!("{name}{of} is {shown}, outside the {least} to {most} of training{published}"))
    }

    /// Returns what makes it unusable, if anything.
    pub(super) fn defect(&self) -> Option<&'static str> {
        let is_finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        if !is_finite(&[self.min, self.max]) || self.min > self.max {
            Some("ends that are not finite or not ascending")
        } else if !self.published.is_empty()
            && (self.published.len() != DECILES || !is_finite(&self.published) || !self.published.is_sorted())
        {
            Some("published values that are not eleven finite ascending deciles")
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bandwidth(published: Vec<f64>) -> Range {
        Range { parameter: "bandwidth_all_threads_gb_per_s".to_owned(), min: 10.1, max: 14.8, published }
    }

    #[test]
    fn shares_by_hand() {
        // Two deciles are equal: a third of the way from 4 to 7 is a third of the way from 40 % to 50 %.
        let range = bandwidth(vec![1.0, 2.0, 2.0, 3.0, 4.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0]);
        let shares = [0.5, 1.0, 1.5, 2.0, 5.0, 12.0, 13.0].map(|value| range.share_below(value).unwrap());
        let expected = [0.0, 0.0, 0.05, 0.1, 0.4 + 0.1 / 3.0, 1.0, 1.0];
        assert!(shares.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{shares:?}");
        assert_eq!(bandwidth(Vec::new()).share_below(3.0), None);
    }

    #[test]
    fn excess_says_how_many_machines_have_less() {
        let range = bandwidth((0..=10).map(|k| 3.0 + 4.0 * f64::from(k)).collect());
        let told = |range: &Range, value| range.excess(&range.parameter, "", Some(value));
        let start = "bandwidth_all_threads_gb_per_s is 39.8 GB/s, outside the 10.1 GB/s to 14.8 GB/s of training";
        assert_eq!(told(&range, 39.8), Some(format!("{start}; 92 % of published machines have less")));
        assert_eq!(told(&bandwidth(Vec::new()), 39.8).as_deref(), Some(start));
        assert!(told(&range, 44.1).is_some_and(|text| text.ends_with("; all published machines have less")));
        assert!(told(&range, 2.7).is_some_and(|text| text.ends_with("; all published machines have more")));
        assert_eq!((told(&range, 16.0), range.excess("x", "", None)), (None, None));
    }

    #[test]
    fn deciles_are_eleven_and_ascend() {
        let of = |published| bandwidth(published).defect().is_some();
        let ascending: Vec<f64> = (0..11).map(f64::from).collect();
        let mut swapped = ascending.clone();
        swapped.swap(3, 4);
        assert_eq!([ascending, swapped, vec![1.0; 10], vec![f64::NAN; 11]].map(of), [false, true, true, true]);
    }
}
