//! Instants as users write them: ISO 8601 with the offset from UTC, always.

use chrono::{DateTime, Datelike, FixedOffset, NaiveDate, NaiveDateTime, NaiveTime, TimeZone, Utc};
use serde::Deserialize;

/// First and last year that a scene may name. Solar positions are good to a few thousandths of a degree within them.
pub const YEARS: std::ops::RangeInclusive<i32> = 1900..=2200;

/// An instant in the user's time zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct LocalTime(DateTime<FixedOffset>);

/// Why a text is not an instant.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TimeError {
    /// A local time without a zone.
    #[error("the time `{0}` has no zone; write the offset from UTC after it, as in {0}+02:00, or {0}Z if it is UTC")]
    MissingZone(String),
    /// The zone is not valid.
    #[error("`{zone}` in `{text}` is not a time zone (expected an offset such as +02:00 or -04:00, or Z for UTC)")]
    BadZone {
        /// What was written.
        text: String,
        /// The part that should be a zone.
        zone: String,
    },
    /// A date without a time of day.
    #[error("`{0}` has no time of day; write it after the date, as in {0}T12:00Z")]
    MissingTime(String),
    /// The date does not exist.
    #[error("the date `{date}` of `{text}` does not exist; write year-month-day, as in 2026-06-21")]
    BadDate {
        /// What was written.
        text: String,
        /// The part that should be a date.
        date: String,
    },
    /// The time of day does not exist.
    #[error("the time of day `{time}` of `{text}` does not exist; write hours:minutes from 00:00 to 23:59")]
    BadTime {
        /// What was written.
        text: String,
        /// The part that should be a time.
        time: String,
    },
    /// The year is too far away.
    #[error("the year {year} of `{text}` is too far away; write one from {} to {}", YEARS.start(), YEARS.end())]
    BadYear {
        /// What was written.
        text: String,
        /// Its year.
        year: i32,
    },
}

impl LocalTime {
    /// Wraps an instant.
    pub fn new(instant: DateTime<FixedOffset>) -> Self {
        Self(instant)
    }

    /// Reads `2026-06-21T15:30+02:00`: date, `T` or a blank, hours and minutes, optionally seconds (also with a
    /// fraction), and the offset from UTC (`+02:00`, `+0200`, `+02`) or `Z`.
    ///
    /// # Errors
    /// [`TimeError`], which names the part that is missing or wrong.
    pub fn parse(text: &str) -> Result<Self, TimeError> {
        let text = text.trim();
        let own = || text.to_owned();
        let Some((date, clock)) = text.split_once(['T', 't', ' ']) else {
            return Err(match date(text) {
                Some(_) => TimeError::MissingTime(own()),
                None => TimeError::BadDate { text: own(), date: own() },
            });
        };
        let clock = clock.trim_start();
        let day = self::date(date).ok_or_else(|| TimeError::BadDate { text: own(), date: date.to_owned() })?;
        if !YEARS.contains(&day.year()) {
            return Err(TimeError::BadYear { text: own(), year: day.year() });
        }
        let zone_start = clock.find(['Z', 'z', '+', '-']).unwrap_or(clock.len());
        let (time, zone) = clock.split_at(zone_start);
        let time = time.trim_end();
        let of_day = time_of_day(time).ok_or_else(|| TimeError::BadTime { text: own(), time: time.to_owned() })?;
        if zone.is_empty() {
            return Err(TimeError::MissingZone(own()));
        }
        let offset = offset(zone).ok_or_else(|| TimeError::BadZone { text: own(), zone: zone.to_owned() })?;
        let instant = offset.from_local_datetime(&NaiveDateTime::new(day, of_day)).single();
        instant.map(Self).ok_or_else(|| TimeError::BadZone { text: own(), zone: zone.to_owned() })
    }

    /// The instant in Universal Time.
    pub fn utc(self) -> DateTime<Utc> {
        self.0.with_timezone(&Utc)
    }

    /// The instant with its zone.
    pub fn zoned(self) -> DateTime<FixedOffset> {
        self.0
    }

    /// The instant a share `t` (0..=1) of the way to `end`, in this instant's zone, to the millisecond.
    pub fn toward(self, end: Self, t: f64) -> Self {
        let whole = (end.0 - self.0).num_milliseconds();
        // Centuries of milliseconds stay below 2^53, so the product is exact to the millisecond.
        let part = (whole as f64 * t.clamp(0.0, 1.0)).round() as i64;
        Self(self.0.checked_add_signed(chrono::Duration::milliseconds(part)).unwrap_or(end.0))
    }
}

impl Default for LocalTime {
    /// Noon UTC of the summer solstice of 2026.
    fn default() -> Self {
        let midday = NaiveDate::from_ymd_opt(2026, 6, 21).and_then(|day| day.and_hms_opt(12, 0, 0)).unwrap_or_default();
        Self(midday.and_utc().fixed_offset())
    }
}

impl std::fmt::Display for LocalTime {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0.to_rfc3339_opts(chrono::SecondsFormat::AutoSi, true))
    }
}

impl std::str::FromStr for LocalTime {
    type Err = TimeError;

    fn from_str(text: &str) -> Result<Self, TimeError> {
        Self::parse(text)
    }
}

impl TryFrom<String> for LocalTime {
    type Error = TimeError;

