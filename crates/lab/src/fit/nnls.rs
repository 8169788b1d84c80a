//! Least squares with coefficients that are not negative.

use linfa_linalg::qr::QRInto;
use ndarray::{Array1, Array2, Axis, concatenate, s};

/// Length outside the span of the active columns that a column of length one needs to join them.
const INDEPENDENT: f64 = 1e-7;

/// Minimises `|a x - b|` over `x >= 0` by the active-set method of Lawson and Hanson (Solving Least Squares Problems,
/// 1974, chapter 23), for `a` of shape (rows, columns) and `b` of length rows.
///
/// Scales columns to length one first, since terms differ by many orders of magnitude. A column that depends linearly
/// on earlier ones in use stays at zero, so that rank-deficient input has one answer. Ends after ten changes of the
/// active set for each column.
pub(crate) fn nnls(a: &Array2<f64>, b: &Array1<f64>) -> Array1<f64> {
    let columns = a.ncols();
    let lengths: Vec<f64> = a.columns().into_iter().map(|c| c.dot(&c).sqrt()).collect();
    let mut scaled = a.clone();
    for (mut column, &length) in scaled.columns_mut().into_iter().zip(&lengths) {
        if length > 0.0 {
            column /= length;
        }
    }
    let (scaled, b) = &reduced(scaled, b);
    let tolerance = 1e-12 * b.dot(b).sqrt();
    let mut x = Array1::<f64>::zeros(columns);
    let mut active: Vec<usize> = Vec::new();
    // Columns that can't join the present active set. They are tried again when it shrinks.
    let mut barred: Vec<bool> = lengths.iter().map(|&l| l == 0.0).collect();
    for _ in 0..10 * columns {
        let gradient = scaled.t().dot(&(b - &scaled.dot(&x)));
        let Some(best) = steepest(&gradient, &active, &barred, tolerance) else { break };
        active.push(best);
        let Some(solution) = solve(scaled, b, &active).filter(|z| z[z.len() - 1] > 0.0) else {
            active.pop();
            barred[best] = true;
            continue;
        };
        if retreat(scaled, b, solution, &mut active, &mut x) {
            barred = lengths.iter().map(|&l| l == 0.0).collect();
        }
    }
    for (value, &length) in x.iter_mut().zip(&lengths) {
        *value = if length > 0.0 { *value / length } else { 0.0 };
    }
    x
}

/// Reduces the problem to as many rows as it has columns, and one more: the triangle of a QR decomposition keeps
/// every length and angle, so that the solutions over any columns stay. The search solves dozens of these, which
/// would be slow over thousands of rows.
fn reduced(a: Array2<f64>, b: &Array1<f64>) -> (Array2<f64>, Array1<f64>) {
    let columns = a.ncols();
    if a.nrows() <= columns + 1 {
        return (a, b.clone());
    }
    let both = concatenate(Axis(1), &[a.view(), b.view().insert_axis(Axis(1))]);
    match both.ok().and_then(|both| both.qr_into().ok()) {
        Some(decomposed) => {
            let triangle = decomposed.into_r();
            (triangle.slice(s![.., ..columns]).to_owned(), triangle.column(columns).to_owned())
        }
        // Never: the shapes fit, and there are more rows than columns.
        None => (a, b.clone()),
    }
}

/// Returns the column along which the error falls fastest; the first of equals.
fn steepest(gradient: &Array1<f64>, active: &[usize], barred: &[bool], tolerance: f64) -> Option<usize> {
    let mut best: Option<usize> = None;
    for (k, &slope) in gradient.iter().enumerate() {
        let better = best.is_none_or(|b| slope > gradient[b] * (1.0 + 1e-9));
        if slope > tolerance && better && !barred[k] && !active.contains(&k) {
            best = Some(k);
        }
    }
    best
}

/// Moves `x` towards the unconstrained `solution` over the active columns, dropping those that reach zero on the way,
/// until the solution over the remaining ones is positive. Returns whether it dropped any.
fn retreat(a: &Array2<f64>, b: &Array1<f64>, solution: Vec<f64>, active: &mut Vec<usize>, x: &mut Array1<f64>) -> bool {
    let mut z = solution;
    let mut dropped = false;
    while z.iter().any(|&v| v <= 0.0) {
        let step =
            active.iter().zip(&z).filter(|(_, v)| **v <= 0.0).map(|(&k, v)| x[k] / (x[k] - v)).fold(1.0, f64::min);
        for (&k, v) in active.iter().zip(&z) {
            x[k] += step * (v - x[k]);
        }
        let before = active.len();
        let low = active.iter().map(|&k| x[k]).fold(f64::INFINITY, f64::min).max(0.0) + 1e-15;
        active.retain(|&k| x[k] > low);
        dropped |= active.len() < before;
        match solve(a, b, active) {
            Some(next) if !active.is_empty() => z = next,
            _ => z.clear(),
        }
    }
    x.fill(0.0);
    for (&k, v) in active.iter().zip(&z) {
        x[k] = *v;
    }
    dropped
}

