//! Least squares over many rows, made small.

use ndarray::{Array1, Array2, s};

/// The same problem in as few rows as there are columns and one more, by Householder's reflections: they keep every length and
/// angle, so the solutions over any columns are the same. The search asks for dozens of those, and over tens of thousands of rows each
/// would take a hundred times as long.
pub(super) fn triangle(a: Array2<f64>, b: &Array1<f64>) -> (Array2<f64>, Array1<f64>) {
    let kept = a.ncols() + 1;
    if a.nrows() <= kept {
        return (a, b.clone());
    }
    let mut columns: Vec<Array1<f64>> = a.columns().into_iter().chain([b.view()]).map(|c| c.to_owned()).collect();
    for j in 0..kept {
        let mut mirror = columns[j].slice(s![j..]).to_owned();
        let length = mirror.dot(&mirror).sqrt();
        if length == 0.0 {
            continue;
        }
        // Away from the axis, so that nothing is cancelled.
        mirror[0] += length.copysign(mirror[0]);
        let square = mirror.dot(&mirror);
        for column in &mut columns[j..] {
            let mut rest = column.slice_mut(s![j..]);
            let share = 2.0 * mirror.dot(&rest) / square;
            rest.scaled_add(-share, &mirror);
        }
    }
    let entry = |(i, j): (usize, usize)| if i <= j { columns[j][i] } else { 0.0 };
    (Array2::from_shape_fn((kept, kept - 1), entry), Array1::from_shape_fn(kept, |i| entry((i, kept - 1))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise_scenes::Random;

    #[test]
    fn a_triangle_has_the_lengths_and_angles_of_its_rows() {
        let mut random = Random::named(5, &[]);
        let a = Array2::from_shape_fn((200, 4), |(_, j)| if j == 2 { 0.0 } else { random.normal() });
        let b = Array1::from_shape_fn(200, |_| random.normal());
        let (t, u) = triangle(a.clone(), &b);
        assert_eq!((t.dim(), u.len()), ((5, 4), 5));
        let far = |x: &Array2<f64>, y: &Array2<f64>| (x - y).iter().any(|d| d.abs() > 1e-10);
        assert!(!far(&a.t().dot(&a), &t.t().dot(&t)));
        let (ab, tu) = (a.t().dot(&b), t.t().dot(&u));
        assert!((&ab - &tu).iter().all(|d| d.abs() < 1e-10) && (b.dot(&b) - u.dot(&u)).abs() < 1e-10);
    }
}