    fn try_from(text: String) -> Result<Self, TimeError> {
        Self::parse(&text)
    }
}

fn date(text: &str) -> Option<NaiveDate> {
    let mut parts = text.splitn(3, '-');
    let (year, month, day) = (parts.next()?, parts.next()?, parts.next()?);
    (year.len() == 4).then_some(())?;
    NaiveDate::from_ymd_opt(digits(year)?.try_into().ok()?, digits(month)?, digits(day)?)
}

fn time_of_day(text: &str) -> Option<NaiveTime> {
    let mut parts = text.splitn(3, ':');
    let (hours, minutes) = (digits(parts.next()?)?, digits(parts.next()?)?);
    let seconds = parts.next().unwrap_or("0");
    let (whole, fraction) = seconds.split_once('.').unwrap_or((seconds, "0"));
    let digits_of_milliseconds: String = fraction.chars().chain("000".chars()).take(3).collect();
    digits(fraction.get(..fraction.len().min(9))?)?;
    NaiveTime::from_hms_milli_opt(hours, minutes, digits(whole)?, digits(&digits_of_milliseconds)?)
}

fn offset(zone: &str) -> Option<FixedOffset> {
    if zone.eq_ignore_ascii_case("z") {
        return FixedOffset::east_opt(0);
    }
    let (sign, rest) = match zone.split_at_checked(1)? {
        ("+", rest) => (1, rest),
        ("-", rest) => (-1, rest),
        _ => return None,
    };
    let (hours, minutes) = match (rest.split_once(':'), rest.len()) {
        (Some((hours, minutes)), _) => (hours, minutes),
        (None, 2) => (rest, "00"),
        (None, 4) => rest.split_at_checked(2)?,
        _ => return None,
    };
    let (hours, minutes) = (digits(hours)?, digits(minutes)?);
    // UTC+14 (Line Islands) is the farthest zone in use.
    (hours <= 14 && minutes < 60).then_some(())?;
    FixedOffset::east_opt(sign * i32::try_from(hours * 3600 + minutes * 60).ok()?)
}

fn digits(text: &str) -> Option<u32> {
    (!text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())).then(|| text.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn utc(text: &str) -> String {
        LocalTime::parse(text).map_or_else(|error| error.to_string(), |time| time.utc().to_rfc3339())
    }

    #[test]
    fn zones_lead_to_utc() {
        assert_eq!(utc("2026-06-21T15:30+02:00"), "2026-06-21T13:30:00+00:00");
        assert_eq!(utc("2026-06-21T23:30-0400"), "2026-06-22T03:30:00+00:00");
        assert_eq!(utc("2026-06-21 05:30:15.5 +05:30"), "2026-06-21T00:00:15.500+00:00");
        assert_eq!(utc("2026-06-21T00:00Z"), "2026-06-21T00:00:00+00:00");
        assert_eq!(utc("2024-02-29T12:00+02"), "2024-02-29T10:00:00+00:00");
    }

    #[test]
    fn each_fault_has_its_own_message() {
        let error = |text: &str| LocalTime::parse(text).err();
        assert!(matches!(error("2026-06-21T15:30"), Some(TimeError::MissingZone(_))));
        assert!(matches!(error("2026-06-21"), Some(TimeError::MissingTime(_))));
        assert!(matches!(error("2026-02-29T15:30Z"), Some(TimeError::BadDate { .. })));
        assert!(matches!(error("soon"), Some(TimeError::BadDate { .. })));
        assert!(matches!(error("2026-06-21T24:30Z"), Some(TimeError::BadTime { .. })));
        assert!(matches!(error("2026-06-21T15Z"), Some(TimeError::BadTime { .. })));
        assert!(matches!(error("2026-06-21T15:30+99:00"), Some(TimeError::BadZone { .. })));
        assert!(matches!(error("2026-06-21T15:30+2é"), Some(TimeError::BadZone { .. })));
        assert!(matches!(error("1066-10-14T09:00Z"), Some(TimeError::BadYear { .. })));
        let message = error("2026-06-21T15:30").map_or(String::new(), |error| error.to_string());
        assert!(message.contains("2026-06-21T15:30+02:00"), "{message}");
    }

    #[test]
    fn toward_divides_a_span_evenly() -> Result<(), TimeError> {
        let (from, to) = (LocalTime::parse("2026-06-21T04:00+02:00")?, LocalTime::parse("2026-06-21T22:00+02:00")?);
        assert_eq!(from.toward(to, 0.0), from);
        assert_eq!(from.toward(to, 1.0), to);
        assert_eq!(from.toward(to, 0.25).to_string(), "2026-06-21T08:30:00+02:00");
        Ok(())
    }

    proptest::proptest! {
        #[test]
        fn any_text_is_answered(text in "\\PC*") {
            let _ = LocalTime::parse(&text);
        }

        #[test]
        fn what_is_printed_is_read_again(seconds in -2_000_000_000_i64..4_000_000_000, zone in -56_i32..=56) {
            let offset = FixedOffset::east_opt(zone * 900).ok_or(proptest::test_runner::TestCaseError::reject("zone"))?;
            let time = offset.timestamp_opt(seconds, 0).single().map(LocalTime::new);
            let again = time.map(|time| LocalTime::parse(&time.to_string()));
            proptest::prop_assert_eq!(again, time.map(Ok));
        }
    }
}
