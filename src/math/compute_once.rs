//! Shared values that parallel work computes when they are first needed.

use std::sync::OnceLock;

/// The value of `cell`, which `compute` computes when it is first needed.
///
/// [`OnceLock::get_or_init`] would lock the cell meanwhile. That must not happen if `compute` uses rayon: a thread that
/// waits for its part of the computation starts other work of the pool, and if that work needs the same cell, the
/// thread waits for itself. Here threads that need the value at the same time may all compute it. One of the results
/// stays, so `compute` must always have the same one.
pub fn compute_once<T>(cell: &OnceLock<T>, compute: impl FnOnce() -> T) -> &T {
    if let Some(value) = cell.get() {
        return value;
    }
    let value = compute();
    cell.get_or_init(|| value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_computation_may_need_its_own_cell() {
        let cell = OnceLock::new();
        let value = compute_once(&cell, || {
            // What a thread does that waits for its part of parallel work: other work, which needs the same value.
            compute_once(&cell, || vec![1]);
            vec![1]
        });
        assert_eq!(*value, [1]);
        assert_eq!(*compute_once(&cell, Vec::new), [1]);
    }
}
