//! Small dense systems of linear equations: the factorisation of Cholesky (1910).

/// The lower factor of a symmetric positive definite matrix of `n` rows, row by row; `None` where it is not positive definite.
pub fn cholesky(mut matrix: Vec<f64>, n: usize) -> Option<Vec<f64>> {
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| matrix[i * n + k] * matrix[j * n + k]).sum();
            let value = matrix[i * n + j] - sum;
            if i == j {
                if value.is_nan() || value <= 0.0 {
                    return None;
                }
                matrix[i * n + i] = value.sqrt();
            } else {
                matrix[i * n + j] = value / matrix[j * n + j];
            }
        }
    }
    Some(matrix)
}

/// Solves the system whose factor [`cholesky`] gave, for the right side `x`, in place.
pub fn solve(factor: &[f64], n: usize, x: &mut [f64]) {
    for i in 0..n {
        let sum: f64 = (0..i).map(|k| factor[i * n + k] * x[k]).sum();
        x[i] = (x[i] - sum) / factor[i * n + i];
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|k| factor[k * n + i] * x[k]).sum();
        x[i] = (x[i] - sum) / factor[i * n + i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_solves() {
        let matrix = vec![4.0, 2.0, 0.4, 2.0, 5.0, 1.0, 0.4, 1.0, 3.0];
        let want = [1.0, -2.0, 0.5];
        let mut x: Vec<f64> = (0..3).map(|i| (0..3).map(|j| matrix[i * 3 + j] * want[j]).sum()).collect();
        solve(&cholesky(matrix, 3).unwrap(), 3, &mut x);
        assert!(x.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-12));
        assert!(cholesky(vec![0.0; 4], 2).is_none() && cholesky(vec![f64::NAN; 4], 2).is_none());
    }
}
