//! The scene's clock: it is stopped or runs at a multiple of real time, and can be moved in steps. Pure.

use chrono::{DateTime, Datelike, Days, FixedOffset, Months, TimeDelta};

use crate::scene::{LocalTime, YEARS};

/// Speeds that the keys choose, in simulated seconds per second.
pub const RATES: [f64; 5] = [0.0, 1.0, 60.0, 600.0, 3600.0];
/// Fastest clock, a month per second; at a higher speed days and nights would flicker.
const FASTEST: f64 = 30.0 * 86_400.0;
/// Longest step of real time in seconds, as for the flight.
const LONGEST_STEP: f64 = 1.0;

/// A clock in the user's time zone. Its year stays within [`YEARS`]: after the last year it continues in the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneClock {
    now: DateTime<FixedOffset>,
    /// Fraction of a millisecond that is not in `now` yet.
    rest: f64,
    rate: f64,
}

impl SceneClock {
    /// A clock that shows `time` and runs `rate` simulated seconds per second (clamped to 0 to a month).
    pub fn new(time: LocalTime, rate: f64) -> Self {
        let rate = if rate.is_finite() { rate.clamp(0.0, FASTEST) } else { 0.0 };
        Self { now: within_years(time.zoned()), rest: 0.0, rate }
    }

    /// The time that the clock shows.
    pub fn now(&self) -> DateTime<FixedOffset> {
        self.now
    }

    /// Simulated seconds per second.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// Sets the clock to `time`; the speed stays.
    pub fn set(&mut self, time: LocalTime) {
        *self = Self { rate: self.rate, ..Self::new(time, 0.0) };
    }

    /// Advances by `seconds` of real time, at most one second per call.
    pub fn advance(&mut self, seconds: f64) {
        if !(seconds > 0.0 && self.rate > 0.0) {
            return;
        }
        let due = seconds.min(LONGEST_STEP) * self.rate * 1e3 + self.rest;
        self.rest = due.fract();
        self.step(TimeDelta::milliseconds(due as i64));
    }

    /// Steps forward or back by a time.
    pub fn step(&mut self, time: TimeDelta) {
        self.show(self.now.checked_add_signed(time));
    }

    /// Steps by whole days of the calendar.
    pub fn step_days(&mut self, days: i32) {
        let count = Days::new(days.unsigned_abs().into());
        let now = self.now;
        self.show(if days < 0 { now.checked_sub_days(count) } else { now.checked_add_days(count) });
    }

    /// Steps by months of the calendar; a day that the month does not have becomes its last one.
    pub fn step_months(&mut self, months: i32) {
        let count = Months::new(months.unsigned_abs());
        let now = self.now;
        self.show(if months < 0 { now.checked_sub_months(count) } else { now.checked_add_months(count) });
    }

    /// Switches to the next faster of [`RATES`].
    pub fn faster(&mut self) {
        self.rate = RATES.into_iter().find(|rate| *rate > self.rate).unwrap_or(self.rate);
    }

    /// Switches to the next slower of [`RATES`].
    pub fn slower(&mut self) {
        self.rate = RATES.into_iter().rev().find(|rate| *rate < self.rate).unwrap_or(0.0);
    }

    fn show(&mut self, time: Option<DateTime<FixedOffset>>) {
        if let Some(time) = time {
            self.now = within_years(time);
        }
    }
}

/// The same day and hour in a year of [`YEARS`]; 29 February becomes the 28th in a year that is not a leap year.
fn within_years(time: DateTime<FixedOffset>) -> DateTime<FixedOffset> {
    if YEARS.contains(&time.year()) {
        return time;
    }
    let year = YEARS.start() + (time.year() - YEARS.start()).rem_euclid(YEARS.end() - YEARS.start() + 1);
    let moved = time.with_year(year).or_else(|| time.with_day(28)?.with_year(year));
    moved.unwrap_or_else(|| LocalTime::default().zoned())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn clock(text: &str, rate: f64) -> SceneClock {
        SceneClock::new(text.parse().unwrap_or_default(), rate)
    }

    fn shows(clock: &SceneClock) -> String {
        LocalTime::new(clock.now()).to_string()
    }

    #[test]
    fn runs_at_its_rate_whatever_the_frames() {
        let mut clock = clock("2026-06-21T15:30:00+02:00", 60.0);
        for _ in 0..144 {
            clock.advance(1.0 / 144.0);
        }
        let passed = (clock.now() - "2026-06-21T15:30:00+02:00".parse::<LocalTime>().unwrap_or_default().zoned())
            .num_milliseconds();
        assert!((59_999..=60_000).contains(&passed), "{passed}");
        clock.slower();
        clock.slower();
        assert_eq!(clock.rate(), 0.0);
        let before = clock;
        clock.advance(10.0);
        assert_eq!(clock, before);
    }

    #[test]
    fn slow_clocks_lose_no_time() {
        let mut clock = clock("2026-06-21T15:30:00Z", 0.25);
        for _ in 0..4000 {
            clock.advance(0.001);
        }
        assert_eq!(shows(&clock), "2026-06-21T15:30:01Z");
    }

    #[test]
    fn rates_go_up_and_down_from_any() {
        let mut clock = clock("2026-06-21T15:30:00Z", 120.0);
        clock.faster();
        assert_eq!(clock.rate(), 600.0);
        clock.faster();
        clock.faster();
        assert_eq!(clock.rate(), 3600.0);
        let mut odd = self::clock("2026-06-21T15:30:00Z", 120.0);
        odd.slower();
        assert_eq!(odd.rate(), 60.0);
        assert_eq!(self::clock("2026-06-21T15:30:00Z", f64::INFINITY).rate(), 0.0);
        assert_eq!(self::clock("2026-06-21T15:30:00Z", 1e300).rate(), FASTEST);
    }

    #[test]
    fn the_calendar_keeps_the_hour() {
        let mut clock = clock("2024-01-31T15:30:00+02:00", 0.0);
        clock.step_months(1);
        assert_eq!(shows(&clock), "2024-02-29T15:30:00+02:00");
        clock.step_days(1);
        assert_eq!(shows(&clock), "2024-03-01T15:30:00+02:00");
        clock.step_days(-2);
        assert_eq!(shows(&clock), "2024-02-28T15:30:00+02:00");
        clock.step_months(-12);
        assert_eq!(shows(&clock), "2023-02-28T15:30:00+02:00");
        clock.step(TimeDelta::minutes(-940));
        assert_eq!(shows(&clock), "2023-02-27T23:50:00+02:00");
    }

    #[test]
    fn after_the_last_year_comes_the_first() {
        let mut clock = clock("2200-12-31T23:59:00Z", 0.0);
        clock.step(TimeDelta::minutes(2));
        assert_eq!(shows(&clock), "1900-01-01T00:01:00Z");
        clock.step(TimeDelta::minutes(-2));
        assert_eq!(shows(&clock), "2200-12-31T23:59:00Z");
    }

    proptest! {
        #[test]
        fn every_step_stays_within_the_years(
            seconds in -2_208_988_800_i64..7_258_118_400, days in -400_i32..400, months in -4000_i32..4000,
            minutes in -1_000_000_i64..1_000_000, real in any::<f64>(), rate in any::<f64>(),
        ) {
            let start = DateTime::from_timestamp(seconds, 0).unwrap_or_default().fixed_offset();
            let mut clock = SceneClock::new(LocalTime::new(start), rate);
            clock.step_days(days);
            clock.step_months(months);
            clock.step(TimeDelta::minutes(minutes));
            clock.advance(real);
            prop_assert!(YEARS.contains(&clock.now().year()), "{}", clock.now());
        }
    }
}
