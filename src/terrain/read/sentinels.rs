//! Numbers that mark missing data although the file does not say so.

use super::Warning;

/// Numbers in use as marks. Numbers far outside the heights of the earth are dealt with elsewhere.
const MARKS: [f32; 12] =
    [-9999.0, -32_768.0, -32_767.0, -10_000.0, -99_999.0, -9998.0, -1000.0, -999.0, 9999.0, 32_767.0, 65_535.0, 0.0];

/// Replaces samples by NaN that are a mark beside sound heights, in the file's own unit. The rule: samples of exactly this
/// number, and between it and all other heights a gap wider than the ground itself has relief; for 0 wider than both
/// 100 and the relief. A gap of a quarter of the relief is reported only.
pub(super) fn remove(heights: &mut [f32]) -> Vec<Warning> {
    let mut counts = [0usize; MARKS.len()];
    let (mut low, mut high, mut others) = (f32::INFINITY, f32::NEG_INFINITY, 0usize);
    for height in heights.iter().filter(|height| height.is_finite()) {
        match MARKS.iter().position(|mark| mark == height) {
            Some(at) => counts[at] += 1,
            // Numbers beyond any height are marks, too, and say nothing of the ground.
            None if (-100_000.0..=1.0e7).contains(height) => {
                (low, high, others) = (low.min(*height), high.max(*height), others + 1);
            }
            None => {}
        }
    }
    let mut warnings = Vec::new();
    if others == 0 {
        return warnings;
    }
    let relief = high - low;
    for (mark, count) in MARKS.into_iter().zip(counts).filter(|(_, count)| *count > 0) {
        let gap = if mark < low { low - mark } else { mark - high };
        // Within the heights it is one of them.
        if gap <= 0.0 {
            continue;
        }
        let strong =
            if mark == 0.0 { gap >= relief.max(100.0) } else { gap > 500.0 && (gap > relief || mark.abs() >= 9998.0) };
        let doubtful = mark != 0.0 && gap > 100.0 || gap > 50.0 && gap >= 0.25 * relief;
        let (value, low, high) = (f64::from(mark), f64::from(low), f64::from(high));
        if strong {
            heights.iter_mut().filter(|height| **height == mark).for_each(|height| *height = f32::NAN);
            warnings.push(Warning::AssumedMissing { value, count, low, high });
        } else if doubtful {
            warnings.push(Warning::DoubtfulHeights { value, count, low, high });
        }
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    fn removed(ground: std::ops::RangeInclusive<u32>, mark: f32) -> (usize, Vec<Warning>) {
        let mut heights: Vec<f32> = ground.map(|height| height as f32).collect();
        heights.extend([mark; 7]);
        let warnings = remove(&mut heights);
        (heights.iter().filter(|height| height.is_nan()).count(), warnings)
    }

    #[test]
    fn marks_beside_sound_heights_are_holes() {
        for mark in [-9999.0, -32_767.0, -32_768.0, -999.0, 9999.0, 32_767.0, 0.0] {
            let (holes, warnings) = removed(280..=380, mark);
            assert_eq!(holes, 7, "{mark}");
            assert!(matches!(warnings[..], [Warning::AssumedMissing { count: 7, .. }]), "{mark}: {warnings:?}");
        }
    }

    #[test]
    fn heights_that_may_be_real_stay() {
        // The sea beside a coast, a valley at 0, plains below it.
        for (ground, mark) in [(1..=900, 0.0), (20..=60, 0.0), (5..=40, 0.0)] {
            assert_eq!(removed(ground, mark), (0, Vec::new()));
        }
        let (holes, warnings) = removed(200..=800, 0.0);
        assert_eq!(holes, 0);
        assert!(matches!(warnings[..], [Warning::DoubtfulHeights { count: 7, .. }]), "{warnings:?}");
        assert_eq!(removed(900..=11_000, 9999.0), (0, Vec::new()));
        let mut nothing = vec![0.0; 9];
        assert!(remove(&mut nothing).is_empty() && nothing == vec![0.0; 9]);
    }
}
