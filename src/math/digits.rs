//! Numbers formatted for people.

/// A number with thousands separators: `1,017,344`.
pub fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_come_in_threes() {
        for (number, text) in
            [(0, "0"), (12, "12"), (123, "123"), (1234, "1,234"), (999, "999"), (1_017_344, "1,017,344")]
        {
            assert_eq!(grouped(number), text);
        }
        assert_eq!(grouped(300_000), "300,000");
        assert_eq!(grouped(12_345_678), "12,345,678");
    }
}