/// Solves least squares over some columns by Gram-Schmidt, each column cleared twice; `None` when they are linearly
/// dependent.
fn solve(a: &Array2<f64>, b: &Array1<f64>, active: &[usize]) -> Option<Vec<f64>> {
    let count = active.len();
    let mut base: Vec<Array1<f64>> = Vec::with_capacity(count);
    let mut r = Array2::<f64>::zeros((count, count));
    for (j, &k) in active.iter().enumerate() {
        let mut column = a.column(k).to_owned();
        for _ in 0..2 {
            for (i, q) in base.iter().enumerate() {
                let share = q.dot(&column);
                r[[i, j]] += share;
                column.scaled_add(-share, q);
            }
        }
        let length = column.dot(&column).sqrt();
        if length < INDEPENDENT {
            return None;
        }
        r[[j, j]] = length;
        base.push(column / length);
    }
    let mut z = vec![0.0; count];
    for j in (0..count).rev() {
        let known: f64 = (j + 1..count).map(|i| r[[j, i]] * z[i]).sum();
        z[j] = (base[j].dot(b) - known) / r[[j, j]];
    }
    Some(z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;
    use sapwise_scenes::Random;

    #[test]
    fn columns_of_any_size_are_found() {
        let truth = array![3e5, 2e-9, 7.0];
        let a = Array2::from_shape_fn((20, 3), |(i, j)| [1.0, 1e12, 50.0][j] * ((i + 1) as f64).powi(j as i32));
        let x = nnls(&a, &a.dot(&truth));
        assert!(x.iter().zip(&truth).all(|(x, t)| (x / t - 1.0).abs() < 1e-6), "{x}");
    }

    #[test]
    fn random_problems_meet_the_conditions_of_optimality() {
        let mut random = Random::named(7, &[]);
        // Five rows are not reduced, twelve are.
        for rows in [5, 12].repeat(100) {
            let a = Array2::from_shape_fn((rows, 5), |_| random.normal());
            let b = Array1::from_shape_fn(rows, |_| random.normal());
            let x = nnls(&a, &b);
            let gradient = a.t().dot(&(&b - &a.dot(&x)));
            for (x, g) in x.iter().zip(&gradient) {
                assert!(*x >= 0.0 && *g < 1e-9 && (*x == 0.0 || g.abs() < 1e-9), "{x} {g}");
            }
        }
    }

    #[test]
    fn fewer_rows_keep_lengths_and_angles() {
        let mut random = Random::named(5, &[]);
        let a = Array2::from_shape_fn((200, 4), |(_, j)| if j == 2 { 0.0 } else { random.normal() });
        let b = Array1::from_shape_fn(200, |_| random.normal());
        let (t, u) = reduced(a.clone(), &b);
        assert_eq!((t.dim(), u.len()), ((5, 4), 5));
        let off = |x: f64, y: f64| (x - y).abs() > 1e-10;
        assert!(!a.t().dot(&a).iter().zip(&t.t().dot(&t)).any(|(x, y)| off(*x, *y)));
        assert!(!a.t().dot(&b).iter().zip(&t.t().dot(&u)).any(|(x, y)| off(*x, *y)) && !off(b.dot(&b), u.dot(&u)));
    }

    #[test]
    fn dependent_columns_end_and_the_first_one_serves() {
        let a = Array2::from_shape_fn((10, 4), |(i, j)| (i + 1) as f64 * [1.0, 2.0, 0.0, 0.5][j]);
        let b = Array1::from_shape_fn(10, |i| 3.0 * (i + 1) as f64);
        let x = nnls(&a, &b);
        assert!((x[0] - 3.0).abs() < 1e-9 && x[1] == 0.0 && x[2] == 0.0 && x[3] == 0.0, "{x}");
        assert_eq!(nnls(&Array2::zeros((3, 2)), &array![1.0, 1.0, 1.0]), array![0.0, 0.0]);
    }
}
