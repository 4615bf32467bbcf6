//! The Pareto front of run time against error, and its knee.

/// Whether each `(time, error)` lies on the front: no other one is as fast and as right, and better in one of the two.
/// Points that are no numbers never do.
pub fn pareto_front(points: &[(f64, f64)]) -> Vec<bool> {
    let finite = |(time, error): &(f64, f64)| time.is_finite() && error.is_finite();
    let beats = |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
    points
        .iter()
        .map(|point| finite(point) && !points.iter().any(|other| finite(other) && beats(other, point)))
        .collect()
}

/// The index of the knee: the point of the front farthest from the line between its ends, on the side of the origin, with
/// both axes scaled to the front's extent [Das 1999]. The only point of a front of one; of two, the one of less error.
/// `None` without a front.
pub fn knee(points: &[(f64, f64)]) -> Option<usize> {
    let on_front = pareto_front(points);
    let mut front: Vec<usize> = (0..points.len()).filter(|index| on_front[*index]).collect();
    front.sort_by(|a, b| points[*a].0.total_cmp(&points[*b].0));
    let (first, last) = (points[*front.first()?], points[*front.last()?]);
    let (width, height) = (last.0 - first.0, first.1 - last.1);
    if !(width > 0.0 && height > 0.0) {
        return front.first().copied();
    }
    let below = |index: &usize| {
        let (time, error) = points[*index];
        1.0 - (time - first.0) / width - (error - last.1) / height
    };
    let farthest = front.iter().rev().copied().max_by(|a, b| below(a).total_cmp(&below(b)))?;
    Some(if below(&farthest) > 0.0 { farthest } else { *front.last()? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [(1.0, 0.9), (2.0, 0.3), (3.0, 0.4), (4.0, 0.2), (2.0, 0.3), (f64::NAN, 0.0), (9.0, 0.2)];
        assert_eq!(pareto_front(&points), [true, true, false, true, true, false, false]);
        assert_eq!(knee(&points), Some(1));
        assert_eq!((knee(&[]), knee(&[(1.0, 1.0)]), knee(&[(1.0, 1.0), (2.0, 0.5)])), (None, Some(0), Some(1)));
    }
}
